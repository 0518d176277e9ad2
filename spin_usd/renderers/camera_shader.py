"""The start of camera rays: its place, and the text of the camera shader that sets it.

Blender's world here has a camera's axes (x right, y up, looking along -z). Up to NEAR_RADII target radii its origin is
the camera, whose rays start there. Further off its origin is the target's centre, and each ray starts just before the
target, so that every float32 number has the target's own size at any range.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.errors import RenderError
from spin_usd.geometry import fisheye, lens
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.fisheye import Fisheye
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.scene.scene import OneBody, Scene, ThinLens

# float32 resolves a range of 16 radii to radius * 2**-20: depth order to a millionth of the target's size, and by the
# camera's axes pixels to 2**-24 of their distance from the principal point.
NEAR_RADII = 16.0
CLEARANCE = 1.01  # rays start this many radii before the target's centre: outside its bounding sphere
MIN_CLEARANCE = 2e-6  # metres: Blender sees nothing nearer to a ray's start than 1e-6
PLAIN_FOCAL = (1 / 8, 16.0)  # fx / width within which Blender's own camera is off by at most 1e-3 px (measured)
INVERSE_ERROR_PX = 1e-5  # tolerance of the lens inverse; float32 itself costs about 1e-4 px
INVERSE_DEGREE = 6  # of the start's polynomial in the squared radius
MAX_INVERSE_STEPS = 12
BEYOND = 1 + 1e-6  # of the frame's own radius, so that the corners' last steps are free
SUBPIXELS = 65536  # places per pixel side that a ray can go through
FIRST_RAY_PX = 0.0006  # that Cycles' first ray misses its pixel's centre by along an axis (1/2048), with room
RASTER_ROUNDINGS = 4  # of float32, on the way of a ray's place in the frame to its place in the pixel
GRID = 65  # points per axis on which the inverse is fitted and proved


@dataclass(frozen=True, kw_only=True, eq=False)
class View:
    """A camera and its target. centre (3,) of the target in the camera frame `cam`, metres; radius, metres, within
    which it stays while the shutter is open; the thin lens, if any, whose aperture the rays start on. Several bodies
    count as one target that holds them all."""

    camera: Camera
    centre: Float
    radius: float
    thin_lens: ThinLens | None = None

    @classmethod
    def sharp(cls, scene: OneBody) -> "View":
        """Return the view of the labels: a pinhole, and the body as it is in the middle of the shutter's
        time."""
        mesh = scene.target.mesh
        return cls(camera=scene.camera, centre=scene.T_cam_body.points(mesh.centre), radius=mesh.radius)

    @classmethod
    def blurred(cls, scene: Scene) -> "View":
        """Return the view of the picture: through the thin lens, for as long as the shutter is open."""
        views = [cls._blurred(one) for one in scene.one_body_scenes]
        return _around(views) if scene.several else views[0]

    @classmethod
    def _blurred(cls, scene: OneBody) -> "View":
        still, mesh = cls.sharp(scene), scene.target.mesh
        way = max(float(np.linalg.norm(pose.points(mesh.centre) - still.centre)) for pose in scene.poses)
        return replace(still, radius=mesh.radius + way, thin_lens=scene.thin_lens)

    @property
    def distance(self) -> float:
        return float(np.linalg.norm(self.centre))

    @property
    def near(self) -> bool:
        """True where rays start at the camera. A target at a right angle or behind has no ray of its own to start
        on."""
        x, y, z = np.abs(self.centre)
        return self.distance <= NEAR_RADII * self.radius or bool(self.centre[2] <= 0.05 * max(x, y, z))

    @property
    def plain(self) -> bool:
        """True where Blender's own perspective camera is exact enough: its first rays miss the pixels' centres by 1e-3
        px at most, which the shader corrects."""
        low, high = PLAIN_FOCAL
        pinhole = not self.thin_lens and not self.camera.distorted
        return self.near and pinhole and low <= self.camera.fx / self.camera.width <= high

    def location(self, place_cam: Float) -> Float:
        """Return where `place_cam` (3,), camera frame, lies in Blender's world, metres."""
        if self.near:
            return T_USDCAM_CAM.points(place_cam)
        return T_USDCAM_CAM.directions(place_cam - self.centre) + 0.0  # no negative zeros

    @property
    def depth(self) -> float:
        """Length of ray within which the target lies, metres."""
        return self.distance + 2 * self.radius if self.near else 4 * CLEARANCE * self.radius

    @property
    def shader(self) -> str:
        """OSL text of the camera shader. Its Newton step is that of geometry.lens._errors_and_steps, in float32; a
        fisheye's is the plain one of its angle.

        Blender calls it with a camera that looks along +z with y up. Its numbers are constants in the text: parameters
        would need Blender's `oslquery` bindings, which clash with OpenImageIO's. Pixels go through integers because
        those have no derivatives, which OSL would carry through all that follows for nobody. A ray as near to its
        pixel's centre as Cycles' first goes through it exactly. Of a picture's other rays that is one in 200,000 at
        1,920 px, which shows less than the first itself: so labels and picture share a shader, compiled in 20 ms.
        """
        c, inverse = self.camera, lens_inverse(self.camera)
        half, snap, unit = SUBPIXELS // 2, round(centre_radius(c) * SUBPIXELS), inverse.unit
        undistorted = _fisheye(inverse) if c.fisheye else _brown(inverse)
        return f"""
shader spin_camera(output point position = 0.0, output vector direction = 0.0, output color throughput = 1.0)
{{
  point raster = camera_shader_raster_position();
  float across = raster[0] * {c.width}.0, down = {c.height}.0 - raster[1] * {c.height}.0;
  int i = (int)floor(across), j = (int)floor(down);
  int di = (int)((across - i) * {SUBPIXELS}.0) - {half}, dj = (int)((down - j) * {SUBPIXELS}.0) - {half};
  if (abs(di) < {snap} && abs(dj) < {snap}) {{ di = 0; dj = 0; }}
  float column = i + (0.5 + di / {SUBPIXELS}.0), row = j + (0.5 + dj / {SUBPIXELS}.0);
  float x0 = (column - {_number(c.cx)}) * {_number(1 / (c.fx * unit))};
  float y0 = (row - {_number(c.cy)}) * {_number(1 / (c.fy * unit))};
{undistorted}  {self._thin_lens() if self.thin_lens else "direction = normalize(vector(x, -y, 1.0));"}
  {self._position()}
}}
"""

    def _thin_lens(self) -> str:
        """Return the statements that choose a place on the aperture, uniformly, and aim from there at the plane of
        focus."""
        assert self.thin_lens
        per_focus = _number(1 / self.thin_lens.focus)
        return (
            "vector chance = camera_shader_random_sample();\n"
            f"  float rim = sqrt(chance[0]) * {_number(self.thin_lens.radius)}, turn = chance[1] * M_2PI;\n"
            "  vector lens = vector(rim * cos(turn), rim * sin(turn), 0.0);\n"
            f"  direction = normalize(vector(x, -y, 1.0) - lens * {per_focus});"
        )

    def _position(self) -> str:
        """Return the statement that sets where the ray starts."""
        if self.near:
            return "position = lens;" if self.thin_lens else "position = point(0.0, 0.0, 0.0);"
        x, y, z = self.centre
        start = max(CLEARANCE * self.radius, self.radius + MIN_CLEARANCE)
        # Seen from the plane of the centre, the aperture's places draw near as it draws near the plane of focus.
        lens = f" + lens * {_number(1 - z / self.thin_lens.focus)}" if self.thin_lens else ""
        return (
            # Where the ray meets the plane of the centre, then back to just before the bounding sphere.
            f"vector p = vector((x - {_number(x / z)}) * {_number(z)}, ({_number(y / z)} - y) * {_number(z)}, 0.0)"
            f"{lens};\n"
            f"  position = p - (dot(p, direction) + {_number(start)}) * direction;"
        )


