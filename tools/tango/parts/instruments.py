"""What looks out: optical heads and sun sensors."""

from collections.abc import Iterator

from tango import dimensions as d
from tango.shapes.fasteners import head, heads
from tango.shapes.shape import Shape, joined
from tango.shapes.solids import box
from tango.shapes.turned import frame, turned

TOWARDS_Y = frame((0.0, 1.0, 0.0))


def optical_heads() -> Shape:
    """Three baffled heads that look along +y from a bracket below the panel's edge."""
    return joined(shape for x, y in zip(d.HEAD_X, d.HEAD_END_Y, strict=True) for shape in _head(x, y))


def _head(x: float, end: float) -> Iterator[Shape]:
    r, z = d.HEAD_RADIUS, d.HEAD_Z
    yield box((x - 0.022, d.Y_FRONT - 0.005, z - 0.008), (x + 0.022, end - 0.006, z - 0.004), "BlackPaint")
    yield box((x - 0.016, 0.330, z - 0.006), (x + 0.016, end - 0.040, z + 0.010), "WhitePaint")
    screws = [(x + dx, y, z - 0.008) for dx in (-0.017, 0.017) for y in (0.335, end - 0.020)]
    yield from heads(screws, (0.0, 0.0, -1.0), head(0.0024, 0.0016, "BrushedAluminium"))
    rim = [(r - 0.0004, 0.0), (r - 0.0011, 0.0), (r - 0.0015, -0.0004), (r - 0.0015, -0.030), (0, -0.030)]
    tube = [(r - 0.001, -0.042), (r, -0.040), (r, -0.013), (r + 0.0008, -0.012), (r + 0.0008, -0.009), (r, -0.008)]
    baffle = turned([(0, -0.042), *tube, (r, -0.0004), *rim], 16, "WhitePaint")
    yield baffle.moved((x, end, z + 0.004), TOWARDS_Y)
    lens = [(0, -0.032), (r - 0.002, -0.032), (r - 0.002, -0.028), (0.007, -0.0264), (0.004, -0.0257), (0, -0.0255)]
    yield turned(lens, 12, "Glass").moved((x, end, z + 0.004), TOWARDS_Y)


def sun_sensors() -> Shape:
    """Small boxes with a round window in a ring and four screws, on each of the free walls."""
    base = box((-0.017, -0.017, -0.006), (0.017, 0.017, 0.007), "BrushedAluminium")
    window = turned([(0, 0.0), (0.009, 0.0), (0.009, 0.008), (0.005, 0.0092), (0, 0.0095)], 16, "Glass")
    ring = turned([(0, 0.001), (0.0115, 0.001), (0.0115, 0.0078), (0.0112, 0.0081), (0, 0.0081)], 16, "BlackPaint")
    corners = [(s * 0.0135, t * 0.0135, 0.007) for s in (-1, 1) for t in (-1, 1)]
    screws = heads(corners, (0.0, 0.0, 1.0), head(0.0017, 0.0013, "BlackPaint"))
    sensor = joined([base, ring, window, *screws])
    places: list[tuple[tuple[float, float, float], tuple[float, float, float]]] = [
        ((d.X - 0.002, 0.125, 0.110), (1.0, 0.0, 0.0)),
        ((-d.X + 0.002, -0.100, 0.110), (-1.0, 0.0, 0.0)),
        ((-0.060, d.Y_BACK + 0.002, 0.160), (0.0, -1.0, 0.0)),
        ((0.060, d.Y_BACK + 0.002, 0.160), (0.0, -1.0, 0.0)),
        ((0.250, d.Y_FRONT - 0.002, 0.240), (0.0, 1.0, 0.0)),
    ]
    return joined(sensor.moved(at, frame(axis)) for at, axis in places)
