"""Pictures that show little: nearly black, nearly white, or at an end of auto-exposure."""

from collections.abc import Iterator, Mapping
from typing import Any

from spin_usd.scene.finding import WARNING, Finding
from spin_usd.sensor.exposure import LONGEST

MIN_SHOWN = 0.25  # of the target's pixels: a picture that shows fewer is nearly black, or nearly white
BLACK, WHITE, EXPOSURE_END = "nearly_black", "nearly_white", "exposure_end"
WORDS = {BLACK: "nearly black", WHITE: "nearly white", EXPOSURE_END: "at an end of auto-exposure"}


def faults(record: Mapping[str, Any]) -> tuple[str, ...]:
    """Which of the three the picture of the `record` is."""
    tones = record.get("tones") or {}
    found = {
        BLACK: tones.get("dark", 0) > 1 - MIN_SHOWN,
        WHITE: tones.get("saturated", 0) > 1 - MIN_SHOWN,
        EXPOSURE_END: "exposure_end" in tones,
    }
    return tuple(fault for fault, there in found.items() if there)


def tone_findings(record: Mapping[str, Any], name: str) -> Iterator[Finding]:
    """A warning for each, with what would cure it; `name` is the record's."""
    for fault in faults(record):
        message = f"is {WORDS[fault]}: {_why(fault, record['tones'])}"
        yield Finding(code=fault.replace("_", "-"), where=name, message=message, severity=WARNING)


def counted_faults(counts: Mapping[str, int], pictures: int) -> str:
    """A sentence's part on how many of so many pictures have each fault; "" where none has."""
    return ", ".join(f"{count} of {pictures} {WORDS[fault]}" for fault, count in counts.items() if count)


def _why(fault: str, tones: Mapping[str, Any]) -> str:
    less, more = "lower the light or the exposure (exposure.stops)", "raise the light or the exposure (exposure.stops)"
    if fault == BLACK:
        do = f"let the Sun stand nearer the camera, seen from the target (target_lit_deg), or {more}"
        return f"{1 - tones['dark']:.0%} of the target's pixels are within five stops of full scale; {do}"
    if fault == WHITE:
        return f"{tones['saturated']:.0%} of the target's pixels are at full scale; {less}"
    end = tones["exposure_end"]
    do = more if end == LONGEST else less
    return f"the {end} time that it may take is not enough; {do}, or widen spin:sensor:autoExposure:stops"
