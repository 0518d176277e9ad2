"""Time and memory of `spin-usd plan` against the number of pictures, of variants and of prims.

The stage is `--poses` again and again, each time a little farther away so that no two pictures are alike, with variants
that change the Sun's strength, or with prims beside the picture's own that hold nothing. Figures are of the command's
processes together (processor seconds) and of the largest of them (memory).
"""

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Any

from benchmarks.command import asked, run
from benchmarks.spread import line

from spin_usd import resources

SUBLAYER = "@./layers/poses.usdc@"
VARIANT = """        "v{0}" {{
            over "Lights" {{
                over "Sun" {{
                    float inputs:intensity = {1}
                }}
            }}
        }}
"""


@dataclass(frozen=True, kw_only=True)
class Case:
    """A stage of so many pictures, variants (nominal among them) and prims besides its own."""

    frames: int
    variants: int = 1
    prims: int = 0


LARGEST = (Case(frames=200, variants=50), Case(frames=60000, variants=4))


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--poses", type=Path, default=resources.stages() / "examples" / "tango_speedplus_poses.json")
    parser.add_argument("--frames", type=int, nargs="+", default=[1000, 4000, 16000])
    parser.add_argument("--variants", type=int, nargs="+", default=[1, 4])
    parser.add_argument("--prims", type=int, nargs="+", default=[1000, 10000, 50000])
    parser.add_argument("--largest", action="store_true", help="also 200 pictures in 50 variants, and 60,000 in 4")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    if options.quick:
        options.frames, options.variants, options.prims, options.largest = [8], [1, 2], [100], False
    few = min(options.frames)
    cases = [Case(frames=frames, variants=variants) for frames, variants in product(options.frames, options.variants)]
    cases += [Case(frames=few, prims=prims) for prims in options.prims]
    rows = [row(case, options.poses) for case in (*cases, *(LARGEST if options.largest else ()))]
    return {"cases": rows, **curves(rows, few)}


def curves(rows: Sequence[dict[str, Any]], few: int) -> dict[str, Any]:
    """Fit straight lines to processor seconds, against pictures in all their variants and against prims."""
    alone = [row for row in rows if not row["prims"]]
    beside = [row for row in rows if row["frames"] == few and row["variants"] == 1]
    return {
        "against_pictures": line([row["frames"] * row["variants"] for row in alone], [row["cpu_s"] for row in alone]),
        "against_prims": line([row["prims"] for row in beside], [row["cpu_s"] for row in beside]),
    }


def row(case: Case, poses: Path) -> dict[str, Any]:
    """Author the stage and plan it once."""
    with tempfile.TemporaryDirectory(prefix="spin_usd-bench-") as folder:
        done = run("plan", author(case, poses, Path(folder)), "--variants", "all")
    mb = round(done.memory_bytes / 1e6)
    return {**asdict(case), "wall_s": round(done.wall_s, 2), "cpu_s": round(done.cpu_s, 2), "memory_mb": mb}


def author(case: Case, poses: Path, folder: Path) -> Path:
    """Author the stage of the case; returns its root layer."""
    listed = json.loads(poses.read_text(encoding="utf-8"))
    known = listed["poses"] if isinstance(listed, dict) else listed
    named = [
        {**_farther(known[i % len(known)], i // len(known)), "filename": f"img{i:06d}.png"} for i in range(case.frames)
    ]
    (folder / "poses.json").write_text(json.dumps({"poses": named} if isinstance(listed, dict) else named))
    model = ["--target", "tango", "--camera", "speedplus"]
    root = Path(asked("author", "--poses", folder / "poses.json", *model, "--out", folder / "stage")["root"])
    root.write_text(root.read_text().replace(SUBLAYER, f"@./layers/bench.usda@, {SUBLAYER}", 1))
    (root.parent / "layers" / "bench.usda").write_text("#usda 1.0\n" + _variants(case.variants) + _prims(case.prims))
    return root


def _variants(count: int) -> str:
    body = "".join(VARIANT.format(i, 1000 + i) for i in range(1, count))
    sets = f'    variantSet "augmentation" = {{\n{body}    }}\n'
    return f'over "World" (\n    prepend variantSets = "augmentation"\n)\n{{\n{sets}}}\n' if count > 1 else ""


def _prims(count: int) -> str:
    return 'def Scope "Beside"\n{\n' + "".join(f'    def Xform "p{i}" {{}}\n' for i in range(count)) + "}\n"


def _farther(pose: dict[str, Any], steps: int) -> dict[str, Any]:
    """Return the pose list's entry, with the target farther away by so many steps of a tenth of a millimetre in a
    metre."""
    name = next(name for name in pose if name.startswith("r_"))
    return {**pose, name: [(1 + 1e-4 * steps) * x for x in pose[name]]}


def table(figures: dict[str, Any]) -> str:
    lines = [
        "| pictures | variants | prims besides | wall s | CPU s | ms a picture | MB, largest process |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in figures["cases"]:
        each = 1000 * row["cpu_s"] / (row["frames"] * row["variants"])
        lines.append(
            f"| {row['frames']} | {row['variants']} | {row['prims']} | {row['wall_s']:.1f} | {row['cpu_s']:.1f} | "
            f"{each:.2f} | {row['memory_mb']} |"
        )
    pictures, prims = figures["against_pictures"], figures["against_prims"]
    lines.append(f"\nCPU: {1000 * pictures['slope']:.3f} ms a picture, {1000 * prims['slope']:.3f} ms a prim")
    return "\n".join(lines)
