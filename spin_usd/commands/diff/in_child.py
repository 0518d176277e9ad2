"""Compare two variants of a stage, composed side by side, as JSON."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from msgspec import to_builtins

from spin_usd.errors import InputError, SpinError
from spin_usd.formats.chosen_frames import slice_of
from spin_usd.progress import Progress
from spin_usd.records.difference import PRIM, ComparedPictures, Difference, DiffReport, TriedDifference
from spin_usd.scene.derived.content_keys import KEYS, KeyMaker, RenderSettings
from spin_usd.scene.effort import Effort
from spin_usd.scene.model import NOMINAL, FrameId, augmentation_and_camera
from spin_usd.stage.composition.apply_difference import Stage, add_schemas, apply_difference, can_apply
from spin_usd.stage.composition.differences import differences
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.composition.stage_hash import AUGMENTATION
from spin_usd.stage.read.stage_reader import StageReader

PROGRESS_EVERY = 500
NOTHING = "nothing"
SETTINGS = RenderSettings(renderer="blender", effort=Effort(), seed=0)  # the same for both variants: any will do
MAX_TRIALS = 200  # each reads the stage again


def compare(*, stage: str, before: str, after: str, frames: str | None, progress: Progress) -> dict[str, Any]:
    """Return what differs from the variant `before` to `after` of a stage, each as Selection.parse reads it.

    "differences" holds what `differences` lists, each with its "effect": the first of the keys "geometry", "radiance",
    "exposure" that it changes by itself, "nothing", or None, as Trials.effect finds. "pictures" holds how many pictures
    both have ("compared"), in how many of them each key differs, and how many only one has ("only_before",
    "only_after"). "resampled" is true where the two are other augmentations: the pictures' own seeds, which the keys
    leave out, then differ, and so do noise and back plates.
    """
    selections = Selection.parse(before), Selection.parse(after)
    first, second = (selection.open(stage) for selection in selections)
    found = list(differences(first.stage, second.stage))
    pairs, pictures = _pairs(first, second, frames)
    first_pairs: dict[str, tuple[FrameId, FrameId]] = {}
    keys = NeutralKeys(first), NeutralKeys(second)
    for done, pair in enumerate(pairs):
        if done % PROGRESS_EVERY == 0:
            progress("comparing: picture", done, len(pairs))
        for key in changed(keys[0].of(pair[0]), keys[1].of(pair[1])):
            pictures[key] += 1
            first_pairs.setdefault(key, pair)
    progress("comparing: picture", len(pairs), len(pairs))
    trials = Trials(
        variants=(
            ComparedVariant(reader=first, trial=selections[0].open(stage).stage),
            ComparedVariant(reader=second, trial=selections[1].open(stage).stage),
        ),
        found=found,
        frames=pairs,
        first_pairs=list(dict.fromkeys(first_pairs.values())),
    )
    listed = []
    for done, each in enumerate(found):
        progress("trying alone: difference", done, len(found))
        listed.append(TriedDifference(**asdict(each), effect=trials.effect(each)))
    if found:
        progress("trying alone: difference", len(found), len(found))
    resampled = selections[0].variant != selections[1].variant
    counts = ComparedPictures(**pictures)
    report = DiffReport(before=before, after=after, differences=listed, pictures=counts, resampled=resampled)
    answer: dict[str, Any] = to_builtins(report)
    return answer


def _pairs(
    first: StageReader, second: StageReader, frames: str | None
) -> tuple[list[tuple[FrameId, FrameId]], dict[str, int]]:
    """Pair the pictures of both by name; count those, the ones that only one has, and 0 for each key."""
    chosen = first.frames[slice_of(frames)] if frames else first.frames
    if not chosen:
        found = f"frames {frames!r} selects none of the {len(first.frames)} frames"
        raise InputError(found, do="count from 0; 0:10 are the first ten")
    others = {frame.name: frame for frame in second.frames}
    pairs = [(frame, others[frame.name]) for frame in chosen if frame.name in others]
    only_after = 0 if frames else len(others.keys() - {frame.name for frame in first.frames})
    counts = {"compared": len(pairs), "only_before": len(chosen) - len(pairs), "only_after": only_after}
    return pairs, {**counts, **dict.fromkeys(KEYS, 0)}


@dataclass(frozen=True, kw_only=True)
class Selection:
    """One composition of a stage: an augmentation, and variants of the default prim's other sets."""

    variant: str
    others: dict[str, str]

    @classmethod
    def parse(cls, text: str) -> "Selection":
        """Read "nominal", "isda_1", "camera=rich,materials=plain" or "isda_1,camera=rich". Raises InputError."""
        chosen: dict[str, str] = {}
        for part in text.split(","):
            name, equals, variant = part.strip().rpartition("=")
            name = name if equals else AUGMENTATION
            if not (name and variant) or name in chosen:
                do = "write VARIANT, or SET=VARIANT,... with each set once"
                raise InputError(f"{text!r} cannot be understood as a variant", do=do)
            chosen[name] = variant
        return cls(variant=chosen.pop(AUGMENTATION, NOMINAL), others=chosen)

    def open(self, stage: str) -> StageReader:
        """Return a reader of the stage so composed. Raises StageError for a set or a variant that it does not have."""
        opened = open_stage(stage, variant=augmentation_and_camera(self.variant)[0], selections=self.others)
        return StageReader(stage, variant=self.variant, stage=opened)


