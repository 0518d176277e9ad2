"""The true shape of a target: its mesh with parts, points of the surface that can be seen, and a grid of the inside."""

from collections.abc import Iterator, Mapping
from functools import lru_cache, partial
from io import BytesIO
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from msgspec import Meta, ValidationError
from msgspec.json import decode
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.basics.json_fields import Count, FileName, JsonStruct, Positive, Share
from spin_usd.errors import InputError, UnsupportedError
from spin_usd.exchange.layout.export_format import MadeFile
from spin_usd.exchange.layout.models import Model, diameter
from spin_usd.files.folder import FileIn, Folder
from spin_usd.files.new_file import write_whole
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.array_file import encoded_point_cloud, read_array
from spin_usd.geometry.directions import sphere
from spin_usd.geometry.triangles import areas, spread_points, unit_normals
from spin_usd.geometry.winding import closed_faces, windings
from spin_usd.reading.description import DescribedPart

FOLDER = "truth"
TRUTH, MESH, POINTS, OCCUPANCY = "truth.json", "mesh.ply", "points.ply", "occupancy.npz"
COUNT = 100_000  # points of the surface
SEED = 0  # of the points
DIRECTIONS = 256  # from which a point may be seen
OFF = 1e-5  # of the craft's radius: how far before the surface a ray starts
ROUNDS = 64  # of drawing points, after which the surface counts as hidden
CELLS = 128  # of the grid along the longest edge of the craft's box
CLOUD = np.dtype([("points", "<f8", 3), ("nx", "<f4"), ("ny", "<f4"), ("nz", "<f4"), ("part", "<u2")])
FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3), ("part", "<u2")])
MESH_HEADER = """ply
format binary_little_endian 1.0
comment metres, in the body's axes; part: the id in truth.json
element vertex {points}
property double x
property double y
property double z
element face {faces}
property list uchar int vertex_indices
property ushort part
end_header
"""
SURFACE = (
    f"points.ply has {COUNT} points, even by area over the surface that can be seen from far away in one of "
    f"{DIRECTIONS} even directions at least, with normals on the side that is seen in more of them, and part ids.",
    "mesh.ply has all faces, hidden ones too, each with the id of its part.",
    f"occupancy.npz has a grid of cubes, {CELLS} along the longest edge: occupied (X, Y, Z), true where closed pieces "
    "of the mesh wind around a cube's centre; low, the corner of the first cube; step, the edge of a cube, metres. "
    "Open pieces, such as sheets of film, enclose nothing.",
)


class TruePicture(JsonStruct, frozen=True, kw_only=True):
    """The pose and the mask of a picture."""

    name: str
    image: FileName
    mask: FileName
    T_cam_body: list[list[float]]


class TrueShape(JsonStruct, frozen=True, kw_only=True):
    """Measures of a true shape, and its parts."""

    diameter: Annotated[Positive, Meta(description="The largest distance between two points, metres.")]
    parts: Annotated[dict[str, str], Meta(description="Names of the parts by their ids.")]
    seed: Annotated[Count, Meta(description="Seed of the points.")]
    seen: Annotated[Share, Meta(description="Share of the mesh's area that can be seen.")]
    closed: Annotated[Share, Meta(description="Share of the mesh's area in closed pieces.")]


class ShapeTruth(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="shape-truth-1"):
    """The true shape of an unknown target. Its files are in the folder of this one; images and masks are named from the
    export's."""

    target: str
    shape: TrueShape
    poses: Annotated[bool, Meta(description="Whether the pictures come with their poses.")]
    conventions: list[str]
    pictures: list[TruePicture]


class TruePoints(NamedTuple):
    """Points of the surface that can be seen, N of them."""

    points: Float
    """(N, 3) body axes, metres."""
    normals: Float
    """(N, 3) unit, on the side that is seen."""
    parts: NDArray[np.uint16]
    """(N,) part ids."""
    seen: float
    """Share of the mesh's area that can be seen."""


def shape_files(model: Model, folder: str) -> Iterator[MadeFile]:
    """Yield the files of the true shape in the `folder` of an export."""
    for name, write in ((MESH, _write_mesh), (POINTS, _write_points), (OCCUPANCY, _write_occupancy)):
        yield MadeFile(path=f"{folder}/{name}", write=partial(write, model))


def measured_shape(model: Model, parts: Mapping[int, DescribedPart]) -> TrueShape:
    """Return the measures of the model, whose parts have these descriptions by their ids."""
    size = areas(model.points[model.faces])
    return TrueShape(
        diameter=diameter(model.hull),
        parts={str(number): parts[number].name for number in np.unique(model.face_part).tolist()},
        seed=SEED,
        seen=visible_points(model).seen,
        closed=float(np.average(closed_faces(model.points, model.faces), weights=size)),
    )


