"""What looks out: optical heads and sun sensors."""

from collections.abc import Iterator

from tango import dimensions as d
from tango.shape import Shape, joined
from tango.solids import box
from tango.turned import frame, turned

TOWARDS_Y = frame((0.0, 1.0, 0.0))


def optical_heads() -> Shape:
    """Three baffled heads that look along +y from a bracket below the panel's edge."""
    return joined(shape for x, y in zip(d.HEAD_X, d.HEAD_END_Y, strict=True) for shape in _head(x, y))


def _head(x: float, end: float) -> Iterator[Shape]:
    r, z = d.HEAD_RADIUS, d.HEAD_Z
    yield box((x - 0.022, d.Y_FRONT - 0.005, z - 0.008), (x + 0.022, end - 0.006, z - 0.004), "BlackPaint")
    yield box((x - 0.016, 0.330, z - 0.006), (x + 0.016, end - 0.040, z + 0.010), "WhitePaint")
    baffle = [(r - 0.001, -0.042), (r, -0.040), (r, 0.0), (r - 0.0015, 0.0), (r - 0.0015, -0.030), (0, -0.030)]
    yield turned([(0, -0.042), *baffle], 12, "WhitePaint").moved((x, end, z + 0.004), TOWARDS_Y)
    lens = [(0, -0.032), (r - 0.002, -0.032), (r - 0.002, -0.028), (0.005, -0.026), (0, -0.0255)]
    yield turned(lens, 12, "Glass").moved((x, end, z + 0.004), TOWARDS_Y)


def sun_sensors() -> Shape:
    """Small boxes with a round window, two on each of the free walls."""
    base = box((-0.017, -0.017, -0.006), (0.017, 0.017, 0.007), "BrushedAluminium")
    window = turned([(0, 0.0), (0.009, 0.0), (0.009, 0.008), (0.005, 0.0092), (0, 0.0095)], 10, "Glass")
    sensor = joined([base, window])
    places: list[tuple[tuple[float, float, float], tuple[float, float, float]]] = [
        ((d.X - 0.002, 0.125, 0.110), (1.0, 0.0, 0.0)),
        ((-d.X + 0.002, -0.100, 0.110), (-1.0, 0.0, 0.0)),
        ((-0.060, d.Y_BACK + 0.002, 0.160), (0.0, -1.0, 0.0)),
        ((0.060, d.Y_BACK + 0.002, 0.160), (0.0, -1.0, 0.0)),
        ((0.250, d.Y_FRONT - 0.002, 0.240), (0.0, 1.0, 0.0)),
    ]
    return joined(sensor.moved(at, frame(axis)) for at, axis in places)
