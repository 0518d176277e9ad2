"""What stands on the mock-up in the test bed of SPEED+: trusses, antennas, boxes, the rod beside its -x wall."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from tango import dimensions as d
from tango.parts.structure import on_x_wall, on_y_wall, plate
from tango.shapes.shape import Point, Shape, joined
from tango.shapes.solids import box, prism
from tango.shapes.turned import Profile, frame, rod, turned

BLACK, WHITE, MAST = "BlackPaint", "WhitePaint", "MastPaint"
Flat = Sequence[tuple[float, float]]


def trusses() -> Shape:
    """Every bar and plate of the structure: lattices on the -x wall, filled plates on the +x one."""
    pieces: list[Shape] = []
    for sx in (-1, 1):
        pieces += _side_truss(sx)
        for wall in (d.Y_BACK, d.Y_FRONT):
            sy = 1 if wall > 0 else -1
            pieces += [*_corner_truss(sx, sy, wall), *_bracket(sx, sy, wall)]
    return joined(pieces)


def _side_truss(sx: int) -> Iterator[Shape]:
    """A trapezium with a V in it, at the lower edge of an x wall."""
    y = d.Y_MIDDLE
    bars = [((y - 0.024, 0.059), (y + 0.024, 0.059))]
    bars += [((y + s * 0.043, 0.000), (y + s * 0.024, 0.059)) for s in (-1, 1)]
    bars += [((y, 0.000), (y + s * 0.022, 0.057)) for s in (-1, 1)]
    yield from on_x_wall(bars, sx, width=0.0095, bolts=False)


def _corner_truss(sx: int, sy: int, wall: float) -> Iterator[Shape]:
    """A triangle over the lower corner of a y wall, with a smaller one in it, and a K around the edge on the x wall."""
    bars = [((0.210, 0.002), (0.370, 0.160)), ((0.308, 0.002), (0.370, 0.062))]
    bars += [((0.285, 0.083), (0.370, 0.062)), ((0.285, 0.083), (0.308, 0.002))]
    mirrored = [((sx * x0, z0), (sx * x1, z1)) for (x0, z0), (x1, z1) in bars]
    yield from on_y_wall(mirrored, wall, sy, width=0.0125, bolts=False)
    edge, inner = wall + sy * 0.003, wall - sy * 0.028
    heel = [((edge, 0.057), (edge, 0.162)), ((inner, 0.057), (edge, 0.057)), ((inner, 0.162), (edge, 0.162))]
    heel += [((inner, z), (edge, 0.110)) for z in (0.057, 0.162)]
    yield from on_x_wall(heel, sx, width=0.0085, bolts=False)


def _bracket(sx: int, sy: int, wall: float) -> Iterator[Shape]:
    """What carries the overhanging panel at a corner: a triangle on the x wall, and its arm out to the panel's edge."""

    def at(out: float, z: float) -> tuple[float, float]:
        return wall + sy * out, z

    apex, low, high = at(-0.106, 0.248), at(-0.022, 0.202), at(-0.022, 0.285)
    out_low, out_high = at(0.074, 0.240), (sy * 0.368, 0.292)
    if sx > 0:
        yield _on_x((apex, low, high), sx)
        yield _on_x((low, out_low, out_high, high), sx, 0.0094)
    else:
        bars = [(apex, high), (apex, low), (high, out_high), (low, out_low), (low, high), (out_low, out_high)]
        bars += [(low, at(0.020, 0.287)), (at(0.030, 0.218), at(0.070, 0.289))]
        yield from on_x_wall(bars, sx, width=0.0125, bolts=False)
    yield plate((sx * 0.352, wall - sy * 0.002, 0.290), (sx * 0.376, sy * 0.383, 0.300))


def _on_x(outline: Flat, sx: int, thickness: float = 0.010) -> Shape:
    """A flat plate on an x wall, from its corners (y, z)."""
    flat = [(sx * y, z) for y, z in outline]
    area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(flat, [*flat[1:], flat[0]], strict=True))
    turn = np.stack([(0.0, sx, 0.0), (0.0, 0.0, 1.0), (sx, 0.0, 0.0)], axis=1)
    flat = flat if area > 0 else flat[::-1]
    return prism(flat, -0.002, thickness, BLACK).moved((sx * d.X, 0.0, 0.0), turn)


def radiator() -> Shape:
    """A thick and a thin black plate on the +y wall, and four plugs on the thin one."""
    pieces: list[Shape] = []
    for x0, x1, z0, z1, thick in d.MOCKUP_RADIATOR:
        pieces.append(box((x0, d.Y_FRONT - 0.005, z0), (x1, d.Y_FRONT + thick, z1), "BlackPlate"))
    front = d.Y_FRONT + d.MOCKUP_RADIATOR[1][4]
    for z in (0.042, 0.059, 0.076, 0.093):
        pieces.append(box((-0.134, front - 0.002, z - 0.003), (-0.116, front + 0.010, z + 0.003), BLACK))
    return joined(pieces)