class NeutralKeys:
    """Makes the keys of a reader's pictures as if they were of the nominal variant: a picture's own seed differs from
    variant to variant."""

    def __init__(self, reader: StageReader) -> None:
        self._reader, self._maker = reader, KeyMaker(SETTINGS)

    def of(self, frame: FrameId) -> dict[str, str]:
        """Return the picture's keys by their names."""
        return asdict(self._maker.keys(self._reader.scene(replace(frame, variant=NOMINAL))))


def changed(before: dict[str, str], after: dict[str, str]) -> list[str]:
    """Return the names of the keys that differ, in the order of KEYS."""
    return [key for key in KEYS if before[key] != after[key]]


@dataclass(frozen=True, kw_only=True)
class ComparedVariant:
    """One of the two variants: a reader of it as it is, and a stage of its own to try changes on."""

    reader: StageReader
    trial: Stage
    _keys: dict[FrameId, dict[str, str]] = field(default_factory=dict)

    def keys(self, frame: FrameId) -> dict[str, str]:
        """Return the keys of the picture as it is."""
        if frame not in self._keys:
            self._keys[frame] = NeutralKeys(self.reader).of(frame)
        return self._keys[frame]

    def changed_by(
        self, differences: Sequence[Difference], other: "ComparedVariant", frames: Sequence[FrameId]
    ) -> set[str] | None:
        """Return the keys that change when this variant takes the `differences` over from the other; None where it
        cannot be read so: the differences may need others."""
        session = self.trial.GetSessionLayer()
        as_it_was = session.ExportToString()
        try:
            for each in differences:
                apply_difference(each, other.reader.stage, self.trial)
                add_schemas(each.where, other.reader.stage, self.trial)
            own = self.reader
            tried = NeutralKeys(StageReader("", variant=own.variant, stage=self.trial, numbering=own.numbering))
            return {key for frame in frames for key in changed(self.keys(frame), tried.of(frame))}
        except SpinError:
            return None
        finally:
            session.ImportFromString(as_it_was)


@dataclass(kw_only=True)
class Trials:
    """Tries differences one by one.

    variants: the two that are compared · found: all that differs between them · frames: pairs of the same picture in
    both · first_pairs: the pairs at which each key differs first.
    """

    variants: tuple[ComparedVariant, ComparedVariant]
    found: Sequence[Difference]
    frames: Sequence[tuple[FrameId, FrameId]]
    first_pairs: Sequence[tuple[FrameId, FrameId]]
    _effects: dict[str, str | None] = field(default_factory=dict)

    def effect(self, difference: Difference) -> str | None:
        """Return the first of KEYS that changes when the first variant takes over this difference alone, or the second
        undoes it.

        "nothing" means that no key changes. None means that it cannot be tried, or only in part: a prim is taken away
        by making it inactive, and what refers to it still finds it. Whatever else differs in the same place is taken
        over too, and so are schemas that its prim lacks: the difference may mean nothing without them.
        """
        where = difference.where
        if where not in self._effects:
            free = len(self._effects) < MAX_TRIALS and self._can_try(difference)
            self._effects[where] = self._tried(difference) if free else None
        return self._effects[where]

    def _can_try(self, difference: Difference) -> bool:
        return all(can_apply(difference, variant.trial) for variant in self.variants)

    def _tried(self, difference: Difference) -> str | None:
        together = [each for each in self.found if each.where == difference.where and self._can_try(each)]
        frames = self._frames_for(difference)
        changes = zip(self.variants, reversed(self.variants), zip(*frames, strict=True), strict=True) if frames else ()
        found = [variant.changed_by(together, other, of) for variant, other, of in changes]
        certain = None not in found and difference.kind != PRIM
        keys = {key for each in found for key in each or ()}
        return next((key for key in KEYS if key in keys), NOTHING if certain else None)

    def _frames_for(self, difference: Difference) -> Sequence[tuple[FrameId, FrameId]]:
        """Return the pictures to try it at: the first pairs, and the picture next to the first sample that differs."""
        time = difference.time_code
        if time is None or not self.frames:
            return self.first_pairs
        return [*self.first_pairs, min(self.frames, key=lambda pair: abs(pair[0].time_code - time))]
