"""Rule: the record counts the pixels that the labels show."""

from collections.abc import Iterator

from spin_usd.commands.check.digests import MAKE_AGAIN
from spin_usd.commands.check.in_child.checked_picture import CheckedPicture
from spin_usd.commands.check.in_child.checked_target import CheckedTarget, targets_of
from spin_usd.scene.finding import Finding

ROUNDING = 1e-9


def count_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Yield errors for counts of pixels, and the visible fraction, that do not fit the masks or one another."""
    for target in targets_of(picture):
        for fault in (*_counts(target), *_fraction(target)):
            yield target.finding("pixels", f"{fault}; {MAKE_AGAIN}")


def _counts(target: CheckedTarget) -> Iterator[str]:
    visible, amodal = (target.recorded["pixels"][name] for name in ("visible", "amodal"))
    if target.mask is not None and int(target.mask.sum()) != visible:
        yield f"{int(target.mask.sum())} pixels show it, and its record counts {visible}"
    if visible > amodal:
        yield f"its record counts {visible} visible pixels of {amodal}"
    alone = all(part["target"] == target.recorded["id"] for part in target.picture.description["parts"].values())
    if alone and visible < amodal:
        yield f"its record counts {visible} visible pixels of {amodal}, and nothing else is there to hide it"


def _fraction(target: CheckedTarget) -> Iterator[str]:
    """The fraction is that of the pixels in the frame, or less where some of the target lies outside it."""
    visible, amodal = (target.recorded["pixels"][name] for name in ("visible", "amodal"))
    fraction, truncated = target.recorded["visible_fraction"], target.recorded["box"]["truncated"]
    if fraction is None:
        if amodal:
            yield f"it covers {amodal} pixels, and has no visible fraction"
        return
    most = visible / amodal if amodal else 0.0
    if fraction > most + ROUNDING or (not truncated and fraction < most - ROUNDING):
        yield f"its visible fraction is {fraction:.4g}, and {visible} of {amodal} pixels in the frame are {most:.4g}"
