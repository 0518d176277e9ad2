"""A stage that is being authored."""

from dataclasses import dataclass, field
from pathlib import Path

from spin_usd.basics.progress import Progress
from spin_usd.commands.author.asked_pictures import AskedPictures
from spin_usd.commands.author.craft_files import CraftTurns
from spin_usd.commands.author.options import AuthorOptions
from spin_usd.commands.author.plausible_target import ModelUnit
from spin_usd.commands.author.sources import Sources
from spin_usd.commands.author.views import ComposedTarget
from spin_usd.scene.poses import PoseList
from spin_usd.stage.author.target_asset import TargetAsset


@dataclass(kw_only=True, eq=False)
class Authoring:
    """A stage that is being authored: its sources, and the results of the steps so far."""

    options: AuthorOptions
    pictures: AskedPictures
    sources: Sources
    folder: Path
    """Where the stage is written until it is whole."""
    progress: Progress
    crafts: Path
    """Folder of the craft that were made for it."""
    given: str
    """The target as the user gave it, such as craft:7."""
    turns: CraftTurns | None = None
    """The craft that the pictures show in turn; None for one target in all."""
    target: TargetAsset = field(init=False)
    unit: ModelUnit = field(init=False)
    """Unit of the target's model."""
    poses: PoseList = field(init=False)
    composed: ComposedTarget = field(init=False)
    """The target as the written stage composes it."""
    model_materials: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """The names of the materials that the model has on surfaces that were given others, by their paths below it."""
    notes: list[str] = field(default_factory=list)
    """Notes for the user, in their order."""
