"""The models of a stage's bodies: their files, their units, and writing them into a stage."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import reading
from spin_usd.basics.resources import bundled, stages
from spin_usd.commands.author.plausible_target import ModelUnit
from spin_usd.errors import InputError
from spin_usd.files.model_root import root_of
from spin_usd.files.size_limits import MAX_MODEL
from spin_usd.files.user_file import open_file
from spin_usd.formats.mesh.dae_document import unit_of
from spin_usd.formats.mesh.fbx_head import Y_UP_FROM_BLENDER, read_fbx_head
from spin_usd.formats.mesh.mesh_file import (
    BY_BLENDER,
    CONVERTED,
    DAE,
    FBX,
    GLTF,
    MESHES,
    STEP,
    check_units,
    read_mesh_file,
    without_doubles,
)
from spin_usd.processes.ask_child import ask_child
from spin_usd.processes.call import Call
from spin_usd.processes.child_limits import rendering_memory
from spin_usd.scene.asset import AT_REST, MeshAsset, MeshPart
from spin_usd.scene.converted_model import ConvertedModel, ModelToConvert
from spin_usd.specifications.sampling_text import BodyText, body_text
from spin_usd.stage.author.from_mesh_file import target_name, write_mesh_target
from spin_usd.stage.author.from_usd import copy_usd_target
from spin_usd.stage.author.leave_out import leave_out
from spin_usd.stage.author.target_asset import TargetAsset, describe

MAX_MODEL_TIME = 1e6  # seconds: Blender counts frames in 32 bits
FBX_UNITS = 100  # per metre, Blender's default for a file without a unit
WHITE = (1.0, 1.0, 1.0)  # glTF's default colour
USD_SUFFIXES = {".usd", ".usda", ".usdc", ".usdz"}


def model_file(given: str) -> Path:
    """Return the file of the target of that name, or the file itself. Raises InputError."""
    suffix = Path(given).suffix.lower()
    if suffix not in USD_SUFFIXES | set(MESHES):
        if suffix or "/" in given:
            glb = f"assimp export {Path(given).name} {Path(given).stem}.glb"
            do = f"give one of {', '.join(MESHES)} or USD; Blender converts many others, and so does: {glb}"
            raise InputError("is not a model file", where=given, do=do)
        return bundled("target", given)
    if not Path(given).is_file():
        raise InputError("is not there, or is not a file", where=given)
    with open_file(given, MAX_MODEL) as file:
        head = file.read(64)
    if head.lstrip().lower().startswith((b"<!doctype html", b"<html")):
        raise InputError("is a web page, and no model", where=given, do="fetch the file itself")
    for begins, what, suffixes in HEADS:
        if head.startswith(begins) and suffix not in suffixes:
            named = f"call it {Path(given).stem}{suffixes[0]}" if suffixes else ""
            raise InputError(f"is {what}", where=given, do=named or "run git lfs pull, or fetch the file itself")
    return Path(given)


HEADS = (
    (b"version https://git-lfs", "a pointer of Git LFS, not the file itself", ()),
    (b"glTF", "a GLB", (".glb",)),
    (b"Kaydara FBX", "an FBX file", (FBX,)),
    (b"BLENDER", "a .blend", (".blend",)),
    (b"ISO-10303-21", "a STEP file", STEP),
    (b"ply\n", "a PLY file", (".ply",)),
    *((begins, "a USD file", (".usd", ".usda", ".usdc")) for begins in (b"PXR-USDC", b"#usda")),
)
"""First bytes of files, the kind of file, and its endings."""


CONVERT_MODEL = Call("spin_usd.renderers.blender.model_conversion:convert_model", ModelToConvert, ConvertedModel)
CONVERT_STEP = Call("spin_usd.formats.mesh.step_file:convert_step", ModelToConvert, ConvertedModel)
ATTACHED = "attached"
NOTHING_SAID = BodyText(text="", count=1, poses={})
WITH_TEXT = re.compile(r"(.+?):([a-z_]+=.*)")


@dataclass(frozen=True, kw_only=True)
class OtherBody:
    """A body beside the first target."""

    file: Path
    """Its model's."""
    occluder: bool
    """True for a body fixed to the camera, which is not a target."""
    poses: Path | None = None
    """The pose list that it follows, or a folder of such; None for none."""
    said: BodyText = NOTHING_SAID
    """Specification of its poses. ATTACHED: modelled in the axes of the first target, and moving with it."""

    @property
    def attached(self) -> bool:
        return self.said.text == ATTACHED


