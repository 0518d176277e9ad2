"""How long a process of a measurement may say nothing before it is taken for one that hangs."""

from collections.abc import Iterable

from spin_usd.accuracy.sweep import STEP
from spin_usd.dataset.measure.campaign import PART
from spin_usd.dataset.picture.make_picture import IMAGE
from spin_usd.dataset.picture.planned_picture import PlannedPicture
from spin_usd.dataset.plan.time_limit import TimeLimits
from spin_usd.dataset.plan.work import RunOptions
from spin_usd.labels.table import DEFAULT_LABELS
from spin_usd.scene.effort import MAX_SAMPLES, Effort

MIN_S = 600.0  # figures of many large renders take minutes, and are not in what a picture is expected to take
TURNS = 2  # renders from one word to the next


def time_limit(
    pictures: Iterable[PlannedPicture], *, max_samples: int, frame_pixels: int, workers: int, cores: int
) -> float:
    """Return seconds: what the longest render of these pictures may take, the slowest setting of `max_samples`."""
    samples = min(TURNS * max(STEP, PART) * max_samples, MAX_SAMPLES)
    effort = Effort(samples=samples, denoiser="high")
    kinds = (IMAGE, *DEFAULT_LABELS)
    options = RunOptions(renderer="blender", effort=effort, kinds=kinds, frame_pixels=frame_pixels)
    limits = TimeLimits(options=options, workers=workers, cores=cores)
    return max(MIN_S, *(limits.of(picture, kinds) for picture in pictures))