@lru_cache(maxsize=1)
def visible_points(model: Model, count: int = COUNT, seed: int = SEED) -> TruePoints:
    """Return `count` points, even by area over the model's surface that can be seen from outside. Raises
    UnsupportedError where none can be."""
    from spin_usd.renderers.embree.caster import mesh_scene  # not above: who only reads has no Embree

    rng, corners = np.random.default_rng(seed), model.points[model.faces]
    if not areas(corners).any():
        raise UnsupportedError("has no surface", where="the target", do="mend its model")
    middle, radius = corners.reshape(-1, 3).mean(0), float(np.ptp(model.points, axis=0).max())
    scene = mesh_scene(((model.points - middle) / radius).astype(np.float32), model.faces)
    across, drawn = unit_normals(corners), 0
    found: list[tuple[Float, NDArray[np.intp], Float]] = []
    while (left := count - sum(len(face) for _, face, _ in found)) > 0:
        if drawn >= ROUNDS * count:
            raise UnsupportedError("is almost all hidden from outside", where="the target", do="mend its model")
        points, face = spread_points(corners, count, rng)
        side = _seen_side(scene, (points - middle) / radius, across[face])
        drawn, chosen = drawn + count, rng.permutation(np.flatnonzero(side))
        found.append((points[chosen[:left]], face[chosen[:left]], side[chosen[:left]]))
        share = len(chosen) / count
    points, face, side = (np.concatenate(each) for each in zip(*found, strict=True))
    return TruePoints(points, across[face] * side[:, None], model.face_part[face], share)


def _seen_side(scene: Any, points: Float, normals: Float) -> Float:
    """Return (N,) 1 for points (N, 3) that are seen from more directions before their face than behind it, -1 for the
    others, 0 for hidden ones."""
    votes, hidden = np.zeros(len(points)), np.ones(len(points), bool)
    for direction in sphere(DIRECTIONS):
        side = np.sign(normals @ direction)
        origins = (points + OFF * side[:, None] * normals).astype(np.float32)
        towards = np.ascontiguousarray(np.broadcast_to(direction, origins.shape), np.float32)
        free = (scene.run(origins, towards, query="OCCLUDED") == -1) & (side != 0)
        votes += side * free
        hidden &= ~free
    return np.where(hidden, 0.0, np.where(votes < 0, -1.0, 1.0))


def _write_mesh(model: Model, path: Path) -> None:
    faces = np.empty(len(model.faces), FACE)
    faces["count"], faces["corners"], faces["part"] = 3, model.faces, model.face_part
    header = MESH_HEADER.format(points=len(model.points), faces=len(faces)).encode("ascii")
    write_whole(path, header + model.points.astype("<f8").tobytes() + faces.tobytes())


def _write_points(model: Model, path: Path) -> None:
    found = visible_points(model)
    cloud = np.empty(len(found.points), CLOUD)
    cloud["points"], cloud["part"] = found.points, found.parts
    cloud["nx"], cloud["ny"], cloud["nz"] = found.normals.T
    write_whole(path, encoded_point_cloud(cloud, ".ply", header={"axes": "the body's", "unit": "metres"}))


def _write_occupancy(model: Model, path: Path) -> None:
    low, high = model.points.min(0), model.points.max(0)
    step = float((high - low).max()) / CELLS
    shape = tuple(np.maximum(np.ceil((high - low) / step - 1e-9), 1).astype(int).tolist())
    closed = closed_faces(model.points, model.faces)
    occupied = windings(model.points[model.faces[closed]], low, step, shape) != 0
    file = BytesIO()
    np.savez_compressed(file, occupied=occupied, low=low, step=step)
    write_whole(path, file.getvalue())


def read_shape_truth(folder: Path) -> tuple[ShapeTruth, TruePoints]:
    """Read truth.json and points.ply in the `folder`. Raises InputError where they are missing or damaged."""
    held = Folder(folder)
    for name in (TRUTH, MESH, POINTS):
        if held.type_of(name) is None:
            do = f"give the folder {FOLDER} of an export --to unknown_target"
            raise InputError(f"has no {name}", where=folder, do=do)
    try:
        truth = decode(held.read(TRUTH, MAX_POSE_LIST), type=ShapeTruth)
    except (ValidationError, ValueError) as e:
        raise InputError(f"is not the truth of a shape ({e})", where=folder / TRUTH, do="export it again") from e
    table = read_array(FileIn(held, POINTS))
    if table.dtype.names is None or not set(CLOUD.names or ()) <= set(table.dtype.names) or not len(table):
        raise InputError("has no points with normals and parts", where=folder / POINTS, do="export it again")
    normals = np.stack([table["nx"], table["ny"], table["nz"]], -1).astype(np.float64)
    return truth, TruePoints(table["points"].astype(np.float64), normals, table["part"], truth.shape.seen)
