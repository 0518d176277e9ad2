"""LiDAR: the points that the scene's LiDAR measures, each with the part that it lies on."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.labels.label import CloudLabel
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.labels.preview import as_the_lidar_sees
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.echoes import Echoes
from spin_usd.scene.lidar import Lidar
from spin_usd.scene.scene import Scene

POINT = np.dtype(
    [
        ("points", "<f4", (3,)),
        ("ranges", "<f4"),
        ("exact_ranges", "<f4"),
        ("beams", "<u4"),
        ("parts", "<u2"),
        ("targets", "<u2"),
    ]
)
ROUNDING = 5e-7  # relative: float32 rounds to 6e-8, each coordinate and both ranges; twice that is added up
MAX_SIGMAS = 8.0  # a normal error is larger once in 8e14 points
MAX_BESIDE = 0.05  # share of points: those near unresolved edges may disagree with depth
MIN_POINTS = 20  # that are compared: a share of fewer is meaningless
SAME_VIEW = math.cos(math.radians(3.0))  # from this far aside LiDAR and camera see the same, except at edges
NINE = np.array([(i, j) for j in (-1.0, 0.0, 1.0) for i in (-1.0, 0.0, 1.0)])  # pixels around one, right and down
FLAT = 1e-3  # relative: nine pixels whose depths are off a plane by more show an edge
PLANE = 1e-4  # relative: bend of a plane by a strong lens over nine pixels, and rounding of float32


def point_cloud(scene: Scene, echoes: Echoes, chance: np.random.Generator) -> NDArray[np.void]:
    """Return (N,) POINT: the beams that come back, in their order.

    A beam comes back where its angle of incidence is small enough, chance does not drop it, and its measured range,
    the exact one and a normal error, is within the LiDAR's limits. Each beam has chances of its own, whatever the
    others meet.
    """
    lidar = _lidar(scene)
    errors, luck = chance.standard_normal(lidar.beams)[echoes.beam], chance.random(lidar.beams)[echoes.beam]
    measured = echoes.range + lidar.sigma(echoes.range) * errors
    low, high = lidar.range_limits
    steep = echoes.cosine >= math.cos(math.radians(lidar.max_incidence_deg))
    back = np.flatnonzero(steep & (luck >= lidar.drop_out) & (low <= measured) & (measured <= high))
    cloud = np.zeros(len(back), POINT)
    cloud["points"] = lidar.directions[echoes.beam[back]] * measured[back, None]
    cloud["ranges"], cloud["exact_ranges"] = measured[back], echoes.range[back]
    cloud["beams"], cloud["parts"], cloud["targets"] = echoes.beam[back], echoes.part[back], echoes.target[back]
    return cloud


def _lidar(scene: Scene) -> Lidar:
    assert scene.lidar is not None, "a scene without LiDAR has no echoes"
    return scene.lidar


def faults(picture: LabelledPicture, name: str) -> Iterator[LabelFault]:
    """Points lie on their own beams, within the noise of the surface, and agree with depth and segmentation."""
    cloud, lidar = picture.arrays[name], picture.lidar
    if lidar is None:
        yield LabelFault(code="lidar", message=f"the record lacks the LiDAR that measured {name}")
        return
    beams = cloud["beams"].astype(np.int64)
    if (np.diff(beams, prepend=-1) <= 0).any() or (beams >= lidar.beams).any():
        yield LabelFault(code="beams", message=f"{name} has beams that the LiDAR has not, or one twice")
        return
    if int(cloud["parts"].max(initial=0)) > picture.parts:
        yield LabelFault(code="parts", message=f"{name} holds part ids above the {picture.parts} in dataset.json")
    elif (cloud["targets"] != picture.target_of_part[cloud["parts"]]).any():
        yield LabelFault(code="parts", message=f"{name} and dataset.json have different targets for its parts")
    yield from _range_faults(cloud, lidar, name)
    beside = _share_beside(picture, cloud, lidar)
    if not beside <= MAX_BESIDE:
        yield LabelFault(code="lidar", message=f"{beside:.0%} of the points of {name} disagree with depth")


def _range_faults(cloud: NDArray[np.void], lidar: Lidar, name: str) -> Iterator[LabelFault]:
    ranges, exact = cloud["ranges"].astype(np.float64), cloud["exact_ranges"].astype(np.float64)
    rounding = ROUNDING * ranges
    off = np.abs(cloud["points"] - lidar.directions[cloud["beams"]] * ranges[:, None]).max(1, initial=0)
    if not (off <= rounding).all():
        yield LabelFault(code="beams", message=f"points of {name} lie up to {off.max():.3g} m beside their beams")
    error = np.abs(ranges - exact)
    if not (error <= MAX_SIGMAS * lidar.sigma(exact) + rounding).all():
        found = f"ranges of {name} are up to {error.max():.3g} m off, more than the LiDAR's noise explains"
        yield LabelFault(code="noise", message=found)
    low, high = lidar.range_limits
    if not ((low - rounding <= ranges) & (ranges <= high + rounding)).all():
        yield LabelFault(code="limits", message=f"{name} has ranges outside the LiDAR's {low:g} to {high:g} m")


def _share_beside(picture: LabelledPicture, cloud: NDArray[np.void], lidar: Lidar) -> float:
    """Return the share of the points without noise that depth contradicts, of those it can judge: where nine pixels
    show the point's own part, and a plane. None lies before that, nor, seen by camera and LiDAR alike, behind."""
    depth, ids = picture.arrays.get("depth"), picture.arrays.get("segmentation")
    if depth is None or ids is None:
        return 0.0
    exact = lidar.directions[cloud["beams"]] * cloud["exact_ranges"][:, None].astype(np.float64)
    points = lidar.T_cam_lidar.points(exact)
    inside, uv = _in_frame(picture, points)
    nine = np.floor(uv)[:, None] + NINE
    columns, rows = np.moveaxis(nine.astype(np.intp), -1, 0)
    alike = (ids[rows, columns] == cloud["parts"][inside, None]).all(1)
    z, bend = _plane_depth(depth[rows[alike], columns[alike]].astype(np.float64), (uv - np.floor(uv) - 0.5)[alike])
    flat, points = bend <= FLAT, points[inside][alike]
    if flat.sum() < MIN_POINTS:
        return 0.0
    further = (points[:, 2] / z - 1)[flat]
    slack = PLANE + 4 * bend[flat]
    return float(((further < -slack) | ((further > slack) & _seen_alike(points[flat], lidar))).mean())


