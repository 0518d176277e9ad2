"""Poses that have times, with the rates of a smooth motion through them."""

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.motion import fitted_rates
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.scene.poses import PoseList


def smooth_poses(poses: PoseList, times: Float | None) -> PoseList:
    """Return the `poses` at the `times` (N,) with fitted rates, and a note on the fit; unchanged if they have rates or
    there are no times."""
    if times is None or len(times) < 2 or poses.velocities is not None:
        return poses
    fit = fitted_rates(times, matrices_from_quaternions(poses.q_cam_body), poses.t_cam_body)
    name = poses.source or "the pose list"
    if fit is None:
        said = f"{name}: its poses are too few, or do not follow one another smoothly: pictures have no motion blur"
        return poses.with_rates(None, None, said)
    said = f"{name}: between its poses the target moves by splines through them"
    if fit.missed or fit.missed_rad:
        off = f"{fit.missed:.2g} m and {np.degrees(fit.missed_rad):.2g} degrees"
        said += f"; splines through every other pose miss those left out by at most {off}"
    return poses.with_rates(fit.velocities, fit.rates, said)
