"""The results of `measure` for a stage: cost and error of each setting on each of a few pictures.

Errors are of the target's pixels against a converged reference, root mean square. In linear light they are relative:
each pixel's deviation over the root of its radiance squared plus the square of FLOOR x the target's mean. FLOOR is 0.4
(accuracy.error).
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from spin_usd.scene.effort import Effort

FORMULAS = 3  # raise it, here and in the schema, when what a figure means changes


@dataclass(frozen=True, kw_only=True)
class Configuration:
    """A way to render: renderer and effort."""

    renderer: str
    effort: Effort

    @property
    def text(self) -> str:
        return f"{self.renderer} {self.effort.text}"


@dataclass(frozen=True, kw_only=True)
class MeasuredPicture:
    """A picture that was measured, and its reference.

    region: columns and rows x0, y0, x1, y1 of the pixels rendered · target_pixels: those that the target covers by half
    or more in the reference · reference_samples: what the reference took a pixel · reference_error: its own error,
    relative, as estimated from its parts · noise_dn: RMS of the detector's own noise and rounding over the target's
    pixels, digital numbers · reference_capped: it took as many samples as it was allowed, before its error was as small
    as wanted.
    """

    name: str
    index: int
    region: tuple[int, int, int, int]
    target_pixels: int
    reference_samples: int
    reference_error: float
    noise_dn: float
    reference_capped: bool = False


@dataclass(frozen=True, kw_only=True)
class Figures:
    """Cost and error of a setting on a picture.

    seeds: so many renders with different seeds · cpu_s, wall_s: median seconds of a render; memory_bytes: the most that
    its process held · variance, bias_squared: of the relative error, so that their sum is its mean square; uncertainty:
    the standard error of that, over the seeds, and the reference's own mean square error where it was capped, for
    smaller errors cannot be resolved; brightness: the target's light over the reference's, minus 1 · error_dn: RMS
    difference after the detector, without its noise, digital numbers; error_dn_uncertainty: by how much more it is with
    its square's uncertainty, of the same kind, added · structure: 1 - SSIM of the image around the target.
    """

    frame: str
    setting: Configuration
    seeds: int
    cpu_s: float
    wall_s: float
    memory_bytes: int
    variance: float
    bias_squared: float
    uncertainty: float
    brightness: float
    error_dn: float
    error_dn_uncertainty: float
    structure: float

    @property
    def error(self) -> float:
        """The relative error, root mean square."""
        return float(self._square**0.5)

    @property
    def bias(self) -> float:
        """The root of its square; 0 where that is within the uncertainty, so that it may be none."""
        return float(self.bias_squared**0.5) if self.bias_squared > self.uncertainty else 0.0

    @property
    def error_at_most(self) -> float:
        """The error with its square's uncertainty added, one standard error."""
        return float((self._square + self.uncertainty) ** 0.5)

    @property
    def error_dn_at_most(self) -> float:
        """The error after the detector with its uncertainty added, digital numbers."""
        return self.error_dn + self.error_dn_uncertainty

    @property
    def _square(self) -> float:
        return self.variance + max(self.bias_squared, 0.0)


@dataclass(frozen=True, kw_only=True)
class LabelFigures:
    """Labels of a picture by a renderer's own pass against another pass: silhouette's intersection over union; of the
    pixels both see, worst |difference| in depth, metres; worst reprojection of the dense pose, pixels; pixels whose
    part differs."""

    frame: str
    renderer: str
    against: str
    iou: float
    depth_m: float
    reprojection_px: float
    part_pixels: int


@dataclass(frozen=True, kw_only=True)
class Execution:
    """The pictures made all together with so many processes of so many threads, with or without the crop to the
    target's region: seconds of wall clock, and whether every pixel was the same as of the first."""

    processes: int
    threads: int
    crop: bool
    wall_s: float
    same: bool


@dataclass(frozen=True, kw_only=True)
class Saving:
    """Work that the scene does not need and that was skipped (see renderers.skipped.requirements), measured on a
    picture: median CPU seconds of the same render without it and with it, made in turn; the least and the most, over
    the seeds, of the ratio of those with it to those without; and the RMS difference between the two pictures,
    relative, beside what another seed makes (`noise`)."""

    frame: str
    what: str
    cpu_s: float
    cpu_s_with: float
    ratio_least: float
    ratio_most: float
    difference: float
    noise: float


@dataclass(frozen=True, kw_only=True)
class Failure:
    """A measurement of a picture that failed: `what`, such as a setting's text, and the reason."""

    frame: str
    what: str
    reason: str


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """All that `measure` found. stage: its hash; machine: what it ran on; versions: of the software; reference_share:
    of the smallest mean square error compared, the most that the reference's own may be."""

    stage: str
    variant: str
    machine: Mapping[str, Any]
    versions: Mapping[str, str]
    frames: tuple[MeasuredPicture, ...]
    figures: tuple[Figures, ...]
    labels: tuple[LabelFigures, ...] = ()
    execution: tuple[Execution, ...] = ()
    savings: tuple[Saving, ...] = ()
    failures: tuple[Failure, ...] = ()
    reference_share: float = 0.1

    def as_json(self) -> dict[str, Any]:
        """Return the measurement as JSON by the schema measure-1."""
        return {"schema": "measure-1", "formulas": FORMULAS, **asdict(self)}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Measurement":
        """Make the measurement of the JSON that `as_json` makes, already checked by the schema."""
        return cls(
            stage=value["stage"],
            variant=value["variant"],
            machine=value["machine"],
            versions=value["versions"],
            frames=tuple(MeasuredPicture(**{**frame, "region": tuple(frame["region"])}) for frame in value["frames"]),
            figures=tuple(Figures(**{**each, "setting": _setting(each["setting"])}) for each in value["figures"]),
            labels=tuple(LabelFigures(**each) for each in value["labels"]),
            execution=tuple(Execution(**each) for each in value["execution"]),
            savings=tuple(Saving(**each) for each in value["savings"]),
            failures=tuple(Failure(**each) for each in value["failures"]),
            reference_share=value["reference_share"],
        )


def _setting(value: Mapping[str, Any]) -> Configuration:
    return Configuration(renderer=value["renderer"], effort=Effort(**value["effort"]))
