"""The calls of the child of the keypoint tool: it reads models and layers, and makes the layer that is saved."""

from msgspec import Struct

from spin_usd.geometry.region import Region
from spin_usd.processes.call import Call

Place = tuple[float, float, float]


class PlacedKeypoints(Struct, frozen=True, kw_only=True):
    """Keypoints: metres, body axes."""

    names: tuple[str, ...]
    points: tuple[Place, ...]


class SaveTarget(Struct, frozen=True, kw_only=True):
    """The request to save the surface of a model as target.npz."""

    target: str
    """Name or file."""
    folder: str
    units_per_metre: float | None = None
    prim: str | None = None
    any_size: bool = False


class SavedTarget(Struct, frozen=True, kw_only=True):
    """A model whose surface was saved."""

    name: str
    notes: tuple[str, ...]
    """Sentences on how its file was read."""
    keypoints: PlacedKeypoints


class KeypointsLayer(Struct, frozen=True, kw_only=True):
    """The request for the text of a layer with keypoints of a target."""

    keypoints: PlacedKeypoints
    target: str


class CutPicture(Struct, frozen=True, kw_only=True):
    """The request for a part of a picture's image."""

    dataset: str
    frame: str
    variant: str
    region: Region


_IN_CHILD = "spin_usd.commands.keypoints.in_child"
SAVE_TARGET = Call(f"{_IN_CHILD}:save_target", SaveTarget, SavedTarget)
READ_KEYPOINTS = Call(f"{_IN_CHILD}:read_keypoints", str, PlacedKeypoints)
KEYPOINTS_TEXT = Call(f"{_IN_CHILD}:keypoints_text", KeypointsLayer, str)
PICTURE_PART = Call(f"{_IN_CHILD}:picture_part", CutPicture, str)
