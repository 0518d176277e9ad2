"""Compare two variants of a stage, composed side by side."""

from dataclasses import asdict, dataclass, replace

from spin_usd.basics.progress import Progress
from spin_usd.commands.diff.calls import CompareVariants
from spin_usd.errors import InputError
from spin_usd.formats.chosen_frames import slice_of
from spin_usd.records.difference import ComparedPictures, DiffReport
from spin_usd.scene.derived.content_keys import KEYS, KeyMaker, RenderSettings
from spin_usd.scene.effort import Effort
from spin_usd.scene.scene import NOMINAL, FrameId, augmentation_and_camera
from spin_usd.stage.composition.differences import differences
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.composition.stage_hash import AUGMENTATION
from spin_usd.stage.read.stage_reader import StageReader

PROGRESS_EVERY = 500
SETTINGS = RenderSettings(renderer="blender", effort=Effort(), seed=0)  # the same for both variants: any will do


def compare(request: CompareVariants, progress: Progress) -> DiffReport:
    """Return what differs between two variants of a stage.

    "pictures" has the number of common pictures ("compared"), of those with another key of each kind, and of those in
    only one ("only_before", "only_after"). "resampled" is true if the two are different augmentations: the pictures'
    own seeds, which the keys leave out, then differ, and so do noise and back plates.
    """
    selections = Selection.parse(request.before), Selection.parse(request.after)
    first, second = (selection.open(request.stage) for selection in selections)
    found = list(differences(first.stage, second.stage))
    pairs, pictures = _pairs(first, second, request.frames)
    keys = NeutralKeys(first), NeutralKeys(second)
    for done, pair in enumerate(pairs):
        if done % PROGRESS_EVERY == 0:
            progress("comparing: picture", done, len(pairs))
        for key in changed(keys[0].of(pair[0]), keys[1].of(pair[1])):
            pictures[key] += 1
    progress("comparing: picture", len(pairs), len(pairs))
    resampled = selections[0].variant != selections[1].variant
    counts = ComparedPictures(**pictures)
    return DiffReport(
        before=request.before, after=request.after, differences=found, pictures=counts, resampled=resampled
    )


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
