"""Pictures that show little: nearly black, nearly white, or at an end of auto-exposure."""

from collections.abc import Iterator, Mapping

import numpy as np
from msgspec import UNSET

from spin_usd.records.record import Record
from spin_usd.scene.derived.sunlight import phase_angle
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.sensor.exposure import LONGEST

MIN_SHOWN = 0.25  # of the target's pixels: a picture that shows fewer is nearly black, or nearly white
MAX_PHASE_DEG = 90.0  # a Sun further from the camera lights less than half of the visible side
BLACK, WHITE, EXPOSURE_END = "nearly_black", "nearly_white", "exposure_end"
WORDS = {BLACK: "nearly black", WHITE: "nearly white", EXPOSURE_END: "at an end of auto-exposure"}


def faults(record: Record) -> tuple[str, ...]:
    """Return the faults that the picture of the `record` has."""
    tones = record.tones
    if tones is UNSET:
        return ()
    found = {
        BLACK: tones.dark > 1 - MIN_SHOWN,
        WHITE: tones.saturated > 1 - MIN_SHOWN,
        EXPOSURE_END: tones.exposure_end is not UNSET,
    }
    return tuple(fault for fault, there in found.items() if there)


def tone_findings(record: Record, name: str) -> Iterator[Finding]:
    """Yield a warning for each fault, with its remedy; `name` is the record's."""
    for fault in faults(record):
        message = f"is {WORDS[fault]}: {_why(fault, record)}"
        yield Finding(code=fault.replace("_", "-"), where=name, message=message, severity=WARNING)


def counted_faults(counts: Mapping[str, int], pictures: int) -> str:
    """Return a sentence's part on how many of all pictures have each fault; "" if none has one."""
    return ", ".join(f"{count} of {pictures} {WORDS[fault]}" for fault, count in counts.items() if count)


def _why(fault: str, record: Record) -> str:
    tones = record.tones
    assert tones is not UNSET, "it has a fault"
    less, more = "lower the light or the exposure (exposure.stops)", "raise the light or the exposure (exposure.stops)"
    if fault == BLACK:
        few = f"only {1 - tones.dark:.0%} of the target's pixels are brighter than 1/64 of full scale and the noise"
        return f"{few}; {_more_sun(record) or more}"
    if fault == WHITE:
        return f"{tones.saturated:.0%} of the target's pixels are saturated; {less}"
    end = tones.exposure_end
    do = more if end == LONGEST else less
    return (
        f"the {end} time that it may take leaves it more than a stop off; {do}, or widen spin:sensor:autoExposure:stops"
    )


def _more_sun(record: Record) -> str:
    """Return the remedy if the Sun is the cause, else ""."""
    sun = record.sun
    if sun is UNSET:
        return "there is no distant light: add one, or raise the others"
    if sun.obscured == 1:
        return "a planet hides the Sun: move it (limb_from_sun_deg), or raise the other lights"
    phase = phase_angle(np.array(sun.towards_cam), np.array(record.pose.t_cam_body))
    if phase > MAX_PHASE_DEG:
        return f"the Sun is {phase:.0f} degrees from the camera, seen from the target: bring it nearer (target_lit_deg)"
    return ""
