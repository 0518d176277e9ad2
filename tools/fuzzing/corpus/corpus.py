"""The corpus: all inputs that are made by hand."""

from collections.abc import Iterator

from fuzzing.corpus import composition, names, numbers, paths, special_files, surroundings
from fuzzing.trial import Trial

CLASSES = (
    paths.paths,
    special_files.links,
    special_files.special_files,
    composition.cycles,
    composition.bombs,
    composition.nesting,
    numbers.numbers,
    numbers.indices,
    numbers.counts,
    names.names,
    names.encodings,
    surroundings.limits,
    surroundings.signals,
)


def corpus() -> Iterator[Trial]:
    """All of it."""
    for trials in CLASSES:
        yield from trials()