def mast(name: str) -> Shape:
    """A tapered black tube, and the white disc at its end, whose middle is an official point."""
    (r0, r1), length = d.MOCKUP_MAST[name], float(np.linalg.norm(np.subtract(d.POINT[name], d.ANTENNA_BASE[name])))
    foot: Profile = [(0, 0.0), (r0 + 0.002, 0.0), (r0 + 0.002, 0.008), (r0, 0.009)]
    tube = [*foot, (r1, length - 0.001), (0, length - 0.001)]
    disc = _round(r1 - 0.003, length - 0.003, length)
    ends = d.ANTENNA_BASE[name], d.POINT[name]
    return joined([rod(*ends, tube, 24, MAST), rod(*ends, disc, 24, WHITE)])


def whip(side: int) -> Shape:
    """A thin monopole on an x wall, on a three-cornered foot with bolts; and the wall's ball antenna."""
    out, y, z = (float(side), 0.0, 0.0), d.Y_MIDDLE, 0.250
    corners = ((y - 0.027, z - 0.017), (y + 0.027, z - 0.017), (y, z + 0.026))
    turn = frame(out)
    bolts = [turned(_round(0.0035, -0.001, 0.012), 8, BLACK).moved((side * d.X, *corner), turn) for corner in corners]
    cone = turned([(0, 0.0), (0.011, 0.0), (0.010, 0.012), (0.004, 0.024), (0, 0.024)], 14, WHITE)
    wire = turned(_round(d.WHIP_RADIUS, 0.0, d.WHIP_TIP_X - d.X), 8, WHITE)
    at = (side * (d.X - 0.001), y, z)
    pieces = [_wide(corners, side), *bolts, cone.moved(at, turn), wire.moved(at, turn)]
    return joined([*pieces, *_ball((side * d.X, *d.MOCKUP_BALLS[side]), out)])


def _wide(corners: Flat, side: int) -> Shape:
    """The foot: a plate a little wider than its bolts' places."""
    middle = np.mean(corners, axis=0)
    wide = [(float(y), float(z)) for y, z in middle + 1.2 * (np.array(corners) - middle)]
    foot = _on_x(wide, side, 0.003)
    return replace(foot, materials=(WHITE,) * len(foot.faces))


def _ball(at: Point, axis: Point) -> Iterator[Shape]:
    """A ball on a short rod on a box; `at` is the middle of the box's foot."""
    turn, r = frame(axis), d.MOCKUP_BALL
    yield box((-0.017, -0.016, -0.002), (0.017, 0.016, 0.012), BLACK).moved(at, turn)
    yield turned(_round(0.0032, 0.010, 0.040), 8, WHITE).moved(at, turn)
    angles = np.radians(np.linspace(-90, 90, 11))
    sphere: Profile = [(0.0, -r), *((r * np.cos(a), r * np.sin(a)) for a in angles[1:-1]), (0.0, r)]
    yield turned(sphere, 18, WHITE).moved(np.array(at) + 0.047 * turn[:, 2], turn)


def heads() -> Shape:
    """The blocks at the panel's +y edge: a shelf, a block below and one above it, and a step further out."""
    y = d.PANEL_Y - 0.001
    blocks = (
        ((-0.045, y, 0.2995), (0.096, 0.396, 0.3135)),
        ((-0.014, y, 0.2790), (0.072, 0.428, 0.2993)),
        ((0.023, y, 0.3130), (0.070, 0.428, 0.3240)),
        ((-0.042, y, 0.3000), (-0.002, 0.452, 0.3160)),
    )
    return joined(box(low, high, WHITE) for low, high in blocks)


def boxes() -> Shape:
    """Small boxes, and two knobs on the panel between its fields of cells."""
    knobs = [turned(_round(0.011, -0.002, 0.012), 16, MAST).moved((0.001, y, d.PANEL_TOP)) for y in (0.081, -0.040)]
    return joined([*(box(low, high, BLACK) for low, high in d.MOCKUP_BOXES), *knobs])


def rods() -> Shape:
    """The rod that two clamps hold beside the -x wall, and five round plugs below the -y edge."""
    x, y, low, high = d.MOCKUP_ROD
    pieces = [turned(_round(0.010, low, high), 14, BLACK).moved((x, y, 0.0))]
    for z in (0.039, 0.173):
        pieces.append(box((x - 0.012, y - 0.016, z - 0.010), (0.002 - d.X, y + 0.016, z + 0.010), BLACK))
    pin = turned(_round(0.0095, -0.004, 0.036), 14, BLACK)
    turn = frame((0.0, -1.0, 0.0))
    pieces += [pin.moved((-0.359 + 0.0437 * number, -0.256, -0.0095), turn) for number in range(5)]
    return joined(pieces)


def _round(radius: float, low: float, high: float) -> Profile:
    """The profile of a cylinder with its edge broken."""
    return [(0, low), (radius, low), (radius, high - 0.001), (radius - 0.001, high), (0, high)]
