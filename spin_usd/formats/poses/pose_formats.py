"""The formats of pose lists that there are. A new one is a file of its own and an entry here."""

from spin_usd.formats.poses.bop import BOP
from spin_usd.formats.poses.coco import COCO
from spin_usd.formats.poses.croissant import CROISSANT
from spin_usd.formats.poses.pose_format import PoseFormat
from spin_usd.formats.poses.record import RECORD
from spin_usd.formats.poses.speedplus import SPEEDPLUS
from spin_usd.formats.poses.stream2 import STREAM_2
from spin_usd.formats.poses.urso import URSO
from spin_usd.formats.poses.webdataset import WEBDATASET

POSE_FORMATS: tuple[PoseFormat, ...] = (RECORD, STREAM_2, URSO, BOP, COCO, WEBDATASET, CROISSANT, SPEEDPLUS)
"""In the order in which they are asked whether they recognise a file."""
