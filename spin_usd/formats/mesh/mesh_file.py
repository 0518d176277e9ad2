"""Mesh files (OBJ, PLY, STL, glTF, GLB, COLLADA) in, MeshAsset in metres out.

Points stay doubles in the file's order; nothing is merged or smoothed. The file's axes are the body axes.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import GeometryError, InputError
from spin_usd.formats.mesh.dae_document import unit_of
from spin_usd.formats.mesh.dae_file import read_dae
from spin_usd.formats.mesh.fbx_head import read_fbx_head
from spin_usd.formats.mesh.gltf_file import read_gltf
from spin_usd.formats.mesh.obj_file import read_obj
from spin_usd.formats.mesh.ply_file import read_ply
from spin_usd.formats.mesh.stl_file import read_stl
from spin_usd.scene.asset import MeshAsset, MeshPart
from spin_usd.scene.shape import MAX_FACES

FLAT_FACE = 1e-13  # area over longest edge squared: below it a face has no normal in double precision
MIX = 0x9E3779B97F4A7C15  # odd, its bits without a pattern: 2**64 over the golden ratio
UNIT_LIMITS = (1e-9, 1e9)
GLTF, DAE, FBX = (".gltf", ".glb"), ".dae", ".fbx"


def read_mesh_file(
    path: str | Path, units_per_metre: float | None = None, *, metres_per_unit: float | None = None
) -> MeshAsset:
    """Read the model in the file at `path`, metres.

    `units_per_metre` is 100 for a file in centimetres; the unit of glTF is the metre, and COLLADA states its own.
    `metres_per_unit`: the unit of the file that was converted to this one, used instead of its own. Raises InputError
    that names the file.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"is not one of the mesh formats {', '.join(READERS)}", where=path)
    if not path.exists():
        raise InputError("is not there", where=path)
    check_units(path, units_per_metre)
    try:
        asset = reader(path)
        own = metres_per_unit or asset.metres_per_unit
        scale = 1 / own if units_per_metre is None else float(units_per_metre)
        asset = replace(asset, parts=tuple(_scaled(part, scale) for part in asset.parts))
        asset = _with_agreeing_normals(_without_nan(_without_flat_faces(asset)))
        return replace(asset, notes=(*asset.notes, *_remarks(asset, path, scale if metres_per_unit is None else 1.0)))
    except GeometryError as error:
        raise InputError(str(error), where=path) from None


def _scaled(part: MeshPart, units_per_metre: float) -> MeshPart:
    copies = part.copies
    if copies is not None:
        copies = copies / np.where(np.arange(4) == 3, units_per_metre, 1.0)
        copies[:, 3, 3] = 1
    return replace(part, points=part.points / units_per_metre, copies=copies)


def says_unit(path: Path) -> bool:
    """Return whether the mesh file at `path` states its unit of length. Raises InputError if it cannot be read."""
    if path.suffix.lower() == DAE:
        return unit_of(path) is not None
    if path.suffix.lower() == FBX:
        return read_fbx_head(path).says_unit
    return path.suffix.lower() in (*GLTF, *CONVERTED)


def check_units(path: Path, units_per_metre: float | None) -> None:
    """Raise InputError if neither file nor user states the model's unit, or if it is not a number."""
    if units_per_metre is None and not says_unit(path):
        raise InputError(
            "does not state its unit of length",
            where=path,
            do="give --units-per-metre, for example 100 for centimetres or 1000 for millimetres",
        )
    if units_per_metre is not None and not UNIT_LIMITS[0] <= float(units_per_metre) <= UNIT_LIMITS[1]:
        raise InputError(f"units per metre is {units_per_metre!r}, expected a number above zero, such as 100")


def _without_flat_faces(asset: MeshAsset) -> MeshAsset:
    """Faces without area are dropped, with a note; GeometryError when nothing is left."""
    keep = [~flat_faces(part) for part in asset.parts]
    dropped = sum(int((~k).sum()) for k in keep)
    if not dropped:
        return asset
    parts = tuple(_kept(part, k) for part, k in zip(asset.parts, keep, strict=True) if k.any())
    if not parts:
        raise GeometryError("all faces have zero area")
    return replace(asset, parts=parts, notes=(*asset.notes, f"{dropped} of {asset.faces} faces have no area: dropped"))


