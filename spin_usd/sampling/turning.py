"""Torque-free turning: of a body of revolution in closed form, of any body by integration."""

import math
from collections.abc import Callable
from typing import Annotated, ClassVar

import numpy as np
from msgspec import Meta, Struct, field
from numpy.typing import ArrayLike

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.rotation import matrices_from_quaternions, matrix_from_quaternion
from spin_usd.sampling.distribution import Distribution, Vector
from spin_usd.sampling.poses import number
from spin_usd.sampling.sample import AnyDistribution

RELATIVE = 1e-12  # of the integrator, a step; energy then keeps to 1e-10 over a thousand radians
STEADY = 1e-14  # relative: a body that turns about a principal axis turns steadily


class Spin(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Torque-free rotation of a body of revolution, in the axes of the orbit."""

    degrees: Annotated[AnyDistribution, Meta(description="From picture to picture, degrees.")]
    axis: Annotated[AnyDistribution, Meta(description="About which axis of the body at the start.")]
    symmetry: Annotated[Vector, Meta(description="The axis of a body of revolution, body frame.")] = (0.0, 0.0, 1.0)
    inertia: Annotated[
        float,
        Meta(gt=0, le=2, description="The moment of inertia about that axis over the one across; 1 turns steadily."),
    ] = 1.0
    inertial: ClassVar = False

    def turns(self, rng: np.random.Generator, times: Float) -> Float:
        """Return R_start_body (N, 3, 3) at the times (N) of the pictures."""
        rate = _rate(self.axis, self.degrees, rng)
        return torque_free(rate, self.symmetry, self.inertia, np.arange(len(times)))


Inertia = Annotated[
    tuple[float | Vector, float | Vector, float | Vector],
    Meta(description="The tensor of inertia about the centre of mass, body axes, as three rows; or its diagonal."),
]


class Tumble(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Torque-free rotation of a rigid body relative to the stars."""

    rate: Annotated[AnyDistribution, Meta(description="At the start, degrees a second.")] = field(name="rate_deg_s")
    axis: Annotated[AnyDistribution, Meta(description="About which axis of the body at the start.")]
    inertia: Inertia = field(name="inertia_kg_m2")
    inertial: ClassVar = True

    def __post_init__(self) -> None:
        tensor_of(self.inertia)

    def turns(self, rng: np.random.Generator, times: Float) -> Float:
        """Return R_start_body (N, 3, 3) at the times (N), seconds."""
        rate = _rate(self.axis, self.rate, rng)
        return matrices_from_quaternions(tumbled(rate, tensor_of(self.inertia), times))


def tensor_of(inertia: Inertia) -> Float:
    """Return the tensor of inertia (3, 3). Raises InputError for one that no body has: each of its principal moments is
    positive, and at most the sum of the other two."""
    if len({isinstance(each, tuple) for each in inertia}) > 1:
        raise InputError("inertia_kg_m2 mixes numbers and rows", do="give three rows of three, or the diagonal")
    given = np.array(inertia, np.float64)
    tensor = np.diag(given) if given.ndim == 1 else given
    if not np.array_equal(tensor, tensor.T):
        raise InputError("inertia_kg_m2 is not symmetric", do="give a tensor of inertia, or its diagonal")
    moments = np.linalg.eigvalsh(tensor)
    if not (moments[0] > 0 and moments[2] <= (moments[0] + moments[1]) * (1 + 1e-9)):
        found = f"has the principal moments {', '.join(f'{moment:g}' for moment in moments)}, which no body has"
        do = "make them positive, and none larger than the sum of the others"
        raise InputError(f"inertia_kg_m2 {found}", do=do)
    return tensor


def _rate(axis: Distribution, degrees: Distribution, rng: np.random.Generator) -> Float:
    """Return a sampled angular velocity (3,), body frame, in radians."""
    about = np.array(axis.sample(rng), np.float64)
    rate: Float = math.radians(number(degrees, rng)) * about / np.linalg.norm(about)
    return rate


def torque_free(rate: Float, symmetry: ArrayLike, inertia: float, times: ArrayLike) -> Float:
    """R_start_body (N, 3, 3) at the times (N) of a body of revolution whose angular velocity at the time 0 is `rate`
    (3,), body frame: it turns about its axis while that precesses about the angular momentum, both steadily.

    Source: H. Goldstein, "Classical Mechanics", chapter 5 (the force-free symmetric top).
    """
    axis = np.asarray(symmetry, np.float64) / np.linalg.norm(symmetry)
    about = float(rate @ axis)
    momentum = rate + (inertia - 1) * about * axis  # over the moment across
    return np.array([turn(momentum * time) @ turn((1 - inertia) * about * axis * time) for time in np.asarray(times)])


def tumbled(rate: Float, inertia: Float, times: Float) -> Float:
    """Return q_start_body (N, 4), unit quaternions, at the times (N), ascending, of a rigid body without torques.

    The attitude alone is integrated: the angular momentum is constant in space, so the body's own rate follows from
    where the body points (L. D. Landau and E. M. Lifshitz, "Mechanics", paragraph 36), and momentum is kept exactly.

    Args:
        rate: (3,): its angular velocity at the time 0, body frame.
        inertia: (3, 3): its tensor, body frame.
    """
    from scipy.integrate import solve_ivp

    momentum = inertia @ rate
    speed = float(np.linalg.norm(rate))
    if float(np.linalg.norm(np.cross(rate, momentum))) <= STEADY * speed * float(np.linalg.norm(momentum)):
        return np.array([_quaternion(rate * time) for time in times])
    change = _attitude_rate(np.linalg.inv(inertia) / speed, momentum)
    angles = speed * times  # time in radians of the first rate: steps have the same size for slow and fast bodies
    start = np.array([1.0, 0, 0, 0])
    found = solve_ivp(
        change, (0.0, float(angles[-1]) or 1.0), start, method="DOP853", t_eval=angles, rtol=RELATIVE, atol=RELATIVE
    ).y.T
    unit: Float = found / np.linalg.norm(found, axis=1, keepdims=True)
    return unit


def _attitude_rate(inverse: Float, momentum: Float) -> Callable[[float, Float], tuple[float, ...]]:
    """Return the function of a time and q_start_body (4,) that gives the derivative of that; in plain numbers, for it
    is called often."""
    (a, b, c), (_, e, f), (_, _, i) = (inverse / 2).tolist()  # symmetric; half, as the derivative is q rate / 2
    mx, my, mz = momentum.tolist()

    def change(_: float, q: Float) -> tuple[float, ...]:
        w, x, y, z = q.tolist()
        tx, ty, tz = my * z - mz * y, mz * x - mx * z, mx * y - my * x  # momentum x (x, y, z)
        twice = 2 / (w * w + x * x + y * y + z * z)
        px = mx + twice * (w * tx + ty * z - tz * y)  # the momentum in body axes
        py = my + twice * (w * ty + tz * x - tx * z)
        pz = mz + twice * (w * tz + tx * y - ty * x)
        rx, ry, rz = a * px + b * py + c * pz, b * px + e * py + f * pz, c * px + f * py + i * pz
        return (
            -x * rx - y * ry - z * rz,
            w * rx + y * rz - z * ry,
            w * ry + z * rx - x * rz,
            w * rz + x * ry - y * rx,
        )

    return change


def turn(vector: Float) -> Float:
    """Return the rotation (3, 3) about `vector` (3,) by its length, radians."""
    return matrix_from_quaternion(_quaternion(vector))


def _quaternion(vector: Float) -> Float:
    """Return the unit quaternion (4,) of the rotation about `vector` (3,) by its length, radians."""
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle else np.zeros(3)
    return np.array([math.cos(angle / 2), *(math.sin(angle / 2) * axis)])
