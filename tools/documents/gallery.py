"""The block on the page of a dataset, made of tools/figures/bench.json."""

from pathlib import Path

from documents.cost import figures_of
from documents.marked import prose


def gallery(folder: Path) -> str:
    """Return how large the page is, and how fast it opens."""
    found = figures_of(folder, "gallery")
    pictures, megabytes = found["pictures"], {name: size / 1e6 for name, size in found["bytes"].items()}
    each = {name: 1000 * megabytes[name] / pictures for name in ("images", "data", "thumbnails")}
    few, many = found["open_s"].values()
    most = list(found["open_s"])[-1]
    return prose(
        f"A page of {pictures:,} pictures of 1920x1200, raycast, with the default labels takes "
        f"{sum(megabytes.values()):.0f} MB: {each['images']:.0f} kB a picture for the image, {each['data']:.0f} kB for "
        f"labels and record, {each['thumbnails']:.1f} kB for the thumbnail. Images of Cycles have more noise, and take "
        f"more. Chromium shows the first row after {few['first row']:.1f} s, and an overlay {few['overlay']:.1f} s "
        f"after a click; with an index of {int(most):,} pictures after {many['first row']:.1f} s and "
        f"{many['overlay']:.1f} s, and filters them in {many['filter']:.2f} s (`tools/bench gallery`)."
    )
