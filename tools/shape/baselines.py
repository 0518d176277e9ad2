"""Reconstruct the shape of an exported unknown target by each baseline, and score it: `tools/shape/baselines --help`.

hull: the visual hull of the masks, with poses. motion: COLMAP's structure from motion, without poses, with masks where
they are given, laid on the truth by its cameras. fusion and points: controls that read the exact depth of the --dataset
that was exported. A row is in tools/figures/shape/EXPORT-BASELINE.json, with its score as `spin-usd score --shape`
returns it; shapes are in --out.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from msgspec import UNSET, to_builtins

import spin_usd
from shape import fusion, hull, motion
from shape.exported import Exported
from spin_usd.errors import SpinError

FIGURES = Path(__file__).resolve().parent.parent / "figures" / "shape"
PACKAGES = ("numpy", "pycolmap", "scikit-image")
HEADINGS = ("baseline", "align", "Chamfer %", "accuracy %", "completeness %", "F-score", "normals", "seconds")


def options() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("export", type=Path, help="folder of an export --to unknown_target, with its truth")
    parser.add_argument("--out", type=Path, required=True, help="folder of the shapes")
    parser.add_argument("--dataset", type=Path, help="the dataset that was exported, for the controls")
    parser.add_argument("--only", help="some baselines, with commas between them")
    parser.add_argument("--figures", type=Path, default=FIGURES, help="folder of the rows")
    return parser


def baselines(export: Exported, dataset: Path | None, out: Path) -> Iterator[tuple[str, Callable[[], Path | None]]]:
    """Yield those that the export has the inputs for."""
    if export.posed and export.masked:
        yield "hull", partial(hull.reconstruct, export, out)
    yield "motion", partial(motion.reconstruct, export, out)
    if dataset is not None:
        exact = spin_usd.Dataset(dataset)
        yield "fusion", partial(fusion.reconstruct, export, exact, out)
        yield "points", partial(fusion.reconstruct_points, export, exact, out)


def row_of(name: str, make: Callable[[], Path | None], export: Exported) -> dict[str, Any]:
    """Run the baseline and score its shape."""
    began = time.monotonic()
    path = make()
    row = {"baseline": name, "export": export.folder.name, "pictures": len(export.views)}
    row |= {"seconds": round(time.monotonic() - began, 1), "versions": {each: version(each) for each in PACKAGES}}
    if path is None:
        return row | {"fault": "no model"}
    try:
        report = spin_usd.score(
            shape=path, truth=export.folder / "truth", align="none"
        )  # motion is laid by its cameras
    except SpinError as e:
        return row | {"fault": e.found}
    score = to_builtins(report)
    return row | {"score": {key: value for key, value in score.items() if key not in ("shape", "truth")}}


def cells(row: dict[str, Any]) -> list[str]:
    if "score" not in row:
        return [row["baseline"], row["fault"], *[""] * 5, str(row["seconds"])]
    score = row["score"]
    lengths = [score["chamfer_m"], score["accuracy_m"], score["completeness_m"]]
    percents = [f"{100 * each / score['diameter']:.4f}" for each in lengths]
    normals = score.get("normal_consistency", UNSET)
    shown = "" if normals is UNSET else f"{normals:.3f}"
    return [
        row["baseline"],
        score["alignment"]["mode"],
        *percents,
        f"{score['f_score']:.4f}",
        shown,
        str(row["seconds"]),
    ]


def main() -> None:
    given = options().parse_args()
    export = Exported(given.export)
    given.out.mkdir(parents=True, exist_ok=True)
    given.figures.mkdir(parents=True, exist_ok=True)
    chosen = given.only.split(",") if given.only else None
    table = [list(HEADINGS)]
    for name, make in baselines(export, given.dataset, given.out):
        if chosen is None or name in chosen:
            row = row_of(name, make, export)
            file = given.figures / f"{export.folder.name}-{name}.json"
            file.write_text(json.dumps(row, indent=1) + "\n")
            table.append(cells(row))
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for line in table:
        print("  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip())


if __name__ == "__main__":
    main()
