"""The blocks on the pages of `watch` and `debug`, made of tools/figures/bench.json."""

from pathlib import Path

from benchmarks import debug as debug_bench
from benchmarks import watch as watch_bench
from documents.cost import figures_of
from documents.marked import prose


def watch(folder: Path) -> str:
    """Return the seconds from the saving of a layer to its pictures."""
    found = figures_of(folder, "watch")
    times = found["repeats"]
    intro = (
        "Seconds from the saving of a layer to the preview, fetched from the page's server, and to Blender's picture: "
        f"1920x1200, Tango through the lens of SPEED+, {_of_edits(times)} (`tools/bench watch`), on "
        f"{found['machine']['cores']} cores."
    )
    return f"{prose(intro)}\n\n{watch_bench.table(found)}"


def _of_edits(times: int) -> str:
    return "each edit once" if times == 1 else f"medians of {times} edits"


def debug(folder: Path) -> str:
    """Return by how much the .blend's picture differs from our radiance."""
    found = figures_of(folder, "debug")
    (width, height) = next(iter(found["stages"].values()))["frame"]
    intro = (
        f"The picture of the .blend in plain Blender less our radiance, at {width}x{height} and {found['samples']} "
        "samples without the denoiser, in the pixels that targets cover: its root mean square and its mean, each as a "
        "share of the radiance's (`tools/bench debug`). The first three are [the benchmarks' "
        "stages](../concepts/benchmarks.md)."
    )
    return f"{prose(intro)}\n\n{debug_bench.table(found)}"
