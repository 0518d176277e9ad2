"""spin_usd with its Python and packages as one archive, in parts that can be carried to a machine without a network.

For Linux x86-64: `sh unpack.sh FOLDER` beside the parts needs a shell, gzip, tar and sha256sum, and no Python; then
FOLDER/bin/spin-usd runs. What the machine must have is glibc, of the version that manifest.json states or later, and
the C++ library of any distribution.
"""

import argparse
import json
import re
import shutil
import sys
import tempfile
from pathlib import Path

from bundling import archive, kernels, leave_out, libraries, licences, tree

ROOT = Path(__file__).resolve().parents[1]
WHEEL_VENV = ROOT / ".venv-wheel"
SUFFIXES = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="new or empty; gets the parts")
    parser.add_argument("--part-size", default="60M", metavar="SIZE", help="of a part at most, as 60M")
    parser.add_argument("--for", dest="device", choices=leave_out.DEVICES, default="cpu", help="what renders there")
    parser.add_argument("--compute", metavar="X.Y", help="of NVIDIA's kernels, those for this compute capability alone")
    parser.add_argument("--ptxas", metavar="FILE", help="CUDA's program, which assembles kernels that Blender lacks")
    options = parser.parse_args()
    size = re.fullmatch(r"([1-9][0-9]*)([KMG])", options.part_size)
    if not size:
        sys.exit(f"tools/bundle: --part-size {options.part_size} is no size; write a number and K, M or G, as 60M")
    part_bytes = int(size[1]) * SUFFIXES[size[2]]
    if options.compute and not (options.device == "cuda" and re.fullmatch(r"[0-9]+\.[0-9]", options.compute)):
        sys.exit("tools/bundle: --compute is of --for cuda, a number with one decimal, as 9.0")
    if options.ptxas and not (options.compute and shutil.which(options.ptxas)):
        sys.exit("tools/bundle: --ptxas names CUDA's program, which assembles kernels for the processor of --compute")
    out = options.out
    if out.exists() and any(out.iterdir()):
        sys.exit(f"tools/bundle: {out} is not empty; name a new folder")
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="spin_usd-bundle-", dir=out) as name:
        root = Path(name) / "spin_usd"
        tree.lay_out(root, WHEEL_VENV)
        left_out = leave_out.prune(root, options.device, options.compute)
        if options.ptxas:
            kernels.assemble(root / leave_out.KERNELS, options.compute, options.ptxas)
        copied, stand_ins = libraries.settle(root, WHEEL_VENV)
        manifest = {
            "device": options.device,
            "glibc": libraries.lowest_glibc(root),
            "unpacked_bytes": sum(file.stat().st_size for file in root.rglob("*") if file.is_file()),
            "left_out": left_out,
            "of_this_system": copied,
            "stand_ins": stand_ins,
            "licences": licences.of(root),
        }
        parts = archive.write(root, out, part_bytes, glibc=manifest["glibc"])
    manifest["parts"] = parts
    (out / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")
    shutil.copyfile(Path(__file__).parent / "bundling" / "unpack.sh", out / "unpack.sh")
    total = sum(part["bytes"] for part in parts.values())
    print(
        f"{out}: {len(parts)} parts, {total / 1e6:.0f} MB; {manifest['unpacked_bytes'] / 1e6:.0f} MB unpacked; ", end=""
    )
    print(f"glibc {manifest['glibc']} or later")


if __name__ == "__main__":
    main()
