"""Tango, part by part."""

from dataclasses import dataclass

from tango.parts.antennas import corner_antenna, patch, wall_antenna, whip
from tango.parts.bus import body, deck, radiator, separation_ring
from tango.parts.harness import harness
from tango.parts.instruments import optical_heads, sun_sensors
from tango.parts.panel import solar_panel
from tango.parts.structure import brackets
from tango.shapes.shape import HALF_TURN, Shape


@dataclass(frozen=True, kw_only=True)
class Part:
    """One Mesh prim: its name, the label of its class, and its surface."""

    name: str
    kind: str
    shape: Shape


def parts() -> tuple[Part, ...]:
    """The whole spacecraft, in a fixed order."""
    return (
        Part(name="Body", kind="main_body", shape=body()),
        Part(name="Deck", kind="main_body", shape=deck()),
        Part(name="Brackets", kind="main_body", shape=brackets()),
        Part(name="Radiator", kind="main_body", shape=radiator()),
        Part(name="SolarPanel", kind="solar_panel", shape=solar_panel()),
        Part(name="AntennaMinusX", kind="omni_antenna", shape=corner_antenna("antenna_tip_9")),
        Part(name="AntennaPlusX", kind="omni_antenna", shape=corner_antenna("antenna_tip_10")),
        Part(name="AntennaMinusY", kind="omni_antenna", shape=wall_antenna("antenna_tip_11")),
        Part(name="PatchPlusX", kind="omni_antenna", shape=patch()),
        Part(name="PatchMinusX", kind="omni_antenna", shape=patch().moved((0, 0, 0), HALF_TURN)),
        Part(name="WhipPlusX", kind="omni_antenna", shape=whip()),
        Part(name="WhipMinusX", kind="omni_antenna", shape=whip().moved((0, 0, 0), HALF_TURN)),
        Part(name="Harness", kind="main_body", shape=harness()),
        Part(name="OpticalHeads", kind="payload", shape=optical_heads()),
        Part(name="SunSensors", kind="payload", shape=sun_sensors()),
        Part(name="SeparationRing", kind="adapter_ring", shape=separation_ring()),
    )
