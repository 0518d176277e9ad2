"""Rules on the views of the target: its size, and pictures in which it is out of sight or in the dark."""

from collections.abc import Iterator

from spin_usd.scene.derived.view_text import MESSAGES, number_text, sentence, size_text
from spin_usd.scene.derived.views import ViewKind, Views
from spin_usd.scene.finding import ERROR, WARNING, Finding
from spin_usd.scene.plausible import SIZES, is_plausible

CODES = {
    ViewKind.CAMERA_INSIDE: "camera-inside",
    ViewKind.BEHIND: "target-behind",
    ViewKind.OUTSIDE: "target-outside",
    ViewKind.CUT_OFF: "target-cut-off",
    ViewKind.FEW_PIXELS: "target-small",
    ViewKind.UNLIT: "target-unlit",
    ViewKind.DARK: "target-dark",
}


def view_findings(found: Views, where: str) -> Iterator[Finding]:
    """Yield findings on the views of the target at the prim `where`: warnings, since each may be meant, but errors
    where no picture shows the target."""
    if not is_plausible(found.size):
        smallest, largest = map(number_text, SIZES)
        message = f"the target is {size_text(found.size)}: spacecraft are {smallest} to {largest} m; check its unit"
        yield Finding(code="target-size", where=where, message=message, severity=WARNING)
    unseen = found.count(ViewKind.BEHIND, ViewKind.OUTSIDE) == found.pictures
    for kind in (kind for kind in found.of if kind in MESSAGES):
        severity = ERROR if unseen and kind in (ViewKind.BEHIND, ViewKind.OUTSIDE) else WARNING
        yield Finding(code=CODES[kind], where=where, message=sentence(found, kind), severity=severity)
