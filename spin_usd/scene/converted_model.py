"""A model to be converted to GLB, and what is known of it afterwards."""

from msgspec import Struct


class ModelToConvert(Struct, frozen=True, kw_only=True):
    """A model's file, and the GLB to write."""

    source: str
    to: str
    root: str
    """Folder below which lie the files that it may name."""
    model_time: float | None = None
    """Seconds after its animations begin; None for the model as it is stored."""


class ConvertedModel(Struct, frozen=True, kw_only=True):
    """A model that was converted."""

    metres_per_unit: float = 1.0
    notes: tuple[str, ...] = ()
    """Sentences on what was left out or changed."""
    refraction: dict[str, float] = {}
    """Indices of refraction by the names of materials."""
