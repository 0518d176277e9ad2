"""Time and memory of `spin-usd plan` against the number of pictures and of variants, as a Markdown table.

The stage is `--poses` again and again, each time a little farther away so that no two pictures are alike, with variants
that change the Sun's strength; figures are of this process's children together (CPU seconds) and of the largest of them
(memory).
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from itertools import product
from pathlib import Path
from typing import Any

from spin_usd import resources

COMMAND = [sys.executable, "-m", "spin_usd.cli.main", "--quiet"]
SUBLAYER = "@./layers/poses.usdc@"
LARGEST = ((200, 50), (60000, 4))  # pictures and variants
VARIANT = """        "v{0}" {{
            over "Lights" {{
                over "Sun" {{
                    float inputs:intensity = {1}
                }}
            }}
        }}
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=Path, default=resources.stages() / "examples" / "tango_speedplus_poses.json")
    parser.add_argument("--frames", type=int, nargs="+", default=[1000, 4000, 16000])
    parser.add_argument("--variants", type=int, nargs="+", default=[1, 4])
    parser.add_argument("--quick", action="store_true", help="leave out the largest cases")
    options = parser.parse_args()
    print("| pictures | variants | wall s | CPU s | ms a picture | MB, largest process |")
    print("| --- | --- | --- | --- | --- | --- |")
    cases = [*product(options.frames, options.variants), *([] if options.quick else LARGEST)]
    for frames, variants in cases:
        with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as folder:
            print(row(author(options.poses, frames, variants, Path(folder)), frames, variants), flush=True)


def author(poses: Path, frames: int, variants: int, folder: Path) -> Path:
    """A stage of so many pictures and variants, nominal among them; returns its root layer."""
    listed = json.loads(poses.read_text(encoding="utf-8"))
    known = listed["poses"] if isinstance(listed, dict) else listed
    named = [{**_farther(known[i % len(known)], i // len(known)), "filename": f"img{i:06d}.png"} for i in range(frames)]
    (folder / "poses.json").write_text(json.dumps({"poses": named} if isinstance(listed, dict) else named))
    of = ["--poses", folder / "poses.json", "--target", "tango", "--camera", "speedplus", "--out", folder / "stage"]
    subprocess.run([*COMMAND, "author", *map(str, of)], check=True, stdout=subprocess.DEVNULL)
    root = folder / "stage" / "dataset.usda"
    if variants == 1:
        return root
    root.write_text(root.read_text().replace(SUBLAYER, f"@./layers/bench.usda@, {SUBLAYER}", 1))
    body = "".join(VARIANT.format(i, 1000 + i) for i in range(1, variants))
    (root.parent / "layers" / "bench.usda").write_text(
        '#usda 1.0\nover "World" (\n    prepend variantSets = "augmentation"\n)\n{\n'
        f'    variantSet "augmentation" = {{\n{body}    }}\n}}\n'
    )
    return root


def _farther(pose: dict[str, Any], steps: int) -> dict[str, Any]:
    """The pose list's entry, with the target so many steps of a tenth of a millimetre in a metre farther away."""
    name = next(name for name in pose if name.startswith("r_"))
    return {**pose, name: [(1 + 1e-4 * steps) * x for x in pose[name]]}


def row(root: Path, frames: int, variants: int) -> str:
    """Plan the stage once."""
    began = time.perf_counter()
    command = [*COMMAND, "plan", str(root), "--variants", "all", "--json"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"plan ended with status {status}")
    wall, cpu = time.perf_counter() - began, usage.ru_utime + usage.ru_stime
    each = 1000 * cpu / (frames * variants)
    return f"| {frames} | {variants} | {wall:.1f} | {cpu:.1f} | {each:.2f} | {usage.ru_maxrss / 1000:.0f} |"


if __name__ == "__main__":
    main()
