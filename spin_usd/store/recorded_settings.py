"""The settings of a picture's render, as its record says."""

from collections.abc import Mapping
from typing import Any

from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import CPU, Effort


def recorded_settings(record: Mapping[str, Any]) -> RenderSettings:
    """Return the settings in a `record` (record-1); what it does not say was the default when there was no choice.

    Raises KeyError, TypeError and InputError for a record that is not valid.
    """
    provenance = record["provenance"]
    render = provenance["render"]
    return RenderSettings(
        renderer=render["renderer"],
        effort=Effort(**render["effort"]),
        seed=provenance["seed"]["dataset"],
        device=render.get("device", CPU),
    )


def recorded_options(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that a `record` (record-1) says by name, where they were not as usual."""
    return dict(record["provenance"].get("options", {}))
