"""The buses of craft, by family: the solids of each, and the sites on its faces where equipment stands."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.craft.craft import CraftPart, corners_of
from spin_usd.craft.solids import Point, Solid, block, box, cushion, cylinder, prism, ring, rod

FOILS = ("gold_foil", "silver_foil", "black_foil")
SHEETS = ("white_paint", "beta_cloth", "aluminium", "anodised_aluminium", "carbon_fibre")
TRIES = 24
U, RAIL, RAIL_END = 0.100, 0.0085, 0.00675  # CubeSat Design Specification, rev. 14: width, rails, their reach
UNITS: Mapping[int, tuple[int, int, float]] = {
    1: (1, 1, 1.0),
    2: (1, 1, 2.0),
    3: (1, 1, 3.0),
    6: (2, 1, 3.0),
    8: (2, 2, 2.0),
    12: (2, 2, 3.0),
    16: (2, 2, 4.0),
}
"""Units along x, y and z of CubeSats."""


@dataclass(eq=False)
class Site:
    """A flat face of the bus, with the rectangles on it that are taken."""

    name: str
    axes: Float
    """(3, 3) columns: along the face, along the face, and outward."""
    centre: Float
    """(3,)"""
    half: tuple[float, float]
    """Half the face's width along its first two axes."""
    taken: list[tuple[float, float, float, float]] = field(default_factory=list)
    """Middles and half widths."""

    def place(self, rng: np.random.Generator, width: float, height: float) -> Float | None:
        """Take a free rectangle and return its middle, body axes; None if there is none."""
        a, b = self.half[0] * 0.94 - width / 2, self.half[1] * 0.94 - height / 2
        for _ in range(TRIES if min(a, b) >= 0 else 0):
            u, v = rng.uniform(-a, a), rng.uniform(-b, b)
            if all(abs(u - x) > width / 2 + w or abs(v - y) > height / 2 + h for x, y, w, h in self.taken):
                self.taken.append((u, v, width / 2, height / 2))
                return self.at(u, v)
        return None

    def at(self, u: float, v: float, out: float = 0.0) -> Float:
        """Return a point of the face, (3,) body axes, or one `out` from it."""
        found: Float = self.centre + self.axes @ [u, v, out]
        return found


@dataclass(frozen=True, kw_only=True, eq=False)
class Bus:
    """The body of a craft, which is about its origin and along z."""

    parts: tuple[CraftPart, ...]
    sites: Mapping[str, Site]
    """By name: PlusZ is the top, MinusZ faces the launcher."""
    wings: tuple[str, str]
    """Names of the opposite sites that carry wings."""
    volume: float
    bulge: float = 0.0
    """The height of its foil in the middle of a face."""

    @property
    def sides(self) -> list[Site]:
        return [site for name, site in self.sites.items() if not name.endswith("Z")]


def _site(name: str, outward: Point, centre: Point, half: tuple[float, float]) -> Site:
    """Return a site; on a side its second axis is z."""
    n = np.asarray(outward, float)
    v = np.array([0.0, 1.0, 0.0]) if abs(n[2]) > 0.5 else np.array([0.0, 0.0, 1.0])
    return Site(name=name, axes=np.stack([np.cross(v, n), v, n], axis=1), centre=np.asarray(centre, float), half=half)


def _box_sites(half: Float) -> dict[str, Site]:
    found = {}
    for axis, letter in enumerate("XYZ"):
        for sign, word in ((-1.0, "Minus"), (1.0, "Plus")):
            n = np.zeros(3)
            n[axis] = sign
            site = _site(f"{word}{letter}", n, n * half[axis], (0, 0))
            site.half = tuple(float(abs(site.axes[:, i]) @ half) for i in (0, 1))  # type: ignore[assignment]
            found[site.name] = site
    return found


def _skin(rng: np.random.Generator, finish: str | None) -> str:
    return finish or str(rng.choice((*FOILS, *FOILS, *SHEETS)))