def _brown(inverse: "LensInverse") -> str:
    """Return the statements that find the undistorted x and y of x0 and y0."""
    unit = inverse.unit
    k1, k2, p1, p2, k3 = map(_number, inverse.distortion)
    return f"""\
  float s = x0 * x0 + y0 * y0, start = {_horner(inverse.start, "s")}, x = x0 * start, y = y0 * start;
  for (int step = 0; step < {inverse.steps}; ++step) {{
    float xx = x * x, yy = y * y, r2 = xx + yy;
    if (r2 > {_number(inverse.max_radius**2)}) {{
      float back = {_number(inverse.max_radius)} / sqrt(r2);
      x *= back;
      y *= back;
      xx = x * x;
      yy = y * y;
      r2 = xx + yy;
    }}
    float xy = x * y;
    float radial = 1.0 + r2 * ({k1} + r2 * ({k2} + r2 * {k3}));
    float ex = x * radial + 2.0 * {p1} * xy + {p2} * (r2 + 2.0 * xx) - x0;
    float ey = y * radial + {p1} * (r2 + 2.0 * yy) + 2.0 * {p2} * xy - y0;
    float slope = 2.0 * ({k1} + r2 * (2.0 * {k2} + 3.0 * {k3} * r2));
    float a = radial + slope * xx + 2.0 * {p1} * y + 6.0 * {p2} * x;
    float b = slope * xy + 2.0 * {p1} * x + 2.0 * {p2} * y;
    float d = radial + slope * yy + 6.0 * {p1} * y + 2.0 * {p2} * x;
    float det = a * d - b * b;
    x -= (d * ex - b * ey) / det;
    y -= (a * ey - b * ex) / det;
  }}
  x *= {_number(unit)};
  y *= {_number(unit)};
"""


