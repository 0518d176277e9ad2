"""Appearances as a specification states them: augmentations, and the photographs behind."""

from dataclasses import dataclass
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.sampling.distribution import Choice, Fixed
from spin_usd.sampling.sample import stream
from spin_usd.scene.environment import BACKGROUND
from spin_usd.specifications.augmentation_spec import AugmentationEntry, read_augmentation_spec
from spin_usd.specifications.background_choice import background_choice
from spin_usd.specifications.sample_table import SampleEntry
from spin_usd.stage.augment.background import is_picture


@dataclass(frozen=True, kw_only=True, eq=False)
class Appearance:
    """An augmentation of the specification in `folder`; `others`: all samples except the background's."""

    entry: AugmentationEntry
    folder: Path
    others: tuple[SampleEntry, ...]
    background: Choice | Fixed | None

    def photograph(self, seed: int, name: str, frame: str) -> dict[str, str]:
        """Draw the photograph behind a picture, if any: its file, by the parameter."""
        if self.background is None:
            return {}
        return {BACKGROUND: str(self.background.sample(stream(seed, name, BACKGROUND, frame)))}


def read_appearances(spec: str) -> list[Appearance]:
    """Return the augmentations of the specification in that file. Raises InputError for one with backgrounds other than
    photographs."""
    return [_appearance(entry, spec) for entry in read_augmentation_spec(spec).augmentations]


def _appearance(entry: AugmentationEntry, spec: str) -> Appearance:
    others = tuple(sample for sample in entry.sample if sample.parameter != BACKGROUND)
    folder = Path(spec).parent
    behind = next((background_choice(each, folder) for each in entry.sample if each not in others), None)
    named = () if behind is None else behind.values if isinstance(behind, Choice) else (behind.value,)
    for name in map(str, named):
        if not is_picture(name):
            where = f"{spec} augmentation {entry.name}: {BACKGROUND}"
            do = "draw photographs, and render environments as variants"
            raise InputError(f"{name} needs a new render", where=where, do=do)
    return Appearance(entry=entry, folder=folder, others=others, background=behind)
