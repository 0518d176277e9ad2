"""Equipment of craft: each kind makes a part of its size on a site of the bus, or in its place."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.craft.buses import Bus, Site
from spin_usd.craft.craft import CraftPart, FieldOfView, Joint
from spin_usd.craft.solids import FRONT, Point, Solid, block, cylinder, lathe, ring, rod, tube, upright

SUNK = 0.012  # of the bus: how deep equipment reaches into it, so that no faces coincide
DISHES = ("white_paint", "carbon_fibre", "aluminium", "antenna_radome")


@dataclass(frozen=True, kw_only=True, eq=False)
class Mount:
    """Where a part stands: a site, and the scale of the craft."""

    bus: Bus
    site: Site
    scale: float
    """The bus's typical width, metres."""
    name: str
    rng: np.random.Generator

    @property
    def sunk(self) -> float:
        return -SUNK * self.scale

    def free(self, width: float, height: float) -> Float | None:
        return self.site.place(self.rng, width, height)

    def pick(self, *materials: str) -> str:
        return str(self.rng.choice(materials))

    def uniform(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high)) * self.scale

    def out(self, solid: Solid, at: Float) -> Solid:
        """Place a solid whose z is outward, and its x and y along the site."""
        return solid.placed(self.site.axes, at)


def _cup(radius: float, mouth: float, depth: float, material: str, floor: str, low: float, sides: int = 32) -> Solid:
    """Return a cup along z that opens from `radius` at `low` to `mouth`, with a floor of another material."""
    wall, bottom = 0.06 * mouth, low + 0.45 * depth
    inside = radius + (mouth - radius) * 0.45 - wall
    made = lathe(
        [(0, low), (radius, low), (mouth, low + depth), (mouth - wall, low + depth), (inside, bottom), (0, bottom)],
        material,
        sides,
    )
    return made.with_material(floor, *range(len(made.faces) - sides, len(made.faces)))


def barrel(mount: Mount) -> CraftPart | None:
    """The barrel of a telescope or camera, whose view of 40 degrees is free."""
    radius, depth = mount.uniform(0.08, 0.22), mount.uniform(0.15, 0.5)
    if (at := mount.free(2.2 * radius, 2.2 * radius)) is None:
        return None
    outside = mount.pick("black_foil", "white_paint", "gold_foil", "black_paint")
    cup = mount.out(_cup(radius, radius * 1.0001, depth - mount.sunk, outside, "lens", mount.sunk), at)
    axis = mount.site.axes[:, 2]
    mouth = at + axis * depth
    rim = {f"rim_{i + 1}": (mouth + mount.site.axes @ p).tolist() for i, p in enumerate(_circle(radius))}
    return CraftPart(
        name=mount.name,
        kind="barrel",
        solids=(cup,),
        keypoints={"mouth": mouth.tolist(), **rim},
        view=FieldOfView(apex=mouth + axis * 1e-3, axis=axis, half_angle_deg=20.0),
    )


def _circle(radius: float, height: float = 0.0) -> Float:
    """Return four points (4, 3) of a circle about z at that height."""
    angles = np.pi / 2 * np.arange(4)
    return np.stack([radius * np.cos(angles), radius * np.sin(angles), np.full(4, height)], axis=1)


def star_tracker(mount: Mount) -> CraftPart | None:
    """The baffle of a star tracker, tilted off its face; its view of 30 degrees is free."""
    radius = min(max(mount.uniform(0.03, 0.07), 0.02), 0.09)
    length = radius * 2.6
    if (at := mount.free(3.4 * radius, 3.4 * radius)) is None:
        return None
    turn, tilt = float(mount.rng.uniform(0, 2 * np.pi)), np.radians(float(mount.rng.uniform(0, 30)))
    axis = mount.site.axes @ [np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)]
    foot = cylinder(radius * 0.7, mount.sunk - radius, mount.bus.bulge + radius, "black_paint")
    base = at + mount.site.axes[:, 2] * (mount.bus.bulge + 0.4 * radius)
    baffle = _cup(radius * 0.6, radius, length, "black_paint", "lens", 0.0).placed(upright(axis), base)
    mouth = base + axis * length
    return CraftPart(
        name=mount.name,
        kind="star_tracker",
        solids=(mount.out(foot, at), baffle),
        keypoints={"mouth": mouth.tolist()},
        view=FieldOfView(apex=mouth + axis * 1e-3, axis=axis, half_angle_deg=15.0),
    )


