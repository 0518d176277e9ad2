"""Settings of the optics, which spread light, and of the detector, which turns it into an image."""

from dataclasses import dataclass, field

from spin_usd.scene.content import ADDED
from spin_usd.scene.texture import Color

# Luminance of linear RGB with Rec. 709 primaries: ITU-R BT.709-6, item 3.2.
LUMINANCE = (0.2126, 0.7152, 0.0722)


@dataclass(frozen=True, kw_only=True)
class Optics:
    """Effects of lens and housing on light, in pixels of the detector; none by default.

    Glare is a wide halo, whose profile is (1 + (r / glare_core)^2) ** (-glare_falloff / 2) at r pixels. Bloom is an
    artist's glow, to match other simulators.
    """

    psf_sigma: float = 0.0
    """Standard deviation of the Gaussian core of the point spread function."""
    glare: float = 0.0
    """Share of all light that is scattered into the halo."""
    glare_core: float = 4.0
    glare_falloff: float = 3.0
    """Above 2: a halo that falls off slower holds infinite energy."""
    bloom_intensity: float = 0.0
    """The share 2 ** `bloom_intensity` - 1 of that light is spread."""
    bloom_scatter: float = 0.7
    """How wide it is spread, 0 to 1."""
    bloom_threshold: float = 1.0
    """The light above this blooms (unit range, linear)."""
    cos_fourth: bool = False
    """Natural vignetting."""
    vignetting: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """(a, b, c): gain 1 + a r^2 + b r^4 + c r^6, r from the principal point in half diagonals of the frame."""


@dataclass(frozen=True, kw_only=True)
class AutoExposure:
    """Metering on the target: its mean signal is brought to `level` (unit range), by a longer or shorter time: a factor
    of at least 2 ** `stops[0]` and at most 2 ** `stops[1]`."""

    level: float = 0.4
    stops: tuple[float, float] = (-10.0, 10.0)


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Settings that turn radiance into numbers.

    The unit range is the signal's: 1 is the ADC's full scale.
    """

    exposure: float = 1.0
    """Factor from radiance (W/m2/sr) to the unit range."""
    time: float = 0.01
    """Seconds."""
    iso: float = 100.0
    """In ISO's numbers."""
    auto_exposure: AutoExposure | None = None
    """The metering; None for a given exposure."""
    channels: str = "mono"
    """"mono" or "rgb"; mono adds red, green and blue by `panchromatic`."""
    quantum_efficiency: Color = (1.0, 1.0, 1.0)
    """Shares of the red, green and blue light that are detected."""
    panchromatic: Color = LUMINANCE
    """Weights by which a mono sensor adds red, green and blue."""
    gain: float = 0.0
    """Electrons per step of the ADC at ISO 100; 0 for a detector without noise or steps."""
    full_well: float = 0.0
    """Electrons that a pixel holds at most; 0 for any number."""
    read_noise: float = 0.0
    """Its standard deviation, electrons; 0 for none."""
    dark_current: float = 0.0
    """Electrons per second."""
    prnu: float = 0.0
    """Standard deviation of the pixels' relative gain."""
    pattern_seed: int = 0
    """The seed of the pattern of those gains, which is sampled once for all pictures."""
    adc_bits: int = 12
    """Bits of the ADC."""
    black_level: float = 0.0
    """Steps of the ADC that are added to the signal."""
    contrast: float = 1.0
    """Exponent of the linear signal about mid-grey."""
    saturation: float = 1.0
    """Factor on each colour's distance from its luminance."""
    filter: Color = (1.0, 1.0, 1.0)
    """Factors on red, green and blue."""
    encoding: str = "srgb"
    """The transfer curve of the written numbers: "linear", "srgb", or "gamma"."""
    gamma: float = 2.2
    """Degree of the root that the encoding "gamma" takes."""
    bit_depth: int = 8
    """Bits of the written numbers, 8 or 16."""
    jpeg_quality: int = field(default=0, metadata=ADDED)
    """Quality of the JPEG that the numbers pass through, 1 to 100, without chroma subsampling; 0 for none. Its loss
    stays in the image, whatever format the file has."""
