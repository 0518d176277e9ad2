"""What is drawn for a stage as it was authored: a layer to which its lights and environment refer, before their own."""

from pathlib import Path

from pxr import Sdf

from spin_usd.errors import InputError
from spin_usd.stage.augment.sampled_values import Opinions, write_opinions
from spin_usd.stage.augment.write_augmentations import MOST_IN_TEXT
from spin_usd.stage.author.added_layer import add_layer
from spin_usd.stage.author.paths import ENVIRONMENT, LIGHTS, WORLD
from spin_usd.stage.usd.layer_file import author_metadata

NAME = "sampled"


def write_sampled(root: Path, what: Opinions, frames: int) -> None:
    """Write `what` beside the layers of the stage at `root`, of so many pictures: as text where a person would read it.

    It comes by reference, so a variant on the default prim beats it. Raises InputError for an opinion that is neither
    on the lights nor on the environment, OutputError.
    """
    places = (LIGHTS, ENVIRONMENT)
    drawn = [Sdf.Path(opinion.place.prim) for opinion in what.attributes]
    if astray := next((path for path in drawn if not any(map(path.HasPrefix, places))), None):
        raise InputError("is sampled, and is neither of the lights nor of the environment", where=astray)
    suffix = ".usdc" if frames > MOST_IN_TEXT and any(opinion.samples for opinion in what.attributes) else ".usda"
    layer = Sdf.Layer.CreateAnonymous(suffix)
    author_metadata(
        layer, default_prim=WORLD.name, frames=frames, documentation="The light drawn or given for each picture."
    )
    write_opinions(layer, what)
    used = [place for place in places if any(path.HasPrefix(place) for path in drawn)]
    add_layer(root, layer, f"{NAME}{suffix}", {place: place for place in used})
