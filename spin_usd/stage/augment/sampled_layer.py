"""The layer of values sampled when a stage is authored: its lights and environment refer to it before their own."""

from pathlib import Path

from pxr import Sdf

from spin_usd.errors import InputError
from spin_usd.stage.augment.sampled_values import SampledValues, write_values
from spin_usd.stage.augment.write_augmentations import MAX_FRAMES_IN_TEXT
from spin_usd.stage.author.added_layer import add_layer
from spin_usd.stage.author.paths import ENVIRONMENT, LIGHTS, WORLD
from spin_usd.stage.usd.layer_file import author_metadata

NAME = "sampled"


def write_sampled(root: Path, values: SampledValues, frames: int) -> None:
    """Write `values` beside the layers of the stage at `root`, which has `frames` pictures: as text where a person
    would read it.

    The layer is referenced, so a variant on the default prim beats it. Raises InputError for an attribute that is
    neither on the lights nor on the environment, OutputError.
    """
    places = (LIGHTS, ENVIRONMENT)
    changed = [Sdf.Path(each.attribute.prim) for each in values.attributes]
    if outside := next((path for path in changed if not any(map(path.HasPrefix, places))), None):
        raise InputError("is sampled, but belongs neither to the lights nor to the environment", where=outside)
    suffix = ".usdc" if frames > MAX_FRAMES_IN_TEXT and any(each.samples for each in values.attributes) else ".usda"
    layer = Sdf.Layer.CreateAnonymous(suffix)
    author_metadata(
        layer, default_prim=WORLD.name, frames=frames, documentation="The light drawn or given for each picture."
    )
    write_values(layer, values)
    used = [place for place in places if any(path.HasPrefix(place) for path in changed)]
    add_layer(root, layer, f"{NAME}{suffix}", {place: place for place in used})
