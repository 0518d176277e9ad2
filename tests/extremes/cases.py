"""The extremes as data: small scenes whose truth `exact` knows, each at one end of what the product must hold."""

from dataclasses import dataclass

import numpy as np
import trimesh

from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.scene.material import Material
from tests.cases.scenes import box, scene, target

WIDTH, HEIGHT = 64, 48
PITCH = 5e-6  # metres per pixel
ATTITUDE = (0.36, 0.48, -0.64, 0.48)  # a box so turned shows three faces
OFF = 0.3  # pixels by which no camera's axis is that of its frame


@dataclass(frozen=True, kw_only=True, eq=False)
class Case:
    """A camera, a mesh (points, faces) in metres, and the pose: q (4,) of any length and t (3,). `group` is the row of
    the report that it belongs to."""

    group: str
    name: str
    camera: Camera
    mesh: tuple[np.ndarray, np.ndarray]
    t: tuple[float, float, float]
    q: tuple[float, float, float, float] = ATTITUDE
    materials: tuple[Material, ...] = ()

    def scene(self):
        T_cam_body = Transform.from_quaternion(to="cam", of="body", q=self.q, t=self.t)
        dressed = {"materials": self.materials} if self.materials else {}
        return scene(target(*self.mesh, **dressed), camera=self.camera, T_cam_body=T_cam_body)

    def __str__(self) -> str:
        return f"{self.group}: {self.name}"


def camera(focal, *, k=(0.0,) * 5):
    """Of a focal length in metres."""
    f = focal / PITCH
    return Camera(width=WIDTH, height=HEIGHT, fx=f, fy=1.01 * f, cx=WIDTH / 2 + OFF, cy=HEIGHT / 2 - OFF, distortion=k)


def cube(size):
    """A box, no two edges alike, whose longest is `size` metres."""
    half = size / 2 * np.array([1, 0.8, 0.6])
    return box(tuple(-half), tuple(half))


def ball(size, subdivisions=1):
    made = trimesh.creation.icosphere(subdivisions=subdivisions)
    return np.asarray(made.vertices) * size / 2, np.asarray(made.faces)


def plate(z=0.0, half=0.5):
    """A square across z, seen from -z."""
    points = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    return points, np.array([[0, 2, 1], [0, 3, 2]])


def joined(*meshes):
    first = np.cumsum([0, *(len(points) for points, _ in meshes)])
    return np.concatenate([p for p, _ in meshes]), np.concatenate(
        [f + n for (_, f), n in zip(meshes, first, strict=False)]
    )


def inside_out(mesh):
    return mesh[0], mesh[1][:, ::-1]


def needles(count=48, radius=1.0):
    """A disc cut into needles that all meet in its centre."""
    angle = 2 * np.pi * np.arange(count) / count
    rim = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
    i = np.arange(count)
    return np.concatenate([rim, [[0, 0, 0]]]), np.stack([np.full(count, count), (i + 1) % count, i], -1)


def sliver(width):
    """A triangle of length 1, `width` across, beside a square with which it shares its long edge."""
    points, faces = plate()
    tip = [[0.5 + width, 0.1, 0]]
    return np.concatenate([points, tip]), np.concatenate([faces, [[1, 2, 4]]])


def steps(count=9, reach=1.2):
    """Plates of all depths from behind the camera to before it, in the body of a camera at its origin."""
    z = np.linspace(-reach, reach, count)
    return joined(*(plate(at, half=0.02 + 0.4 * max(at, 0)) for at in z))


def folding(k, share):
    """A camera with the radial lens `k` whose corner reaches `share` of the way to where the fold ends the image; the
    focal length is that which this takes."""
    corner = 0.5 * np.hypot(WIDTH, HEIGHT)
    k1, k2, _, _, k3 = k
    roots = np.roots([7 * k3, 5 * k2, 3 * k1, 1])
    fold = np.sqrt(min(r.real for r in roots if abs(r.imag) < 1e-9 and r.real > 0))
    end = fold * (1 + k1 * fold**2 + k2 * fold**4 + k3 * fold**6)
    return Camera(
        width=WIDTH,
        height=HEIGHT,
        fx=corner / (share * end),
        fy=corner / (share * end),
        cx=WIDTH / 2,
        cy=HEIGHT / 2,
        distortion=k,
    )


