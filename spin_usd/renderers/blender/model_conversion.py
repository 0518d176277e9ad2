"""Models of the formats that Blender alone reads, FBX and its own, as GLB: what it would render, in metres.

Scripts of a .blend are not run. Files that a model names are taken from below one folder; others are left out, with a
note, before anything is written.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy

from spin_usd.errors import InputError

GLTF = "io_scene_gltf2"


def convert_model(*, source: str, to: str, root: str) -> dict[str, Any]:
    """Write the model at `source` to the GLB `to`; files that it names lie below `root`. Return the length of its unit
    in metres as "metres_per_unit", and "notes". Raises InputError for a file that Blender cannot read."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    try:
        if source.lower().endswith(".fbx"):
            bpy.ops.wm.fbx_import(filepath=source, use_anim=False)
        else:
            bpy.ops.wm.open_mainfile(filepath=source, use_scripts=False, load_ui=False)
    except RuntimeError as error:
        said = str(error).strip().removeprefix("Error: ").splitlines()[0]
        raise InputError(f"cannot be read by Blender ({said})", where=source) from None
    _refuse_libraries(source, Path(root))
    notes = list(_without_images_from_elsewhere(Path(source).parent, Path(root)))
    for each in bpy.data.objects:
        if each.data is not None and each.data.users == 1:
            each.data.name = each.name  # by which people know a part
    bpy.ops.preferences.addon_enable(module=GLTF)
    bpy.ops.export_scene.gltf(
        filepath=to,
        export_format="GLB",
        export_apply=True,
        export_animations=False,
        export_skins=False,
        export_morph=False,
        export_cameras=False,
        export_lights=False,
        export_yup=False,  # the body axes are those that Blender shows
        use_renderable=True,
    )
    unit = bpy.context.scene.unit_settings
    return {"metres_per_unit": float(unit.scale_length), "notes": notes}


def _refuse_libraries(source: str, root: Path) -> None:
    """Raise InputError for a .blend that links another from elsewhere: Blender has opened it already, and what it holds
    must not end in a stage."""
    for library in bpy.data.libraries:
        if not _within(root, Path(bpy.path.abspath(library.filepath))):
            found = f"links {library.filepath}, which lies outside the model's folder"
            raise InputError(found, where=source, do="append it in Blender, or give --root")


def _without_images_from_elsewhere(folder: Path, root: Path) -> Iterator[str]:
    """Remove the images that lie outside `root`, or are not there; yield a note on each."""
    for image in list(bpy.data.images):
        if image.source != "FILE" or image.packed_file:
            continue
        path = Path(bpy.path.abspath(image.filepath, start=str(folder)))
        lost = "lies outside the model's folder" if not _within(root, path) else "is missing"
        if not _within(root, path) or not path.is_file():
            yield f"the texture {path.name!r} {lost}, and was left out"
            bpy.data.images.remove(image)


def _within(root: Path, path: Path) -> bool:
    return path.resolve().is_relative_to(root)
