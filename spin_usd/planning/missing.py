"""The pictures that a manifest lists and a dataset lacks."""

from collections.abc import Set

from spin_usd.planning.manifest import Manifest
from spin_usd.planning.shard import Shard
from spin_usd.pluralise import pluralise


def missing_pictures(manifest: Manifest, there: Set[tuple[str, str]]) -> dict[tuple[str, str], Shard]:
    """Return the shards of the pictures that are still to come; a picture's name is its variant and frame."""
    return {name: shard for name, shard in manifest.pictures() if name not in there}


def missing_in_words(count: int, shard: str) -> str:
    """Say that so many pictures of the shard, "1/3", are still to come."""
    return f"missing: {pluralise(count, 'picture')} of shard {shard}"