def _fisheye(inverse: "LensInverse") -> str:
    """Return the statements that find the undistorted x and y of x0 and y0, and put out the light from beyond a right
    angle."""
    k1, k2, k3, k4 = map(_number, inverse.distortion)
    far, most = (_number(each) for each in (inverse.max_radius, np.tan(fisheye.GRAZING)))
    return f"""\
  float far = sqrt(x0 * x0 + y0 * y0), s = min(far, {far}), t = s * {_horner(inverse.start, "(s * s)")};
  for (int step = 0; step < {inverse.steps}; ++step) {{
    float tt = t * t;
    float e = t * (1.0 + tt * ({k1} + tt * ({k2} + tt * ({k3} + tt * {k4})))) - s;
    t -= e / (1.0 + tt * (3.0 * {k1} + tt * (5.0 * {k2} + tt * (7.0 * {k3} + tt * 9.0 * {k4}))));
  }}
  float flat = cos(t), wide = flat > 0.0 ? min(sin(t) / max(flat, 1e-9), {most}) : {most};
  float x = far > 0.0 ? x0 * (wide / far) : 0.0, y = far > 0.0 ? y0 * (wide / far) : 0.0;
  if (far >= {far}) throughput = 0.0;
"""


def _around(views: Sequence[View]) -> View:
    """Return the common view of the `views`."""
    low = np.min([view.centre - view.radius for view in views], axis=0)
    high = np.max([view.centre + view.radius for view in views], axis=0)
    centre = (low + high) / 2
    radius = max(float(np.linalg.norm(view.centre - centre)) + view.radius for view in views)
    return replace(views[0], centre=centre, radius=radius)


def centre_radius(camera: Camera) -> float:
    """Pixels along an axis, from a pixel's centre, within which the shader finds Cycles' first ray."""
    return FIRST_RAY_PX + RASTER_ROUNDINGS * 2.0**-24 * max(camera.width, camera.height)


@dataclass(frozen=True, kw_only=True)
class LensInverse:
    """The shader's conversion from distorted to undistorted coordinates.

    All is in a `unit` of normalised coordinates in which float32 neither overflows nor loses digits, however long the
    focal length. A fisheye's start takes distances to angles, and its max_radius is the distance of what lies at a
    right angle.
    """

    unit: float
    start: tuple[float, ...]
    """A polynomial in the squared distorted radius, lowest power first, that scales distorted to undistorted
    coordinates."""
    steps: int
    """How many Newton steps must follow."""
    max_radius: float
    """Largest undistorted radius of the frame; no step begins beyond it."""
    distortion: tuple[float, ...]
    """The lens's coefficients in that unit."""


