"""Rule: the pictures that shards were to make are there."""

from collections import Counter
from collections.abc import Iterator

from spin_usd.dataset.shards.manifest import read_manifest
from spin_usd.dataset.shards.missing import missing_in_words, missing_pictures
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.names import SHARDS, picture_of
from spin_usd.scene.finding import WARNING, Finding


def shard_findings(store: Store) -> Iterator[Finding]:
    """Yield a warning for each shard whose pictures are not all there."""
    if manifest := read_manifest(store):
        there = {(variant, frame) for frame, variant in map(picture_of, store.records())}
        for shard, count in Counter(map(str, missing_pictures(manifest, there).values())).items():
            yield Finding(code="shards", where=SHARDS, message=missing_in_words(count, shard), severity=WARNING)
