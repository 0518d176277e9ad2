"""Print what we read of an authored stage as JSON: the target's bounds in metres, faces, and share of the frame.

Started by real_files.attempt as `ours.py FOLDER`, whose stage/ and dataset/ it reads. It also writes FOLDER/view.json,
which tells Blender where the camera and the Sun are.
"""

import json
import sys
from pathlib import Path

import numpy as np
import OpenImageIO

from spin_usd.scene.light import DistantLight
from spin_usd.stage.read.stage_reader import StageReader


def main() -> None:
    folder = Path(sys.argv[1])
    reader = StageReader(folder / "stage" / "dataset.usda")
    scene = reader.scene(reader.frames[0])
    mesh, camera = scene.target.mesh, scene.camera
    sun = next(light for light in scene.lights if isinstance(light, DistantLight))
    points = mesh.points[np.unique(mesh.faces)]
    view = {
        "size": [camera.width, camera.height],
        "focal_px": camera.fx,
        "rotation": scene.T_cam_body.rotation.tolist(),
        "translation": scene.T_cam_body.translation.tolist(),
        "sun_direction": list(sun.direction_cam),
        "irradiance": float(sun.irradiance[0]),
        "angle": sun.angle,
    }
    (folder / "view.json").write_text(json.dumps(view))
    parts = OpenImageIO.ImageBuf(str(folder / "dataset" / "segmentation" / "nominal" / "picture.png"))
    share = float(np.mean(np.asarray(parts.get_pixels(OpenImageIO.FLOAT)) > 0)) if parts.initialized else None
    bounds = [points.min(0).tolist(), points.max(0).tolist()]
    print(json.dumps({"ours": {"bounds": bounds, "faces": len(mesh.faces), "share": share}}))


if __name__ == "__main__":
    main()
