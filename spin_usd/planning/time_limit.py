"""The timeout of a picture, after which its worker is replaced, in seconds as Patience counts them: of the processor,
not of the clock."""

from collections.abc import Sequence
from dataclasses import dataclass

from spin_usd.picture.kinds import RENDERED
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.cost import Timings, expected_work
from spin_usd.planning.wall_time import thread_seconds
from spin_usd.planning.work import CommonWork, PictureWork, Work

TIMES, MIN_S = 10.0, 60.0
GRAPHICS_S = 3600.0  # a driver may compile for minutes before the first picture, while the worker is idle


@dataclass(frozen=True, kw_only=True)
class TimeLimits:
    """The time limits of a run's pictures: TIMES as long as each is expected to take."""

    options: CommonWork
    """Options of the run."""
    workers: int
    """Workers that share the work."""
    cores: int
    """Processors that they share."""
    measured: Sequence[Timings] = ()
    """Timings of earlier runs and of this one, which grow as it goes on; the slowest counts."""
    min_s: float = MIN_S
    """Least number of seconds for a picture."""
    given: float | None = None
    """The user's own limit for all pictures in seconds; None for none."""

    def of(self, picture: PlannedPicture, kinds: Sequence[str]) -> float:
        """Return the seconds that a worker has for these kinds of file of the picture, its stage being open."""
        if self.given is not None:
            return self.given
        task = PictureWork(picture=picture, label_pass=True, render=not RENDERED.isdisjoint(kinds))
        expected = expected_work(task, self.options)
        works = (expected, *(timings.scaled(expected) for timings in self.measured))
        slowest = max(thread_seconds(Work.of(each), workers=self.workers, cores=self.cores) for each in works)
        return max(self.min_s, TIMES * slowest)
