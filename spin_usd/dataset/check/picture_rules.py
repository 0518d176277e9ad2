"""The rules on each picture of a dataset. A new one is a file of its own and an entry here."""

from collections.abc import Callable, Iterator

from spin_usd.dataset.check.boxes import box_findings
from spin_usd.dataset.check.brightness import brightness_findings
from spin_usd.dataset.check.checked_picture import CheckedPicture
from spin_usd.dataset.check.keypoints import keypoint_findings
from spin_usd.dataset.check.labels import label_findings
from spin_usd.dataset.check.pixel_counts import count_findings
from spin_usd.dataset.check.pose import pose_findings
from spin_usd.dataset.check.provenance import provenance_findings
from spin_usd.scene.finding import Finding

PICTURE_RULES: tuple[Callable[[CheckedPicture], Iterator[Finding]], ...] = (
    provenance_findings,
    brightness_findings,
    label_findings,
    pose_findings,
    box_findings,
    count_findings,
    keypoint_findings,
)
"""The rules, in the order in which their findings are reported."""
