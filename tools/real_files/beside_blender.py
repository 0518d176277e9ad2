"""Import a model with Blender's own importer, render it as our picture was, and lay both side by side.

Started by real_files.attempt as `beside_blender.py FOLDER FILE METRES`: view.json there says where camera and Sun are,
in the axes of the file, whose unit is so many metres where it does not say so itself. Writes FOLDER/beside.png: ours,
Blender's, and their difference, all with the same white. Prints the bounds in metres, in the file's axes, and how far
the two are apart, as JSON.
"""

import json
import math
import os
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenImageIO
from mathutils import Matrix, Vector

SAMPLES = 64
Z_UP_OF_Y_UP = Matrix.Rotation(math.pi / 2, 4, "X")
FLIP = Matrix.Diagonal((1, -1, -1, 1))  # OpenCV's camera axes to Blender's
SHARED = 0.5  # coverage from which a pixel counts as the model's


def main() -> None:
    folder, file = Path(sys.argv[1]), Path(sys.argv[2])
    view = json.loads((folder / "view.json").read_text())
    poses = json.loads((folder / "poses.json").read_text())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    world_from_file = imported(file, float(sys.argv[3]))
    bounds = bounds_in(world_from_file.inverted())
    set_up(view, world_from_file)
    theirs = rendered(folder)
    ours = read(folder / "dataset" / "radiance" / "nominal" / f"{Path(poses[0]['filename']).stem}.exr")
    write_beside(folder / "beside.png", ours, theirs)
    print(json.dumps({"bounds": bounds, **apart(ours, theirs)}))
    sys.stdout.flush()
    os._exit(0)  # the interpreter's teardown with bpy loaded can hang


def imported(file: Path, metres: float) -> Matrix:
    """Import the model; returns Blender's world axes from the file's. `metres` is the unit of a file without one."""
    path = str(file)
    match file.suffix.lower():
        case ".obj":
            bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z")
        case ".ply":
            bpy.ops.wm.ply_import(filepath=path, forward_axis="Y", up_axis="Z")
        case ".stl":
            bpy.ops.wm.stl_import(filepath=path, forward_axis="Y", up_axis="Z")
        case ".gltf" | ".glb":
            import addon_utils

            addon_utils.enable("io_scene_gltf2")
            bpy.ops.import_scene.gltf(filepath=path)
            return Z_UP_OF_Y_UP
        case _:
            from pxr import Usd, UsdGeom

            stage = Usd.Stage.Open(path)
            unsaid = not UsdGeom.StageHasAuthoredMetersPerUnit(stage)  # Blender takes that for centimetres
            bpy.ops.wm.usd_import(
                filepath=path,
                import_lights=False,
                import_cameras=False,
                apply_unit_conversion_scale=not unsaid,
                scale=metres if unsaid else 1.0,
            )
            return Z_UP_OF_Y_UP if UsdGeom.GetStageUpAxis(stage) == "Y" else Matrix.Identity(4)
    for thing in bpy.context.scene.objects:
        if thing.parent is None:
            thing.matrix_world = Matrix.Scale(metres, 4) @ thing.matrix_world
    return Matrix.Identity(4)


def bounds_in(file_from_world: Matrix) -> list[list[float]] | None:
    """Corners of the bounds of all that is rendered, in the file's axes; None where nothing is."""
    graph = bpy.context.evaluated_depsgraph_get()
    corners = []
    for each in graph.object_instances:
        if each.object.type == "MESH" and not each.object.hide_render:
            mesh = each.object.to_mesh()
            matrix = np.array(file_from_world @ each.matrix_world)
            points = np.empty(3 * len(mesh.vertices))
            mesh.vertices.foreach_get("co", points)
            if len(points):
                moved = points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
                corners += [moved.min(0), moved.max(0)]
    return [np.min(corners, 0).tolist(), np.max(corners, 0).tolist()] if corners else None


