"""Complex indices of refraction n + i k of materials, at `WAVELENGTHS`.

Interpolated linearly from the tables of the refractiveindex.info database (M. N. Polyanskiy, Scientific Data 11, 94
(2024); public domain, CC0), of Kapton's k, which spans three decades, its logarithm. Each entry names its paper.
"""

from dataclasses import dataclass

import numpy as np

from materials.values import Array

WAVELENGTHS: Array = np.arange(400.0, 701.0, 25.0)  # nanometres


@dataclass(frozen=True, kw_only=True)
class OpticalConstants:
    """A material's n and k at `WAVELENGTHS`, and the paper that they are from."""

    n: tuple[float, ...]
    k: tuple[float, ...] = (0.0,) * len(WAVELENGTHS)
    paper: str

    @property
    def index(self) -> Array:
        """(W,) complex128."""
        made: Array = np.array(self.n) + 1j * np.array(self.k)
        return made


# fmt: off
ALUMINIUM = OpticalConstants(
    n=(0.4879, 0.5557, 0.6332, 0.7212, 0.8126, 0.9091, 1.015, 1.132, 1.262, 1.398, 1.558, 1.733, 1.921),
    k=(4.836, 5.146, 5.454, 5.756, 6.048, 6.339, 6.627, 6.910, 7.185, 7.457, 7.712, 7.937, 8.142),
    paper="Rakic, Applied Optics 34, 4755 (1995)",
)
SILVER = OpticalConstants(
    n=(0.05, 0.0432, 0.04, 0.05, 0.05, 0.05148, 0.05958, 0.05212, 0.05516, 0.05808, 0.05222, 0.04656, 0.041),
    k=(2.104, 2.402, 2.648, 2.902, 3.131, 3.363, 3.597, 3.800, 4.010, 4.216, 4.409, 4.605, 4.803),
    paper="Johnson and Christy, Physical Review B 6, 4370 (1972)",
)
GOLD = OpticalConstants(
    n=(1.468, 1.453, 1.383, 1.27, 0.9711, 0.5919, 0.4241, 0.3197, 0.2487, 0.1966, 0.1556, 0.1366, 0.131),
    k=(1.953, 1.951, 1.915, 1.847, 1.874, 2.136, 2.472, 2.777, 3.074, 3.354, 3.602, 3.837, 4.062),
    paper="Johnson and Christy, Physical Review B 6, 4370 (1972)",
)
COPPER = OpticalConstants(
    n=(1.313, 1.26, 1.24, 1.246, 1.213, 1.156, 1.007, 0.7678, 0.4937, 0.2846, 0.2378, 0.2166, 0.211),
    k=(2.131, 2.274, 2.393, 2.495, 2.571, 2.603, 2.582, 2.677, 2.962, 3.309, 3.626, 3.905, 4.159),
    paper="Johnson and Christy, Physical Review B 6, 4370 (1972)",
)
TITANIUM = OpticalConstants(
    n=(1.585, 1.642, 1.694, 1.740, 1.781, 1.820, 1.864, 1.914, 1.971, 2.033, 2.099, 2.167, 2.235),
    k=(1.755, 1.799, 1.847, 1.896, 1.949, 2.009, 2.074, 2.141, 2.207, 2.268, 2.324, 2.372, 2.413),
    paper="Palm, Murray, Narayan and Munday, ACS Photonics 5, 4677 (2018), an evaporated film",
)
NIOBIUM = OpticalConstants(
    n=(1.500, 1.685, 1.955, 2.015, 2.130, 2.208, 2.260, 2.290, 2.270, 2.277, 2.270, 2.240, 2.220),
    k=(2.990, 2.958, 2.990, 3.030, 3.070, 3.098, 3.160, 3.215, 3.250, 3.263, 3.330, 3.375, 3.410),
    paper="Golovashkin, Leksina, Motulevich and Shubin, Soviet Physics JETP 29, 27 (1969)",
)
STEEL = OpticalConstants(
    n=(1.525, 1.592, 1.678, 1.773, 1.864, 1.953, 2.044, 2.137, 2.232, 2.333, 2.440, 2.551, 2.662),
    k=(2.792, 2.957, 3.117, 3.265, 3.401, 3.535, 3.673, 3.816, 3.959, 4.072, 4.182, 4.293, 4.407),
    paper="Karlsson and Ribbing, Journal of Applied Physics 53, 6340 (1982), austenitic",
)
SILICON = OpticalConstants(
    n=(5.613, 5.034, 4.691, 4.458, 4.294, 4.172, 4.077, 4.002, 3.940, 3.889, 3.844, 3.806, 3.772),
    k=(0.296, 0.157, 0.0863, 0.05854, 0.04417, 0.03476, 0.02797, 0.02333, 0.01993, 0.01691, 0.01443, 0.01232, 0.01053),
    paper="Green, Solar Energy Materials and Solar Cells 92, 1305 (2008)",
)
TITANIA = OpticalConstants(
    n=(2.681, 2.605, 2.551, 2.512, 2.481, 2.456, 2.436, 2.419, 2.405, 2.393, 2.382, 2.373, 2.365),
    paper="Siefke and others, Advanced Optical Materials 4, 1780 (2016)",
)
KAPTON = OpticalConstants(
    n=(1.946, 1.915, 1.891, 1.870, 1.853, 1.839, 1.830, 1.822, 1.815, 1.809, 1.803, 1.799, 1.795),
    k=(0.0593, 0.0251, 0.00546, 0.00121, 6.94e-4, 3.86e-4, 2.14e-4, 1.43e-4, 1.14e-4, 9.36e-5, 7.86e-5, 6.90e-5,
       6.07e-5),
    paper="French and others, 34th IEEE Photovoltaic Specialists Conference, 394 (2009), below 480 nm k of Arakawa and "
    "others, Journal of Applied Physics 52, 3579 (1981)",
)
# fmt: on
NITRIDE = OpticalConstants(
    n=tuple(np.sqrt(1 + 2.8939 / (1 - (139.67 / WAVELENGTHS) ** 2)).tolist()),
    paper="Philipp, Journal of the Electrochemical Society 120, 295 (1973), by the formula of Baak, Applied Optics 21, "
    "1069 (1982)",
)
FUSED_SILICA = OpticalConstants(
    n=(1.458,) * len(WAVELENGTHS),
    paper="Malitson, Journal of the Optical Society of America 55, 1205 (1965), at 589 nm",
)
AIR: Array = np.ones(len(WAVELENGTHS), complex)
