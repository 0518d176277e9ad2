"""What the look `mockup` paints on flat faces: the panel's cells, and folds in the film of the walls; 8-bit.

Images are (H, W, C) float64 in 0 to 1, the top row first; st (0, 0) is the lower left corner.
"""

import numpy as np
from materials.values import Array

from tango import dimensions as d

PAINT, CELL, WIRE = 0.35, 0.014, 0.95  # albedo of plates, of a cell, and of the wires between two rows
PANEL_SIZE = (2 * d.X, 2 * d.PANEL_Y)
PANEL_PIXEL, FINE = 0.00125, 5  # metres, and how many parts of a pixel along each axis are averaged
FILM_PIXEL = 0.005
FILM_LEVELS = 16  # of slopes: few, so that the file is small
FILM_ORIGIN = {"-y": (0.38, 0.01), "+y": (0.38, 0.33), "-z": (0.38, 0.92)}
"""Where the origin of each wall's own coordinates (x and z, below x and y) lies on the film, st in metres."""
FILM_SIZE = (0.76, 1.24)

# Folds as they lie in the pictures, from end to end, in the walls' own coordinates.
Fold = tuple[float, float, float, float]
FOLDS: dict[str, tuple[Fold, ...]] = {
    "+y": (
        (0.337, 0.262, 0.299, 0.156),
        (0.287, 0.257, 0.221, 0.114),
        (0.213, 0.268, 0.213, 0.174),
        (-0.048, 0.253, 0.013, 0.182),
        (0.000, 0.207, -0.180, 0.170),
        (-0.180, 0.170, -0.304, 0.117),
        (-0.244, 0.253, -0.349, 0.084),
        (-0.331, 0.260, -0.345, 0.180),
        (-0.123, 0.100, -0.259, 0.016),
        (0.254, 0.084, 0.201, 0.016),
    ),
    "-y": (
        (-0.338, 0.255, -0.227, 0.215),
        (-0.227, 0.215, -0.056, 0.274),
        (-0.338, 0.176, -0.188, 0.169),
        (-0.148, 0.176, -0.043, 0.202),
        (0.088, 0.137, 0.226, 0.146),
        (0.095, 0.169, 0.219, 0.183),
        (0.062, 0.196, 0.147, 0.235),
        (0.095, 0.104, 0.246, 0.104),
        (0.193, 0.261, 0.240, 0.202),
        (0.240, 0.202, 0.324, 0.215),
        (-0.128, 0.032, -0.056, 0.058),
        (-0.056, 0.058, 0.062, 0.025),
    ),
    "-z": (
        (-0.302, 0.185, -0.188, 0.079),
        (0.229, 0.209, 0.294, -0.011),
        (-0.237, -0.190, -0.033, -0.250),
        (0.163, -0.150, 0.171, -0.250),
        (0.073, -0.250, 0.171, -0.190),
        (0.286, -0.133, 0.352, -0.052),
        (0.180, 0.290, 0.205, 0.200),
        (-0.220, 0.080, -0.245, 0.010),
    ),
}


def mockup_panel() -> Array:
    """The panel from above, linear: dark cells with two cropped corners, and bright wires between the rows."""
    step = PANEL_PIXEL / FINE
    x, y = (np.arange(round(size / step)) * step + step / 2 - size / 2 for size in PANEL_SIZE)
    plan = np.full((len(y), len(x)), PAINT)
    for left, right, up in d.MOCKUP_FIELDS:
        low, high = d.MOCKUP_FIELD_Y
        pitch = (right - left) / d.MOCKUP_COLUMNS, (high - low) / d.MOCKUP_ROWS
        on = np.outer((y > low) & (y < high), (x > left) & (x < right))
        a, b = np.abs((x - left) % pitch[0] - pitch[0] / 2), up * ((y - low) % pitch[1] - pitch[1] / 2)
        from_side, from_end = pitch[0] / 2 - d.MOCKUP_GAP / 2 - a, pitch[1] / 2 - d.MOCKUP_GAP / 2 - np.abs(b)
        cropped = from_side + (pitch[1] / 2 - d.MOCKUP_GAP / 2 - b)[:, None] < d.MOCKUP_CROP
        cell = (from_side > 0) & (from_end[:, None] > 0) & ~cropped
        wire = (from_side > d.MOCKUP_CROP) & (from_end[:, None] < 0)
        plan = np.where(on & cell, CELL, np.where(on & wire, WIRE, plan))
    rows, columns = len(y) // FINE, len(x) // FINE
    fine = plan.reshape(rows, FINE, columns, FINE).mean(axis=(1, 3))
    return np.asarray(fine[::-1, :, None])


def mockup_film_normal() -> Array:
    """The film, taut and flat but for its folds, which stand out as ridges; as tangent-space normals."""
    s, t = (np.arange(round(size / FILM_PIXEL)) * FILM_PIXEL + FILM_PIXEL / 2 for size in FILM_SIZE)
    slopes = np.zeros((len(t), len(s), 2))
    for wall, folds in FOLDS.items():
        for fold in folds:
            slopes += _ridge(np.stack(np.meshgrid(s, t), axis=-1), np.array(fold).reshape(2, 2) + FILM_ORIGIN[wall])
    slopes = np.round(slopes * FILM_LEVELS * 2) / (FILM_LEVELS * 2)
    normal = np.concatenate([-slopes, np.ones((*slopes.shape[:2], 1))], axis=-1)
    return np.asarray(0.5 + 0.5 * (normal / np.linalg.norm(normal, axis=-1, keepdims=True))[::-1])


def _ridge(at: Array, ends: Array) -> Array:
    """Slopes (H, W, 2) along s and t of one ridge, which flattens out towards its ends."""
    length = np.linalg.norm(ends[1] - ends[0])
    along = (ends[1] - ends[0]) / length
    across = np.array([-along[1], along[0]])
    u, v = (at - ends[0]) @ along / length, (at - ends[0]) @ across / d.MOCKUP_FOLD_WIDTH
    taper = np.where((u > 0) & (u < 1), np.sin(np.pi * np.clip(u, 0, 1)) ** 0.5, 0.0)
    steep = -v * np.exp(-(v**2) / 2) * taper * d.MOCKUP_FOLD_HEIGHT / d.MOCKUP_FOLD_WIDTH
    return np.asarray(steep[..., None] * across)
