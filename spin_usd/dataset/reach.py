"""Which of a picture's keys each difference between two variants changes by itself, found by trying it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from spin_usd.errors import SpinError
from spin_usd.scene.keys import RenderSettings, exposure_key, geometry_key, radiance_key
from spin_usd.scene.model import NOMINAL, FrameId
from spin_usd.stage.diff import PRIM, SCHEMAS, Difference
from spin_usd.stage.read import StageReader
from spin_usd.stage.transplant import Stage, can_transplant, transplant

KEYS = ("geometry", "radiance", "exposure")
NOTHING = "nothing"
SETTINGS = RenderSettings(renderer="blender", samples=1, seed=0)  # the same for both variants: any will do
MAX_TRIALS = 200  # each reads the stage again


def neutral_keys(reader: StageReader, frame: FrameId) -> dict[str, str]:
    """The picture's keys as if it were of the nominal variant: no two variants share a picture's own seed."""
    scene = reader.scene(replace(frame, variant=NOMINAL))
    return {
        "geometry": geometry_key(scene, SETTINGS.renderer),
        "radiance": radiance_key(scene, SETTINGS),
        "exposure": exposure_key(scene, SETTINGS),
    }


def changed(before: dict[str, str], after: dict[str, str]) -> list[str]:
    """The keys that are not the same, in the order of KEYS."""
    return [key for key in KEYS if before[key] != after[key]]


@dataclass(kw_only=True)
class Trials:
    """`first`, `second`: the variants; `trial`: a stage of its own in the first. `found`: all that differs. `frames`:
    the first's pictures that are compared; `telling`: those of them at which each key differs."""

    first: StageReader
    second: StageReader
    trial: Stage
    found: Sequence[Difference]
    frames: Sequence[FrameId]
    telling: Sequence[FrameId]
    _places: dict[str, str | None] = field(default_factory=dict)
    _own: dict[str, dict[str, str]] = field(default_factory=dict)

    def reach(self, difference: Difference) -> str | None:
        """The first of KEYS that it changes, "nothing", or None where that cannot be tried.

        With it goes what else differs in the same place, and the schemas that its prim has applied: without them it
        would mean nothing.
        """
        where = difference.where
        if where not in self._places:
            free = can_transplant(difference, self.trial) and len(self._places) < MAX_TRIALS
            self._places[where] = self._tried(difference) if free else None
        return self._places[where]

    def _tried(self, difference: Difference) -> str | None:
        session = self.trial.GetSessionLayer()
        as_it_was = session.ExportToString()
        found = set()
        try:
            for each in self.found:
                if _goes_with(each, difference) and can_transplant(each, self.trial):
                    transplant(each, self.second.stage, self.trial)
            reader = StageReader("", variant=self.first.variant, stage=self.trial)
            for frame in self._frames_for(difference):
                found |= set(changed(self._own_keys(frame), neutral_keys(reader, frame)))
        except SpinError:
            return None  # by itself it makes no stage that can be read
        finally:
            session.ImportFromString(as_it_was)
        if not found and difference.kind == PRIM and difference.after is None:
            return None  # a prim can only be made inactive here, and what refers to it still finds it
        return next((key for key in KEYS if key in found), NOTHING)

    def _frames_for(self, difference: Difference) -> Sequence[FrameId]:
        """The pictures to try it at: the telling ones, and the one next to the first sample that differs."""
        time = difference.time_code
        if time is None or not self.frames:
            return self.telling
        return [*self.telling, min(self.frames, key=lambda frame: abs(frame.time_code - time))]

    def _own_keys(self, frame: FrameId) -> dict[str, str]:
        if frame.name not in self._own:
            self._own[frame.name] = neutral_keys(self.first, frame)
        return self._own[frame.name]


def _goes_with(other: Difference, each: Difference) -> bool:
    return other.where == each.where or (other.kind == SCHEMAS and each.where.startswith(f"{other.where}."))
