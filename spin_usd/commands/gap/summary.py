"""The report's figures over all pictures, from the measures of each."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from msgspec import UNSET, UnsetType

from spin_usd.basics.arrays import Float
from spin_usd.commands.gap.calls import LightAnswer, MeasuredPair
from spin_usd.commands.gap.options import GapOptions
from spin_usd.commands.gap.report import GapFit, GapLight, GapMeasure, GapParameter, GapPart, GapPicture, GapReport
from spin_usd.realism.camera_fit import CameraFit
from spin_usd.realism.intervals import Interval, interval, median_interval
from spin_usd.realism.measures import GREY, PAIR_MEASURES, PICTURE_MEASURES
from spin_usd.realism.two_sample import separability

Values = Callable[[MeasuredPair], float | None]


@dataclass(frozen=True, kw_only=True)
class Step:
    """The measures of all pictures with the fits up to one."""

    name: str
    """The fit's; "ours" for the stage as it is."""
    pictures: dict[str, MeasuredPair]
    lights: Mapping[str, LightAnswer]
    seconds: float
    """Per picture."""


def report_of(
    options: GapOptions,
    steps: Sequence[Step],
    fits: Mapping[str, GapFit],
    left_out: Mapping[str, str],
    notes: Sequence[str],
) -> GapReport:
    """Return the report on the steps, the stage as it is first."""
    summary = {
        measure.name: _both(measure.unit, measure.description, steps, _value("both", measure.name))
        for measure in PAIR_MEASURES
    }
    for of_one in PICTURE_MEASURES:
        real, ours = _value("real", of_one.name), _value("ours", of_one.name)
        summary[of_one.name] = _paired(of_one.unit, of_one.description, steps, real, ours)
    sharp = next(step for step in reversed(steps) if step.name in ("ours", "light"))
    summary["psf_sigma"] = _paired(
        "px",
        "Point spread function: at which our edges are as sharp as the real ones, in the same noise.",
        steps,
        lambda pair: pair.psf_sigma,
        lambda pair: pair.own_psf,
        real_in=sharp,
    )
    offset = median_interval(_values(steps[0], _value("silhouette", "median")))
    summary["silhouette"] = GapMeasure(
        unit="px",
        description="Offset of the real pictures' edges from the labels' silhouette, outwards: geometry and pose.",
        real=_known(offset[0]),
        interval=_known_span(offset[1]),
    )
    summary["classifier_auc"] = _classifier(steps)
    return GapReport(
        real=str(options.real),
        stage=str(options.stage),
        pictures=[_picture(name, steps) for name in steps[0].pictures],
        parts=dict(_parts(steps)),
        summary=summary,
        fits=dict(fits),
        left_out=dict(left_out),
        seconds=steps[0].seconds,
        notes=[*notes, *_shared_notes(steps[0])],
    )


def camera_parameters(camera: CameraFit, levels: Sequence[float]) -> dict[str, GapParameter]:
    """Return the parameters of a camera and the median level of its pictures."""
    level, around = median_interval(levels)
    units = {"noise": GREY, "shot_noise": GREY, "psf_sigma": "px", "jpeg_quality": ""}
    return {
        "black_level": GapParameter(value=level, interval=_known_span(around), unit=GREY),
        **{
            name: GapParameter(value=getattr(camera, name), interval=list(around), unit=units[name])
            for name, around in camera.intervals.items()
        },
    }


def _picture(name: str, steps: Sequence[Step]) -> GapPicture:
    first, last = steps[0].pictures[name], steps[-1].pictures[name]
    answer = steps[-1].lights.get(name)
    return GapPicture(
        name=name,
        real=first.real,
        ours=first.ours | first.both,
        fitted=last.ours | last.both if len(steps) > 1 else {},
        silhouette=first.silhouette,
        lights=[
            GapLight(
                name=light.path,
                strength=light.strength,
                interval=[light.low, light.high],
                share=light.share,
                direction=light.direction,
                distance=light.distance,
            )
            for light in (answer.lights if answer else ())
        ],
        notes=first.notes,
    )


