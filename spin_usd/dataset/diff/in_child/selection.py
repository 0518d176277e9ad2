"""A composition of a stage as a user names it."""

from dataclasses import dataclass

from spin_usd.errors import InputError
from spin_usd.scene.model import NOMINAL
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.composition.stage_hash import AUGMENTATION
from spin_usd.stage.read.stage_reader import StageReader


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
        opened = open_stage(stage, variant=self.variant, selections=self.others)
        return StageReader(stage, variant=self.variant, stage=opened)
