"""One material of the library: its values, what may be drawn in their place, and where all of it is from."""

from dataclasses import dataclass, replace

from materials.optics import Reflectance
from materials.values import Colour, MaterialValues, Picture, Sample

WEAR = "wear.png"
SCALE = (0.7, 1.4)
MASKS = ("cell_array_bars.png", "patch_antenna.png")  # of metal on something else


@dataclass(frozen=True, kw_only=True)
class LibraryMaterial:
    """What a layer of the library holds."""

    kind: str
    """What it is used for: materials of a kind can take one another's place."""
    about: str
    """One sentence."""
    source: str
    """Sentences on where its numbers are from; what is "ours" is our estimate."""
    values: MaterialValues
    body: Colour
    """Its colour without its pictures."""
    reflectance: Reflectance
    """What theory says a smooth, flat piece reflects, without its pictures."""
    colours: tuple[Colour, ...] = ()
    """What may be drawn instead of its colour; factors on it where that is a picture."""
    roughness: tuple[float, float]
    """The least and the most that may be drawn."""

    @property
    def plain(self) -> MaterialValues:
        """Its values without pictures: a colour, the metalness and roughness that pictures have in the mean."""
        return replace(
            self.values,
            colour=self.body,
            metallic=_plain(self.values.metallic),
            roughness=self.middle,
            normal=None,
        )

    @property
    def middle(self) -> float:
        """Its roughness in the mean."""
        return _plain(self.values.roughness)

    @property
    def scale(self) -> tuple[float, float] | None:
        """Factors on the size of its pattern that may be drawn: of what its surface is uneven by."""
        return SCALE if self.values.normal else None

    @property
    def pattern(self) -> tuple[float, float] | None:
        """The metres that one copy of its pattern covers; of wear it has none."""
        named = [self.values.colour, self.values.metallic, self.values.normal, self.values.roughness]
        pictures = [each.picture if isinstance(each, Sample) else each for each in named]
        found = [each.metres for each in pictures if isinstance(each, Picture) and each.file != WEAR]
        return found[0] if found else None


def _plain(value: float | Sample) -> float:
    """The number without its picture: a half of the picture's scale, or of a mask what is not of metal."""
    if isinstance(value, Sample):
        assert isinstance(value.scale, float), "the colours of a texture give no number"
        return value.bias + (0.0 if value.picture.file in MASKS else 0.5 * value.scale)
    return value
