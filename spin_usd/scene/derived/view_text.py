"""Views as text: one sentence for each kind of picture that a user may not have meant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.scene.derived.views import FEW_PX, PicturesOfKind, Span, ViewKind, Views

FEW_NAMES = 3  # of pictures in a sentence


@dataclass(frozen=True, kw_only=True)
class ViewMessage:
    """Message on pictures of a kind."""

    found: str
    """End of a sentence on the content of such a picture."""
    do: str
    """Consequence, or remedy."""


MESSAGES: Mapping[ViewKind, ViewMessage] = {
    ViewKind.CAMERA_INSIDE: ViewMessage(
        found="the camera is inside the target's bounding box",
        do="check the units of the model and of the poses",
    ),
    ViewKind.BEHIND: ViewMessage(
        found="the target is behind the camera",
        do="place it at a z above zero: camera axes are x right, y down, z forward",
    ),
    ViewKind.OUTSIDE: ViewMessage(
        found="the target is outside the frame",
        do="bring it nearer to the middle of the picture, or take a wider lens",
    ),
    ViewKind.CUT_OFF: ViewMessage(
        found="the target is cut off by the frame",
        do="where all of it is wanted, bring it nearer to the middle, or farther away",
    ),
    ViewKind.FEW_PIXELS: ViewMessage(
        found=f"the target is less than {FEW_PX:g} pixels across",
        do="labels, which are of pixel centres, may show nothing of it, and its light needs many samples",
    ),
    ViewKind.UNLIT: ViewMessage(
        found="the side of the target that the camera sees faces away from the Sun",
        do="such pictures are all but black; turn the Sun, or sample it with the constraint target_lit_deg",
    ),
    ViewKind.DARK: ViewMessage(
        found="no light reaches the target",
        do="give the stage a light, or take the Sun out of the planet's shadow",
    ),
}
MOSTLY_SMALL = ViewMessage(
    found="the target is less than a tenth of the frame across",
    do="check the units of the model and of the poses",
)
"""The message where most pictures are of the kind SMALL: a few from afar are meant."""


def summary(found: Views, sizes: Sequence[float] = ()) -> str:
    """Return a line such as "target 1.1 x 0.8 x 0.3 m, 2.2 to 9.9 m from the camera, its diagonal 200 to 900
    pixels". `sizes`: the longest edges of several craft that are shown in turn, metres."""
    what, whose = f"target {size_text(found.size)}", "its diagonal"
    if sizes:
        what, whose = f"{len(sizes)} craft of {_span((min(sizes), max(sizes)))} m", "their diagonals"
    across = f", {whose} {_span(found.pixels)} pixels" if found.pixels else ""
    return f"{what}, {_span(found.distance)} m from the camera{across}"


def sentences(found: Views) -> list[str]:
    """Return a sentence for each kind of picture there is, with its remedy."""
    lines = [sentence(found, kind) for kind in found.of if kind in MESSAGES]
    if mostly(found, ViewKind.SMALL):
        lines.append(_sentence(found, ViewKind.SMALL, MOSTLY_SMALL))
    return lines


def sentence(found: Views, kind: ViewKind) -> str:
    """Return the sentence for one kind that there is."""
    return _sentence(found, kind, MESSAGES[kind])


def mostly(found: Views, kind: ViewKind) -> bool:
    """Return whether most of the pictures are of the kind."""
    return 2 * found.count(kind) > found.pictures


def size_text(edges: Sequence[float] | Float) -> str:
    """Lengths in metres, such as "1.1 x 0.8 x 0.3 m"."""
    return f"{' x '.join(number_text(edge) for edge in edges)} m"


def number_text(value: float) -> str:
    """Return three digits of the number, without an exponent."""
    return np.format_float_positional(value, precision=3, fractional=False, trim="-")


def _sentence(found: Views, kind: ViewKind, message: ViewMessage) -> str:
    pictures = found.of[kind]
    shown = ", ".join(pictures.names[:FEW_NAMES]) + (", ..." if pictures.count > FEW_NAMES else "")
    return f"in {_share(pictures)} {message.found} ({shown}): {message.do}"


def _share(pictures: PicturesOfKind) -> str:
    if pictures.among == 1:
        return "the only picture"
    share = "all" if pictures.count == pictures.among else f"{pictures.count} of"
    return f"{share} {pictures.among} pictures"


def _span(span: Span) -> str:
    least, most = map(number_text, span)
    return least if least == most else f"{least} to {most}"
