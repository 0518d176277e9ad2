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
    """One Mesh prim: its name, the layer that holds its surface, the label of its class, and its surface."""

    name: str
    layer: str
    kind: str
    shape: Shape


def parts() -> tuple[Part, ...]:
    """The whole spacecraft, in a fixed order."""
    return (
        Part(name="Body", layer="bus", kind="main_body", shape=body()),
        Part(name="Deck", layer="bus", kind="main_body", shape=deck()),
        Part(name="Brackets", layer="structure", kind="main_body", shape=brackets()),
        Part(name="Radiator", layer="bus", kind="main_body", shape=radiator()),
        Part(name="SolarPanel", layer="panel", kind="solar_panel", shape=solar_panel()),
        Part(name="AntennaMinusX", layer="equipment", kind="omni_antenna", shape=corner_antenna("antenna_tip_9")),
        Part(name="AntennaPlusX", layer="equipment", kind="omni_antenna", shape=corner_antenna("antenna_tip_10")),
        Part(name="AntennaMinusY", layer="equipment", kind="omni_antenna", shape=wall_antenna("antenna_tip_11")),
        Part(name="PatchPlusX", layer="equipment", kind="omni_antenna", shape=patch()),
        Part(name="PatchMinusX", layer="equipment", kind="omni_antenna", shape=patch().moved((0, 0, 0), HALF_TURN)),
        Part(name="WhipPlusX", layer="equipment", kind="omni_antenna", shape=whip()),
        Part(name="WhipMinusX", layer="equipment", kind="omni_antenna", shape=whip().moved((0, 0, 0), HALF_TURN)),
        Part(name="Harness", layer="structure", kind="main_body", shape=harness()),
        Part(name="OpticalHeads", layer="equipment", kind="payload", shape=optical_heads()),
        Part(name="SunSensors", layer="equipment", kind="payload", shape=sun_sensors()),
        Part(name="SeparationRing", layer="bus", kind="adapter_ring", shape=separation_ring()),
    )
