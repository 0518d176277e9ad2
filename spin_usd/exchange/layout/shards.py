"""Shards: files that each hold a number of the pictures of a split, in the dataset's order."""

from functools import lru_cache
from typing import NamedTuple

from spin_usd.exchange.layout.export_format import FormatOption, from_one
from spin_usd.exchange.layout.exported_dataset import ExportedDataset, ExportedPicture


class ExportShard(NamedTuple):
    """A shard: its split, its place among `of` of that, from 0, and the numbers of its pictures."""

    split: str
    place: int
    of: int
    numbers: list[int]


PICTURES = FormatOption(name="pictures", meaning="how many pictures a shard has, from 1", default="1000", read=from_one)


@lru_cache(maxsize=1)
def shards_of(dataset: ExportedDataset) -> dict[int, ExportShard]:
    """Return each shard by the number of its last picture."""
    size: int = dataset.options[PICTURES.name]
    found = {}
    for split in dataset.splits:
        numbers = [number for number, entry in enumerate(dataset.entries) if entry.split == split]
        starts = range(0, len(numbers), size)
        for place, start in enumerate(starts):
            held = numbers[start : start + size]
            found[held[-1]] = ExportShard(split, place, len(starts), held)
    return found


def shard_with(dataset: ExportedDataset, picture: ExportedPicture) -> ExportShard:
    """Return the shard that holds the picture: the first whose last picture is not before it, of its split."""
    shards = sorted(shards_of(dataset).items())
    return next(shard for last, shard in shards if picture.number <= last and picture.number in shard.numbers)
