"""Pictures of the bundled Earth as it is seen from six heights."""

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import spin_usd
from environments.noise import Array
from environments.textures import write_image
from spin_usd.basics.resources import stages
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.background.sky import sky
from spin_usd.scene.derived import srgb
from spin_usd.scene.light import DistantLight
from spin_usd.scene.scene import Scene
from spin_usd.stage.read.stage_reader import StageReader

POSES = stages() / "examples" / "tango_speedplus_poses.json"
SIZE = 1920, 1200  # pixels, of the SPEED+ camera
CELL = 480, 300  # of the sheet
RADIUS = 6371e3
WHITE = 1361.0 * 0.75 / np.pi  # the radiance that is white


@dataclass(frozen=True, kw_only=True)
class View:
    """What is in the picture: the camera `height_km` above a place, turned `heading` from north to east and looking
    `down` below the horizontal, and the Sun `sun` from the zenith, `aside` of the view; degrees."""

    height_km: float
    down: float
    sun: float
    aside: float
    latitude: float
    longitude: float
    heading: float = 0.0


VIEWS = {
    "300_km_nadir": View(height_km=300, down=80, sun=50, aside=60, latitude=28, longitude=33),
    "400_km_limb": View(height_km=400, down=24, sun=55, aside=120, latitude=40, longitude=10),
    "800_km_glint": View(height_km=800, down=50, sun=40, aside=0, latitude=-10, longitude=-110),
    "700_km_terminator": View(height_km=700, down=28, sun=84, aside=50, latitude=20, longitude=100),
    "geostationary_disc": View(height_km=35786, down=90, sun=30, aside=50, latitude=0, longitude=-30),
    "500_km_afternoon": View(height_km=500, down=27, sun=65, aside=-60, latitude=32, longitude=12),
}


def write_sheet(path: Path) -> None:
    """Write all views as one JPEG, two rows of three."""
    with _earth() as earth:
        cells = [_reduced(_picture(earth, view)) for view in VIEWS.values()]
    rows = [np.concatenate(cells[start : start + 3], axis=1) for start in (0, 3)]
    write_image(path, np.concatenate(rows), quality=68)


def write_views(folder: Path) -> None:
    """Write each view as a PNG of a frame's size, into a folder that is made."""
    folder.mkdir(parents=True, exist_ok=True)
    with _earth() as earth:
        for name, view in VIEWS.items():
            write_image(folder / f"{name}.png", _picture(earth, view), quality=100)


def write_plates(folder: Path, views: Mapping[View, float], size: tuple[int, int]) -> None:
    """Write each view, grey, as bright as given, as a PNG of that size: encoded twice, so that a linear camera records
    it encoded."""
    factor = SIZE[0] // size[0]
    with _earth() as earth:
        for number, (view, bright) in enumerate(views.items()):
            grey = _picture(earth, view).reshape(size[1], factor, size[0], factor, 3).mean((1, 3, 4))[..., None]
            grey = srgb.encode(srgb.decode(grey) * bright)
            write_image(folder / f"earth_{number:03d}.png", srgb.encode(grey), quality=100)


@contextmanager
def _earth() -> Iterator[Scene]:
    """Yield a scene with the bundled Earth, as a stage with it is read, while its maps are there to be opened."""
    with tempfile.TemporaryDirectory() as folder:
        report = spin_usd.author(
            poses=POSES, target="cubesat", camera="speedplus", out=f"{folder}/stage", frames="0:1", environment="earth"
        )
        reader = StageReader(report.root)
        yield reader.scene(reader.frames[0])


def _picture(earth: Scene, view: View) -> Array:
    """Return (H, W, 3): code values from 0 to 1 of what a camera without noise sees."""
    frame = sky(_seen(earth, view), seed=0)
    assert frame is not None
    return np.asarray(srgb.encode(np.clip(frame.astype(float) / WHITE, 0, 1)))


def _seen(earth: Scene, view: View) -> Scene:
    """Return `earth` with planet and Sun placed so that the camera has the view."""
    latitude, longitude, heading, down, sun, aside = np.radians(
        [view.latitude, view.longitude, view.heading, view.down, view.sun, view.aside]
    )
    up = np.array([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)])
    east = np.array([-np.sin(longitude), np.cos(longitude), 0.0])
    level = np.cos(heading) * np.cross(up, east) + np.sin(heading) * east
    right, forward = np.cross(level, up), np.cos(down) * level - np.sin(down) * up
    rotation = np.stack([right, np.cross(forward, right), forward])
    (planet,) = earth.environment.planets
    place = Transform(
        to="cam", of="planet", rotation=rotation, translation=-rotation @ up * (RADIUS + view.height_km * 1e3)
    )
    to_sun = np.cos(sun) * up + np.sin(sun) * (np.cos(aside) * level + np.sin(aside) * right)
    x, y, z = rotation @ -to_sun
    light = DistantLight(path="/Sun", direction_cam=(x, y, z), irradiance=(1361.0,) * 3, angle=0.0093)
    environment = replace(earth.environment, planets=(replace(planet, T_cam_planet=place),))
    return replace(earth, environment=environment, lights=(light,))


def _reduced(picture: Array) -> Array:
    """Return the means of as many pixels as make a cell of the sheet."""
    factor = SIZE[0] // CELL[0]
    return np.asarray(picture.reshape(CELL[1], factor, CELL[0], factor, 3).mean((1, 3)))
