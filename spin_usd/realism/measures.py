"""The table of measures: of one picture, of a real picture beside ours, and of a part of both."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from spin_usd.realism import signals
from spin_usd.realism.darkness import shot_noise
from spin_usd.realism.edges import SilhouetteOffsets, edge_spread, silhouette_offsets
from spin_usd.realism.picture_view import PictureView

GREY = "steps of 8 bits"
SHARE = "share of the target's pixels"


@dataclass(frozen=True, kw_only=True)
class PictureMeasure:
    """A number of a picture, or of a pair."""

    name: str
    unit: str
    description: str
    of: Callable[[PictureView, PictureView], float]
    """In PICTURE_MEASURES of the first picture, where the second is the real one, which decides what counts as dark; in
    PAIR_MEASURES of the real picture, then ours."""


def _of_darkness(name: str, unit: str, description: str, field: str) -> PictureMeasure:
    return PictureMeasure(
        name=name, unit=unit, description=description, of=lambda view, _: getattr(view.darkness, field)
    )


PICTURE_MEASURES = (
    _of_darkness("black_level", GREY, "Mean of the darkest blocks.", "level"),
    _of_darkness("noise", GREY, "Standard deviation in the dark: neighbours' differences over the root of 2.", "noise"),
    PictureMeasure(
        name="shot_noise",
        unit=GREY,
        description="Variance of the noise per step of signal, from flat blocks (photon transfer).",
        of=lambda view, _: shot_noise(view.grey, view.darkness),
    ),
    _of_darkness("noise_across", "", "Correlation of the noise of neighbours in a row.", "across"),
    _of_darkness("noise_down", "", "Correlation of the noise of neighbours in a column.", "down"),
    _of_darkness("row_pattern", "", "Deviation of rows in the dark over the noise.", "rows"),
    _of_darkness("column_pattern", "", "Deviation of columns in the dark over the noise.", "columns"),
    PictureMeasure(
        name="edge_spread",
        unit="px",
        description="Standard deviation of the sharpest edges on the target, and around it before the dark room.",
        of=lambda view, real: edge_spread(view.grey, real.edge_places, view.darkness.noise),
    ),
    PictureMeasure(
        name="dark_share",
        unit=SHARE,
        description="As dark as the room.",
        of=lambda view, real: signals.dark_share(view, max(view.dark_limit, real.dark_limit)),
    ),
    PictureMeasure(
        name="saturated_share",
        unit=SHARE,
        description="At full scale.",
        of=lambda view, _: signals.saturated_share(view),
    ),
    PictureMeasure(
        name="signal_median",
        unit=GREY,
        description="Median of the target's signal.",
        of=lambda view, _: signals.signal_median(view),
    ),
    PictureMeasure(
        name="signal_p90",
        unit=GREY,
        description="90th percentile of the target's signal.",
        of=lambda view, _: signals.signal_p90(view),
    ),
    PictureMeasure(
        name="spectrum_slope",
        unit="",
        description="Slope of the target's radial power spectrum.",
        of=lambda view, _: signals.spectrum_slope(view),
    ),
    PictureMeasure(
        name="lit_background",
        unit="share of the pixels around the target",
        description="Brighter than the room.",
        of=lambda view, _: signals.lit_background(view),
    ),
)

PAIR_MEASURES = (
    PictureMeasure(
        name="correlation",
        unit="",
        description="Pearson's correlation of the smooth signals on the target.",
        of=lambda real, ours: signals.correlation(real.smooth, ours.smooth, real.target),
    ),
    PictureMeasure(
        name="wasserstein",
        unit=GREY,
        description="First Wasserstein distance of the smooth signals on the target.",
        of=lambda real, ours: signals.wasserstein(real, ours, real.target),
    ),
)


def measured(view: PictureView, real: PictureView) -> dict[str, float]:
    """Return the measures of a picture; `real`: the real one of its pair."""
    return {measure.name: float(measure.of(view, real)) for measure in PICTURE_MEASURES}


def compared(real: PictureView, ours: PictureView) -> dict[str, float]:
    """Return the measures of a pair."""
    return {measure.name: float(measure.of(real, ours)) for measure in PAIR_MEASURES}


def compared_parts(
    real: PictureView, ours: PictureView, names: Mapping[int, str]
) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield each part that shows enough pixels, with the correlation and the distance of its signals."""
    for number, name in names.items():
        mask = real.part(number)
        if mask.sum() >= signals.LEAST_PIXELS:
            yield (
                name,
                {
                    "pixels": float(mask.sum()),
                    "correlation": signals.correlation(real.smooth, ours.smooth, mask),
                    "wasserstein": signals.wasserstein(real, ours, mask),
                },
            )


def silhouette(view: PictureView) -> SilhouetteOffsets:
    """Return the offsets of a picture's silhouette from the labels'."""
    return silhouette_offsets(view.grey, view.target, view.darkness.noise)
