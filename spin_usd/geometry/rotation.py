"""Rotations: unit quaternions (scalar first, Hamilton) and 3x3 matrices, active, double precision.

Source: J. Diebel, "Representing Attitude" (2006); the matrix to quaternion branch choice is Shepperd's (1978).
"""

from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spin_usd.basics.arrays import Float, finite
from spin_usd.errors import GeometryError

Real = TypeVar("Real", np.float32, np.float64)

# Six-decimal label files (SPEED+ synthetic) hold quaternions whose norm is off by at most 1e-6 (half a unit in
# the last place, four components); a norm further off is another rotation, not a rounded one.
QUATERNION_NORM_TOLERANCE = 1e-5
QUATERNION_NORM_ROUNDED = 1e-3  # off a norm of 1, as three decimals leave a quaternion: one that people write
ORTHONORMAL_TOLERANCE = 1e-9
FEW = 9  # coordinates, up to which plain numbers are faster than arrays


def unit_quaternion(q: ArrayLike) -> Float:
    """Return the unit quaternion (4,) along `q`, scalar first.

    Raises GeometryError for NaN, zero, or a norm off 1 by more than QUATERNION_NORM_TOLERANCE.
    """
    values = finite(q, (4,), "quaternion")
    norm = float(np.linalg.norm(values))
    if norm == 0:
        raise GeometryError("quaternion is zero, which is not a rotation")
    if abs(norm - 1) > QUATERNION_NORM_TOLERANCE:
        raise GeometryError(f"quaternion has norm {norm:.9g}, expected 1", do="normalise it")
    return values / norm


def matrix_from_quaternion(q: ArrayLike) -> Float:
    """Rotation matrix (3, 3) of the unit quaternion `q` (4,), scalar first."""
    return matrices_from_quaternions(unit_quaternion(q))


def matrices_from_quaternions(q: Float) -> Float:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4), scalar first, which must be of unit length: they are not
    checked."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return np.moveaxis(rows, (0, 1), (-2, -1))


def quaternion_from_matrix(rotation: ArrayLike) -> Float:
    """Unit quaternion (4,), scalar first and not negative, of the rotation matrix (3, 3)."""
    r = check_rotation(rotation)
    trace = np.trace(r)
    # Four times the squares of w, x, y, z: divide by the largest, which is never small.
    squares = np.array([1 + trace, *(1 + 2 * np.diag(r) - trace)])
    i = int(np.argmax(squares))
    rows = (
        (squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]),
        (r[2, 1] - r[1, 2], squares[1], r[1, 0] + r[0, 1], r[0, 2] + r[2, 0]),
        (r[0, 2] - r[2, 0], r[1, 0] + r[0, 1], squares[2], r[2, 1] + r[1, 2]),
        (r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[2, 1] + r[1, 2], squares[3]),
    )
    q = np.array(rows[i])
    q /= np.linalg.norm(q)
    return -q if q[0] < 0 else q


def product(matrix: NDArray[Real], vectors: NDArray[Real]) -> NDArray[Real]:
    """Return (..., 3) `matrix` (3, 3) times each of the `vectors` (..., 3), with the same bits on all processors.

    BLAS, behind `@`, fuses and orders its additions as its kernels for a processor do; what decides labels must not.
    """
    if vectors.size <= FEW and matrix.dtype == vectors.dtype == np.float64:
        return _product_of_few(matrix, vectors)
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    found = np.empty(vectors.shape, vectors.dtype)
    for i, (a, b, c) in enumerate(matrix.tolist()):
        found[..., i] = a * x + b * y + c * z
    return found


def _product_of_few(matrix: NDArray[Real], vectors: NDArray[Real]) -> NDArray[Real]:
    """Return what `product` does, of float64: plain numbers are rounded like those of arrays."""
    rows = matrix.tolist()
    found = [[a * x + b * y + c * z for a, b, c in rows] for x, y, z in vectors.reshape(-1, 3).tolist()]
    return np.array(found, vectors.dtype).reshape(vectors.shape)


def turn_between(start: ArrayLike, end: ArrayLike, share: float) -> Float:
    """Rotation matrix (3, 3) that is `share` of the way from `start` to `end` (3, 3), by the shorter way, at a steady
    rate; shares beyond 0 and 1 turn on."""
    first = check_rotation(start)
    w, *xyz = quaternion_from_matrix(first.T @ check_rotation(end))
    sine = float(np.linalg.norm(xyz))
    half_angle = share * np.arctan2(sine, w)
    axis = np.array(xyz) / sine if sine else np.zeros(3)
    turn: Float = first @ matrix_from_quaternion([np.cos(half_angle), *(np.sin(half_angle) * axis)])
    return turn


def check_rotation(rotation: ArrayLike) -> Float:
    """`rotation` as (3, 3) float64, or GeometryError when it is not orthonormal and right-handed."""
    r = finite(rotation, (3, 3), "rotation")
    off, right_handed = off_rotation(r)
    if off > ORTHONORMAL_TOLERANCE or not right_handed:
        raise GeometryError(f"rotation is not orthonormal and right-handed (off by {off:.3g})")
    return r


def off_rotation(matrix: Float) -> tuple[float, bool]:
    """Return the most by which the rows of `matrix` (3, 3) miss being orthonormal, and whether they are
    right-handed."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()  # plain numbers: every pose of every picture is looked at
    lengths = (a * a + b * b + c * c - 1, d * d + e * e + f * f - 1, g * g + h * h + i * i - 1)
    angles = (a * d + b * e + c * f, d * g + e * h + f * i, g * a + h * b + i * c)
    off = max(map(abs, (*lengths, *angles)))
    return off, a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) >= 0