def ranges():
    """A target of every size at every range; the focal length is the one that shows it on half of the frame, where
    there is such a lens between 1 mm and 10 m."""
    for size in (1e-3, 1.0, 1e3):
        for away in (0.05, 1.0, 100.0, 1e4, 1e5):
            focal = float(np.clip(0.5 * HEIGHT * PITCH * away / size, 1e-3, 10.0))
            pixels = focal / PITCH * size / away
            if pixels < 1:
                continue  # no pixel's centre need see it: what is said of those is another test
            x, y = 0.1 * np.array([WIDTH, HEIGHT]) * PITCH / focal * away
            name = f"{size:g} m at {away:g} m, f = {1000 * focal:.3g} mm"
            yield Case(group="range", name=name, camera=camera(focal), mesh=cube(size), t=(x, -y, away))


def focal_lengths():
    for focal in (1e-3, 1e-2, 0.1, 1.0, 10.0):
        size = 20.0 * PITCH / focal * 50
        name = f"f = {1000 * focal:g} mm, {size:g} m at 50 m"
        yield Case(
            group="focal length", name=name, camera=camera(focal), mesh=ball(size), t=(0.1 * size, 0.05 * size, 50.0)
        )


def inside():
    wide = camera(1.5e-4)  # 94 degrees
    yield Case(
        group="inside",
        name="within the bounding box of a frame",
        camera=wide,
        mesh=joined(plate(1.0), plate(-1.0), plate(0.3, 0.02)),
        t=(0.01, 0.02, 0.0),
        q=(1, 0, 0, 0),
    )
    yield Case(group="inside", name="in the middle of a closed ball", camera=wide, mesh=ball(2.0), t=(0.1, -0.2, 0.3))
    yield Case(group="inside", name="in a hall of 1 km", camera=wide, mesh=cube(1e3), t=(100.0, 50.0, 20.0))
    yield Case(group="inside", name="in a box of 1 mm", camera=wide, mesh=cube(1e-3), t=(1e-4, 5e-5, 2e-5))
    yield Case(
        group="inside",
        name="5 cm before the wall of a hall of 1 km",
        camera=wide,
        mesh=cube(1e3),
        t=(0.0, 0.0, -299.95),
        q=(1, 0, 0, 0),
    )
    yield Case(
        group="near plane",
        name="plates from behind to before the camera",
        camera=wide,
        mesh=steps(),
        t=(0, 0, 0.01),
        q=(1, 0, 0, 0),
    )
    yield Case(
        group="near plane",
        name="a wall that passes through the camera's plane",
        camera=wide,
        mesh=plate(0.0, 5.0),
        t=(0.0, 0.4, 0.5),
        q=(0.70710678118654757, 0.70710678118654757, 0, 0),
    )
    yield Case(
        group="near plane",
        name="a wall 20 um before the camera",
        camera=wide,
        mesh=plate(0.0, 0.5),
        t=(0, 0, 2e-5),
        q=(1, 0, 0, 0),
    )


def attitudes():
    turns = {
        "identity": (1, 0, 0, 0),
        "1e-9 rad": (1, 5e-10, 0, 0),
        "1e-5 rad": (1, 0, 5e-6, 0),
        "180 degrees": (0, 0.6, 0.8, 0),
        "1e-9 rad from 180 degrees": (5e-10, 0, 0.6, 0.8),
        "a right angle in pitch": (0.70710678118654757, 0, 0.70710678118654757, 0),
        "negated": tuple(-a for a in ATTITUDE),
        "norm off by 1e-6": tuple(a * (1 + 1e-6) for a in ATTITUDE),
    }
    for name, q in turns.items():
        yield Case(group="attitude", name=name, camera=camera(2e-3), mesh=cube(1.0), t=(0.3, -0.2, 12.0), q=q)


