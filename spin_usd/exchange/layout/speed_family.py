"""What SPEED, SPEED+ and SHIRT share: camera.json, and the entry of a pose."""

from typing import Any

from spin_usd.exchange.layout.exported_dataset import ExportedDataset
from spin_usd.exchange.layout.exported_picture import ExportedPicture
from spin_usd.exchange.layout.index_file import write_json_file
from spin_usd.exchange.layout.output import MadeFile
from spin_usd.formats.camera_file import camera_document

POSE_CONVENTIONS = (
    "p_cam = R(q) p_body + r: q is the unit quaternion, scalar first, Hamilton, of the rotation from the body's axes "
    "to the camera's; r is the body's origin in the camera's axes, in metres. Numbers have all their digits.",
    "Camera axes are OpenCV's: x right, y down, z forward. Body axes are those of the target's model.",
    "camera.json: cameraMatrix in pixels, (0, 0) being the corner of the image as in SPEED+ (cx = width / 2 is its "
    "middle); distCoeffs are k1, k2, p1, p2, k3 of OpenCV; fx and fy there are metres, cameraMatrix times the pixel "
    "pitch ppx, for which the pitch of SPEED+'s camera is taken.",
)


def camera_file(dataset: ExportedDataset) -> MadeFile:
    """Return camera.json."""
    return MadeFile(path="camera.json", write=write_json_file(camera_document(dataset.camera)))


def pose_row(picture: ExportedPicture, filename: str, quaternion: str) -> dict[str, Any]:
    """Return the entry of a list of poses; `quaternion` is the key that the set gives it."""
    target = picture.target
    return {
        "filename": filename,
        quaternion: target.q_cam_body.tolist(),
        "r_Vo2To_vbs_true": target.t_cam_body.tolist(),
    }
