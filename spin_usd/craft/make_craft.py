"""A craft from a seed: a bus of a family, wings of the area that its power needs, and equipment with free views."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.craft.buses import FAMILIES, Bus, Family, Site
from spin_usd.craft.craft import CraftPart, GeneratedCraft, keeps
from spin_usd.craft.equipment import EQUIPMENT, SUNK, Mount, WingDesign, adapter_ring, body_array, main_engine, wing
from spin_usd.errors import InputError

DENSITY = (40.0, 150.0)  # kg/m3; Larson and Wertz, Space Mission Analysis and Design, section 10.5.1: 20 to 172
POWER = (0.5, 3.0)  # W/kg, our choice
ARRAY = (110.0, 230.0)  # W/m2 at the end of life, our choice: the Sun's 1361 x 0.14 to 0.28 x 0.85 (packing) x 0.7
CHARGING = (1.2, 2.1)  # an array's power over the craft's, our choice: losses alone, or 35 min of eclipse in 100 too
LEAST_ARRAY = 1.0  # of the square of the bus's width, our choice: who unfolds wings has more cells than a side holds
PANELS, PANEL_ASPECT = 6, (0.4, 1.6)  # most of a wing; length over width
GAP = 0.004  # of the craft's width: what parts keep apart
TRIES = 6  # at a place, for each part
TRIES_OF_CHOSEN = 60  # at least, of a kind whose number is chosen


@dataclass(frozen=True, kw_only=True)
class CraftChoice:
    """A craft that is wanted: what is None is drawn from the seed."""

    seed: int = 0
    family: str | None = None
    size: float | None = None
    """The bus's longest edge, or its diameter, metres."""
    finish: str | None = None
    """Material of the bus's skin."""
    wings: int | None = None
    """0, 1 or 2."""
    panels: int | None = None
    """Of each wing."""
    driven: bool | None = None
    counts: Mapping[str, int] = field(default_factory=dict)
    """Numbers of equipment by the keys of EQUIPMENT."""

    @property
    def needs_wings(self) -> bool:
        """Whether something is chosen that wings alone have."""
        return bool(self.panels or self.driven)


def make_craft(choice: CraftChoice) -> GeneratedCraft:
    """Make the craft of a choice; the same choice gives the same craft. Raises InputError for a family that there is
    not, and for a choice that the craft cannot have."""
    rng = _stream(choice.seed, "bus")
    family = _family(choice, rng)
    bus = FAMILIES[family].make(rng, choice.size, choice.finish)
    craft = _Assembly(choice=choice, family=FAMILIES[family], bus=bus, parts=list(bus.parts))
    craft.add_wings()
    if not craft.family.small:
        craft.add_ends()
    for key in EQUIPMENT:
        craft.add_equipment(key)
    craft.add_body_arrays()
    parts = tuple(craft.parts)
    return GeneratedCraft(name=f"craft_{choice.seed}", family=family, parts=parts, symmetries=_symmetries(parts))


def _family(choice: CraftChoice, rng: np.random.Generator) -> str:
    """Return the chosen family, or one that can have what is chosen. Raises InputError."""
    family = choice.family or str(rng.choice(list(FAMILIES)))
    if family not in FAMILIES:
        raise InputError(f"there is no family {family!r} of craft", do=f"choose one of {', '.join(FAMILIES)}")
    if (fault := _fault(choice, family)) is None:
        return family
    if choice.family:
        raise fault
    return str(rng.choice([name for name in FAMILIES if _fault(choice, name) is None]))


def _fault(choice: CraftChoice, family: str) -> InputError | None:
    """Return the error of a choice that craft of a family cannot have, None if they can."""
    kind = FAMILIES[family]
    if choice.size is not None and choice.size > kind.largest:
        found = f"size: a {family} is at most {kind.largest:g} m long, not {choice.size:g}"
        return InputError(found, do="give a smaller size, or another family")
    if kind.wings[0] == 1 and (choice.wings or choice.needs_wings):
        return InputError(f"a {family} has no wings", do="leave out wings, panels and driven, or give another family")
    return None


def _stream(seed: int, word: str) -> np.random.Generator:
    """Return the random numbers of one kind of decision, which others do not shift."""
    return np.random.default_rng([seed, *word.encode()])


def _symmetries(parts: Sequence[CraftPart]) -> tuple[Float, ...]:
    """Return the turns by halves about x, y and z, and by parts of a circle about z, that keep the craft as it is."""
    turns = [(axis, 2) for axis in (0, 1)] + [(2, n) for n in (2, 3, 4, 6, 8)]
    found: dict[bytes, Float] = {}
    for axis, n in turns:
        for k in range(1, n):
            rotation = np.round(_turn(axis, 2 * np.pi * k / n), 12) + 0.0
            if rotation.tobytes() not in found and keeps(parts, rotation):
                found[rotation.tobytes()] = rotation
    return tuple(found.values())


def _turn(axis: int, angle: float) -> Float:
    c, s = np.cos(angle), np.sin(angle)
    a, b = (axis + 1) % 3, (axis + 2) % 3
    rotation = np.eye(3)
    rotation[a, a] = rotation[b, b] = c
    rotation[a, b], rotation[b, a] = -s, s
    return rotation