def other_body(given: str, *, occluder: bool) -> OtherBody:
    """Return the body that "MODEL" or "MODEL:POSES" names, MODEL being a target's name or a file, and POSES for a
    target also "attached" or a line such as "distance=1..5". Raises InputError."""
    model, colon, poses = given.rpartition(":")
    if not colon or Path(given).is_file():
        return OtherBody(file=model_file(given), occluder=occluder)
    if not occluder and (found := WITH_TEXT.fullmatch(given)):
        return OtherBody(file=model_file(found[1]), occluder=False, said=body_text(found[2]))
    if not occluder and poses == ATTACHED:
        return OtherBody(file=model_file(model), occluder=False, said=replace(NOTHING_SAID, text=ATTACHED))
    if not (poses and Path(poses).exists()):
        do = "write MODEL or MODEL:POSES" if occluder else "write MODEL, MODEL:POSES or MODEL:distance=1..5"
        raise InputError("is not there", where=poses or given, do=do)
    return OtherBody(file=model_file(model), occluder=occluder, poses=Path(poses))


def write_model(
    file: Path,
    folder: Path,
    units_per_metre: float | None,
    prim: str | None,
    model_time: float | None = None,
    variants: Mapping[str, str] = MappingProxyType({}),
    leaves: Sequence[str] = (),
) -> tuple[TargetAsset, tuple[str, ...]]:
    """Write the model as a target of the stage in `folder`, where no other has its name; return it with notes on it. It
    is in its stored rest state, or its state `model_time` seconds after its animations begin; `variants` of a USD file
    are selected by their sets; prims of the patterns `leaves` are left out. Raises InputError."""
    moving = (*BY_BLENDER, *GLTF)
    if model_time is not None and file.suffix.lower() not in moving:
        found = f"model_time is given, and only {', '.join(moving)} have animations that it chooses"
        raise InputError(found, where=file, do="leave it out")
    if model_time is not None and not 0 <= model_time <= MAX_MODEL_TIME:
        raise InputError(f"model_time is {model_time:g}", where=file, do=f"make it 0 to {MAX_MODEL_TIME:g} seconds")
    plain = name = target_name(file.stem)
    number = 1
    while (place := folder / "targets" / name).exists():
        number += 1
        name = f"{plain}_{number}"
    if file.suffix.lower() in USD_SUFFIXES:
        with reading(file):
            asset = copy_usd_target(file, place, name, units_per_metre, prim, variants)
            asset = leave_out(asset, leaves, file)
        return asset, asset.notes
    if prim is not None:
        raise InputError("prim is given, and only USD files have prims", where=file, do="leave prim out")
    if variants:
        raise InputError("a variant is given, and only USD files have variants", where=file, do="leave variant out")
    with reading(file):
        convert = file.suffix.lower() in CONVERTED or model_time is not None
        model = _converted(file, units_per_metre, model_time) if convert else read_mesh_file(file, units_per_metre)
        model = without_doubles(model)
        asset = leave_out(describe(write_mesh_target(model, place, name), name), leaves, file)
    return replace(asset, up=model.up), (*model.notes, *asset.notes)


def is_users(file: Path) -> bool:
    """Return whether a model is the user's, and does not travel with spin_usd."""
    return not file.is_relative_to(stages())


