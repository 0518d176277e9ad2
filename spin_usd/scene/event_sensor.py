"""An event camera's pixels, by the parameters in the literature: threshold, speed and noise.

Sources: Lichtsteiner, Posch and Delbruck 2008 (the pixel); Hu, Liu and Delbruck 2021 (v2e: cutoff by light, leak, shot
noise); Joubert and others 2021 (IEBCS: latency, jitter, refractory time).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class EventSensor:
    """Parameters of all pixels; each has thresholds of its own.

    A pixel compares the logarithm of its photocurrent with the one at its last event. The current's unit is the unit
    range of the image: 1 is white.
    """

    threshold_on: float = 0.2
    """Rise of the natural logarithm of the light that makes an event."""
    threshold_off: float = 0.2
    """Fall of it that does."""
    threshold_spread: float = 0.0
    """Standard deviation of the thresholds from pixel to pixel, in the same unit."""
    dark: float = 1e-3
    """The dark current, which is added to the light's."""
    cutoff: float = 0.0
    """Hz: the corner frequency of the photoreceptor in white light; in other light it is proportional to the current. 0
    for one that follows at once."""
    leak: float = 0.0
    """Hz: rate of events of a rise that a pixel in constant light makes, but for those before which noise comes."""
    shot_noise: float = 0.0
    """Hz: rate of events that noise makes in a dark pixel, a half of each sign."""
    shot_noise_in_white: float = 0.25
    """The share of that rate that is left in white light; between it falls linearly with the light."""
    refractory: float = 0.0
    """Seconds after an event for which the pixel notices nothing."""
    latency: float = 0.0
    """Seconds from the change to its time stamp."""
    jitter: float = 0.0
    """Standard deviation of the time stamps, seconds."""


PRESETS: Mapping[str, EventSensor] = {
    "ideal": EventSensor(),
    "v2e_clean": EventSensor(threshold_spread=0.02),
    "v2e_noisy": EventSensor(threshold_spread=0.05, cutoff=30, leak=0.1, shot_noise=5),
    "evk4": EventSensor(
        threshold_on=math.log(1.25),
        threshold_off=math.log(1.25),
        threshold_spread=0.02,
        cutoff=1592,
        leak=0.1,
        shot_noise=0.02,
        shot_noise_in_white=1,
        refractory=50e-6,
        latency=100e-6,
        jitter=30e-6,
    ),
    "davis346": EventSensor(
        threshold_on=math.log(1.143),
        threshold_off=math.log(1.225),
        threshold_spread=0.035,
        cutoff=300,
        leak=0.1,
        shot_noise=0.1,
        latency=20e-6,
    ),
}
"""v2e_clean, v2e_noisy: v2e's settings of these names. evk4: Prophesee's EVK4 with Sony's IMX636: the nominal contrast
of 25 %, and otherwise IEBCS's proposal for such a camera at 1 klux: a time constant of 100 us, latency, jitter,
refractory time, background activity. davis346: iniVation's DAVIS346: contrasts of 14.3 % and 22.5 % and the latency, as
specified; the spread that Brandli and others (2014) measured for its predecessor; cutoff and noise are guesses."""
