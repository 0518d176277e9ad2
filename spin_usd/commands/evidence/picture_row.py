"""The child's part of a row of the table of pictures: values from the record, and from the image where it has none."""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray

from spin_usd.commands.evidence.calls import MeasureRow, PictureRow
from spin_usd.geometry.ellipsoid import rays_meet
from spin_usd.picture.kinds import IMAGE
from spin_usd.reading.description import read_description
from spin_usd.reading.measures import MEASURES
from spin_usd.reading.picture import Picture, read_picture
from spin_usd.reading.pictured_target import PicturedTarget
from spin_usd.realism.darkness import ROUNDING, shot_noise
from spin_usd.realism.picture_view import FULL, PictureView
from spin_usd.realism.signals import lit_background
from spin_usd.records.record import RecordedFile
from spin_usd.scene.derived import srgb
from spin_usd.scene.scene import Scene
from spin_usd.scene.sensor import LUMINANCE
from spin_usd.studio.open_stage import OpenStage
from spin_usd.studio.picture_request import PictureRequest

SEGMENTATION = "segmentation"
PHOTOGRAPH = "picture"
GRID = 65  # rays each way that look for a planet
LIT = 0.05  # share of the surroundings that is brighter than the dark, from which a planet is behind
LEAST_SIDE, LEAST_TARGET = 32, 16  # pixels that the measures of an image need


def picture_row(request: MeasureRow) -> PictureRow:
    """Return the row of a picture. Raises InputError for a record or an image that cannot be read, StageError."""
    root = Path(request.dataset)
    picture = read_picture(root, request.record, read_description(root))
    target, scene = picture.targets[0], _scene_of(picture)
    noise, background = _of_image(picture)
    x, y, z = (MEASURES[name].of(picture, target) for name in ("from_x", "from_y", "from_z"))
    box = target.box_amodal
    return PictureRow(
        name=picture.frame,
        variant=picture.variant,
        range=target.range,
        sun=_known(MEASURES["sun"].of(picture, target)),
        attitude=(x, y, z),
        roll=roll_of(target),
        visible=_known(target.visible_fraction),
        signal_to_noise=noise,
        background=background if scene is None or background == PHOTOGRAPH else background_of(scene),
        size=_known(max(box[2] - box[0], box[3] - box[1])),
        blur=0.0 if scene is not None and scene.shutter is None else blur_of(picture, target),
    )


@lru_cache(maxsize=1)
def _opened(stage: Path) -> OpenStage:
    return OpenStage(stage, check_images=False)


def _scene_of(picture: Picture) -> Scene | None:
    """Return the picture's scene; None of a dataset without its stage."""
    stage = picture.root / picture.recorded.provenance.stage.root
    if not stage.is_file():
        return None
    return _opened(stage).scene(PictureRequest(frame=picture.frame, variant=picture.variant))


def background_of(scene: Scene) -> str:
    """Return "planet" where one is in the view, lit or not, else "space"."""
    camera = scene.camera
    u, v = np.meshgrid(*(np.linspace(0, length, GRID) for length in (camera.width, camera.height)))
    rays = camera.rays(np.stack([u, v], -1).reshape(-1, 2))
    for planet in scene.environment.planets:
        pose = planet.T_cam_planet
        start, directions = -pose.rotation.T @ pose.translation, rays @ pose.rotation
        if rays_meet(np.array(planet.radii), start, directions).any():
            return "planet"
    return "space"


def roll_of(target: PicturedTarget) -> float:
    """Return the direction of the body's z axis in the image, degrees clockwise from up."""
    sight = target.t_cam_body / max(float(np.linalg.norm(target.t_cam_body)), 1e-30)
    axis = target.T_cam_body[:3, 2]
    across = axis - (axis @ sight) * sight
    return float(np.degrees(np.arctan2(across[0], -across[1])) % 360)


def blur_of(picture: Picture, target: PicturedTarget) -> float | None:
    """Return the blur by the recorded motion, 0 of a stage without motion; None without an image."""
    appearance, factor = picture.recorded.appearance, picture.recorded.provenance.auto_exposure
    if appearance is UNSET:
        return None
    if np.isnan(target.velocity).any():
        return 0.0
    corners = np.array([[x, y, z] for x in target.box[:, 0] for y in target.box[:, 1] for z in target.box[:, 2]])
    turned = corners @ target.T_cam_body[:3, :3].T
    speeds = target.velocity + np.cross(target.angular_velocity, turned)
    half = appearance.time * (1.0 if factor is UNSET else factor) / 2
    ends = [picture.camera.project(turned + target.t_cam_body + sign * half * speeds) for sign in (-1, 1)]
    ways = np.linalg.norm(ends[1] - ends[0], axis=1)
    return _known(float(np.nanmax(ways))) if np.isfinite(ways).any() else None


def _of_image(picture: Picture) -> tuple[float | None, str | None]:
    """Return the signal to noise and the background, as far as the picture has what they need."""
    appearance = picture.recorded.appearance
    if IMAGE not in picture.files:
        return None, None
    grey = linear_grey(picture.image, picture.recorded.files[IMAGE])
    behind = None if appearance is UNSET or appearance.background is UNSET else PHOTOGRAPH
    if SEGMENTATION not in picture.files or min(grey.shape) < LEAST_SIDE:
        return None, behind
    view = PictureView(grey=grey, parts=picture.segmentation)
    around = lit_background(view)
    behind = behind or (None if np.isnan(around) else "planet" if around > LIT else "space")
    return signal_to_noise(view), behind


def signal_to_noise(view: PictureView) -> float | None:
    """Return the median signal on the target over its noise; None of a target of few pixels."""
    if view.target.sum() < LEAST_TARGET:
        return None
    signal = max(float(np.median(view.target_signal)), 0.0)
    shot = float(np.nan_to_num(max(shot_noise(view.grey, view.darkness), 0.0)))
    return signal / float(np.sqrt(view.darkness.noise**2 + ROUNDING + shot * signal))


def linear_grey(image: NDArray[Any], file: RecordedFile) -> NDArray[np.float32]:
    """Return the linear luminance (H, W) of an image in steps of 8 bits."""
    share = image / np.iinfo(image.dtype).max
    if file.encoding == "srgb":
        share = srgb.decode(share)
    elif file.encoding == "gamma" and file.gamma is not UNSET:
        share = share**file.gamma
    return np.asarray(FULL * (share if share.ndim == 2 else share @ np.array(LUMINANCE)), np.float32)


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
