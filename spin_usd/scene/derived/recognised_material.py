"""Recognition of a surface's material from the names of its material and parts, else from its colour."""

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spin_usd.scene.name_rule import Color, MaterialRule

WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[^\W\d_]+")
"""A word of a name, such as Bus and Panel of "BusPanel_2"."""
PAINT = "white_paint"
"""Material for surfaces of a colour not listed below, and for unknown ones: the commonest on spacecraft that is not
black without surroundings to mirror."""
UNKNOWN = "neither its name nor its colour tells its material"
BARE = "aluminium"  # for an unspecific grey
GREY = 0.1  # the most saturation of a grey
MUTED = 0.5  # the most saturation of a paint; stronger colours tell parts of a drawing apart
BLACK = 0.06  # linear
GREY_WORD, BLACK_WORD = "grey", "black"


@dataclass(frozen=True, kw_only=True)
class ColorRule:
    """Colours that a material has, by their brightest channel, and hue and saturation as HSV has them."""

    material: str
    value: tuple[float, float]
    saturation: tuple[float, float] = (0.0, 1.0)
    hue_deg: tuple[float, float] = (0.0, 360.0)

    def holds(self, color: Color) -> bool:
        """Return whether a colour is of the material."""
        value = max(color)
        saturation = (value - min(color)) / value if value else 0.0
        within = ((self.value, value), (self.saturation, saturation), (self.hue_deg, _hue_deg(color)))
        return all(low <= number <= high for (low, high), number in within)


COLORS = (
    ColorRule(material="solar_cell", value=(0.02, 1.0), saturation=(0.33, 1.0), hue_deg=(205, 262)),
    ColorRule(material="gold_foil", value=(0.12, 1.0), saturation=(0.35, 1.0), hue_deg=(25, 62)),
    ColorRule(material="black_paint", value=(0.0, 0.06)),
    ColorRule(material="black_paint", value=(0.0, 0.13), saturation=(0.0, 0.3)),
    ColorRule(material="white_paint", value=(0.65, 1.0), saturation=(0.0, 0.15)),
    ColorRule(material="aluminium", value=(0.0, 1.0), saturation=(0.0, 0.25)),
)
"""The first that holds counts. In 411 public models these bounds find 77 of 86 named solar cells, 50 of 69 named gold
or kapton, 35 of 41 black and 76 of 80 white."""


@dataclass(frozen=True, kw_only=True)
class Vocabulary:
    """Materials by entries: words, all of which must be in a name; one that begins or ends in * goes on there. Of
    several words GREY_WORD and BLACK_WORD may come from the colour instead."""

    substances: Mapping[str, str]
    """Names of materials and their colours."""
    parts: Mapping[str, str]
    """Names of parts that are made of it."""
    guesses: Mapping[str, str]
    """Names of parts that may be made of others too: they count where the colour tells no other material."""


def _hue_deg(color: Color) -> float:
    """Return the hue of HSV; 0 for greys."""
    red, green, blue = color
    return float(np.degrees(np.arctan2(np.sqrt(3) * (green - blue), 2 * red - green - blue)) % 360)


def is_grey(color: Color) -> bool:
    """Return whether a colour is a grey."""
    return max(color) - min(color) <= GREY * max(color)


def words_of(name: str) -> tuple[str, ...]:
    """Return the words of a name, in lower case and without accents."""
    plain = "".join(each for each in unicodedata.normalize("NFKD", name) if not unicodedata.combining(each))
    return tuple(found.lower() for found in WORD.findall(plain))


def recognised(
    names: Sequence[str], materials: Sequence[str], color: Color | None, vocabulary: Vocabulary
) -> MaterialRule:
    """Return a rule without a pattern for a surface of these `names`, from the outermost group to its own, and of these
    names of its material.

    A material's name takes precedence over the part's, and that over its groups'; in a name the entry of most words,
    then the longest.
    """
    said = None if color is None else BLACK_WORD if max(color) < BLACK else GREY_WORD if is_grey(color) else None
    own_first = (*materials, *reversed([each for each in names if "/" not in each]))
    by_color = _of_color(color)
    tiers = [(name, tier) for name in own_first for tier in (vocabulary.substances, vocabulary.parts)]
    if by_color.material == BARE or by_color.note == UNKNOWN:
        tiers += [(name, vocabulary.guesses) for name in own_first]
    for name, tier in tiers:
        if entry := _told(words_of(name), said, tuple(tier)):
            return MaterialRule(pattern="", material=tier[entry], note=f"{entry.replace('*', '')} in {name}")
    return by_color


def _of_color(color: Color | None) -> MaterialRule:
    told = next((rule.material for rule in COLORS if color and rule.holds(color)), None)
    if told:
        return MaterialRule(pattern="", material=told, note="its colour")
    if color is None or max(color) - min(color) > MUTED * max(color):
        return MaterialRule(pattern="", material=PAINT, note=UNKNOWN)
    return MaterialRule(pattern="", material=PAINT, color=color, note="paint of its colour")


@lru_cache(maxsize=2**14)  # thousands of parts have the same few words
def _told(words: tuple[str, ...], color: str | None, entries: tuple[str, ...]) -> str | None:
    """Return the most specific of the entries that the words of a name, and the word of its colour, contain; None for
    none."""
    held: dict[str, tuple[int, bool, int, str]] = {}
    for entry in entries:
        lacking = [of for of in entry.split() if not any(_is(word, of) for word in words)]
        if not lacking or (" " in entry and lacking == [color]):
            held[entry] = (entry.count(" "), not lacking, len(entry.replace("*", "")), entry)
    return max(held, key=lambda entry: held[entry], default=None)


def _is(word: str, of: str) -> bool:
    """Return whether a word equals an entry's, also in the plural, or continues it where the entry has a *."""
    stem = of.strip("*")
    begins, ends = word.startswith(stem), word.removesuffix("s").endswith(stem.removesuffix("s"))
    return word in (stem, f"{stem}s") or (of.endswith("*") and begins) or (of.startswith("*") and ends)