def set_up(view: dict[str, Any], world_from_file: Matrix) -> None:
    """The camera and the Sun of `view`, and Cycles as we use it."""
    scene = bpy.context.scene
    cam_from_file = Matrix(
        [[*row, t] for row, t in zip(view["rotation"], view["translation"], strict=True)] + [[0, 0, 0, 1]]
    )
    world_from_cam = world_from_file @ cam_from_file.inverted()
    camera = bpy.data.cameras.new("camera")
    camera.sensor_width, camera.lens = 36, 36 * view["focal_px"] / view["size"][0]
    camera.clip_start, camera.clip_end = 1e-3, 1e6
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.camera.matrix_world = world_from_cam @ FLIP
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle = view["irradiance"], view["angle"]
    lamp = bpy.data.objects.new("sun", sun)
    towards = world_from_cam.to_3x3() @ Vector(view["sun_direction"])
    lamp.matrix_world = towards.to_track_quat("-Z", "Y").to_matrix().to_4x4()
    for thing in (scene.camera, lamp):
        scene.collection.objects.link(thing)
    scene.world = None  # black; a new one is grey
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.use_denoising = SAMPLES, False, False
    scene.render.resolution_x, scene.render.resolution_y = view["size"]
    scene.render.film_transparent = True


def rendered(folder: Path) -> np.ndarray:
    """Blender's picture (H, W, 4): linear red, green, blue and coverage."""
    image = bpy.context.scene.render.image_settings
    image.media_type, image.file_format = "IMAGE", "OPEN_EXR"
    image.color_mode, image.color_depth = "RGBA", "32"
    bpy.context.scene.render.filepath = str(folder / "blender.exr")
    bpy.ops.render.render(write_still=True)
    return read(folder / "blender.exr")


def read(file: Path) -> np.ndarray:
    """(H, W, 4) of an EXR file, whatever its data window is."""
    buffer = OpenImageIO.ImageBuf(str(file))
    spec = buffer.spec()
    whole = OpenImageIO.ROI(
        spec.full_x, spec.full_x + spec.full_width, spec.full_y, spec.full_y + spec.full_height, 0, 1, 0, 4
    )
    return np.asarray(buffer.get_pixels(OpenImageIO.FLOAT, whole))


def apart(ours: np.ndarray, theirs: np.ndarray) -> dict[str, float]:
    """Silhouette's intersection over union, and on it our mean brightness over Blender's and the mean difference over
    Blender's mean."""
    mine, other = ours[..., 3] > SHARED, theirs[..., 3] > SHARED
    both = mine & other
    a, b = ours[both][:, :3], theirs[both][:, :3]
    mean = max(float(b.mean()), 1e-9) if both.any() else 1.0
    return {
        "silhouette_iou": int(both.sum()) / max(int((mine | other).sum()), 1),
        "brightness": float(a.mean() / mean) if both.any() else 0.0,
        "difference": float(np.abs(a - b).mean() / mean) if both.any() else 0.0,
    }


def write_beside(file: Path, ours: np.ndarray, theirs: np.ndarray) -> None:
    """Ours, Blender's, and their difference around grey."""
    lit = theirs[..., :3][theirs[..., 3] > SHARED]
    white = max(float(np.quantile(lit, 0.95)), 1e-9) if len(lit) else 1.0
    tiles = [ours[..., :3] / white, theirs[..., :3] / white, 0.214 + (ours - theirs)[..., :3] / white / 2]
    linear = np.clip(np.concatenate(tiles, 1), 0, 1)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    height, width, _ = encoded.shape
    spec = OpenImageIO.ImageSpec(width, height, 3, OpenImageIO.UINT8)
    out = OpenImageIO.ImageOutput.create(str(file))
    if out is None:
        raise OSError(f"{file}: OpenImageIO writes no such image")
    out.open(str(file), spec)
    out.write_image(np.ascontiguousarray(np.round(255 * encoded).astype(np.uint8)))
    out.close()


if __name__ == "__main__":
    main()
