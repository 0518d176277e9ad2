"""What views show, in words: one sentence for each kind of picture that a user may not have meant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spin_usd.arrays import Float
from spin_usd.scene.derived import views
from spin_usd.scene.derived.views import Some, Views

FEW_NAMES = 3  # of pictures in a sentence


@dataclass(frozen=True, kw_only=True)
class Words:
    """`found`: what a picture of a kind is · `do`: what it comes to, or what to do about it."""

    found: str
    do: str


WORDS: Mapping[str, Words] = {
    views.INSIDE: Words(
        found="the camera is inside the target's bounding box",
        do="check the unit of the model, and that of the poses",
    ),
    views.BEHIND: Words(
        found="the target is behind the camera",
        do="place it at a z above zero: camera axes are x right, y down, z forward",
    ),
    views.OUTSIDE: Words(
        found="the target is outside the frame",
        do="bring it nearer to the middle of the picture, or take a wider lens",
    ),
    views.CUT_OFF: Words(
        found="the target is cut off by the frame",
        do="where all of it is wanted, bring it nearer to the middle, or farther away",
    ),
    views.FEW_PIXELS: Words(
        found=f"the target is less than {views.FEW_PX:g} pixels across",
        do="labels, which are of pixel centres, may show nothing of it, and its light needs many samples",
    ),
    views.UNLIT: Words(
        found="the side of the target that the camera sees is turned away from the Sun",
        do="such pictures are all but black; turn the Sun, or draw it with the constraint target_lit_deg",
    ),
    views.DARK: Words(
        found="no light reaches the target",
        do="give the stage a light, or take the Sun out of the planet's shadow",
    ),
}
MOSTLY_SMALL = Words(
    found="the target is less than a tenth of the frame across",
    do="check the unit of the model, and that of the poses",
)
"""Said where it is so in most pictures: a few from afar are meant."""


def summary(found: Views) -> str:
    """Such as "target 1.1 x 0.8 x 0.3 m, 2.2 to 9.9 m from the camera, 200 to 900 pixels across"."""
    across = f", {_span(found.pixels)} pixels across" if found.pixels else ""
    return f"target {size_text(found.size)}, {_span(found.distance)} m from the camera{across}"


def sentences(found: Views) -> list[str]:
    """A sentence for each kind of picture there is, with its remedy."""
    said = [sentence(found, kind) for kind in found.of if kind in WORDS]
    if mostly(found, views.SMALL):
        said.append(_sentence(found, views.SMALL, MOSTLY_SMALL))
    return said


def sentence(found: Views, kind: str) -> str:
    """That of one kind that there is."""
    return _sentence(found, kind, WORDS[kind])


def mostly(found: Views, kind: str) -> bool:
    """Whether most of the pictures are of the kind."""
    return 2 * found.count(kind) > found.pictures


def size_text(edges: Sequence[float] | Float) -> str:
    """Lengths in metres, such as "1.1 x 0.8 x 0.3 m"."""
    return f"{' x '.join(number_text(edge) for edge in edges)} m"


def number_text(value: float) -> str:
    """Three digits of it, without an exponent."""
    return np.format_float_positional(value, precision=3, fractional=False, trim="-")


def _sentence(found: Views, kind: str, words: Words) -> str:
    some = found.of[kind]
    shown = ", ".join(some.names[:FEW_NAMES]) + (", ..." if some.count > FEW_NAMES else "")
    return f"in {_share(some)} {words.found} ({shown}): {words.do}"


def _share(some: Some) -> str:
    if some.among == 1:
        return "the only picture"
    return f"all {some.among} pictures" if some.count == some.among else f"{some.count} of {some.among} pictures"


def _span(span: views.Span) -> str:
    least, most = map(number_text, span)
    return least if least == most else f"{least} to {most}"
