"""How long a worker may take for a picture before it is taken for one that hangs, and is replaced."""

from collections.abc import Sequence
from dataclasses import dataclass

from spin_usd.dataset.picture.make_picture import IMAGE, RADIANCE
from spin_usd.dataset.picture.planned_picture import PlannedPicture
from spin_usd.dataset.plan.cost import Timings, expected_work
from spin_usd.dataset.plan.wall_time import Work, worker_seconds
from spin_usd.dataset.plan.work import RunOptions, Task
from spin_usd.errors import InputError

TIMES, MIN_S = 10.0, 60.0
LEAST_S, MOST_S = 1.0, 604800.0  # of a user's own; workers are looked at twice a second


@dataclass(frozen=True, kw_only=True)
class TimeLimits:
    """The time limits of a run's pictures: TIMES as long as each is expected to take, and MIN_S at least.

    options: of the run · workers, cores: that share the work · measured: timings of earlier runs and of this one, which
    grow as it goes on; the slowest counts · given: the user's own limit for all pictures in seconds, None for none.
    """

    options: RunOptions
    workers: int
    cores: int
    measured: Sequence[Timings] = ()
    given: float | None = None

    def of(self, picture: PlannedPicture, kinds: Sequence[str]) -> float:
        """Return the seconds that a worker has for these kinds of file of the picture, its stage being open."""
        if self.given is not None:
            return self.given
        renders = IMAGE in kinds or RADIANCE in kinds
        expected = expected_work(Task(picture=picture, label_pass=True, render=renders), self.options)
        works = (expected, *(timings.scaled(expected) for timings in self.measured))
        slowest = max(worker_seconds(Work.of(each), workers=self.workers, cores=self.cores) for each in works)
        return max(MIN_S, TIMES * slowest)


def refuse_time_limit(seconds: float | None) -> None:
    """Raise InputError for a user's limit that is finer than workers are looked at, or is none."""
    if seconds is not None and not LEAST_S <= seconds <= MOST_S:
        do = f"make it seconds from {LEAST_S:g} to {MOST_S:.0f}, which is a week"
        raise InputError(f"--picture-timeout (picture_timeout in Python) is {seconds:g}", do=do)
