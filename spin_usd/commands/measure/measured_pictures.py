"""The pictures to measure: their plan, their choice among the stage's pictures, and the timeout of a render."""

from collections.abc import Iterable
from pathlib import Path

from spin_usd.accuracy.sweep import STEP, representative
from spin_usd.commands.measure.campaign import PART
from spin_usd.commands.measure.options import MeasureOptions
from spin_usd.errors import InputError
from spin_usd.labels.table import DEFAULT_LABELS
from spin_usd.options import PictureOptions
from spin_usd.picture.kinds import IMAGE
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.make_plan import Plan, make_plan
from spin_usd.planning.request import PlanRequest, RenderRequest
from spin_usd.planning.time_limit import TimeLimits
from spin_usd.planning.work import NOISE, CommonWork
from spin_usd.processes.processors import usable_cpus
from spin_usd.scene.effort import MAX_SAMPLES, Effort

WITHOUT_NOISE = (
    "the detector has no noise (spin:sensor:gain is 0), so --error auto, which goes by that noise, will not work with "
    'this measurement; --error X will; spin:sensor:gain, a preset or an augmentation\'s camera = "rich" gives it noise'
)
MIN_S = 600.0  # figures of many large renders take minutes, which a picture's expected time does not contain
TURNS = 2  # renders from one message to the next


def plan_measured(request: MeasureOptions, stage: Path, copy_to: Path) -> Plan:
    """Plan the requested pictures of the stage, copied into that folder."""
    options = PictureOptions(
        stage, variants=request.variant, frames=request.frames, labels="none", labels_only=True, radiance=True
    )
    question = PlanRequest(request=RenderRequest(options=options, effort=Effort()), copy_to=copy_to)
    return make_plan(question, processes=len(usable_cpus()), progress=request.progress)


def choose(plan: Plan, stage: Path, count: int) -> list[PlannedPicture]:
    """Choose the pictures to measure. Raises InputError if none shows the target."""
    pixels = {place: picture.region_pixels for place, picture in enumerate(plan.pictures)}
    chosen = representative(pixels, count)
    if not chosen:
        do = "choose others with --frames"
        raise InputError(f"none of the {len(plan.pictures)} pictures shows the target", where=stage, do=do)
    return [plan.pictures[place] for place in chosen]


def all_noisy(pictures: Iterable[PlannedPicture]) -> bool:
    """Return whether the detector has noise in each of the pictures."""
    return all(NOISE in picture.features for picture in pictures)


def frame_pixels(plan: Plan) -> int:
    """Return how many pixels a frame has."""
    width, height = plan.content.camera
    return int(width * height)


def time_limit(
    pictures: Iterable[PlannedPicture], *, max_samples: int, frame_pixels: int, workers: int, cores: int
) -> float:
    """Return the timeout, seconds, of the longest render of the pictures, with the slowest setting of `max_samples`."""
    samples = min(TURNS * max(STEP, PART) * max_samples, MAX_SAMPLES)
    effort = Effort(samples=samples, denoiser="high")
    kinds = (IMAGE, *DEFAULT_LABELS)
    options = CommonWork(renderer="blender", effort=effort, kinds=kinds, frame_pixels=frame_pixels)
    limits = TimeLimits(options=options, workers=workers, cores=cores)
    return max(MIN_S, *(limits.of(picture, kinds) for picture in pictures))
