"""A data set of somebody else as records: its pictures, with the labels that its own files give them.

Numbers are as read, neither normalised nor refused: finding what is wrong with them is the purpose. A number that a
file lacks, or that is not one, is NaN.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from msgspec import Struct

from spin_usd.basics.arrays import Float
from spin_usd.geometry.camera import Camera


class MaskSource(Struct, frozen=True, kw_only=True):
    """Pixels of a target: an image, COCO's run lengths, or outlines."""

    file: str = ""
    """Path of an image in the set's folder, 0 or dark where the target is not."""
    size: tuple[int, int] | None = None
    """Height and width of run lengths."""
    counts: str | list[int] = ""
    """Run lengths down the columns, compressed or not."""
    polygons: list[list[float]] = []
    """Outlines x, y, x, y, ... in pixels from the image's corner."""


class DepthSource(Struct, frozen=True, kw_only=True):
    """Depth of a picture."""

    file: str
    """Path in the set's folder: PNG, EXR, or .npz with one array."""
    metres: float
    """Metres per step."""
    nothing: float = 0.0
    """Depth in metres, beyond 0, from which there is no surface; 0 if only 0 means nothing."""


@dataclass(frozen=True, kw_only=True, slots=True)
class AnnotatedTarget:
    """The labels of one target in one picture, in our conventions where the layout defines how to convert them."""

    id: str
    """Class or object, as the set names it."""
    rotation: Float | None = None
    """(4,) the layout's quaternion, scalar first, which `AnnotatedSet.q_cam_body` converts, or R_cam_body (3, 3)."""
    t_cam_body: Float | None = None
    """(3,), metres."""
    box: Float | None = None
    """(4,) x0, y0, x1, y1, pixels from the image's corner."""
    mask: MaskSource | None = None
    keypoints: Float | None = None
    """(N, 3): x and y, pixels from the image's corner, and visibility, 0 where not labelled."""
    visible: float | None = None
    """Visible share of its silhouette."""
    pixels: int | None = None
    """Number of visible pixels."""
    whole: int | None = None
    """Number of pixels of its whole silhouette, also outside the frame."""


@dataclass(frozen=True, kw_only=True, slots=True)
class AnnotatedPicture:
    """One picture of a set."""

    name: str
    """Path of its image in the set's folder, or the name that a list gives it where there is no such file."""
    exists: bool
    """Whether the image exists."""
    place: str
    """The list that has it, and the entry."""
    split: str = ""
    sequence: str = ""
    camera: Camera | None = None
    targets: tuple[AnnotatedTarget, ...] = ()
    depth: DepthSource | None = None
    time: float | None = None
    """Time in a unit of the layout's own, which only its order is compared in."""
    said_size: tuple[int, int] | None = None
    """Width and height that a list gives the image."""

    @property
    def list(self) -> str:
        """Name of the list that has it."""
        return self.place.rpartition(",")[0]


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault of a set that its reader met."""

    rule: str
    where: str
    message: str


@dataclass(frozen=True, kw_only=True)
class AnnotatedSet:
    """A data set."""

    pictures: Sequence[AnnotatedPicture]
    classes: Mapping[str, str] = field(default_factory=dict)
    """Names of the ids; empty where the set has no list of them."""
    models: Mapping[str, str] = field(default_factory=dict)
    """Paths of model files in the set's folder, by id."""
    model_unit: float = 1.0
    """Metres of a model's unit."""
    faults: Sequence[Fault] = ()
    q_cam_body: Callable[[Float], Float] = lambda q: q
    """Converts the layout's quaternions (N, 4), scalar first, to ours."""
    other_axes: bool = False
    """Whether the layout's poses are in other axes of the camera than OpenCV's."""
    scalar_last: bool = False
    """Whether the layout's quaternions have the scalar at the end."""
    masks_are_lossy: bool = False
    """Whether the layout's masks are JPEG."""
    renamed: Mapping[str, str] = field(default_factory=dict)
    """Paths of images that lie elsewhere than their lists say, or are spelled otherwise, by their names there."""
    unlabelled: Sequence[str] = ()
    """Images in the folders of pictures that no list has."""
