"""What a user should know, before any picture is made, of how a new stage's target will look."""

from spin_usd.errors import SpinError
from spin_usd.scene.derived.emission import dim_emissions
from spin_usd.stage.read.stage_reader import StageReader

BLACK = (0.0, 0.0, 0.0)


def look_notes(reader: StageReader) -> tuple[str, ...]:
    """Notes on a target that cannot be seen, and on light of its own that will not show."""
    frame = reader.frames[0]
    materials = reader.target_at(frame.time_code).materials
    if all(material.opacity == 0 for material in materials):
        return ("every material of the target has opacity 0: pictures show at most its reflections, labels all of it",)
    if all(material.emissive_color == BLACK for material in materials):
        return ()
    try:
        return dim_emissions(reader.scene(frame))
    except SpinError:  # of the lights, which `check` and `render` will tell with all else that is wrong
        return ()
