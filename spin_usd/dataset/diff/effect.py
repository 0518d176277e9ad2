"""Which of a picture's keys each difference between two variants changes by itself, found by trying it."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace

from spin_usd.errors import SpinError
from spin_usd.scene.derived.keys import KEYS, KeyMaker, RenderSettings
from spin_usd.scene.effort import Effort
from spin_usd.scene.model import NOMINAL, FrameId
from spin_usd.stage.diff.apply_difference import Stage, add_schemas, can_transplant, transplant
from spin_usd.stage.diff.differences import PRIM, Difference
from spin_usd.stage.read.stage_reader import StageReader

NOTHING = "nothing"
SETTINGS = RenderSettings(renderer="blender", effort=Effort(), seed=0)  # the same for both variants: any will do
MAX_TRIALS = 200  # each reads the stage again


class NeutralKeys:
    """The keys of a reader's pictures as if they were of the nominal variant: no two variants share a picture's own
    seed."""

    def __init__(self, reader: StageReader) -> None:
        self._reader, self._maker = reader, KeyMaker(SETTINGS)

    def of(self, frame: FrameId) -> dict[str, str]:
        """By name."""
        return asdict(self._maker.keys(self._reader.scene(replace(frame, variant=NOMINAL))))


def changed(before: dict[str, str], after: dict[str, str]) -> list[str]:
    """The keys that are not the same, in the order of KEYS."""
    return [key for key in KEYS if before[key] != after[key]]


@dataclass(frozen=True, kw_only=True)
class Side:
    """One of the two variants: as it is, and a stage of its own to try things on."""

    reader: StageReader
    trial: Stage
    known: dict[FrameId, dict[str, str]] = field(default_factory=dict)

    def keys(self, frame: FrameId) -> dict[str, str]:
        """Of the picture as it is."""
        if frame not in self.known:
            self.known[frame] = NeutralKeys(self.reader).of(frame)
        return self.known[frame]

    def changed_by(
        self, differences: Sequence[Difference], other: "Side", frames: Sequence[FrameId]
    ) -> set[str] | None:
        """The keys that change where this side has the `differences` as the other has them; None where it cannot be
        read so: they may need others."""
        session = self.trial.GetSessionLayer()
        as_it_was = session.ExportToString()
        try:
            for each in differences:
                transplant(each, other.reader.stage, self.trial)
                add_schemas(each.where, other.reader.stage, self.trial)
            tried = NeutralKeys(StageReader("", variant=self.reader.variant, stage=self.trial))
            return {key for frame in frames for key in changed(self.keys(frame), tried.of(frame))}
        except SpinError:
            return None
        finally:
            session.ImportFromString(as_it_was)


@dataclass(kw_only=True)
class Trials:
    """`found`: all that differs between the two sides. `frames`: pairs of the same picture in both; `telling`: those
    at which each key differs first."""

    sides: tuple[Side, Side]
    found: Sequence[Difference]
    frames: Sequence[tuple[FrameId, FrameId]]
    telling: Sequence[tuple[FrameId, FrameId]]
    _places: dict[str, str | None] = field(default_factory=dict)

    def reach(self, difference: Difference) -> str | None:
        """The first of KEYS that changes when that alone becomes different in the first variant, or the same again in
        the second; "nothing" where none does; None where that cannot be tried, or only in part: prims can be taken away
        by making them inactive alone, and what refers to them still finds them.

        With it goes what else differs in the same place, and schemas that its prim lacks: it may mean nothing without.
        """
        where = difference.where
        if where not in self._places:
            free = len(self._places) < MAX_TRIALS and self._can_try(difference)
            self._places[where] = self._tried(difference) if free else None
        return self._places[where]

    def _can_try(self, difference: Difference) -> bool:
        return all(can_transplant(difference, side.trial) for side in self.sides)

    def _tried(self, difference: Difference) -> str | None:
        together = [each for each in self.found if each.where == difference.where and self._can_try(each)]
        frames = self._frames_for(difference)
        sides = zip(self.sides, reversed(self.sides), zip(*frames, strict=True), strict=True) if frames else ()
        found = [side.changed_by(together, other, of) for side, other, of in sides]
        certain = None not in found and difference.kind != PRIM
        keys = {key for each in found for key in each or ()}
        return next((key for key in KEYS if key in keys), NOTHING if certain else None)

    def _frames_for(self, difference: Difference) -> Sequence[tuple[FrameId, FrameId]]:
        """The pictures to try it at: the telling ones, and the one next to the first sample that differs."""
        time = difference.time_code
        if time is None or not self.frames:
            return self.telling
        return [*self.telling, min(self.frames, key=lambda pair: abs(pair[0].time_code - time))]
