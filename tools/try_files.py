"""Try models that others made: author, check and render each in one picture, and tell the outcome of each in a table.

    tools/try_files FILE_OR_FOLDER ... --out DIR

The size of what was authored stands beside that of the source, which another library reads: pxr itself for USD, trimesh
for other formats. A file that was tried before is not tried again while DIR/outcomes is kept.
"""

import argparse
import json
import shutil
import subprocess
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from spin_usd.stage.read.stage_reader import StageReader

USD = {".usd", ".usda", ".usdc", ".usdz"}
UNITLESS = {".obj", ".ply", ".stl"}
SUFFIXES = USD | UNITLESS | {".gltf", ".glb"}
PLAUSIBLE_M = (0.02, 200.0)  # a craft's largest side, as `spin-usd author` takes it
SIZE_PX, FOCAL_PX = 160, 400.0
RADII_AWAY = 6.0  # the target's bounding sphere fills five sixths of the frame
ATTITUDE = np.array([0.33, 0.88, -0.20, 0.28])  # three quarters from above, whatever axis is up; scalar first
PATIENCE_S = 240
HEAD = (
    "| file | author | check | render | faces | size, m | source's, m |\n| --- | --- | --- | --- | ---: | --- | --- |"
)


def source_bounds(file: Path) -> tuple[list[list[float]], float | None]:
    """The corners of the bounds in the file's own units, and how many metres one is, None where it does not say so.

    Raises ValueError where the library finds no geometry.
    """
    if file.suffix.lower() not in USD:
        import trimesh

        bounds = trimesh.load_scene(file, process=False).bounds
        if bounds is None:
            raise ValueError("trimesh finds no geometry")
        return bounds.tolist(), None if file.suffix.lower() in UNITLESS else 1.0
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(file))
    boxes = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), [UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
    box = boxes.ComputeWorldBound(stage.GetPseudoRoot()).ComputeAlignedRange()
    if box.IsEmpty():
        raise ValueError("pxr finds no geometry")
    said = UsdGeom.StageHasAuthoredMetersPerUnit(stage)
    return [list(box.GetMin()), list(box.GetMax())], UsdGeom.GetStageMetersPerUnit(stage) if said else None


def plausible_units(size: float) -> float:
    """Units per metre that make `size` a craft's: 1, or the least power of ten that does."""
    units = 1.0
    while size / units > PLAUSIBLE_M[1]:
        units *= 10
    while 0 < size / units < PLAUSIBLE_M[0]:
        units /= 10
    return units


def tried(file: Path, folder: Path, command: str, renderer: str) -> dict[str, Any]:
    """What came of it: each step as far as it went, faces, and the bounds in metres by both who read it."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    outcome: dict[str, Any] = {}
    bounds, units, metres = np.array([[-1.0] * 3, [1.0] * 3]), 1.0, None
    try:
        # A process of its own, as a file by others may crash its reader.
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as apart:
            found, metres = apart.submit(source_bounds, file).result(PATIENCE_S)
        units = 1 / metres if metres else plausible_units(float(np.ptp(found, axis=0).max()))
        bounds = np.array(found) / units
        outcome["source"] = bounds.tolist()
    except Exception as error:
        outcome["source_error"] = f"{type(error).__name__}: {error}"[-200:]
    _write_inputs(folder, bounds)

    def call(*arguments: str) -> dict[str, Any]:
        done = subprocess.run([command, *arguments], cwd=folder, capture_output=True, text=True, timeout=PATIENCE_S)
        return {"exit": done.returncode, "out": done.stdout, "said": done.stderr[-1500:]}

    inputs = ("--poses", "poses.json", "--camera", "camera.json", "--target", str(file.resolve()), "--any-size")
    told = () if metres else ("--units-per-metre", f"{units:g}")
    outcome["author"] = call("author", *inputs, *told, "--out", "stage", "--json")
    if outcome["author"]["exit"] == 0:
        outcome["check"] = call("check", "stage", "--json")
        outcome["render"] = call("render", "stage", "--renderer", renderer, "--samples", "16", "--out", "dataset")
        reader = StageReader(folder / "stage" / "dataset.usda")
        mesh = reader.scene(reader.frames[0]).bodies[0].target.mesh
        points = mesh.points[np.unique(mesh.faces)]
        outcome |= {"faces": len(mesh.faces), "ours": [points.min(0).tolist(), points.max(0).tolist()]}
    return outcome


def _write_inputs(folder: Path, bounds: np.ndarray) -> None:
    """A camera, and one pose that shows the whole model."""
    centre, radius = bounds.mean(0), float(np.linalg.norm(np.ptp(bounds, axis=0)) / 2) or 1.0
    matrix = [[FOCAL_PX, 0, SIZE_PX / 2], [0, FOCAL_PX, SIZE_PX / 2], [0, 0, 1]]
    camera = {"Nu": SIZE_PX, "Nv": SIZE_PX, "cameraMatrix": matrix, "distCoeffs": [0, 0, 0, 0, 0]}
    (folder / "camera.json").write_text(json.dumps(camera))
    w, *v = ATTITUDE / np.linalg.norm(ATTITUDE)
    turned = centre + 2 * np.cross(v, np.cross(v, centre) + w * centre)
    away = (np.array([0, 0, RADII_AWAY * radius]) - turned).tolist()
    pose = {"filename": "picture.png", "q_vbs2tango_true": [w, *v], "r_Vo2To_vbs_true": away}
    (folder / "poses.json").write_text(json.dumps([pose]))


def row(name: str, outcome: dict[str, Any]) -> str:
    """The outcome as a row of the table."""
    notes = json.loads(outcome["author"]["out"])["notes"] if outcome["author"]["exit"] == 0 else []
    found = outcome.get("check", {}).get("out", "")
    findings = json.loads(found)["findings"] if found.startswith("{") else []
    cells = [
        name,
        "; ".join([_step(outcome["author"]), *notes[:1]]),
        ", ".join([_step(outcome.get("check")), *sorted({each["code"] for each in findings})]),
        _step(outcome.get("render")),
        outcome.get("faces", ""),
        _size(outcome.get("ours")),
        _size(outcome.get("source")) or outcome.get("source_error", ""),
    ]
    return "| " + " | ".join(str(cell).replace("|", "/").replace("\n", " ") for cell in cells) + " |"


def _step(done: dict[str, Any] | None) -> str:
    if done is None:
        return ""
    lines = done["said"].strip().splitlines() or ["nothing said"]
    return "ok" if done["exit"] == 0 else f"{done['exit']}: {lines[-1][:200]}"


def _size(bounds: Any) -> str:
    """Length by width by height."""
    return " x ".join(f"{b - a:.4g}" for a, b in zip(*bounds, strict=True)) if bounds else ""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", type=Path, nargs="+", metavar="FILE_OR_FOLDER")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    parser.add_argument("--renderer", choices=("blender", "raycast"), default="raycast")
    parser.add_argument("--command", default="spin-usd", help="the spin-usd to try, such as that of another version")
    options = parser.parse_args()
    files = [(file, root) for root in options.models for file in model_files(root)]
    (options.out / "outcomes").mkdir(parents=True, exist_ok=True)
    rows = [HEAD]
    for file, root in track(files, description="files"):
        name = file.name if file == root else str(file.relative_to(root.parent))
        kept = options.out / "outcomes" / f"{name.replace('/', '__')}.json"
        if not kept.is_file():
            folder = options.out / "work" / kept.stem
            kept.write_text(json.dumps(tried(file, folder, options.command, options.renderer), indent=1))
        rows.append(row(name, json.loads(kept.read_text())))
    print("\n".join(rows))


def model_files(root: Path) -> list[Path]:
    """The model files at or below `root`, in order of their names."""
    return [root] if root.is_file() else sorted(f for f in root.rglob("*") if f.suffix.lower() in SUFFIXES)


if __name__ == "__main__":
    main()
