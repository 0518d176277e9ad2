"""Blocks made of tools/figures/bench.json, which `tools/bench NAME --json` writes."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks import device as device_bench
from benchmarks.frames import CROPPED_SCRIPT, EQUAL
from benchmarks.peers import CROPS
from benchmarks.spread import shown
from documents.marked import NotMeasuredError, prose

from spin_usd.accuracy.tables import in_markdown, number, percent


def figures_of(folder: Path, name: str) -> dict[str, Any]:
    """Return what the benchmark `name` measured. Raises NotMeasuredError."""
    file = folder / "bench.json"
    found: dict[str, dict[str, Any]] = json.loads(file.read_text()) if file.is_file() else {}
    if name not in found:
        raise NotMeasuredError(f"run tools/bench {name} --json {file}")
    return found[name]


def machine(folder: Path) -> str:
    """Return what all of the costs were measured on."""
    found = figures_of(folder, "frames")
    of, (width, height) = found["machine"], found["frame"]
    where = f"{of['cores']} cores of an {of['architecture'].replace('_', '-')} server without a GPU"
    of_what = f"{width}x{height}, the SPEED+ lens, a Tango mesh of {found['faces']:,} faces"
    return prose(f"Measured on {where}, {of_what}. All figures can be taken again: `tools/bench`.")


def device(folder: Path) -> str:
    """Return what light costs on a graphics processor and on the CPU of the same machine."""
    return device_bench.table(figures_of(folder, "device"))


def peers(folder: Path) -> str:
    """Return the seconds of a picture, by spin_usd and by others."""
    found = figures_of(folder, "frames")
    rows = []
    for name, taken in found["makers"].items():
        beside = "" if name == CROPPED_SCRIPT else shown(taken["cpu_over_script"])
        rows.append([name, shown(taken["cpu_s"]), beside])
    poses = f"{found['pictures']} {'pose' if found['pictures'] == 1 else 'poses'}"
    intro = (
        f"Processor seconds a picture of the stage `{found['stage']}`, over {poses}, all in turn, held open, "
        f"until the files are there: median (least to most). The scripts take {found['samples']} samples. The box that "
        f"the target can cover is {percent(found['box_share']['median'])} of the frame (median)."
    )
    names = ", ".join(found["left_out"])
    failed = f"Did not work there: {names}. Of a peer's variants the fastest that works is shown."
    lacking = f"\n{prose(failed)}\n" if found["left_out"] else ""
    headings = ("", "CPU s", "times the cropped script's")
    lacks = (
        "The scripts have neither labels, but passes, nor the lens's distortion, nor textures, nor a frame around what "
        f"they crop. {_totals(found)}"
    )
    return f"{prose(intro)}\n\n{in_markdown(headings, rows)}{lacking}\n{prose(lacks)}"


def _totals(found: Mapping[str, Any]) -> str:
    """Return a sentence on all processor time of the pictures, by spin_usd over that of the two cropped ones."""
    own, cropped = found["makers"][EQUAL]["total_cpu_over_script"], _cropped_mitsuba(found)
    beside = [f"{number(own)} times the processor time of the cropped bpy script"]
    beside += [f"{number(own / cropped)} times that of cropped Mitsuba"] if cropped else []
    return f"At equal samples spin_usd, with labels and files, takes {' and '.join(beside)} in all."


def _cropped_mitsuba(found: Mapping[str, Any]) -> float | None:
    """Return all processor time of cropped Mitsuba over that of the cropped script; None where none worked."""
    makers: Mapping[str, Mapping[str, float]] = found["makers"]
    names = (name for name in makers if name.startswith("Mitsuba") and name.endswith(CROPS["box"]))
    return next((makers[name]["total_cpu_over_script"] for name in names), None)


def equal_error(folder: Path) -> str:
    """Return what a picture takes at equal error, by spin_usd and by Mitsuba."""
    found = figures_of(folder, "equal_error")
    intro = (
        "Processor seconds of a picture and its error in linear light, as [Accuracy](accuracy.md) defines it, each "
        f"tool against {found['reference_samples']:,} samples of its own, so that it does not count that they shade "
        "differently. spin_usd makes labels, lens, detector and files too; Mitsuba (llvm, cropped to the target's box) "
        "has the mesh, distant lights without size, what shines from all around, and materials of one colour, metallic "
        "and roughness: no distortion, detector, labels, textures or denoiser, for its own needs a graphics processor."
    )
    headings = ("stage", "", "CPU s", "error", "times Mitsuba's CPU s at that error")
    rows = [_error_row(stage, row) for stage, measured in found["stages"].items() for row in measured["rows"]]
    offs = [f"{percent(max(each['references'].values()))} on `{name}`" for name, each in found["stages"].items()]
    outro = (
        f"The references are off by up to {', '.join(offs)}. Mitsuba's seconds at an error are a + b / error² through "
        f"its rows. {_limit(folder)}"
    )
    return f"{prose(intro)}\n\n{in_markdown(headings, rows)}\n{prose(outro)}"


def _error_row(stage: str, row: Mapping[str, Any]) -> list[str]:
    """Return a line of the table, whose last cell is empty for Mitsuba itself."""
    ratio = number(row["cpu_s"] / row["mitsuba_cpu_s"]) if "mitsuba_cpu_s" in row else ""
    return [stage, f"{row['tool']}, {row['what']}", number(row["cpu_s"]), percent(row["error"]), ratio]


def _limit(folder: Path) -> str:
    """Return a sentence on what keeps spin_usd from Mitsuba's time, where both are in the first table."""
    cropped = _cropped_mitsuba(figures_of(folder, "frames"))
    if not cropped:
        return ""
    return (
        "What limits spin_usd is Cycles: at equal samples the cropped bpy script of the first table, which has nothing "
        f"of spin_usd, takes {number(1 / cropped)} times the processor time of cropped Mitsuba."
    )


def label_costs(folder: Path) -> str:
    """Return what each label takes."""
    found = figures_of(folder, "labels")
    width, height = found["frame"]
    intro = (
        f"Seconds of one core for each label at {width}x{height}, before files are written, over {found['pictures']} "
        f"poses of which Tango covers {percent(found['target_share']['median'])} (median): median (least to most). "
        "What labels share, such as normals, counts for the first that takes it."
    )
    rows = [[kind, shown(taken)] for kind, taken in (*found["seconds"].items(), ("in all", found["in_all"]))]
    return f"{prose(intro)}\n\n{in_markdown(('', 'seconds'), rows)}"