@lru_cache(maxsize=16)
def lens_inverse(camera: Camera) -> LensInverse:
    """Return the cheapest inverse of the camera's lens.

    Raises RenderError when MAX_INVERSE_STEPS do not reach INVERSE_ERROR_PX somewhere in the frame.
    """
    if camera.fisheye:
        return _inverse_of_fisheye(camera)
    if not camera.distorted:
        return LensInverse(unit=1.0, start=(1.0,), steps=0, max_radius=1.0, distortion=camera.distortion)
    u, v = np.meshgrid(np.linspace(0, camera.width, GRID), np.linspace(0, camera.height, GRID))
    pixels = np.stack([u.ravel(), v.ravel()], -1)
    normalised = (pixels - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    unit = 2.0 ** np.ceil(np.log2(np.linalg.norm(normalised, axis=1).max()))  # a power of two rounds nothing
    distorted, true = normalised / unit, camera.normalised(pixels) / unit
    k1, k2, p1, p2, k3 = camera.distortion
    made = LensInverse(
        unit=float(unit),
        start=_radial_start(distorted, true),
        steps=0,
        max_radius=BEYOND * float(np.linalg.norm(true, axis=1).max()),
        distortion=(k1 * unit**2, k2 * unit**4, p1 * unit, p2 * unit, k3 * unit**6),
    )
    guess = distorted * np.polynomial.polynomial.polyval((distorted**2).sum(1), made.start)[:, None]
    for steps in range(MAX_INVERSE_STEPS + 1):
        if float(np.abs((guess - true) * unit * (camera.fx, camera.fy)).max()) <= INVERSE_ERROR_PX:
            return replace(made, steps=steps)
        guess = _newton_step(guess, distorted, made)
    raise _too_many_steps(camera)


def _too_many_steps(camera: Camera) -> RenderError:
    return RenderError(
        f"the lens distortion {list(camera.distortion)} needs more than {MAX_INVERSE_STEPS} steps to invert",
        do="use coefficients that stay well within the lens's invertible range over the whole frame",
    )


def _inverse_of_fisheye(camera: Camera) -> LensInverse:
    """Return the cheapest inverse of a fisheye, from distances to angles; raises as `lens_inverse`."""
    assert isinstance(camera.distortion, Fisheye)
    k, corners = camera.distortion, camera.rim(1) - (camera.cx, camera.cy)
    end = lens.image_radius(k)
    far = np.linspace(0, min(end, float(np.hypot(*(corners / (camera.fx, camera.fy)).T).max())), GRID**2)[1:]
    true = fisheye.angles(far, k)
    powers = (far**2)[:, None] ** np.arange(INVERSE_DEGREE + 1)
    start = np.linalg.lstsq(powers * far[:, None], true, rcond=None)[0]
    guess = far * (powers @ start)
    for steps in range(MAX_INVERSE_STEPS + 1):
        if float(np.abs(guess - true).max()) * max(camera.fx, camera.fy) <= INVERSE_ERROR_PX:
            return LensInverse(unit=1.0, start=tuple(map(float, start)), steps=steps, max_radius=end, distortion=k)
        reached, slope = fisheye.distances(guess, k)
        guess = guess - (reached - far) / slope
    raise _too_many_steps(camera)


def _radial_start(distorted: Float, true: Float) -> tuple[float, ...]:
    """Coefficients, lowest power first, of the least-squares polynomial in r2 that takes `distorted` to `true`."""
    powers = (distorted**2).sum(1)[:, None] ** np.arange(INVERSE_DEGREE + 1)
    columns = np.concatenate([powers * distorted[:, :1], powers * distorted[:, 1:]])
    fit = np.linalg.lstsq(columns, np.concatenate([true[:, 0], true[:, 1]]), rcond=None)[0]
    return tuple(float(c) for c in fit)


def _newton_step(xy: Float, distorted: Float, inverse: LensInverse) -> Float:
    """One Newton step of the shader's; points (N, 2)."""
    radius = np.linalg.norm(xy, axis=1, keepdims=True)
    xy = xy * (inverse.max_radius / np.maximum(radius, inverse.max_radius))
    error = lens.distort(xy, inverse.distortion) - distorted
    jacobian = lens.distortion_jacobian(xy, inverse.distortion)
    return xy - np.linalg.solve(jacobian, error[..., None])[..., 0]


def _number(value: float) -> str:
    """Return an OSL float literal, parenthesised so that its sign meets no other."""
    return f"({float(value):.17e})"


def _horner(coefficients: tuple[float, ...], variable: str) -> str:
    text = _number(coefficients[-1])
    for c in reversed(coefficients[:-1]):
        text = f"({_number(c)} + {variable} * {text})"
    return text