def box_bus(rng: np.random.Generator, size: float | None, finish: str | None) -> Bus:
    """A box of 0.4 to 3.2 m, in foil or bare."""
    longest = size or float(np.exp(rng.uniform(np.log(0.4), np.log(3.2))))
    ratios = np.sort(rng.uniform(0.5, 1.0, 2))
    edges = longest * np.array([ratios[0], ratios[1], 1.0])[rng.permutation(3)]
    half, skin = edges / 2, _skin(rng, finish)
    bulge = float(edges.min() * rng.uniform(0.004, 0.016)) if skin in FOILS else 0.0
    solid = cushion(-half, half, bulge, skin) if bulge else box(-half, half, skin)
    frame = corners_of(box(-half, half, skin))
    part = CraftPart(name="Bus", kind="bus", solids=(solid,), keypoints=frame)
    volume = float(np.prod(edges))
    return Bus(parts=(part,), sites=_box_sites(half), wings=("PlusY", "MinusY"), volume=volume, bulge=bulge)


def hexagonal_bus(rng: np.random.Generator, size: float | None, finish: str | None) -> Bus:
    """A prism of six or eight sides, 0.5 to 2.2 m across."""
    sides = int(rng.choice((6, 8)))
    radius = size / 2 if size else float(np.exp(rng.uniform(np.log(0.25), np.log(1.1))))
    high = radius * float(rng.uniform(0.5, 1.5))
    solid = prism(sides, radius, -high, high, _skin(rng, finish))
    width = radius * np.tan(np.pi / sides)
    sites = {}
    for i in range(sides):
        angle = 2 * np.pi * i / sides
        n = np.round([np.cos(angle), np.sin(angle), 0.0], 12)
        name = {0: "PlusX", sides // 2: "MinusX"}.get(i, f"Side{i + 1}")
        sites[name] = _site(name, n, n * radius, (width, high))
    sites |= _ends(radius * 0.7, high)
    points = {f"corner_{i}": point.tolist() for i, point in enumerate(solid.points, 1)}
    part = CraftPart(name="Bus", kind="bus", solids=(solid,), keypoints=points)
    volume = float(2 * high * sides * radius * width)
    return Bus(parts=(part,), sites=sites, wings=("PlusX", "MinusX"), volume=volume)


def _ends(half: float, high: float) -> dict[str, Site]:
    return {
        "PlusZ": _site("PlusZ", (0, 0, 1), (0, 0, high), (half, half)),
        "MinusZ": _site("MinusZ", (0, 0, -1), (0, 0, -high), (half, half)),
    }


def cylinder_bus(rng: np.random.Generator, size: float | None, finish: str | None) -> Bus:
    """A drum of 0.6 to 2.2 m across with a belt of solar cells, as craft that spin have."""
    radius = size / 2 if size else float(np.exp(rng.uniform(np.log(0.3), np.log(1.1))))
    high = radius * float(rng.uniform(0.4, 1.3))
    core = cylinder(radius, -high, high, _skin(rng, finish), 48)
    low, top = -high * float(rng.uniform(0.6, 0.92)), high * float(rng.uniform(0.6, 0.92))
    belt = ring(radius - 0.01, radius + 0.006, low, top, "solar_cell", 48)
    rims = {
        f"rim_{place}_{i + 1}": (radius * np.cos(a), radius * np.sin(a), z)
        for place, z in (("low", -high), ("high", high))
        for i, a in enumerate(np.pi / 2 * np.arange(4))
    }
    body = CraftPart(name="Bus", kind="bus", solids=(core,), keypoints=rims)
    cells = CraftPart(name="BodyArray", kind="body_array", solids=(belt,))
    volume = float(2 * high * np.pi * radius**2)
    sites = _ends(radius * 0.66, high)
    for name, sign in (("PlusX", 1.0), ("MinusX", -1.0)):  # lines, on which wings alone stand
        sites[name] = _site(name, (sign, 0, 0), (sign * radius, 0, 0), (0.0, high))
        sites[name].taken.append((0.0, 0.0, 0.0, high))
    return Bus(parts=(body, cells), sites=sites, wings=("PlusX", "MinusX"), volume=volume)


def cubesat_bus(rng: np.random.Generator, size: float | None, finish: str | None) -> Bus:
    """A CubeSat of 1 to 16 units with its rails; `size` chooses the fewest units of the nearest length."""
    units = min(UNITS, key=lambda n: abs(UNITS[n][2] * U - size)) if size else int(rng.choice(list(UNITS)))
    x, y, z = UNITS[units]
    outer = np.array([x * U, y * U, z * U + 0.0135])
    inner = np.array([outer[0] - 0.003, outer[1] - 0.003, z * U])
    body = block(
        (0, 0, 0), inner.tolist(), finish or str(rng.choice(("anodised_aluminium", "aluminium", "gold_plating")))
    )
    rails = tuple(
        block((sx * (outer[0] - RAIL) / 2, sy * (outer[1] - RAIL) / 2, 0), (RAIL, RAIL, outer[2]), "aluminium")
        for sx in (-1, 1)
        for sy in (-1, 1)
    )
    frame = corners_of(block((0, 0, 0), outer.tolist(), "aluminium"))
    part = CraftPart(name="Bus", kind="bus", solids=(body, *rails), keypoints=frame)
    sites = _box_sites(inner / 2)
    for site in sites.values():
        site.half = (site.half[0] - RAIL, site.half[1] - RAIL)
    return Bus(parts=(part,), sites=sites, wings=("PlusY", "MinusY"), volume=float(np.prod(outer)))


def truss_bus(rng: np.random.Generator, size: float | None, finish: str | None) -> Bus:
    """A box of 0.5 to 1.6 m that bears a square truss along +z, with a mass at its end."""
    bus = box_bus(rng, size or float(rng.uniform(0.5, 1.6)), finish)
    width = 0.3 * min(bus.sites["PlusZ"].half)
    start = float(bus.sites["PlusZ"].centre[2])
    bays = int(rng.integers(3, 7))
    material = str(rng.choice(("carbon_fibre", "titanium", "aluminium")))
    corners = [(a * width, b * width) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    z = [start - 0.05 * width, *(start + 2.2 * width * (i + 1) for i in range(bays))]
    thick = width * 0.07
    solids: list[Solid] = [rod((*c, z[0]), (*c, z[-1]), thick, material, 8) for c in corners]
    for bay in range(bays):
        for i in range(4):
            a, b = corners[i], corners[(i + 1) % 4]
            solids.append(rod((*a, z[bay + 1]), (*b, z[bay + 1]), thick * 0.8, material, 8))
            solids.append(rod((*a, z[bay]), (*b, z[bay + 1]), thick * 0.6, material, 8))
    head = block((0, 0, z[-1] + 0.9 * width), (3 * width, 2.6 * width, 2 * width), _skin(rng, None))
    tips = {f"tip_{i}": (*c, z[-1]) for i, c in enumerate(corners, 1)}
    truss = CraftPart(name="Truss", kind="truss", solids=(*solids, head), keypoints=tips)
    top = bus.sites["PlusZ"]
    top.taken.append((0.0, 0.0, 1.6 * width, 1.6 * width))
    return Bus(parts=(*bus.parts, truss), sites=bus.sites, wings=bus.wings, volume=bus.volume, bulge=bus.bulge)


@dataclass(frozen=True, kw_only=True)
class Family:
    """A family of craft: its bus, and what its craft have on it."""

    make: Callable[[np.random.Generator, float | None, str | None], Bus]
    """Maker of a bus from the size of its longest edge, or its diameter, and the material of its skin, if chosen."""
    wings: tuple[float, float, float] = (0.15, 0.15, 0.7)
    """Probabilities of no wing, one and two."""
    small: bool = False
    """True without a ring to the launcher and an engine, and with little equipment."""
    largest: float = np.inf
    """Largest size that can be chosen, metres."""


FAMILIES: Mapping[str, Family] = {
    "box": Family(make=box_bus),
    "hexagonal": Family(make=hexagonal_bus),
    "cylinder": Family(make=cylinder_bus, wings=(1.0, 0.0, 0.0)),
    "cubesat": Family(make=cubesat_bus, wings=(0.45, 0.1, 0.45), small=True, largest=4.5 * U),
    "truss": Family(make=truss_bus),
}
