"""Rule: the target can be seen in the image."""

from collections.abc import Iterator

from spin_usd.dataset.check.in_child.checked_picture import CheckedPicture
from spin_usd.dataset.picture.brightness import tone_findings
from spin_usd.scene.finding import Finding


def brightness_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Return a warning for each reason why little of the target shows."""
    return tone_findings(picture.record, picture.where)
