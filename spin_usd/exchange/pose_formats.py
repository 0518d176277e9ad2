"""The formats of pose lists that there are. A new one is a file of its own and an entry here."""

from spin_usd.exchange.bop_poses import BOP
from spin_usd.exchange.coco_poses import COCO
from spin_usd.exchange.croissant_poses import CROISSANT
from spin_usd.exchange.pose_format import PoseFormat
from spin_usd.exchange.record_poses import RECORD
from spin_usd.exchange.spark_poses import STREAM_2
from spin_usd.exchange.speedplus_poses import SPEEDPLUS
from spin_usd.exchange.urso_poses import URSO
from spin_usd.exchange.webdataset_poses import WEBDATASET

POSE_FORMATS: tuple[PoseFormat, ...] = (RECORD, STREAM_2, URSO, BOP, COCO, WEBDATASET, CROISSANT, SPEEDPLUS)
"""In the order in which they are asked whether they recognise a file."""
