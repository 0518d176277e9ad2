"""What a researcher's own bpy script would do: the whole frame, all passes in one multilayer EXR, and a PNG.

Started by benchmarks.peers, which says what it is told and what it answers; its fifth argument, `frame` or `box`, says
whether it renders the whole frame or the target's box alone.
No distortion (a plain perspective camera), no body coordinates beyond the Position pass: less than spin_usd delivers.
"""

import os
import sys

import bpy
import mathutils
import numpy as np


def build(scene_file: str, samples: int) -> tuple[bpy.types.Scene, bpy.types.Object]:
    """Make the scene; returns it and the target, whose pose is not set."""
    data = np.load(scene_file)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    configure(scene, data["camera"], samples)
    target = bpy.data.objects.new("target", mesh(data))
    target.rotation_mode, target.pass_index = "QUATERNION", 1
    for item in (camera(data["camera"]), target, lamp(data["suns"][0])):
        scene.collection.objects.link(item)
    scene.camera = scene.objects["camera"]
    return scene, target


def configure(scene: bpy.types.Scene, numbers: np.ndarray, samples: int) -> None:
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.use_denoising = samples, False, False
    scene.cycles.max_bounces = 4
    scene.render.resolution_x, scene.render.resolution_y = int(numbers[0]), int(numbers[1])
    scene.render.use_persistent_data = True
    scene.world = None  # black; a new one is grey
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_position = layer.use_pass_object_index = True


def camera(numbers: np.ndarray) -> bpy.types.Object:
    width, height, fx, cx, cy = numbers
    made = bpy.data.cameras.new("camera")
    made.sensor_width, made.lens = 36, 36 * fx / width
    made.shift_x, made.shift_y = (width / 2 - cx) / width, (cy - height / 2) / width
    return bpy.data.objects.new("camera", made)


def mesh(data: np.lib.npyio.NpzFile) -> bpy.types.Mesh:
    made = bpy.data.meshes.new("target")
    made.from_pydata(data["points"].tolist(), [], data["faces"].tolist())
    material = bpy.data.materials.new("grey")
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (*data["colors"][0], 1)
    inputs["Metallic"].default_value, inputs["Roughness"].default_value = data["metal_rough"][0]
    made.materials.append(material)
    return made


def lamp(numbers: np.ndarray) -> bpy.types.Object:
    x, y, z, irradiance = numbers[:4]
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle = float(irradiance), 0.00925
    made = bpy.data.objects.new("sun", sun)
    made.rotation_mode = "QUATERNION"
    made.rotation_quaternion = mathutils.Vector((x, -y, -z)).to_track_quat("-Z", "Y")
    return made


def crop(scene: bpy.types.Scene, box: np.ndarray) -> None:
    x0, y0, x1, y1 = box
    render = scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = x0 / render.resolution_x, x1 / render.resolution_x
    render.border_min_y, render.border_max_y = 1 - y1 / render.resolution_y, 1 - y0 / render.resolution_y


def main() -> None:
    answers = os.fdopen(int(sys.argv[1]), "w", buffering=1)
    scene, target = build(sys.argv[2], int(sys.argv[4]))
    print(f"Blender {bpy.app.version_string}", file=answers)
    for i, line in enumerate(sys.stdin):
        numbers = np.array(line.split(), float)
        if sys.argv[5] == "box":
            crop(scene, numbers[12:])
        flip = np.diag([1.0, -1.0, -1.0])
        rotation = mathutils.Matrix((flip @ numbers[:9].reshape(3, 3)).tolist())
        target.rotation_quaternion, target.location = rotation.to_quaternion(), flip @ numbers[9:12]
        image = scene.render.image_settings
        image.media_type, image.file_format = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER"
        image.color_depth, image.exr_codec = "32", "ZIP"
        scene.render.filepath = os.path.join(sys.argv[3], f"{i:06d}.exr")
        bpy.ops.render.render(write_still=True)
        image.media_type, image.file_format = "IMAGE", "PNG"
        bpy.data.images["Render Result"].save_render(os.path.join(sys.argv[3], f"{i:06d}.png"))
        print("done", file=answers)
    os._exit(0)


if __name__ == "__main__":
    main()