@dataclass(kw_only=True, eq=False)
class _Assembly:
    """A craft that is being put together."""

    choice: CraftChoice
    family: Family
    bus: Bus
    parts: list[CraftPart]

    @property
    def scale(self) -> float:
        """Return the bus's typical width, metres."""
        return float(self.bus.volume ** (1 / 3))

    def mount(self, site: Site, name: str, rng: np.random.Generator) -> Mount:
        return Mount(bus=self.bus, site=site, scale=self.scale, name=name, rng=rng)

    def accept(self, part: CraftPart | None, *, within: str = "") -> bool:
        """Add a part where it touches no other but the bus, is in no other's view, and sees none; it may stand `within`
        a ring of that name."""
        if part is None:
            return False
        others = [each for each in self.parts[1:] if each.name != within]
        for other in others:
            if _overlap(part, other, GAP * self.scale) or (other.view and other.view.sees(part.triangles)):
                return False
        if part.view and any(part.view.sees(other.triangles) for other in self.parts):
            return False
        self.parts.append(part)
        return True

    def add_wings(self) -> None:
        rng, choice = _stream(self.choice.seed, "wings"), self.choice
        if (count := choice.wings) is None:
            count = int(rng.choice(3, p=self.family.wings)) or (2 if choice.needs_wings else 0)
        density, power = rng.uniform(*DENSITY), rng.uniform(*POWER)
        cells = _stream(self.choice.seed, "cells")
        needed = self.bus.volume * density * power * cells.uniform(*CHARGING) / cells.uniform(*ARRAY)
        area = max(needed, LEAST_ARRAY * self.bus.volume ** (2 / 3))
        driven = bool(rng.uniform() < 0.6) if choice.driven is None else choice.driven
        angle = float(rng.uniform(-80, 80)) if driven else float(rng.choice((0, 0, 90, -90)))
        design = self._design(rng, area / max(count, 1), angle, driven)
        for name in self.bus.wings[:count]:
            site = self.bus.sites[name]
            if self.accept(wing(site, design, f"Wing{name}", -SUNK * self.scale)):
                site.taken.append((0.0, 0.0, 0.2 * self.scale, 0.2 * self.scale))

    def _design(self, rng: np.random.Generator, area: float, angle: float, driven: bool) -> WingDesign:
        """Return the design of wings of `area` each: as many panels as keep each about as long as it is wide."""
        chord = float(2 * self.bus.sites[self.bus.wings[0]].half[1] * rng.uniform(0.7, 1.2))
        panels = self.choice.panels or int(np.clip(np.ceil(area / (PANEL_ASPECT[1] * chord**2)), 1, PANELS))
        length = chord * float(np.clip(area / (panels * chord**2), *PANEL_ASPECT))
        reach = chord * 0.5 * abs(np.sin(np.radians(angle)))  # of a panel that is turned across the bus
        standoff = max(0.3 * self.scale, 0.6 * reach)
        return WingDesign(panels=panels, length=length, chord=chord, standoff=standoff, angle_deg=angle, driven=driven)

    def add_ends(self) -> None:
        """Add the ring to the launcher, and an engine in it."""
        rng = _stream(self.choice.seed, "ends")
        site = self.bus.sites["MinusZ"]
        self.accept(adapter_ring(self.mount(site, "AdapterRing", rng)))
        if rng.uniform() < 0.6:
            self.accept(main_engine(self.mount(site, "MainEngine", rng)), within="AdapterRing")

    def add_equipment(self, key: str) -> None:
        """Add as many of a kind as find a place. Raises InputError if they are fewer than chosen."""
        kind, rng = EQUIPMENT[key], _stream(self.choice.seed, key)
        drawn = int(rng.integers(0, (kind.most_of_small if self.family.small else kind.most) + 1))
        chosen = self.choice.counts.get(key)
        wanted = max(drawn, kind.fewest) if chosen is None else chosen
        sites = [site for name, site in self.bus.sites.items() if kind.ends or not name.endswith("Z")]
        sites = sites or list(self.bus.sites.values())
        made = 0
        for _ in range(max(TRIES * wanted, TRIES_OF_CHOSEN if chosen else 0)):
            site = sites[int(rng.integers(len(sites)))]
            kept = list(site.taken)
            if self.accept(kind.make(self.mount(site, f"{kind.name}{made + 1}", rng))):
                made += 1
            else:
                site.taken = kept
            if made == wanted:
                return
        if chosen:
            found = f"{made} of {chosen} {key} found room"
            raise InputError(found, do="ask for fewer, or give another seed or family")

    def add_body_arrays(self) -> None:
        """Cover bare sides with cells: of a craft without wings most of them, of one with wings few."""
        rng = _stream(self.choice.seed, "arrays")
        share = 0.25 if any(part.kind == "wing" for part in self.parts) else 0.9
        for site in self.bus.sides:
            if rng.uniform() < share:
                self.accept(body_array(self.mount(site, f"BodyArray{site.name}", rng)))


def _overlap(part: CraftPart, other: CraftPart, gap: float) -> bool:
    """Return whether the boxes around two of their solids come nearer than `gap`."""
    return any(_near(a.points, b.points, gap) for a in part.solids for b in other.solids)


def _near(a: Float, b: Float, gap: float) -> bool:
    return bool(np.all(a.min(0) - gap < b.max(0)) and np.all(b.min(0) - gap < a.max(0)))