LENSES = {
    "barrel": ((-0.3, 0, 0, 0, 0), 0.9),
    "barrel next to its fold": ((-0.3, 0, 0, 0, 0), 0.9999),
    "moustache next to its fold": ((0.3, -0.45, 0, 0, 0), 0.999),
    "third order next to its fold": ((0, 0, 0, 0, -5.0), 0.999),
    "barrel of a focal length of 10 m": ((-3.6e8, 0, 0, 0, 0), 0.99),
}
PINCUSHIONS = {
    "pincushion": (0.9, 0.4, 0.01, -0.02, 0.0),
    "pincushion nine times as large at the corner": (30.0, 200.0, 0, 0, 500.0),
    "tangential": (0.0, 0.0, 0.03, -0.05, 0.0),
}


def lenses():
    for name, (k, share) in LENSES.items():
        through = folding(k, share)
        away = 100.0 if through.fx > 1e6 else 5.0
        size = 30.0 / through.fx * away
        yield Case(group="lens", name=name, camera=through, mesh=ball(size), t=(0.3 * size, 0.1 * size, away))
    for name, distortion in PINCUSHIONS.items():
        through = Camera(width=WIDTH, height=HEIGHT, fx=80.0, fy=81.0, cx=30.0, cy=25.0, distortion=distortion)
        yield Case(group="lens", name=name, camera=through, mesh=ball(1.5), t=(0.2, 0.1, 3.0))
        yield Case(group="lens", name=f"{name}, far", camera=through, mesh=ball(15.0), t=(-2.0, 6.0, 170.0))


def faces():
    still = (1, 0, 0, 0)
    for short in (1.0, 0.1, 0.01, 0.001):  # of a right angle, degrees
        half = np.radians(90 - short) / 2
        yield Case(
            group="grazing",
            name=f"a plate at {90 - short:g} degrees",
            camera=camera(0.01 / short),
            mesh=plate(),
            t=(0, 0, 2.0),
            q=(float(np.cos(half)), float(np.sin(half)), 0, 0),
        )
    for away, focal in ((3.0, 5e-4), (3e4, 5.0)):
        yield Case(
            group="needles",
            name=f"a disc of needles at {away:g} m",
            camera=camera(focal),
            mesh=needles(),
            t=(0.1, 0.05, away),
            q=(0.8, 0.48, 0.36, 0),
        )
        yield Case(
            group="needles",
            name=f"a sliver of 1e-6 at {away:g} m",
            camera=camera(focal),
            mesh=sliver(1e-6),
            t=(0.0, 0.0, away),
            q=still,
        )
    doubled = joined(cube(1.0), cube(1.0))
    yield Case(group="coincident", name="every face twice", camera=camera(2e-3), mesh=doubled, t=(0, 0, 15.0))
    yield Case(
        group="coincident",
        name="every face also inside out",
        camera=camera(2e-3),
        mesh=joined(cube(1.0), inside_out(cube(1.0))),
        t=(0, 0, 15.0),
    )
    for away, focal in ((5.0, 7e-4), (5e4, 7.0)):
        decal = joined(plate(0.0), plate(-3e-5, 0.2))
        yield Case(
            group="coincident",
            name=f"a decal 30 um before a plate at {away:g} m",
            camera=camera(focal),
            mesh=decal,
            t=(0, 0, away),
            q=still,
        )
    yield Case(group="windings", name="inside out", camera=camera(2e-3), mesh=inside_out(cube(1.0)), t=(0, 0, 15.0))
    yield Case(
        group="windings",
        name="a plate from behind",
        camera=camera(2e-3),
        mesh=plate(),
        t=(0, 0, 15.0),
        q=(0, 0.8, 0.6, 0),
    )


CASES = tuple(case for made in (ranges, focal_lengths, inside, attitudes, lenses, faces) for case in made())