def without_doubles(asset: MeshAsset) -> MeshAsset:
    """Of faces with the same corners, in whatever order, the first is kept, with a note: path tracers show two in one
    place black."""
    keys = np.concatenate([_corner_keys(part) for part in asset.parts])
    chosen = np.zeros(len(keys), bool)
    chosen[np.unique(keys, return_index=True)[1]] = True
    if chosen.all():
        return asset
    ends = np.cumsum([len(part.face_counts) for part in asset.parts])
    keep = np.split(chosen, ends[:-1])
    parts = tuple(_kept(part, k) for part, k in zip(asset.parts, keep, strict=True) if k.any())
    note = f"{(~chosen).sum()} of {asset.faces} faces have the corners of another: one of each two is kept"
    return replace(asset, parts=parts, notes=(*asset.notes, note))


def _corner_keys(part: MeshPart) -> NDArray[np.uint64]:
    """Return (F,) a number that faces with the same corners share, and by chance no others of 2**64."""
    mixed = np.zeros(len(part.points), np.uint64)
    for column in (part.points + 0.0).T:  # -0 becomes 0
        mixed ^= column.copy().view(np.uint64)
        for shift in (30, 27, 31):
            mixed = (mixed ^ (mixed >> np.uint64(shift))) * np.uint64(MIX)
    mixed ^= mixed >> np.uint64(32)
    return np.add.reduceat(mixed[part.face_indices], part.face_starts)


def _without_nan(asset: MeshAsset) -> MeshAsset:
    """Replace normals that are not numbers by their faces' normals, and drop a part's colours or coordinates if some
    are not numbers; with notes."""
    parts, notes = [], []
    for part in asset.parts:
        if part.normals is not None and not np.isfinite(part.normals).all():
            normals = np.where(np.isfinite(part.normals).all(axis=1, keepdims=True), part.normals, 0.0)
            part = replace(part, normals=normals)
            notes.append(f"normals of {part.name!r} that are not numbers: replaced by the normals of its faces")
        lost = [name for name, values in part.primvars.items() if not np.isfinite(values).all()]
        if lost:
            part = replace(part, primvars={name: part.primvars[name] for name in part.primvars if name not in lost})
            notes.append(f"{', '.join(lost)} of {part.name!r} holds values that are not numbers: dropped")
        parts.append(part)
    return replace(asset, parts=tuple(parts), notes=(*asset.notes, *notes))


def flat_faces(part: MeshPart) -> NDArray[np.bool_]:
    """Return (F,) which faces have no area."""
    _, twice_areas, longest = part.areas
    return np.asarray(twice_areas <= FLAT_FACE * longest**2)


def _with_agreeing_normals(asset: MeshAsset) -> MeshAsset:
    """Turn normals that point to the back of their face, with a note: path tracers show black there, others do not, and
    the intended side is unknown."""
    found, against, whole = [], 0.0, 0.0
    for part in asset.parts:
        vectors, areas, _ = part.areas
        whole += float(areas.sum())
        if part.normals is not None:
            mean = np.add.reduceat(part.normals, part.face_starts)
            turned = (mean * vectors).sum(1) < 0
            against += float(areas[turned].sum())
            if turned.any():
                sign = np.where(np.repeat(turned, part.face_counts), -1.0, 1.0)
                part = replace(part, normals=part.normals * sign[:, None])
        found.append(part)
    if not against:
        return asset
    note = f"normals on {100 * against / whole:.3g} % of the area contradict their faces' winding, and were turned"
    return replace(asset, parts=tuple(found), notes=(*asset.notes, note))


def _kept(part: MeshPart, keep: NDArray[np.bool_]) -> MeshPart:
    corners = np.repeat(keep, part.face_counts)
    return replace(
        part,
        face_counts=part.face_counts[keep],
        face_indices=part.face_indices[corners],
        face_material=part.face_material[keep],
        normals=None if part.normals is None else part.normals[corners],
        primvars={name: values[corners] for name, values in part.primvars.items()},
    )


def _remarks(asset: MeshAsset, path: Path, scale: float) -> list[str]:
    if asset.faces > MAX_FACES:
        raise GeometryError(f"the model has {asset.faces} faces, expected at most {MAX_FACES}")
    notes = []
    if path.suffix.lower() in GLTF and scale != 1:
        notes.append(f"glTF is in metres by its standard; {scale:g} units per metre was used, as given")
    return notes


READERS: dict[str, Callable[[Path], MeshAsset]] = {
    ".obj": read_obj,
    ".ply": read_ply,
    ".stl": read_stl,
    ".gltf": read_gltf,
    ".glb": read_gltf,
    DAE: read_dae,
}
BY_BLENDER, STEP = (FBX, ".blend"), (".step", ".stp")
CONVERTED = (*BY_BLENDER, *STEP)
"""Formats that are read in a process of their own, and written as GLB."""
MESHES = (*READERS, *CONVERTED)
