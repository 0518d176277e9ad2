"""The child's part of scoring a shape: it reads the mesh, lays it on the truth, and measures it.

Points of a mesh, and starts of an alignment, are drawn from one seed: equal files have equal scores.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray

from spin_usd.basics.progress import Progress
from spin_usd.commands.score.shape_report import ScoredAlignment, ScoredPart, ScoredViews, ScoreShape, ShapeReport
from spin_usd.errors import InputError
from spin_usd.exchange.layout.true_shape import COUNT, MESH, ShapeTruth, TruePoints, read_shape_truth
from spin_usd.files.folder import Folder
from spin_usd.files.size_limits import MAX_ARRAY
from spin_usd.files.user_file import names_in
from spin_usd.formats.image_file import decoded_image
from spin_usd.formats.mesh.shape_file import read_shape
from spin_usd.geometry.triangles import areas
from spin_usd.scoring.shape_alignment import Similarity, aligned
from spin_usd.scoring.shape_errors import ShapeErrors, picture_errors, shape_errors, share_within
from spin_usd.scoring.shape_surface import ScoredSurface

SEED = 0
THRESHOLD = 0.01  # of the diameter
NONE, RIGID, SIMILARITY = "none", "rigid", "similarity"
IMAGES = (".png", ".jpg", ".jpeg")


def score_shape(request: ScoreShape, progress: Progress) -> ShapeReport:
    """Score the request's shape. Raises InputError for files that are missing, damaged or hold no shape."""
    truth, points = read_shape_truth(Path(request.truth))
    found = read_surface(Path(request.shape))
    mode = request.align or (NONE if truth.poses else SIMILARITY)
    progress(f"aligning: {mode}, step", 0, 3)
    move = _alignment(found, points, mode, request.shape)
    progress("measuring distances: step", 1, 3)
    surface = read_surface(Path(request.truth, MESH))
    errors = shape_errors(found.moved(*move), surface, points.points, points.normals)
    progress("comparing views: step", 2, 3)
    views = UNSET if request.views is None else _views(Path(request.views), Path(request.truth).parent, truth)
    across, threshold = truth.shape.diameter, truth.shape.diameter * THRESHOLD
    return ShapeReport(
        shape=request.shape,
        truth=request.truth,
        target=truth.target,
        diameter=across,
        alignment=ScoredAlignment(mode=mode, scale=move.scale, R=move.R.tolist(), t=move.t.tolist()),
        chamfer_m=errors.chamfer,
        chamfer_percent=100 * errors.chamfer / across,
        accuracy_m=float(errors.accuracy.mean()),
        completeness_m=float(errors.completeness.mean()),
        threshold_m=threshold,
        precision=share_within(errors.accuracy, threshold),
        recall=share_within(errors.completeness, threshold),
        f_score=errors.f_score(threshold),
        normal_consistency=UNSET if errors.agreement is None else min(errors.agreement, 1.0),
        parts=[*_parts(errors, points, truth, threshold)],
        views=views,
        notes=[],
    )


def read_surface(path: Path) -> ScoredSurface:
    """Return the surface in a file, a mesh with COUNT points of it, a cloud with at most as many. Raises InputError."""
    corners, points, normals = read_shape(path)
    rng = np.random.default_rng(SEED)
    if corners is None:
        assert points is not None
        chosen = np.sort(rng.permutation(len(points))[:COUNT])
        return ScoredSurface(points=points[chosen], normals=None if normals is None else normals[chosen])
    if not areas(corners).sum() > 0:
        raise InputError("has only faces without area", where=path, do="give a mesh with a surface")
    return ScoredSurface.of_triangles(corners, COUNT, rng)


def _alignment(found: ScoredSurface, truth: TruePoints, mode: str, where: str) -> Similarity:
    if mode == NONE:
        return Similarity(1.0, np.eye(3), np.zeros(3))
    rng = np.random.default_rng(SEED)
    move = aligned(found.points, truth.points, truth.normals, scaled=mode == SIMILARITY, rng=rng)
    if move is None:
        raise InputError("has no extent to align by", where=where, do="give more points, or --align none")
    return move


def _parts(errors: ShapeErrors, points: TruePoints, truth: ShapeTruth, threshold: float) -> Iterator[ScoredPart]:
    """Yield each part that can be seen."""
    for number, name in truth.shape.parts.items():
        own = errors.completeness[points.parts == int(number)]
        if len(own):
            mean, within = float(own.mean()), share_within(own, threshold)
            yield ScoredPart(name=name, points=len(own), completeness_m=mean, recall=within)


def _views(folder: Path, export: Path, truth: ShapeTruth) -> ScoredViews:
    """Return the errors of the views in the `folder`, which are called as pictures of the `export`. Raises InputError
    where there is none, and for one of another size."""
    held = {Path(name).stem: name for name in names_in(folder) if Path(name).suffix.lower() in IMAGES}
    rows = []
    for picture in truth.pictures:
        if picture.name in held:
            files = ((folder, held[picture.name]), (export, picture.image), (export, picture.mask))
            view, image, mask = (_image(Folder(root), name) for root, name in files)
            view, image = _alike(view, image, folder / held[picture.name])
            if mask.any():
                rows.append(picture_errors(view, image, mask[..., 0] > 0))
    if not rows:
        do = f"name views after pictures, such as {truth.pictures[0].name}.png"
        raise InputError("has no view of a picture that shows the target", where=folder, do=do)
    psnr, ssim = np.mean(rows, axis=0).tolist()
    return ScoredViews(pictures=len(rows), psnr=psnr if np.isfinite(psnr) else UNSET, ssim=ssim)


def _image(folder: Folder, name: str) -> NDArray[np.uint8]:
    """Return (H, W, C) of an image of 8 bits. Raises InputError."""
    with folder.open(name, MAX_ARRAY) as file:
        image, _ = decoded_image(file, folder.root / name)
    if image.dtype != np.uint8:
        raise InputError("does not have 8 bits", where=folder.root / name, do="write it as PNG or JPEG of 8 bits")
    return image.reshape(*image.shape[:2], -1)[..., :3]


def _alike(view: NDArray[np.uint8], image: NDArray[np.uint8], where: Path) -> tuple[NDArray[np.uint8], ...]:
    """Return both (H, W, C) with as many channels, grey ones repeated. Raises InputError for other sizes."""
    if view.shape[:2] != image.shape[:2]:
        found = f"is {view.shape[1]} x {view.shape[0]} pixels, and its picture {image.shape[1]} x {image.shape[0]}"
        raise InputError(found, where=where, do="render it with the camera of frames.json")
    channels = max(view.shape[2], image.shape[2])
    return tuple(np.repeat(each, channels // each.shape[2], axis=2) for each in (view, image))