def dish(mount: Mount) -> CraftPart | None:
    """A dish on a mast, with its feed in the focus; what it sees within 5 degrees is free."""
    radius = mount.uniform(0.2, 0.6)
    foot = 0.12 * radius
    if (at := mount.free(4 * foot, 4 * foot)) is None:
        return None
    mast, focal, thick = 0.45 * radius + mount.bus.bulge, 0.8 * radius, 0.02 * radius
    bowl = [(radius * s, (radius * s) ** 2 / (4 * focal)) for s in (0, 0.25, 0.5, 0.75, 1.0)]
    shell = lathe([*bowl, *((r, z + thick) for r, z in reversed(bowl))], mount.pick(*DISHES), 40)
    feed = cylinder(0.09 * radius, focal * 0.92, focal * 1.08, "gold_plating", 16)
    rim = bowl[-1][1]
    legs = [
        rod((0.97 * radius * np.cos(a), 0.97 * radius * np.sin(a), rim), (0, 0, focal), 0.012 * radius, "aluminium", 6)
        for a in 2 * np.pi / 3 * np.arange(3)
    ]
    tilt = np.radians(float(mount.rng.uniform(0, 35)))
    turned = mount.site.axes @ np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    neck = at + mount.site.axes[:, 2] * mast
    post = rod(at + mount.site.axes[:, 2] * mount.sunk, neck + turned[:, 2] * 0.5 * thick, foot * 0.6, "aluminium")
    placed = [each.placed(turned, neck) for each in (shell, feed, *legs)]
    points = {f"rim_{i + 1}": neck + turned @ p for i, p in enumerate(_circle(radius, rim))}
    points |= {"focus": neck + turned[:, 2] * focal * 1.08}
    return CraftPart(
        name=mount.name,
        kind="dish",
        solids=(post, *placed),
        keypoints={name: point.tolist() for name, point in points.items()},
        view=FieldOfView(apex=neck + turned[:, 2] * focal * 1.1, axis=turned[:, 2], half_angle_deg=5.0),
    )


def horn(mount: Mount) -> CraftPart | None:
    """A horn antenna; what it sees within 15 degrees is free."""
    mouth = min(mount.uniform(0.04, 0.1), 0.25)
    if (at := mount.free(2.4 * mouth, 2.4 * mouth)) is None:
        return None
    length = 3 * mouth + mount.bus.bulge
    cup = _cup(mouth * 0.35, mouth, length - mount.sunk, mount.pick("gold_plating", "aluminium"), "copper", mount.sunk)
    axis = mount.site.axes[:, 2]
    end = at + axis * length
    view = FieldOfView(apex=end + axis * 1e-3, axis=axis, half_angle_deg=15.0)
    return CraftPart(
        name=mount.name, kind="horn", solids=(mount.out(cup, at),), keypoints={"mouth": end.tolist()}, view=view
    )


def omni(mount: Mount) -> CraftPart | None:
    """A rod antenna."""
    length, radius = mount.uniform(0.25, 0.8), max(mount.uniform(0.005, 0.012), 0.0015)
    if (at := mount.free(8 * radius, 8 * radius)) is None:
        return None
    axis = mount.site.axes[:, 2]
    high = at + axis * (length + mount.bus.bulge)
    whip = rod(at + axis * mount.sunk, high, radius, mount.pick("white_paint", "copper", "stainless_steel"))
    foot = mount.out(cylinder(3 * radius, mount.sunk * 0.7, mount.bus.bulge + 4 * radius, "antenna_radome", 16), at)
    return CraftPart(name=mount.name, kind="omni", solids=(whip, foot), keypoints={"tip": high.tolist()})


def radiator(mount: Mount) -> CraftPart | None:
    """A radiator of mirrors or white paint, flat on its face."""
    width, height = (1.1 * half * float(mount.rng.uniform(0.5, 1.2)) for half in mount.site.half)
    if (at := mount.free(width, height)) is None:
        return None
    thick = mount.bus.bulge + max(0.008 * mount.scale, 0.004)
    face = mount.pick("optical_solar_reflector", "optical_solar_reflector", "white_paint")
    return _sheet(mount, "radiator", at, (width, height, thick), "aluminium", face)


def _sheet(mount: Mount, kind: str, at: Float, size: Point, material: str, front: str) -> CraftPart:
    """Return a flat box on its face, whose front, with its four corners as keypoints, is of another material."""
    width, height, thick = size
    panel = block((0, 0, (thick + mount.sunk) / 2), (width, height, thick - mount.sunk), material)
    placed = mount.out(panel.with_material(front, FRONT), at)
    corners = {f"corner_{i}": placed.points[corner].tolist() for i, corner in enumerate(placed.faces[FRONT], 1)}
    return CraftPart(name=mount.name, kind=kind, solids=(placed,), keypoints=corners)


