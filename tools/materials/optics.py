"""What the formulas of optics say that surfaces reflect: (..., W) at the wavelengths of the constants, or as colours.

Cosines are of the angle of incidence, outside. Sources: Born and Wolf, Principles of Optics, chapters 1.5, 1.6 and 14.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from scipy.optimize import minimize_scalar

from materials.optical_constants import AIR, WAVELENGTHS
from materials.values import Array, Colour

ANGLES = (0.0, 30.0, 60.0)  # degrees, at which Schlick's formula is fitted
Reflectance: TypeAlias = Callable[[float], Array]
"""From the cosine of the angle of incidence to a linear colour (3,): what a smooth surface reflects of it."""

# The daylight D65, relative. Source: CIE 15:2004, table T.1; linear between its values 10 nm apart.
D65 = (82.75, 90.06, 117.01, 115.39, 109.35, 106.24, 104.05, 96.06, 90.01, 85.49, 80.03, 80.28, 71.61)
TO_RGB = np.linalg.inv([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])  # IEC 61966-2-1


def colour(spectrum: Array) -> Array:
    """Linear Rec. 709 (3,) of a reflectance (W,) in daylight D65; that of a perfect mirror is 1."""
    fine = np.arange(WAVELENGTHS[0], WAVELENGTHS[-1] + 1, 5.0)
    light = np.interp(fine, WAVELENGTHS, D65) * _matching(fine)
    seen, white = (TO_RGB @ (light @ values) for values in (np.interp(fine, WAVELENGTHS, spectrum), np.ones(len(fine))))
    return np.clip(seen / white, 0, 1)


def _matching(wavelengths: Array) -> Array:
    """Colour matching functions (3, W) of CIE 1931. Source: Wyman, Sloan and Shirley, Journal of Computer Graphics
    Techniques 2(2), 1 (2013), the fit by several lobes."""

    def lobe(height: float, middle: float, below: float, above: float) -> Array:
        away = (wavelengths - middle) * np.where(wavelengths < middle, below, above)
        return np.asarray(height * np.exp(-0.5 * away**2))

    x = lobe(0.362, 442.0, 0.0624, 0.0374) + lobe(1.056, 599.8, 0.0264, 0.0323) + lobe(-0.065, 501.1, 0.0490, 0.0382)
    y = lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322)
    z = lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725)
    return np.stack([x, y, z])


def fresnel(index: Array | complex, cosine: float) -> Array:
    """The unpolarised reflectance of a surface in vacuum."""
    return np.asarray(np.mean([np.abs(r) ** 2 for r in _amplitudes(AIR, index, _sine(cosine) * AIR)], axis=0))


def film(outside: Array, coating: Array, below: Array, thickness: float, cosine: float) -> Array:
    """The unpolarised reflectance of a thin film, `thickness` nanometres, in which light interferes. `cosine` is in
    `outside`."""
    sine = _sine(cosine) * outside
    phase = 2 * np.pi * coating * np.sqrt(1 - (sine / coating) ** 2) * thickness / WAVELENGTHS
    upper, lower = _amplitudes(outside, coating, sine), _amplitudes(coating, below, sine)
    turn = np.exp(2j * phase)
    each = [np.abs((r + s * turn) / (1 + r * s * turn)) ** 2 for r, s in zip(upper, lower, strict=True)]
    return np.asarray(np.mean(each, axis=0))


def slab(sheet: Array, below: Array, thickness: float, cosine: float) -> Array:
    """The unpolarised reflectance of a thick sheet, `thickness` nanometres, on a metal: too thick to interfere."""
    sine = _sine(cosine) * AIR.real
    within = np.sqrt(1 - (sine / sheet.real) ** 2)
    twice = np.exp(-8 * np.pi * sheet.imag * thickness / WAVELENGTHS / within)
    upper, lower = _amplitudes(AIR, sheet.real, sine), _amplitudes(sheet.real, below, sine)
    each = [_incoherent(abs(r) ** 2, abs(s) ** 2, twice) for r, s in zip(upper, lower, strict=True)]
    return np.asarray(np.mean(each, axis=0))


def quarter_wave(coating: Array, wavelength: float) -> float:
    """The thickness in nanometres that reflects least at that wavelength."""
    return wavelength / 4 / float(np.interp(wavelength, WAVELENGTHS, coating.real))


def schlick(head_on: Array | float, cosine: float) -> Array:
    """What UsdPreviewSurface's metal reflects. Source: Schlick, Computer Graphics Forum 13, 233 (1994)."""
    return np.asarray(head_on + (1 - np.asarray(head_on)) * (1 - cosine) ** 5)


def head_on(reflectance: Reflectance) -> Colour:
    """The colour by which Schlick's formula has the least greatest relative error at `ANGLES`; three decimals."""
    exact = np.stack([reflectance(np.cos(np.radians(angle))) for angle in ANGLES])
    found = [
        minimize_scalar(lambda f0, wanted=wanted: _worst(f0, wanted), bounds=(0, 1), options={"xatol": 1e-6}).x
        for wanted in exact.T
    ]
    r, g, b = (round(float(each), 3) for each in found)
    return r, g, b


def fit_errors(reflectance: Reflectance, chosen: Colour) -> tuple[float, float]:
    """The greatest error of Schlick's formula at `ANGLES`, over the colours: of the light that arrives, and relative to
    what is reflected of it."""
    exact = np.stack([reflectance(np.cos(np.radians(angle))) for angle in ANGLES])
    fitted = np.stack([schlick(np.array(chosen), np.cos(np.radians(angle))) for angle in ANGLES])
    return float(np.abs(fitted - exact).max()), float(np.abs(fitted / exact - 1).max())


def _worst(f0: float, exact: Array) -> float:
    fitted = np.array([schlick(f0, np.cos(np.radians(angle))) for angle in ANGLES])
    return float(np.abs(fitted / np.maximum(exact, 1e-3) - 1).max())


def _incoherent(upper: Array, lower: Array, twice: Array) -> Array:
    return np.asarray(upper + (1 - upper) ** 2 * lower * twice / (1 - upper * lower * twice))


def _sine(cosine: float) -> float:
    return float(np.sqrt(max(0.0, 1 - cosine**2)))


def _amplitudes(outside: Array, index: Array | complex, sine: Array) -> tuple[Array, Array]:
    """Fresnel's of both polarisations; `sine` is the index times the sine, which is the same in all layers."""
    near = np.sqrt(1 - (sine / outside.astype(complex)) ** 2)
    far = np.sqrt(1 - (sine / np.asarray(index, complex)) ** 2)
    across = (outside * near - index * far) / (outside * near + index * far)
    along = (index * near - outside * far) / (index * near + outside * far)
    return np.asarray(across), np.asarray(along)
