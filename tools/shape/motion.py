"""Structure from motion by COLMAP: the cameras and a cloud of points, from the pictures alone."""

import shutil
from pathlib import Path

import numpy as np
import pycolmap

from shape.exported import Exported, Floats, camera_of, write_cloud
from spin_usd.exchange.layout.true_shape import FOLDER, read_shape_truth

LEAST_TRACK = 3  # pictures in which a point must be found
MAX_ERROR = 2.0  # pixels
MODELS = {5: "OPENCV", 4: "OPENCV_FISHEYE"}


def reconstruct(export: Exported, out: Path) -> Path | None:
    """Write the points of the largest model in the folder `out`, laid by its cameras; None where there is no model."""
    work = out / "colmap"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    first = camera_of(export.views[0])
    numbers = [first.fx, first.fy, first.cx, first.cy, *first.distortion[:4]]  # k3 is not COLMAP's
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model, reader.camera_params = MODELS[len(first.distortion)], ",".join(map(repr, numbers))
    if export.masked:
        for view in export.views:
            (work / "masks").mkdir(exist_ok=True)
            shutil.copy(export.folder / str(view.mask), work / "masks" / f"{Path(view.image).name}.png")
        reader.mask_path = work / "masks"
    database, images = work / "database.db", export.folder / "images"
    pycolmap.set_random_seed(0)
    single = pycolmap.CameraMode.SINGLE
    pycolmap.extract_features(database, images, camera_mode=single, reader_options=reader)
    pycolmap.match_exhaustive(database)
    models = pycolmap.incremental_mapping(database, images, work)
    if not models:
        return None
    model = max(models.values(), key=lambda each: each.num_reg_images())
    kept = [p.xyz for p in model.points3D.values() if p.track.length() >= LEAST_TRACK and p.error <= MAX_ERROR]
    path = out / "motion.ply"
    centres = {each.name: each.projection_center() for each in model.images.values()}
    write_cloud(path, laid_by_cameras(np.array(kept, float).reshape(-1, 3), centres, export))
    print(f"COLMAP placed {model.num_reg_images()} of {len(export.views)} pictures, {len(kept)} points")
    return path


def laid_by_cameras(points: Floats, centres: dict[str, Floats], export: Exported) -> Floats:
    """The points (N, 3) in body axes, metres, by the similarity that lays the cameras' centres on the true ones: as
    benchmarks do for a scoring that the points' own sparseness does not disturb. Source: Umeyama 1991.

    This is for scoring alone: the reconstruction itself knows nothing of the truth.
    """
    truth, _ = read_shape_truth(export.folder / FOLDER)
    poses = {Path(each.image).name: np.array(each.T_cam_body) for each in truth.pictures}
    own = np.array(list(centres.values()))
    true = np.array([np.linalg.inv(poses[name])[:3, 3] for name in centres])
    a, b = own - own.mean(0), true - true.mean(0)
    U, sizes, Vt = np.linalg.svd(b.T @ a)
    flip = np.array([1, 1, np.linalg.det(U @ Vt)])
    scale, turn = (sizes * flip).sum() / (a * a).sum(), U * flip @ Vt
    moved: Floats = scale * (points - own.mean(0)) @ turn.T + true.mean(0)
    return moved