def body_array(mount: Mount) -> CraftPart | None:
    """Solar cells on a panel that fills most of a face."""
    width, height = 1.7 * mount.site.half[0], 1.7 * mount.site.half[1]
    if mount.site.taken or (at := mount.free(width, height)) is None:
        return None
    thick = mount.bus.bulge + max(0.01 * mount.scale, 0.0025)
    return _sheet(mount, "body_array", at, (width, height, thick), "solar_panel_substrate", "solar_cell")


def handle(mount: Mount) -> CraftPart | None:
    """A handrail, 25 to 40 mm thick where the craft is large enough."""
    length, radius = mount.uniform(0.2, 0.45), min(max(mount.uniform(0.008, 0.015), 0.0015), 0.02)
    if (at := mount.free(length + 4 * radius, 6 * radius)) is None:
        return None
    high, half = mount.bus.bulge + 5 * radius, length / 2
    path = [(-half, 0, mount.sunk), (-half, 0, high), (half, 0, high), (half, 0, mount.sunk)]
    bar = mount.out(tube(path, radius, mount.pick("gold_plating", "anodised_aluminium", "white_paint"), 10), at)
    ends = {
        f"end_{i}": (at + mount.site.axes @ [s * (half - radius), 0, high + radius]).tolist()
        for i, s in ((1, -1), (2, 1))
    }
    return CraftPart(name=mount.name, kind="handle", solids=(bar,), keypoints=ends)


def cable(mount: Mount) -> CraftPart | None:
    """A cable along a face, in a few bends, whose ends go into the bus."""
    length, wide, radius = mount.uniform(0.3, 0.7), mount.uniform(0.1, 0.2), max(mount.uniform(0.005, 0.01), 0.0015)
    if (at := mount.free(length + 4 * radius, wide + 4 * radius)) is None:
        return None
    s = np.linspace(-0.5, 0.5, 9)
    along, aside = s * length, np.cumsum(mount.rng.uniform(-1, 1, 9))
    aside = (aside - aside.mean()) / max(float(np.abs(aside - aside.mean()).max()), 1e-6) * wide / 2
    high = np.full(9, mount.bus.bulge + 0.9 * radius)
    high[[0, -1]] = mount.sunk
    cord = mount.out(tube(np.stack([along, aside, high], 1), radius, "cable_jacket"), at)
    return CraftPart(name=mount.name, kind="cable", solids=(cord,))


def adapter_ring(mount: Mount) -> CraftPart | None:
    """The ring on the launcher's side."""
    outer = 0.62 * min(mount.site.half)
    mount.site.taken.append((0.0, 0.0, outer, outer))
    high = mount.bus.bulge + mount.uniform(0.03, 0.08)
    made = ring(0.88 * outer, outer, mount.sunk, high, mount.pick("aluminium", "milled_aluminium", "titanium"), 48)
    at = mount.site.centre
    rim = {f"rim_{i + 1}": (at + mount.site.axes @ p).tolist() for i, p in enumerate(_circle(outer, high))}
    centre = {"centre": (at + mount.site.axes[:, 2] * high).tolist()}
    return CraftPart(name=mount.name, kind="adapter_ring", solids=(mount.out(made, at),), keypoints=centre | rim)


def main_engine(mount: Mount) -> CraftPart | None:
    """The main engine, whose axis goes through the centre of the bus."""
    mouth = 0.3 * min(mount.site.half)
    long = mount.bus.bulge + 2.2 * mouth
    bell = _cup(0.35 * mouth, mouth, long - mount.sunk, "thruster_nozzle", "black_paint", mount.sunk)
    end = (mount.site.centre + mount.site.axes[:, 2] * long).tolist()
    placed = mount.out(bell, mount.site.centre)
    return CraftPart(name=mount.name, kind="main_engine", solids=(placed,), keypoints={"exit": end})


def thruster(mount: Mount) -> CraftPart | None:
    """A small thruster for attitude, near the edge of its face, where its torque is large."""
    mouth = min(max(mount.uniform(0.015, 0.035), 0.004), 0.06)
    place = [float(mount.rng.choice((-1, 1))) * 0.8 * (half - 1.5 * mouth) for half in mount.site.half]
    if any(abs(place[0] - x) < 2 * mouth + w and abs(place[1] - y) < 2 * mouth + h for x, y, w, h in mount.site.taken):
        return None
    mount.site.taken.append((place[0], place[1], 1.5 * mouth, 1.5 * mouth))
    at, long = mount.site.at(*place), mount.bus.bulge + 2.5 * mouth
    bell = _cup(0.4 * mouth, mouth, long - mount.sunk, "thruster_nozzle", "black_paint", mount.sunk, 20)
    end = (at + mount.site.axes[:, 2] * long).tolist()
    return CraftPart(name=mount.name, kind="thruster", solids=(mount.out(bell, at),), keypoints={"exit": end})


