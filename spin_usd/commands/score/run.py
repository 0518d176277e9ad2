"""Score predicted poses against a dataset or a pose list."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import UNSET, UnsetType
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import expected
from spin_usd.commands.score.matching import Matched, matched
from spin_usd.commands.score.options import ScoreOptions
from spin_usd.commands.score.predictions import read_predictions
from spin_usd.commands.score.report import ScoredErrors, ScoredGroup, ScoredModel, ScoredPicture, ScoreReport
from spin_usd.commands.score.shape_report import SCORE_SHAPE, ScoreShape, ShapeReport
from spin_usd.commands.score.truth import Truth, read_truth
from spin_usd.exchange.layout.models import diameter, read_models
from spin_usd.files.folder import Folder
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.options import names_in, takes
from spin_usd.scoring.model_errors import found_share, model_errors, mspd_recall, mssd_recall
from spin_usd.scoring.pose_errors import SCORES, PoseErrors, scores

PATIENCE_S = 1800.0  # a child is silent while it aligns and measures a mesh of millions of faces
WORST = 12
MODEL_POINTS = 2000  # of the target at most, evenly from its list, that ADD and ADD-S take the mean of
RANGES_M = (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, np.inf)
SUN_DEG = (0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0)
VISIBLE = (0.0, 0.25, 0.5, 0.75, 0.99, 1.0)


@takes(ScoreOptions)
def score(options: ScoreOptions) -> ScoreReport | ShapeReport:
    """Score predicted poses by SPEED's and SPEED+'s rules, in metres and degrees, by ADD and by BOP's recalls, in all
    and for pictures that are alike: a ScoreReport. With `shape`, score a reconstructed shape: a ShapeReport.

    Raises InputError for predictions that cannot be matched with the truth, and files that hold no shape; StageError.
    """
    if options.shape is not None:
        return _of_shape(options, options.shape)
    assert options.predictions is not None
    return _of_poses(options, Path(options.predictions))


def _of_shape(options: ScoreOptions, shape: str | Path) -> ShapeReport:
    """Score the shape in a child, since it is a file of others."""
    from spin_usd.processes.ask_child import ask_child  # not above: who only scores poses may have no system for it

    views = None if options.views is None else str(options.views)
    request = ScoreShape(shape=str(shape), truth=str(options.truth), align=options.align, views=views)
    return ask_child(SCORE_SHAPE, request, reads=shape, progress=options.progress, within_s=PATIENCE_S)


def _of_poses(options: ScoreOptions, given: Path) -> ScoreReport:
    annotations = Path(options.annotations) if options.annotations else None
    predictions = read_predictions(given, annotations)
    truth = read_truth(
        Path(options.truth), variants=names_in(options.variants), target=options.target, progress=options.progress
    )
    found = matched(predictions, truth, partial=options.partial)
    notes = [*found.notes]
    try:
        model = _model(truth, found)
    except ModuleNotFoundError as missing:  # of the extra [render], or of Linux
        if (lack := expected(missing)) is None:
            raise
        model = UNSET
        notes.append(f"ADD and BOP's recalls, which take the target's points, are left out: {lack}")
    errors = PoseErrors.of(q=found.q, t=found.t, true_q=truth.q[found.places], true_t=truth.t[found.places])
    report = ScoreReport(
        predictions=str(options.predictions),
        truth=str(options.truth),
        all=ScoredErrors(**_figures(errors)),
        missing=found.missing,
        groups=[*_groups(errors, truth, found.places)],
        model=model,
        worst=_worst(errors, truth, found.places),
        notes=notes,
    )
    if options.out is not None:
        from spin_usd.commands.score.page import write_page

        write_page(Path(options.out), report, errors, truth, found)
    return report


def _figures(errors: PoseErrors) -> dict[str, Any]:
    return {
        "pictures": len(errors.position),
        "scores": {name: float(scores(errors, name).mean()) for name in SCORES},
        "position_m": _spread(errors.position),
        "relative_position": _spread(errors.relative_position),
        "attitude_deg": _spread(np.degrees(errors.attitude)),
    }


def _spread(values: Float) -> dict[str, float]:
    return {
        "mean": float(values.mean()),
        "median": float(np.median(values)),
        "p90": float(np.quantile(values, 0.9)),
    }


def _groups(errors: PoseErrors, truth: Truth, places: Sequence[int]) -> Iterator[ScoredGroup]:
    """Yield the pictures of each non-empty group, if there are at least two groups."""
    variants = np.array([truth.names[place][1] for place in places])
    kinds: dict[str, list[tuple[str, NDArray[np.bool_]]]] = {
        "variant": [(name, variants == name) for name in dict.fromkeys(variants.tolist())],
        "range": _between(errors.range, RANGES_M, "m"),
        "facing": _alike(np.array(truth.facing)[places]),
        "sun": _between(truth.sun[places], SUN_DEG, "degrees"),
        "visible": _between(truth.visible[places], VISIBLE, ""),
    }
    for by, groups in kinds.items():
        some = [(name, chosen) for name, chosen in groups if chosen.any()]
        if len(some) > 1:
            yield from (ScoredGroup(by=by, group=name, **_figures(errors[chosen])) for name, chosen in some)


def _alike(names: NDArray[np.str_]) -> list[tuple[str, NDArray[np.bool_]]]:
    return [(name, names == name) for name in sorted(set(names.tolist()))]


def _between(values: Float, edges: Sequence[float], unit: str) -> list[tuple[str, NDArray[np.bool_]]]:
    """Return the groups between each two edges; the last one holds its upper edge too."""
    groups = []
    for low, high in pairwise(edges):
        name = f"{low:g} to {high:g} {unit}".strip() if high < np.inf else f"{low:g} {unit} and more"
        groups.append((name, (values >= low) & ((values < high) | (values == high) & (high == edges[-1]))))
    return groups


def _model(truth: Truth, found: Matched) -> ScoredModel | UnsetType:
    """Return the errors of the target's own points, read from the dataset's copy of its stage."""
    picture = truth.picture(found.places[0])
    if truth.dataset is None or truth.target is None or picture is None:
        return UNSET
    stage = Folder(truth.dataset.root).path(picture.recorded.provenance.stage.root)
    model = read_models(stage, {picture.variant: [picture.frame]})[truth.target]
    hull, across = model.hull, diameter(model.hull)
    some = model.points[:: -(-len(model.points) // MODEL_POINTS)]
    errors = model_errors(
        some, hull, _matrices(found.q, found.t), _matrices(truth.q, truth.t)[found.places], picture.camera
    )
    return ScoredModel(
        diameter=across,
        add_m=_spread(errors.add),
        add_s_m=_spread(errors.add_s),
        add_found=found_share(errors.add, across),
        add_s_found=found_share(errors.add_s, across),
        mssd_recall=mssd_recall(errors.mssd, across),
        mspd_recall=mspd_recall(errors.mspd, picture.camera.width),
    )


def _matrices(q: Float, t: Float) -> Float:
    found = np.tile(np.eye(4), (len(q), 1, 1))
    found[:, :3, :3], found[:, :3, 3] = matrices_from_quaternions(q), t
    return found


def _worst(errors: PoseErrors, truth: Truth, places: Sequence[int]) -> list[ScoredPicture]:
    speed = scores(errors, "speed")
    return [
        ScoredPicture(
            picture=truth.names[places[i]][0],
            variant=truth.names[places[i]][1],
            speed=float(speed[i]),
            position_m=float(errors.position[i]),
            attitude_deg=float(np.degrees(errors.attitude[i])),
        )
        for i in np.argsort(-speed, kind="stable")[:WORST].tolist()
    ]
