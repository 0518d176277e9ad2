"""The results of `measure` for a stage: cost and error of each setting on each of a few pictures.

Errors are of the target's pixels against a converged reference, root mean square. In linear light they are relative:
each pixel's deviation over the root of its radiance squared plus the square of FLOOR x the target's mean. FLOOR is 0.4
(accuracy.error).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Final, Literal

from msgspec import Meta

from spin_usd.basics.json_fields import Count, FrameName, Name, Positive, Sha256, Share, Size, VariantName
from spin_usd.scene.effort import Effort

FORMULAS: Final = 3  # raise it, here and in Measurement, when the meaning of a figure changes
AtLeastOne = Annotated[int, Meta(ge=1)]


@dataclass(frozen=True, kw_only=True)
class Configuration:
    """A way to render."""

    renderer: Name
    effort: Annotated[Effort, Meta(description="As in a record's provenance (record-1).")]

    @property
    def text(self) -> str:
        return f"{self.renderer} {self.effort.text}"


@dataclass(frozen=True, kw_only=True)
class MeasuredPicture:
    """A picture that was measured, and its reference."""

    name: FrameName
    index: Annotated[Count, Meta(description="The picture's place in the stage, from 0.")]
    region: Annotated[tuple[int, int, int, int], Meta(description="x0, y0, x1, y1 of the pixels rendered.")]
    target_pixels: Annotated[Count, Meta(description="Pixels that the target covers by half or more in the reference.")]
    reference_samples: Annotated[AtLeastOne, Meta(description="Rays through each of the reference's pixels.")]
    reference_error: Annotated[
        Size,
        Meta(description="The reference's own, relative, root mean square, as estimated from the spread of its parts."),
    ]
    noise_dn: Annotated[
        Size,
        Meta(description="Root mean square of the detector's own noise and rounding, over the target's pixels, DN."),
    ]
    reference_capped: Annotated[
        bool,
        Meta(
            description="Whether the reference took as many samples as it was allowed before its error was as small "
            "as wanted."
        ),
    ] = False


@dataclass(frozen=True, kw_only=True)
class Figures:
    """Cost and error of a setting on a picture."""

    frame: FrameName
    setting: Configuration
    seeds: Annotated[int, Meta(ge=2, description="Renders, each with a seed of its own.")]
    cpu_s: Annotated[Size, Meta(description="Seconds of one core, median.")]
    wall_s: Annotated[Size, Meta(description="Seconds of wall clock, median.")]
    memory_bytes: Annotated[Count, Meta(description="The most that the process held meanwhile.")]
    variance: Annotated[Size, Meta(description="Of the relative error, over the seeds.")]
    bias_squared: Annotated[
        float,
        Meta(description="Of the relative error; an unbiased estimate, so a little below 0 without bias."),
    ]
    uncertainty: Annotated[
        Size,
        Meta(
            description="Of the mean square error, variance + bias_squared: its standard error over the seeds, and the "
            "reference's own mean square error where that was capped, for smaller errors cannot be resolved."
        ),
    ]
    brightness: Annotated[float, Meta(description="The target's light over the reference's, minus 1.")]
    error_dn: Annotated[
        Size,
        Meta(description="Root mean square difference from the reference after the detector, without its noise, DN."),
    ]
    error_dn_uncertainty: Annotated[
        Size,
        Meta(
            description="By how much error_dn is greater with the uncertainty of its square, of the same kind, added; "
            "DN."
        ),
    ]
    structure: Annotated[Size, Meta(description="1 - SSIM around the target's pixels (Wang et al. 2004).")]

    @property
    def error(self) -> float:
        """The relative error, root mean square."""
        return float(self._square**0.5)

    @property
    def bias(self) -> float:
        """The root of its square; 0 if that is within the uncertainty."""
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
    """The labels of a picture by a renderer's own pass, against another pass."""

    frame: FrameName
    renderer: Name
    against: Name
    iou: Annotated[Share, Meta(description="Of the silhouettes: intersection over union.")]
    depth_m: Annotated[Size, Meta(description="Worst difference in depth, metres, where both see the target.")]
    reprojection_px: Annotated[
        Size, Meta(description="Farthest that the projection of a pixel's body point is from its centre.")
    ]
    part_pixels: Annotated[Count, Meta(description="Pixels that both see with different parts.")]


@dataclass(frozen=True, kw_only=True)
class Execution:
    """The same renders made in one of several ways, which change no byte."""

    processes: AtLeastOne
    threads: Annotated[AtLeastOne, Meta(description="Of each process.")]
    crop: Annotated[bool, Meta(description="Whether only the target's region was rendered.")]
    wall_s: Annotated[Size, Meta(description="Seconds of wall clock for all of them.")]
    same: Annotated[bool, Meta(description="Whether each pixel was that of the first way.")]


@dataclass(frozen=True, kw_only=True)
class Saving:
    """Work that the scene does not need and that was skipped (see renderers.skipped), measured on a
    picture by rendering it without that work and with it in turn."""

    frame: FrameName
    what: Annotated[str, Meta(min_length=1)]
    cpu_s: Annotated[Size, Meta(description="Seconds of one core without it, median.")]
    cpu_s_with: Annotated[Size, Meta(description="Seconds of one core with it, median.")]
    ratio_least: Annotated[
        Size,
        Meta(
            description="Of the seconds with it to those without, of two renders of one seed made in turn: the least "
            "of all seeds."
        ),
    ]
    ratio_most: Annotated[Size, Meta(description="The most of all seeds.")]
    difference: Annotated[Size, Meta(description="Between the two pictures, relative, root mean square.")]
    noise: Annotated[Size, Meta(description="The same between pictures of two seeds.")]


@dataclass(frozen=True, kw_only=True)
class Failure:
    """A measurement of a picture that failed."""

    frame: FrameName
    what: Annotated[str, Meta(min_length=1, description="Such as a setting.")]
    reason: Annotated[str, Meta(min_length=1)]


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """Cost and error of render settings, measured on a few pictures of a stage.

    Seconds are of one render. Relative errors are of the target's pixels in linear light, of each pixel's deviation
    over the root of its own radiance squared plus the square of 40 % of the target's mean. DN: digital numbers of the
    image.
    """

    schema: Literal["measure-1"] = "measure-1"
    formulas: Annotated[
        Literal[3],
        Meta(description="Version of the formulas; figures of other formulas have other meanings."),
    ] = FORMULAS
    stage: Annotated[Sha256, Meta(description="Hash of the composed content, as in a record's provenance.")]
    variant: VariantName
    machine: Annotated[
        Mapping[str, str | int | float],
        Meta(description="Machine, such as the number of usable processors (cores)."),
    ]
    versions: Annotated[Mapping[str, str], Meta(description="Of the software.")]
    frames: Annotated[tuple[MeasuredPicture, ...], Meta(min_length=1)]
    figures: Annotated[tuple[Figures, ...], Meta(description="Each setting on each picture.")]
    labels: Annotated[
        tuple[LabelFigures, ...],
        Meta(description="Labels of a renderer's own pass, compared with another pass."),
    ] = ()
    execution: Annotated[
        tuple[Execution, ...], Meta(description="The same renders made in several ways, which change no byte.")
    ] = ()
    savings: Annotated[
        tuple[Saving, ...], Meta(description="Work that the scene does not need, and that is skipped.")
    ] = ()
    failures: Annotated[
        tuple[Failure, ...], Meta(description="Failed measurements; the next run tries them again.")
    ] = ()
    reference_share: Annotated[
        Positive,
        Meta(
            description="Of the smallest mean square error compared on a picture: the most that its reference's own "
            "may be."
        ),
    ] = 0.1