def _plane_depth(depth: Float, offset: Float) -> tuple[Float, Float]:
    """Return the depth (N,) of the plane that nine pixels (N, 9) show, at the `offset` (N, 2) from the middle one's
    centre, pixels, and how far off it they are at most (N,), as a share of it. Inverse depth is linear over a plane."""
    inverse = 1 / depth
    slopes = inverse @ NINE / 6
    fitted = inverse.mean(1, keepdims=True) + slopes @ NINE.T
    bend = np.abs(fitted / inverse - 1).max(1, initial=0)
    return 1 / (inverse.mean(1) + (slopes * offset).sum(1)), bend


def _in_frame(picture: LabelledPicture, points: Float) -> tuple[NDArray[np.intp], Float]:
    """Return which of the `points` (N, 3), camera axes, lie in the frame, off its outermost pixels (M,), and where
    (M, 2), pixels."""
    camera = picture.camera
    uv = np.nan_to_num(camera.project(points), nan=-1.0)
    inside = (points[:, 2] > 0) & (uv >= 1).all(1) & (uv < (camera.width - 1, camera.height - 1)).all(1)
    return np.flatnonzero(inside), uv[inside]


def _seen_alike(points: Float, lidar: Lidar) -> NDArray[np.bool_]:
    """Return (N,) whether camera and LiDAR see the `points` (N, 3), camera axes, from about the same direction."""
    to_lidar = points - lidar.T_cam_lidar.translation
    lengths = np.linalg.norm(points, axis=1) * np.linalg.norm(to_lidar, axis=1)
    return np.asarray((points * to_lidar).sum(1) >= SAME_VIEW * lengths)


LIDAR = CloudLabel(
    name="lidar",
    make=point_cloud,
    channels=Channels(
        meaning="points that the LiDAR measures, in its own axes (x forward, y left, z up), metres, with their ranges, "
        "the exact ranges, beams, and the parts and targets that they lie on: an array for each",
        dtype={name: POINT[name].base.name for name in POINT.names or ()},
        holds={
            "points": "x, y, z as measured",
            "ranges": "range as measured",
            "exact_ranges": "range without noise",
            "beams": "number of the beam, from 0",
            "parts": "part id",
            "targets": "target id",
        },
        unit="m",
        frame="lidar",
    ),
    suffix=".npz",
    file_bytes=0.5,
    preview=as_the_lidar_sees,
    faults=lambda picture: faults(picture, "lidar"),
)
LIDAR_PLY = replace(
    LIDAR,
    name="lidar_ply",
    suffix=".ply",
    channels=replace(LIDAR.channels, meaning="the same as lidar, for programs that read PLY: a vertex for each point"),
    faults=lambda picture: faults(picture, "lidar_ply"),
)
