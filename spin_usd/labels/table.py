"""The labels that there are.

A new one is a file of its own and an entry here.
"""

from collections.abc import Iterable

from spin_usd.labels.classes import CLASSES
from spin_usd.labels.dense_pose import DENSE_POSE
from spin_usd.labels.depth import DEPTH
from spin_usd.labels.disparity import DISPARITY
from spin_usd.labels.flow import FLOW
from spin_usd.labels.instance import INSTANCE
from spin_usd.labels.label import CloudLabel, Label
from spin_usd.labels.lidar import LIDAR, LIDAR_PLY
from spin_usd.labels.lit import LIT
from spin_usd.labels.masks import MASK_AMODAL, MASK_VISIBLE
from spin_usd.labels.nocs import NOCS
from spin_usd.labels.normals import NORMALS_BODY, NORMALS_CAM
from spin_usd.labels.range import RANGE
from spin_usd.labels.segmentation import SEGMENTATION
from spin_usd.scene.scene import Scene

_ALL: tuple[Label | CloudLabel, ...] = (
    DEPTH,
    SEGMENTATION,
    DENSE_POSE,
    INSTANCE,
    RANGE,
    NORMALS_CAM,
    NORMALS_BODY,
    CLASSES,
    MASK_VISIBLE,
    MASK_AMODAL,
    LIT,
    LIDAR,
    LIDAR_PLY,
    NOCS,
    FLOW,
    DISPARITY,
)
LABELS: dict[str, Label | CloudLabel] = {label.name: label for label in _ALL}
"""By name, in the order in which they are made."""

PIXEL_LABELS = {label.name: label for label in _ALL if isinstance(label, Label)}
"""Labels with a value for every pixel."""

CLOUD_LABELS = {label.name: label for label in _ALL if isinstance(label, CloudLabel)}
"""Labels of a LiDAR, which not every stage has."""

NEEDS = dict.fromkeys(CLOUD_LABELS, "lidar") | {
    name: label.takes for name, label in PIXEL_LABELS.items() if label.takes == "paired"
}
"""Part of a scene that a label needs and not every stage has, by the label's name."""

NOT_EVERYWHERE = (*NEEDS, *(name for name, label in PIXEL_LABELS.items() if label.max_targets is not None))
"""Names of the labels that not every stage can have."""

DEFAULT_LABELS = tuple(name for name, label in PIXEL_LABELS.items() if label.default)
"""Names of the labels that `render` writes by default."""

LABELS_OF_SEVERAL = tuple(name for name, label in PIXEL_LABELS.items() if label.of_several)
"""Names of the labels that `render` adds to any other label if a stage has several bodies."""


def own_keys(names: Iterable[str], scene: Scene, geometry: str, seed: int) -> dict[str, str]:
    """Return the keys, by name, of the labels that depend on more than the geometry, whose key is given; none for
    labels that the scene cannot have. Names that are not labels are ignored."""
    keys = {name: LABELS[name].key(scene, geometry, seed) for name in names if name in LABELS}
    return {name: key for name, key in keys.items() if key not in ("", geometry)}


def other_views(names: Iterable[str]) -> frozenset[str]:
    """Return the further views of the scene that the labels need, as in `Label.takes`. Names that are not labels are
    ignored."""
    taken = (PIXEL_LABELS[name].takes for name in names if name in PIXEL_LABELS)
    return frozenset(view for view in taken if view)
