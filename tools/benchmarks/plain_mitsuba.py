"""The same picture by Mitsuba 3: path tracer, depth, position and shape index, one multilayer EXR and a PNG.

Started by benchmarks.peers, which says what it is told and what it answers; its fifth argument, `frame` or `box`, says
whether it renders the whole frame or the target's box alone, and the sixth is Mitsuba's variant.
The target stays, camera and Sun move round it, so that nothing is built again. No distortion, as plain_bpy.py.
"""

import os
import sys
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

BOUNCES = 4


def build(data: dict[str, np.ndarray]) -> Any:
    tracer = {"type": "path", "max_depth": BOUNCES + 1, "hide_emitters": True}
    layers = {"type": "aov", "aovs": "z:depth,position:position,shape:shape_index", "tracer": tracer}
    scene = {"type": "scene", "integrator": layers, **meshes(data)}
    for i, sun in enumerate(data["suns"]):
        irradiance = {"type": "rgb", "value": sun[3:].tolist()}
        scene[f"sun{i}"] = {"type": "directional", "direction": [0, 0, 1], "irradiance": irradiance}
    if data["around"].size:
        scene["around"] = {"type": "envmap", "bitmap": mi.Bitmap(data["around"].astype(np.float32))}
    return mi.load_dict(scene)


def meshes(data: dict[str, np.ndarray]) -> dict[str, Any]:
    """Return the target's faces, one mesh for each material."""
    found = {}
    for i, (color, (metallic, roughness)) in enumerate(zip(data["colors"], data["metal_rough"], strict=True)):
        faces = data["faces"][data["face_material"] == i]
        if len(faces):
            material = {"type": "principled", "metallic": float(metallic), "roughness": float(roughness)}
            material["base_color"] = {"type": "rgb", "value": np.clip(color, 0, 1).tolist()}
            found[f"mesh{i}"] = mesh(data["points"], faces, {"type": "twosided", "bsdf": material})
    return found


def mesh(points: np.ndarray, faces: np.ndarray, material: dict[str, Any]) -> Any:
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(material)
    used, corners = np.unique(faces, return_inverse=True)
    made = mi.Mesh("target", len(used), len(faces), has_vertex_normals=False, props=properties)
    values = mi.traverse(made)
    values["vertex_positions"] = points[used].astype(np.float32).ravel()
    values["faces"] = corners.astype(np.uint32).ravel()
    values.update()
    return made


def sensor(data: dict[str, np.ndarray], rotation: np.ndarray, translation: np.ndarray, box: np.ndarray) -> Any:
    """Return a camera at the OpenCV pose from body to camera, in body axes, whose film is the box of pixels."""
    width, height, fx, cx, cy = data["camera"]
    to_world = np.eye(4)
    to_world[:3, :3] = rotation.T @ np.diag([-1, -1, 1])  # Mitsuba's x points left, its y up
    to_world[:3, 3] = -rotation.T @ translation
    return mi.load_dict(
        {
            "type": "perspective",
            "fov_axis": "x",
            "fov": float(np.degrees(2 * np.arctan(width / 2 / fx))),
            "principal_point_offset_x": float((cx - width / 2) / width),
            "principal_point_offset_y": float((cy - height / 2) / height),
            "near_clip": 0.01,
            "to_world": mi.ScalarAffineTransform4f(to_world.tolist()),
            "film": film(int(width), int(height), box),
        }
    )


def film(width: int, height: int, box: np.ndarray) -> dict[str, Any]:
    x0, y0, x1, y1 = (int(side) for side in box)
    return {
        "type": "hdrfilm",
        "width": width,
        "height": height,
        "crop_offset_x": x0,
        "crop_offset_y": y0,
        "crop_width": x1 - x0,
        "crop_height": y1 - y0,
        "pixel_format": "rgba",
        "rfilter": {"type": "box"},
    }


def along(direction: np.ndarray) -> np.ndarray:
    """Return (4, 4), a turn of the z axis to `direction`."""
    across = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    across /= np.linalg.norm(across)
    turn = np.eye(4)
    turn[:3, :3] = np.stack([across, np.cross(direction, across), direction], -1)
    return turn


def turn(lights: Any, data: dict[str, np.ndarray], rotation: np.ndarray) -> None:
    """Turn all light with the camera round the target, by the rotation from body to OpenCV camera."""
    for i, sun in enumerate(data["suns"]):
        lights[f"sun{i}.to_world"] = mi.AffineTransform4f(along(rotation.T @ sun[:3]).tolist())
    if data["around"].size:
        to_world = np.eye(4)
        to_world[:3, :3] = rotation.T @ data["turn_around"] @ np.diag([-1, 1, -1])  # Mitsuba begins behind
        lights["around.to_world"] = mi.AffineTransform4f(to_world.tolist())
    lights.update()


def main() -> None:
    answers = os.fdopen(int(sys.argv[1]), "w", buffering=1)
    mi.set_variant(sys.argv[6])
    dr.set_thread_count(len(os.sched_getaffinity(0)))
    data = dict(np.load(sys.argv[2]))
    scene, cropped = build(data), sys.argv[5] == "box"
    lights = mi.traverse(scene)
    width, height = data["camera"][:2]
    print(f"Mitsuba {mi.__version__} {sys.argv[6]}", file=answers)
    for i, line in enumerate(sys.stdin):
        numbers = np.array(line.split(), float)
        rotation, translation = numbers[:9].reshape(3, 3), numbers[9:12]
        samples, seed = (int(number) for number in (numbers[16:] if len(numbers) > 16 else (int(sys.argv[4]), 0)))
        turn(lights, data, rotation)
        box = numbers[12:16] if cropped else np.array([0, 0, width, height])
        picture = mi.render(scene, sensor=sensor(data, rotation, translation, box), spp=samples, seed=seed)
        mi.util.write_bitmap(os.path.join(sys.argv[3], f"{i:06d}.exr"), picture, write_async=False)
        mi.util.write_bitmap(os.path.join(sys.argv[3], f"{i:06d}.png"), picture[..., :3], write_async=False)
        print("done", file=answers)
    os._exit(0)


if __name__ == "__main__":
    main()
