"""The camera of a calibration in any of the formats of the table."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from spin_usd.errors import GeometryError, InputError
from spin_usd.exchange.cameras.camera_format import CENTRE, CORNER, CameraFile
from spin_usd.exchange.table import CAMERA_FORMATS, CAMERA_HEAD, recognised, refuse_of_other_option
from spin_usd.geometry.camera import Camera

BENT = 3.0  # scale of corners, beyond which coefficients are probably wrong
WIDE_DEG = 110.0  # field of view, beyond which polynomials of a pinhole's tangent fit badly
LIKE = {CENTRE: "(0, 0), as OpenCV counts: half a pixel is added", CORNER: "(0.5, 0.5), as here: they stay"}


def read_camera(path: str | Path) -> CameraFile:
    """Read the camera of the file at `path`. Raises InputError that names the file and the missing value."""
    path = Path(path)
    found, _ = recognised(path, CAMERA_FORMATS, CAMERA_HEAD)
    try:
        said, shift = found.read(path), CORNER - found.first_centre
    except InputError:
        refuse_of_other_option(path, found)
        raise
    fx, fy, cx, cy = said.projection
    try:
        camera = Camera(
            width=said.size[0],
            height=said.size[1],
            fx=fx,
            fy=fy,
            cx=cx + shift,
            cy=cy + shift,
            distortion=said.distortion,
        )
        camera.check_invertible()
    except GeometryError as error:
        raise InputError(error.found, where=path, do=error.do) from None
    read = f"is read as {found.name}, {lens_in_words(camera)}: its cx and cy, {cx:.9g} and {cy:.9g},"
    notes = [f"{read} have the first pixel's centre at {LIKE[found.first_centre]}", *said.notes]
    if camera.looks_past_frame:
        size, point = f"{camera.width} x {camera.height}", f"({camera.cx:g}, {camera.cy:g})"
        aside = f"has its principal point {point} outside its picture of {size} pixels"
        notes.append(f"{aside}: check that this is the size of the calibration")
    notes += _odd_lens(camera)
    if camera.blind(camera.frame) is not None:
        notes.append("sees more than half a turn in its corners; directions beyond are black, and 0 in labels")
    sentences = tuple(f"{path.name} {note}" for note in notes)
    return CameraFile(camera=camera, pixel_pitch=said.pixel_pitch, source=str(path), notes=sentences)


def _odd_lens(camera: Camera) -> Iterator[str]:
    """Yield what coefficients of another unit, or of a lens too wide for its model, do to the edge of the picture."""
    if camera.fisheye:
        return
    edge, straight = (np.linalg.norm(each.normalised(camera.rim(1)), axis=1) for each in (camera, camera.pinhole))
    bend = float((straight / edge).max())
    if bend > BENT or bend < 1 / BENT:
        yield f"has distortion that scales its corners by {bend:.3g}: check its coefficients"
    if (angle := 2 * np.degrees(np.arctan(edge.max()))) > WIDE_DEG:
        yield f"sees {angle:.0f} degrees from corner to corner as a pinhole: a fisheye's model fits such a lens better"


def lens_in_words(camera: Camera) -> str:
    """Return the kind of the camera's lens."""
    return "a fisheye" if camera.fisheye else "a pinhole with distortion" if camera.distorted else "a pinhole"
