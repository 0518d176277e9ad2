"""Settings of the optics, which spread light, and of the detector, which turns it into an image."""

from dataclasses import dataclass

from spin_usd.scene.texture import Color

# Luminance of linear RGB with Rec. 709 primaries: ITU-R BT.709-6, item 3.2.
LUMINANCE = (0.2126, 0.7152, 0.0722)


@dataclass(frozen=True, kw_only=True)
class Optics:
    """Effects of lens and housing on light, in pixels of the detector; none by default.

    psf_sigma: standard deviation of the Gaussian core of the point spread function.
    glare: share of all light that is scattered into a wide halo, whose profile is (1 + (r / glare_core)^2) **
    (-glare_falloff / 2) at r pixels. glare_falloff is above 2: a halo that falls off slower holds infinite energy.
    bloom_*: an artist's glow, to match other simulators: of the light above `bloom_threshold` (unit range, linear) the
    share 2 ** `bloom_intensity` - 1 is spread as wide as `bloom_scatter` (0 to 1) says.
    cos_fourth: natural vignetting. vignetting (a, b, c): gain 1 + a r^2 + b r^4 + c r^6, r from the principal point in
    half diagonals of the frame.
    """

    psf_sigma: float = 0.0
    glare: float = 0.0
    glare_core: float = 4.0
    glare_falloff: float = 3.0
    bloom_intensity: float = 0.0
    bloom_scatter: float = 0.7
    bloom_threshold: float = 1.0
    cos_fourth: bool = False
    vignetting: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class AutoExposure:
    """Metering on the target: its mean signal is brought to `level` (unit range), by a longer or shorter time: a factor
    of at least 2 ** `stops[0]` and at most 2 ** `stops[1]`."""

    level: float = 0.4
    stops: tuple[float, float] = (-10.0, 10.0)


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Settings by which radiance becomes numbers. The unit range is that of the signal: its 1 is the ADC's full scale.

    exposure: factor from radiance (W/m2/sr) to the unit range. time: seconds. iso: in ISO's numbers. auto_exposure: the
    metering; None for an exposure as it is given. channels: "mono" or "rgb"; mono adds red, green and blue by
    `panchromatic`. quantum_efficiency: shares of the red, green and blue light that are detected. panchromatic: weights
    by which a mono sensor adds red, green and blue. gain: electrons per step of the ADC at ISO 100; 0 for a detector
    without noise or steps. full_well: electrons that a pixel holds at most; 0 for any number. read_noise: its standard
    deviation, electrons; 0 for none. dark_current: electrons per second. prnu: standard deviation of the pixels'
    relative gain. pattern_seed: the seed of the pattern of those gains, which is sampled once for all pictures.
    adc_bits: bits of the ADC. black_level: steps of the ADC that are added to the signal. contrast: exponent of the
    linear signal about mid-grey. saturation: factor on each colour's distance from its luminance. filter: factors on
    red, green and blue. encoding: the transfer curve of the written numbers: "linear", "srgb", or "gamma". gamma: what
    the encoding "gamma" takes the root of. bit_depth: bits of the written numbers, 8 or 16.
    """

    exposure: float = 1.0
    time: float = 0.01
    iso: float = 100.0
    auto_exposure: AutoExposure | None = None
    channels: str = "mono"
    quantum_efficiency: Color = (1.0, 1.0, 1.0)
    panchromatic: Color = LUMINANCE
    gain: float = 0.0
    full_well: float = 0.0
    read_noise: float = 0.0
    dark_current: float = 0.0
    prnu: float = 0.0
    pattern_seed: int = 0
    adc_bits: int = 12
    black_level: float = 0.0
    contrast: float = 1.0
    saturation: float = 1.0
    filter: Color = (1.0, 1.0, 1.0)
    encoding: str = "srgb"
    gamma: float = 2.2
    bit_depth: int = 8
