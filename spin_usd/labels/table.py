"""The labels that there are. A new one is a file of its own and an entry here."""

from spin_usd.labels.dense_pose import DENSE_POSE
from spin_usd.labels.depth import DEPTH
from spin_usd.labels.instance import INSTANCE
from spin_usd.labels.range import RANGE
from spin_usd.labels.segmentation import SEGMENTATION

_ALL = (
    DEPTH,
    SEGMENTATION,
    DENSE_POSE,
    INSTANCE,
    RANGE,
)
LABELS = {label.name: label for label in _ALL}
"""By name, in the order in which they are made."""

DEFAULT_LABELS = tuple(name for name, label in LABELS.items() if label.default)
"""Names of those that `render` writes when none are named."""

LABELS_OF_SEVERAL = tuple(name for name, label in LABELS.items() if label.of_several)
"""Names of those that `render` writes beside any other label where a stage has several bodies."""
