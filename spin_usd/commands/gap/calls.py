"""The calls of children that compare pictures: one opens a stage with a renderer, the others measure and fit a pair."""

from msgspec import Struct

from spin_usd.processes.call import Call
from spin_usd.realism.camera_fit import CameraFit
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.sensor import Sensor
from spin_usd.studio.picture_request import Matrix


class OpenGap(Struct, frozen=True, kw_only=True):
    """The request to open a stage."""

    stage: str
    variant: str
    settings: RenderSettings
    cpus: list[int]
    """Processors that the worker may use."""


class OpenedGap(Struct, frozen=True, kw_only=True):
    """An open stage."""

    frames: list[str]
    sensor: Sensor
    """The camera's, at the first frame."""


class Pair(Struct, frozen=True, kw_only=True):
    """A real picture, and the frame of the stage that shows the same."""

    name: str
    file: str
    """The real picture's."""
    frame: str | None = None
    """Frame of the stage; None for its first, which `pose` changes."""
    pose: Matrix | None = None
    """T_cam_body of the first target; None for the frame's own."""


class Fitted(Struct, frozen=True, kw_only=True):
    """The fits so far, of one picture."""

    panels: int = 0
    """Number of panels, and of Suns, around the target; 0 for the stage's own lights."""
    lights: dict[str, float] | None = None
    """Factors on the lights' strengths by path, of those that shine; None for the stage's own light."""
    camera: CameraFit | None = None
    level: float = 0.0
    """Black level of the picture with `camera`, steps of 8 bits of linear signal."""
    values: dict[str, float] = {}
    """Parameters of materials."""


class MeasurePair(Struct, frozen=True, kw_only=True):
    """The request to measure a pair."""

    pair: Pair
    fitted: Fitted
    sharpness: bool = False
    """Whether to measure the edges of our picture with each psf_sigma."""


class MeasuredPair(Struct, frozen=True, kw_only=True):
    """The measures of a pair; those that cannot be taken are absent."""

    real: dict[str, float]
    ours: dict[str, float]
    both: dict[str, float]
    parts: dict[str, dict[str, float]]
    silhouette: dict[str, float]
    """Offsets of the real picture's edges from the labels'."""
    linear: dict[str, float]
    """Level and noise of the real picture, of its linear signal."""
    own_pose: bool
    """Whether the pose is that of the stage's frame."""
    jpeg: bool
    """Whether the real picture is a JPEG of our size, whose blocks correlate its noise."""
    psf_sigma: float | None
    """At which our edges are as sharp as the real ones, pixels."""
    own_psf: float
    """psf_sigma of our picture."""
    real_features: list[list[float]]
    our_features: list[list[float]]
    shown: list[str]
    """The real picture and ours around the target, JPEG in base64."""
    notes: list[str]
    """Sentences without the picture's name."""


class FitLight(Struct, frozen=True, kw_only=True):
    """The request to fit the light of a picture."""

    pair: Pair
    fitted: Fitted
    """Earlier fits; `lights`, if given, are the only ones that may shine."""
    psf_sigma: float | None = None
    """Point spread function of the real picture, pixels; None for the scene's own."""


class FittedLight(Struct, frozen=True, kw_only=True):
    """A light that shines."""

    path: str
    strength: float
    """Factor on a light that gives the target's centre about 1 W/m2; on the light's own strength if it is the
    stage's."""
    low: float
    high: float
    share: float
    """Share of the picture's light that it gives."""
    direction: list[float]
    """Towards the light, camera axes; its place relative to the target's centre over its distance."""
    distance: float
    """From the target's centre, metres; 0 for a Sun."""


class LightAnswer(Struct, frozen=True, kw_only=True):
    """The fitted light of a picture."""

    lights: list[FittedLight]
    explained: float
    """Share of the squared signal that it explains."""
    squared: float
    """Squared signal, of which the rest is the error."""


class ShownMaterial(Struct, frozen=True, kw_only=True):
    """A material of the first target in a picture."""

    pixels: int
    limits: dict[str, tuple[float, float]]
    """Limits of the logarithm of a factor, by input."""


class TrySurfaces(Struct, frozen=True, kw_only=True):
    """The request to try values of materials on a picture, its light solved again for each."""

    pair: Pair
    fitted: Fitted
    psf_sigma: float | None
    trials: list[dict[str, float]]
    """Parameters by name; all trials have the same names."""


class SurfaceErrors(Struct, frozen=True, kw_only=True):
    """The errors of trials on a picture."""

    products: list[list[float]]
    """Products of the trials' residuals over the squared signal, each trial with each: on the diagonal, the share that
    a trial does not explain."""


class FittedPair(Struct, frozen=True, kw_only=True):
    """A pair with its fits."""

    pair: Pair
    fitted: Fitted


class WriteFits(Struct, frozen=True, kw_only=True):
    """The request to write the fits of pictures as layers over a copy of the stage."""

    folder: str
    pictures: list[FittedPair]
    fits: list[str]
    values: dict[str, float]


OPEN_GAP = Call("spin_usd.commands.gap.worker:GapWorker", OpenGap, OpenedGap)
MEASURE_PAIR = Call("spin_usd.commands.gap.worker:GapWorker.measure", MeasurePair, MeasuredPair)
FIT_LIGHT = Call("spin_usd.commands.gap.worker:GapWorker.fit_light", FitLight, LightAnswer)
SHOWN_MATERIALS = Call("spin_usd.commands.gap.worker:GapWorker.shown_materials", Pair, dict[str, ShownMaterial])
"""Answers with the materials by name."""
TRY_SURFACES = Call("spin_usd.commands.gap.worker:GapWorker.try_surfaces", TrySurfaces, SurfaceErrors)
WRITE_FITS = Call("spin_usd.commands.gap.worker:GapWorker.write_fits", WriteFits, str)
"""Answers with the root layer that it wrote."""
