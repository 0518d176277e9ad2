"""The rules on each picture of a dataset. A new one is a file of its own and an entry here."""

from collections.abc import Callable, Iterator

from spin_usd.dataset.check.in_child.boxes import box_findings
from spin_usd.dataset.check.in_child.brightness import brightness_findings
from spin_usd.dataset.check.in_child.checked_picture import CheckedPicture
from spin_usd.dataset.check.in_child.keypoints import keypoint_findings
from spin_usd.dataset.check.in_child.labels import label_findings
from spin_usd.dataset.check.in_child.pixel_counts import count_findings
from spin_usd.dataset.check.in_child.pose import pose_findings
from spin_usd.dataset.check.in_child.target_ids import target_id_findings
from spin_usd.scene.finding import Finding

PICTURE_RULES: tuple[Callable[[CheckedPicture], Iterator[Finding]], ...] = (
    target_id_findings,
    brightness_findings,
    label_findings,
    pose_findings,
    box_findings,
    count_findings,
    keypoint_findings,
)
"""The rules, in the order in which their findings are reported."""
