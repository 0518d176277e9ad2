"""The stand-ins. Sizes are those of the craft they stand in for, as far as they are known; all else is ours."""

from spin_usd.craft.craft import corners_of
from spin_usd.craft.solids import Solid, block
from stand_ins.craft import Craft, Part, Point, Round

U, LENGTH, RAIL = 0.100, 0.1135, 0.0085  # of a one-unit CubeSat: width, rails' length and width (CubeSat standard)


def cubesat() -> Craft:
    """A one-unit CubeSat: the standard's envelope, cells on four sides, two short tape antennas."""
    body = block((0, 0, 0), (U - 0.003, U - 0.003, U), "Aluminium")
    rails = [
        block((x * (U - RAIL) / 2, y * (U - RAIL) / 2, 0), (RAIL, RAIL, LENGTH), "Rail")
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    out = U / 2 - 0.0015  # the body's faces
    sides = [
        [_plate(axis, sign * out, s * 0.0205, (0.038, 0.076)) for s in (-1, 1)] for axis in (0, 1) for sign in (-1, 1)
    ]
    tapes = [block((s * 0.030, 0.0, 0.0760), (0.006, 0.0008, 0.055), "Tape") for s in (-1, 1)]
    parts = [
        Part(name="Body", kind="main_body", solids=(body,)),
        Part(name="Rails", kind="main_body", solids=tuple(rails)),
        *(
            Part(name=f"Cells{name}", kind="solar_panel", solids=tuple(plates))
            for name, plates in zip(("MinusX", "PlusX", "MinusY", "PlusY"), sides, strict=True)
        ),
        Part(
            name="Camera",
            kind="payload",
            solids=Round(kind="Cylinder", material="BlackPaint", centre=(0.0, 0.0, -0.051), radius=0.016, height=0.008),
        ),
        *(
            Part(name=f"Antenna{side}", kind="omni_antenna", solids=(tape,))
            for side, tape in zip(("MinusX", "PlusX"), tapes, strict=True)
        ),
    ]
    envelope = block((0, 0, 0), (U, U, LENGTH), "Rail")
    tips = {f"antenna_tip_{n}": (s * 0.030, 0.0, 0.1035) for n, s in enumerate((-1, 1), 9)}
    about = "A one-unit CubeSat: stand-in for SwissCube and for the craft of CubeSat-CDT."
    return Craft(name="cubesat", prim="CubeSat", about=about, parts=tuple(parts), keypoints=corners_of(envelope) | tips)


def _plate(axis: int, at: float, aside: float, size: tuple[float, float]) -> Solid:
    """A solar cell on the side wall at `at` along x or y."""
    thick = 0.0012
    centre: Point = (at, aside, 0.0) if axis == 0 else (aside, at, 0.0)
    across: Point = (thick, size[0], size[1]) if axis == 0 else (size[0], thick, size[1])
    return block(centre, across, "SolarCell")


def microsat() -> Craft:
    """A box of Proba-2's size with two wings."""
    body = block((0, 0, 0), (0.60, 0.70, 0.85), "Foil")
    wings = [block((s * 0.66, 0.33, 0.0), (0.66, 0.020, 0.80), "Aluminium") for s in (-1, 1)]
    fields = [
        [block((s * (0.36 + 0.105 + 0.2 * i), 0.342, 0.0), (0.19, 0.006, 0.76), "SolarCell") for i in range(3)]
        for s in (-1, 1)
    ]
    parts = [
        Part(name="Body", kind="main_body", solids=(body,)),
        Part(name="TopPlate", kind="main_body", solids=(block((0, 0, 0.43), (0.56, 0.66, 0.02), "WhitePaint"),)),
        *(
            Part(name=f"{what}{side}", kind="solar_panel", solids=tuple(solids))
            for what, each in (("Wing", [[w] for w in wings]), ("Cells", fields))
            for side, solids in zip(("MinusX", "PlusX"), each, strict=True)
        ),
        Part(
            name="BodyCells",
            kind="solar_panel",
            solids=(block((0, 0.352, 0), (0.54, 0.008, 0.76), "SolarCell"),),
        ),
        Part(
            name="Telescope",
            kind="payload",
            solids=Round(kind="Cylinder", material="BlackPaint", centre=(0.12, 0.16, 0.49), radius=0.07, height=0.14),
        ),
        Part(
            name="Baffle",
            kind="payload",
            solids=Round(kind="Cylinder", material="BlackPaint", centre=(-0.14, -0.12, 0.48), radius=0.05, height=0.12),
        ),
        Part(
            name="AdapterRing",
            kind="adapter_ring",
            solids=Round(kind="Cylinder", material="Aluminium", centre=(0.0, 0.0, -0.44), radius=0.2, height=0.06),
        ),
        Part(
            name="Antenna",
            kind="omni_antenna",
            solids=Round(kind="Cylinder", material="WhitePaint", centre=(0.2, -0.26, 0.5), radius=0.02, height=0.16),
        ),
    ]
    ends = {
        f"wing_{n}": (s * 0.99, 0.33, z) for n, (s, z) in enumerate([(-1, -0.4), (-1, 0.4), (1, -0.4), (1, 0.4)], 9)
    }
    about = "A box of 0.60 x 0.70 x 0.85 m with two wings: stand-in for Proba-2, whose size that is."
    return Craft(name="microsat", prim="Microsat", about=about, parts=tuple(parts), keypoints=corners_of(body) | ends)


def capsule() -> Craft:
    """A crewed craft of three modules and two wings, 7 m long, along z."""
    wings = [block((s * 3.2, 0.0, -2.1), (4.2, 0.05, 1.2), "Aluminium") for s in (-1, 1)]
    fields = [
        [block((s * (1.1 + 0.53 + 1.02 * i), 0.035, -2.1), (0.96, 0.03, 1.1), "SolarCell") for i in range(4)]
        for s in (-1, 1)
    ]
    parts = [
        _module("ServiceModule", "main_body", "GreyBlanket", "Cylinder", (0, 0, -2.05), 1.12, 2.3),
        _module("Skirt", "adapter_ring", "GreyBlanket", "Cylinder", (0, 0, -3.3), 1.32, 0.4),
        _module("DescentModule", "main_body", "DarkBlanket", "Cylinder", (0, 0, 0.05), 1.06, 2.0),
        _module("OrbitalModule", "main_body", "GreyBlanket", "Sphere", (0, 0, 1.9), 1.13),
        _module("DockingRing", "payload", "Aluminium", "Cylinder", (0, 0, 3.05), 0.62, 0.4),
        _module("Probe", "payload", "Aluminium", "Cylinder", (0, 0, 3.35), 0.09, 0.4),
        _module("Engine", "thruster", "BlackPaint", "Cone", (0, 0, -3.5), 0.45, 0.5),
        _module("Periscope", "payload", "WhitePaint", "Cylinder", (0, -1.2, 0.4), 0.12, 0.5, (90.0, 0.0, 0.0)),
        _module("Mast", "omni_antenna", "Aluminium", "Cylinder", (0, 1.5, 1.9), 0.05, 1.0, (90.0, 0.0, 0.0)),
        *(
            Part(name=f"{what}{side}", kind="solar_panel", solids=tuple(solids))
            for what, each in (("Wing", [[w] for w in wings]), ("Cells", fields))
            for side, solids in zip(("MinusX", "PlusX"), each, strict=True)
        ),
    ]
    ends = {
        f"wing_{n}": (s * 5.3, 0.0, z) for n, (s, z) in enumerate([(-1, -2.7), (-1, -1.5), (1, -2.7), (1, -1.5)], 1)
    }
    middle: dict[str, Point] = {"probe_5": (0, 0, 3.55), "engine_6": (0, 0, -3.75), "mast_7": (0, 2.0, 1.9)}
    about = "Three modules and two wings, 7 m long: stand-in for a craft of Soyuz's size, not a model of it."
    return Craft(name="capsule", prim="Capsule", about=about, parts=tuple(parts), keypoints=ends | middle)


def _module(
    name: str,
    kind: str,
    material: str,
    solid: str,
    centre: Point,
    radius: float,
    height: float = 0.0,
    turn: Point = (0.0, 0.0, 0.0),
) -> Part:
    solids = Round(kind=solid, material=material, centre=centre, radius=radius, height=height, turn=turn)
    return Part(name=name, kind=kind, solids=solids)