@dataclass(frozen=True, kw_only=True)
class WingDesign:
    """What the wings of a craft have in common."""

    panels: int
    length: float
    """Of a panel, outward, metres."""
    chord: float
    standoff: float
    """From the bus to the first panel."""
    angle_deg: float
    """About the wing's axis; 0 faces along the craft's +x, or -y where the wings are along x."""
    driven: bool


def wing(site: Site, design: WingDesign, name: str, sunk: float) -> CraftPart:
    """Return a wing: panels in a row on a yoke. Its cells face one way, its back is a substrate."""
    n = site.axes[:, 2]
    chord = np.array([0.0, 0.0, 1.0])
    front = np.cross(n, chord) * (1 if n.sum() > 0 else -1)  # the same way for both wings
    c, s = np.cos(np.radians(design.angle_deg)), np.sin(np.radians(design.angle_deg))
    turned = front * c + chord * s
    axes = np.stack([n, np.cross(turned, n), turned], axis=1)
    thick, gap, wide = max(0.02 * design.chord, 0.003), 0.04 * design.length, design.chord / 2
    radius = 0.4 * thick  # so that the yoke's ends are inside the panel
    solids = [rod((sunk, 0, 0), (0.55 * design.standoff, 0, 0), 1.6 * radius, "titanium")]
    fork, ends = 0.5 * design.standoff, design.standoff + 0.03 * design.length
    solids += [rod((fork, 0, 0), (ends, y * 0.7 * wide, 0), radius, "titanium") for y in (-1, 1)]
    for i in range(design.panels):
        start = design.standoff + i * (design.length + gap)
        panel = block((start + design.length / 2, 0, 0), (design.length, design.chord, thick), "solar_panel_substrate")
        solids.append(panel.with_material("solar_cell", FRONT))
        if i:
            hinge = (3 * gap, 0.06 * wide, 0.5 * thick)
            solids += [block((start - gap / 2, y * 0.6 * wide, 0), hinge, "titanium") for y in (-1, 1)]
    end = design.standoff + design.panels * (design.length + gap) - gap
    corners = {
        f"{word}_{i}": (site.centre + axes @ [x, y * wide, thick / 2]).tolist()
        for word, x in (("root", design.standoff), ("tip", end))
        for i, y in ((1, -1), (2, 1))
    }
    joint = Joint(axis="XYZ"[int(np.abs(n).argmax())], at=site.centre) if design.driven else None
    placed = tuple(each.placed(axes, site.centre) for each in solids)
    return CraftPart(name=name, kind="wing", solids=placed, keypoints=corners, joint=joint)


Maker = Callable[[Mount], CraftPart | None]


@dataclass(frozen=True, kw_only=True)
class Equipment:
    """A kind of equipment: where it stands, and how many of it craft have."""

    name: str
    """Of its parts, before their numbers."""
    make: Maker
    ends: bool
    """True if it stands on the top and the bottom too, and not on sides alone."""
    fewest: int = 0
    """Number that is wanted at least."""
    most: int
    """Largest number that is drawn."""
    most_of_small: int = 1
    """Largest number that is drawn for small families."""


EQUIPMENT: Mapping[str, Equipment] = {
    "radiators": Equipment(name="Radiator", make=radiator, ends=False, most=2),
    "barrels": Equipment(name="Barrel", make=barrel, ends=True, fewest=1, most=2),
    "dishes": Equipment(name="Dish", make=dish, ends=True, most=2, most_of_small=0),
    "star_trackers": Equipment(name="StarTracker", make=star_tracker, ends=True, most=3),
    "horns": Equipment(name="Horn", make=horn, ends=True, most=3),
    "omnis": Equipment(name="Omni", make=omni, ends=True, fewest=1, most=4),
    "thrusters": Equipment(name="Thruster", make=thruster, ends=True, most=8),
    "handles": Equipment(name="Handle", make=handle, ends=False, most=3),
    "cables": Equipment(name="Cable", make=cable, ends=False, most=3),
}
"""Equipment by the keys of specifications, in the order in which it finds its places: what needs most room first."""
