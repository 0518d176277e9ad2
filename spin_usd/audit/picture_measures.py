"""The files of a picture that a child reads, and what it measures of them."""

from msgspec import Struct

from spin_usd.audit.annotated_set import DepthSource, MaskSource


class Lens(Struct, frozen=True, kw_only=True):
    """A camera as numbers."""

    size: tuple[int, int]
    """Width and height, pixels."""
    projection: tuple[float, float, float, float]
    """fx, fy, cx, cy, pixels; (0, 0) is the image's corner."""
    distortion: list[float]
    fisheye: bool = False


class TargetFiles(Struct, frozen=True, kw_only=True):
    """The labels of a target that are compared with pixels."""

    id: str
    mask: MaskSource | None = None
    box: list[float] | None = None
    """x0, y0, x1, y1."""
    pose: list[list[float]] | None = None
    """T_cam_body (3, 4), where the set has a usable one."""


class PictureFiles(Struct, frozen=True, kw_only=True):
    """The files of a picture."""

    name: str
    """Path of the image in the set's folder."""
    targets: list[TargetFiles]
    depth: DepthSource | None = None
    lens: Lens | None = None


class MeasurePictures(Struct, frozen=True, kw_only=True):
    """The request to measure pictures of a set."""

    folder: str
    pictures: list[PictureFiles]
    models: dict[str, tuple[str, float]] = {}
    """Model files, and metres of their units, by id of the target; "" is of all others."""
    lossy_masks: bool = False


class ModelFile(Struct, frozen=True, kw_only=True):
    """The request to read a model."""

    path: str
    unit: float
    """Metres of its unit."""


class Silhouette(Struct, frozen=True, kw_only=True):
    """A mask beside the projected model."""

    iou: float
    """Intersection over union, pixels at the projection's edge forgiven."""
    shift: tuple[float, float]
    """Mean of the mask's pixels less the projection's, pixels."""
    edge: float
    """Median distance of the mask's edge from the projection's, pixels, positive outside."""


class TargetMeasures(Struct, frozen=True, kw_only=True):
    """The measures of a target's labels in the pixels."""

    box: list[float] | None = None
    """Bounding box x0, y0, x1, y1 of the mask; None without one, or if it is empty."""
    pixels: int = 0
    """Of the mask."""
    centre: tuple[float, float] | None = None
    """Mean pixel of the mask."""
    grey: float = 0.0
    """Share of the mask's pixels that are neither black nor white."""
    lit: tuple[float, float, float, float] | None = None
    """Share of the picture's lit pixels inside the mask, or the box, and inside it mirrored left to right, upside down,
    and both; None where the picture has no dark background."""
    depth: float | None = None
    """Median depth inside the mask, metres."""
    without_depth: float = 0.0
    """Share of the mask's pixels without depth."""
    beside_mask: float = 0.0
    """Share of the pixels with depth that lie in no mask."""
    silhouette: Silhouette | None = None


class PictureMeasures(Struct, frozen=True, kw_only=True):
    """The measures of a picture's files."""

    name: str
    errors: dict[str, str] = {}
    """Reasons why files could not be used, by their paths."""
    size: tuple[int, int] | None = None
    """Width and height."""
    mask_size: tuple[int, int] | None = None
    """Width and height of the first mask or depth of another size than the image."""
    equal_channels: bool | None = None
    """Whether all three channels are equal; None for grey files."""
    sha256: str = ""
    look: str = ""
    """Brightness of 16 x 16 fields, as text; "" for pictures that are nearly uniform."""
    twice_encoded: bool = False
    """Whether its values are those that an sRGB curve leaves of 8-bit values."""
    lit_box: list[float] | None = None
    """Bounding box of the lit pixels before a dark background."""
    targets: list[TargetMeasures] = []


class DrawPicture(Struct, frozen=True, kw_only=True):
    """The request to draw a picture with its labels."""

    folder: str
    picture: PictureFiles
    keypoints: list[list[float]] = []
    """x and y, pixels."""
    lossy_masks: bool = False


class TraceOutlines(Struct, frozen=True, kw_only=True):
    """The request to follow a model's outline in pictures, under several poses of each."""

    folder: str
    pictures: list[PictureFiles]
    poses: list[list[list[list[float]]]]
    """T_cam_body (3, 4) of each pose of each picture."""
    model: tuple[str, float]
    """Model file, and metres of its unit."""