def axes_note(
    file: Path, model: TargetAsset, meant: str, *, whose: str = "body", crafts: Path | None = None
) -> tuple[str, ...]:
    """Return the note on a model's axes, the same for all formats: they are the file's own, or the craft's for a file
    in the folder `crafts`; () for bundled models. `meant`: what they apply to."""
    if not is_users(file):
        return ()
    if crafts and file.is_relative_to(crafts):
        return (f"{whose} axes are the craft's own, z away from its launcher: {meant}",)
    called = f", of which it calls {model.up} up" if model.up else ", and it does not state an up axis"
    return (f"{whose} axes are the file's own x, y and z{called}: {meant}",)


def _converted(file: Path, units_per_metre: float | None, model_time: float | None) -> MeshAsset:
    """Read a model that Blender or Open CASCADE converts, in a separate process. Raises InputError, and StageError if
    the process dies."""
    suffix, axes, up, remarks = file.suffix.lower(), None, "", []
    if suffix == FBX:
        head = read_fbx_head(file)
        axes, up, remarks = head.from_blender, head.up, [AT_REST] * (head.moves and model_time is None)
        if units_per_metre is not None and not head.says_unit:
            units_per_metre /= FBX_UNITS
    elif suffix in GLTF:
        read_mesh_file(file, units_per_metre)  # refuses buffers from elsewhere, of which Blender makes no list
        axes, up = Y_UP_FROM_BLENDER, "y"
    elif suffix not in STEP:
        up = "z"
    with TemporaryDirectory(prefix="spin_usd-") as folder:
        glb = Path(folder) / f"{file.stem}.glb"
        root = root_of(file)
        by_step = suffix in STEP
        converted = ask_child(
            CONVERT_STEP if by_step else CONVERT_MODEL,
            ModelToConvert(source=str(file), to=str(glb), root=str(root), model_time=model_time),
            reads=file,
            memory=rendering_memory(),
            below=root,
            writes=(Path(folder),),
        )
        check_units(file, units_per_metre)
        try:
            model = read_mesh_file(glb, units_per_metre, metres_per_unit=converted.metres_per_unit)
        except InputError as error:  # of a file that will be gone
            raise InputError(error.found.replace(str(glb), file.name), where=file, do=error.do) from None
    model = _painted(model) if by_step else _refracting(model, converted.refraction)
    if axes is not None:
        model = replace(model, parts=tuple(_turned(part, axes) for part in model.parts))
    return replace(model, notes=(*converted.notes, *remarks, *model.notes), up=up)


def _turned(part: MeshPart, axes: Float) -> MeshPart:
    normals = None if part.normals is None else part.normals @ axes.T
    return replace(part, points=part.points @ axes.T, normals=normals)


def _refracting(model: MeshAsset, indices: Mapping[str, float]) -> MeshAsset:
    """Return the model with these indices of refraction, by the names of its materials."""
    materials = tuple(
        replace(each, constants=replace(each.constants, ior=round(ior, 6)))
        if (ior := indices.get(each.constants.path)) is not None
        else each
        for each in model.materials
    )
    return replace(model, materials=materials)


def _painted(model: MeshAsset) -> MeshAsset:
    """Return a model of STEP, which has colours at most, without the metal that glTF has for a default."""
    paints = tuple(replace(each, constants=replace(each.constants, metallic=0.0)) for each in model.materials)
    bare = {-1, *(i for i, each in enumerate(model.materials) if each.constants.diffuse_color == WHITE)}
    plain = sum(not bare.isdisjoint(part.face_material.tolist()) for part in model.parts)
    notes = (f"{plain} of {len(model.parts)} parts have no colour in the file: they are of a plain paint",)
    return replace(model, materials=paints, notes=(*model.notes, *(notes if plain else ())))


def model_unit(file: Path, target: TargetAsset, units_per_metre: float | None) -> ModelUnit:
    """Return how long a unit of the model in `file` is."""
    per_metre = units_per_metre or 1 / target.metres_per_unit
    if file.suffix.lower() in MESHES and units_per_metre is None:
        per_metre = 1 / (unit_of(file) or 1.0) if file.suffix.lower() == DAE else 1.0
    return ModelUnit(file=file, per_metre=per_metre, given=units_per_metre is not None)
