"""What the materials' surfaces reflect, as functions of the cosine of the angle of incidence, and their colours."""

import numpy as np

from materials import optical_constants as constants
from materials.optical_constants import AIR, OpticalConstants
from materials.optics import Reflectance, colour, film, fresnel, head_on, quarter_wave, slab
from materials.values import Array, Colour

GLASS_INDEX = AIR * 1.5
KAPTON_THICKNESS, TAPE_THICKNESS, SILICA_THICKNESS = 25_400.0, 50_800.0, 150_000.0  # nanometres: 1 mil, 2 mil, 0.15 mm
COATED_AT = 600.0  # nanometres, the wavelength at which a cell's coating reflects least
COATING_SPREAD = (0.9, 0.95, 1.0, 1.05, 1.1)  # thicknesses over a cell, of the mean (ours)
LENS_COATED_AT = 550.0  # nanometres
MAGNESIUM_FLUORIDE, CROWN_GLASS = AIR * 1.38, AIR * 1.52
OXIDE_INDEX = AIR * 2.3  # niobium pentoxide's, about
COMPOSITE = 0.05  # what black carbon composite reflects diffusely (ours)


def metal(of: OpticalConstants) -> Reflectance:
    """A polished metal."""
    return lambda cosine: colour(fresnel(of.index, cosine))


def on_metal(sheet: OpticalConstants, below: OpticalConstants, thickness: float) -> Reflectance:
    """A metal behind a sheet."""
    return lambda cosine: colour(slab(sheet.index, below.index, thickness, cosine))


def dielectric(ior: float, body: Colour) -> Reflectance:
    """A dielectric over what its body scatters: Fresnel's share, and of the rest the body's colour."""

    def reflectance(cosine: float) -> Array:
        first = float(fresnel(ior, cosine)[0]) if ior > 1 else 0.0
        return first + (1 - first) * np.array(body)

    return reflectance


def coated(below: Reflectance) -> Reflectance:
    """A clearcoat of index 1.5 over a surface."""

    def reflectance(cosine: float) -> Array:
        first = float(fresnel(1.5, cosine)[0])
        return np.asarray(first + (1 - first) * below(cosine))

    return reflectance


def scaled(by: float, of: Reflectance) -> Reflectance:
    """A share of it."""
    return lambda cosine: by * of(cosine)


def uniform(body: Colour) -> Reflectance:
    """The same at all angles."""
    return lambda cosine: np.array(body)


def body_for(absorptance: float, ior: float, tint: Colour = (1.0, 1.0, 1.0)) -> Colour:
    """The body's colour of a dielectric that absorbs this share of light at normal incidence; `tint` has the mean 1."""
    first = ((ior - 1) / (ior + 1)) ** 2
    return tuple_of((1 - absorptance - first) / (1 - first) * np.array(tint))


def oxide(below: Array, thickness: float) -> Colour:
    """A metal under its oxide, head-on."""
    return tuple_of(colour(film(AIR, OXIDE_INDEX, below, thickness, 1.0)))


def tuple_of(colour: Array) -> Colour:
    """Four decimals."""
    r, g, b = np.round(colour, 4).tolist()
    return r, g, b


def _cell(outside: Array, coating: OpticalConstants) -> Colour:
    """Silicon under a coating that is a quarter of a wave, head-on, over the spread of thicknesses."""
    depth = quarter_wave(coating.index, COATED_AT)
    made = [colour(film(outside, coating.index, constants.SILICON.index, depth * part, 1.0)) for part in COATING_SPREAD]
    return tuple_of(np.mean(made, axis=0))


def _below_kapton(body: float) -> Colour:
    """What scatters `body` under a film of Kapton, through which light goes twice."""
    depth = 4 * np.pi * constants.KAPTON.index.imag * KAPTON_THICKNESS / constants.WAVELENGTHS
    return tuple_of(colour(body * np.exp(-2 * depth)))


CELL = _cell(GLASS_INDEX, constants.TITANIA)
CELL_BARE = _cell(AIR, constants.NITRIDE)
PRINTED_SHARE = 0.6  # of what silver reflects: bars and fingers of cells are porous (ours)
PRINTED = tuple_of(PRINTED_SHARE * np.array(head_on(metal(constants.SILVER))))
BETWEEN_CELLS = _below_kapton(COMPOSITE)
_LENS = film(AIR, MAGNESIUM_FLUORIDE, CROWN_GLASS, quarter_wave(MAGNESIUM_FLUORIDE, LENS_COATED_AT), 1.0)
_ROOT = float(np.sqrt(colour(_LENS).mean()))
LENS_IOR = round((1 + _ROOT) / (1 - _ROOT), 3)  # the index that reflects as much as the coated lens, head-on
