"""The formats of pose lists that there are. A new one is a file of its own and an entry here."""

from spin_usd.formats.poses.pose_format import PoseFormat
from spin_usd.formats.poses.speedplus import SPEEDPLUS

POSE_FORMATS: tuple[PoseFormat, ...] = (SPEEDPLUS,)
"""In the order in which they are asked whether they recognise a file."""
