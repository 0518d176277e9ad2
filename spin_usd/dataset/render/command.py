"""The command line that makes one picture of a run again, for those who look why it failed."""

import shlex
from collections.abc import Iterator
from pathlib import Path

from spin_usd.dataset.picture.planned_picture import PlannedPicture
from spin_usd.dataset.render.request import RenderRequest
from spin_usd.scene.effort import CPU


def command_of(request: RenderRequest, out: Path, picture_timeout: float | None, picture: PlannedPicture) -> str:
    """Return the `spin-usd render` command that makes this one picture of the request in the dataset `out`, within the
    same time."""
    place = ("--frames", f"{picture.index}:{picture.index + 1}", "--variants", picture.variant)
    where = (str(request.stage), "--out", str(out))
    limit = () if picture_timeout is None else ("--picture-timeout", f"{picture_timeout:g}")
    return shlex.join(("spin-usd", "render", *where, *place, *_options(request), *limit))


def _options(request: RenderRequest) -> Iterator[str]:
    """Yield the options that decide the picture."""
    yield from ("--renderer", request.renderer, "--effort", request.effort.text)
    if request.device != CPU:
        yield from ("--device", request.device)
    if request.seed is not None:
        yield from ("--seed", str(request.seed))
    yield from ("--labels", "all" if request.offered else ",".join(request.labels) or "none")
    if not request.image:
        yield "--labels-only"
    if request.radiance:
        yield "--radiance"
    yield from ("--image-format", request.image_suffix.removeprefix("."))