def _parts(steps: Sequence[Step]) -> list[tuple[str, GapPart]]:
    """Return the parts, the one with most of the target's pixels first."""
    pixels: dict[str, float] = {}
    for pair in steps[0].pictures.values():
        for name, of in pair.parts.items():
            pixels[name] = pixels.get(name, 0.0) + of["pixels"]

    def value(part: str, name: str) -> Values:
        return lambda pair: pair.parts.get(part, {}).get(name)

    return [
        (
            part,
            GapPart(
                pictures=sum(part in pair.parts for pair in steps[0].pictures.values()),
                correlation=_both("", "Correlation of the smooth signals.", steps, value(part, "correlation")),
                wasserstein=_both(GREY, "Wasserstein distance of the signals.", steps, value(part, "wasserstein")),
            ),
        )
        for part in sorted(pixels, key=lambda each: -pixels[each])
    ]


def _both(unit: str, description: str, steps: Sequence[Step], of: Values) -> GapMeasure:
    """Return a measure of real pictures and ours together."""
    found = [median_interval(_values(step, of)) for step in steps]
    return GapMeasure(
        unit=unit,
        description=description,
        ours=_known(found[0][0]),
        fitted=_known(found[-1][0]) if len(steps) > 1 else UNSET,
        interval=_known_span(found[-1][1]),
        steps={step.name: each[0] for step, each in list(zip(steps, found, strict=True))[1:] if np.isfinite(each[0])},
    )


def _paired(
    unit: str, description: str, steps: Sequence[Step], real: Values, ours: Values, *, real_in: Step | None = None
) -> GapMeasure:
    """Return a measure that the real pictures have, and ours. `real_in`: the step whose real values count."""
    of_real = _values(real_in or steps[0], real)
    of_ours = [_values(step, ours) for step in steps]
    median, around = median_interval(of_real)
    first = median_interval(of_ours[0] - of_real)
    last = median_interval(of_ours[-1] - of_real)
    fitted = len(steps) > 1
    medians = [median_interval(each)[0] for each in of_ours]
    return GapMeasure(
        unit=unit,
        description=description,
        ours=_known(medians[0]),
        fitted=_known(medians[-1]) if fitted else UNSET,
        gap=_known(first[0]),
        gap_interval=_known_span(first[1]),
        fitted_gap=_known(last[0]) if fitted else UNSET,
        fitted_gap_interval=_known_span(last[1]) if fitted else UNSET,
        steps={step.name: each for step, each in list(zip(steps, medians, strict=True))[1:] if np.isfinite(each)},
        real=_known(median),
        interval=_known_span(around),
    )


def _classifier(steps: Sequence[Step]) -> GapMeasure:
    """Return how well a classifier tells the pictures apart, with an interval over pictures."""
    areas, last = [], np.zeros(0)
    for step in steps:
        pairs = step.pictures.values()
        area, last = separability(
            [np.array(pair.real_features) for pair in pairs], [np.array(pair.our_features) for pair in pairs]
        )
        areas.append(area)
    _, around = interval(last, lambda drawn: drawn.mean(axis=1))
    return GapMeasure(
        unit="",
        description="Area under the ROC curve of a classifier of patches: 0.5 if it cannot tell real from ours.",
        ours=_known(areas[0]),
        fitted=_known(areas[-1]) if len(steps) > 1 else UNSET,
        interval=_known_span(around),
        steps={step.name: each for step, each in list(zip(steps, areas, strict=True))[1:] if np.isfinite(each)},
    )


def _value(of: str, name: str) -> Values:
    """Return a function that takes a measure of a pair's real picture, of ours, of both, or of its silhouette."""
    return lambda pair: getattr(pair, of).get(name)


def _values(step: Step, of: Values) -> Float:
    found = (of(pair) for pair in step.pictures.values())
    return np.array([np.nan if value is None else value for value in found])


def _shared_notes(step: Step) -> list[str]:
    """Return the notes on pictures: those that all share once."""
    notes: dict[str, list[str]] = {}
    for name, pair in step.pictures.items():
        for note in pair.notes:
            notes.setdefault(note, []).append(name)
    return [
        f"{'every picture' if len(names) == len(step.pictures) > 1 else ', '.join(names)} {note}"
        for note, names in notes.items()
    ]


def _known(value: float) -> float | UnsetType:
    return value if np.isfinite(value) else UNSET


def _known_span(span: Interval) -> list[float] | UnsetType:
    return _span(span) if np.isfinite(span).all() else UNSET


def _span(span: Interval) -> list[float]:
    return [float(each) if np.isfinite(each) else 0.0 for each in span]
