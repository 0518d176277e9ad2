"""A pose from keypoints found in a picture: EPnP within RANSAC, then refined on the points that agree; lens included.

Sources: Lepetit et al. 2009 (EPnP), Fischler and Bolles 1981 (RANSAC), as OpenCV has them.
"""

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import quaternion_from_matrix

LEAST = 5  # points at least, from which OpenCV's RANSAC makes an EPnP
AGREES = 0.01  # of the picture's width: how far a point may be off and still agree
TRIES, CONFIDENCE = 1000, 0.9999
SEED = 0  # so that the same points give the same pose


def pose_from_keypoints(points: Float, pixels: Float, camera: Camera) -> tuple[Float, Float] | None:
    """Return q_cam_body (4,), scalar first, and t_cam_body (3,), metres; None where no pose puts enough of the points
    before the camera and near their pixels.

    Args:
        points: (K, 3) in the body's axes, metres.
        pixels: (K, 2) where each was found, (0, 0) being the image's corner.
    """
    import cv2  # not above: it is slow to load

    if len(points) < LEAST:
        return None
    if camera.fisheye:  # OpenCV solves for the other lens alone: each pixel is moved to where a pinhole has it
        xy, there = camera.normalised_where_seen(np.asarray(pixels, np.float64))
        points, pixels, camera = points[there], camera.pinhole.pixels(xy[there]), camera.pinhole
        if len(points) < LEAST:
            return None
    points, lens = np.ascontiguousarray(points), np.array(camera.distortion)
    # The same half pixel in pixels and in cx and cy: OpenCV's formulas hold as they are.
    pixels = np.ascontiguousarray(pixels, np.float64)
    cv2.setRNGSeed(SEED)
    try:
        found, turn, t, agreeing = cv2.solvePnPRansac(
            points,
            pixels,
            camera.matrix,
            lens,
            iterationsCount=TRIES,
            reprojectionError=AGREES * camera.width,
            confidence=CONFIDENCE,
            flags=cv2.SOLVEPNP_EPNP,
        )
        if not found or agreeing is None:
            return None
        near = agreeing.ravel()
        turn, t = cv2.solvePnPRefineLM(points[near], pixels[near], camera.matrix, lens, turn, t)
        matrix = np.asarray(cv2.Rodrigues(turn)[0], np.float64)
    except cv2.error:  # of points that lie in a line, or all in one place
        return None
    if not (np.isfinite(matrix).all() and np.isfinite(t).all() and t[2, 0] > 0):
        return None
    return quaternion_from_matrix(_orthonormal(matrix)), np.asarray(t.ravel())


def _orthonormal(matrix: Float) -> Float:
    u, _, v = np.linalg.svd(matrix)
    return np.asarray(u @ v)
