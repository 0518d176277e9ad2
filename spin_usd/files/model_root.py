"""The folder of all files that a model may name: its own, or a wider one while a stage is authored from it.

Models often come in folders beside the folders of their textures and parts, as in ROS packages. A user who authors from
a model trusts its surroundings more than a received stage's.
"""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from types import MappingProxyType

from spin_usd.errors import InputError

_ROOTS: ContextVar[Mapping[Path, Path]] = ContextVar("model_roots", default=MappingProxyType({}))


def root_of(model: Path) -> Path:
    """Return the folder, links resolved, below which all files lie that the model at that path may name."""
    real = model.resolve()
    return _ROOTS.get().get(real, real.parent)


@contextmanager
def model_roots(models: Iterable[Path], root: Path | None) -> Iterator[None]:
    """Let the `models` name files below `root` within the block; None for the parent of each model's folder. Raises
    InputError for a model that is not below `root`."""
    found = {}
    for model in models:
        real = model.resolve()
        found[real] = real.parent.parent if root is None else root.resolve()
        if not real.is_relative_to(found[real]):
            raise InputError("is not below --root", where=model, do="give a folder that holds the model")
    token = _ROOTS.set(found)
    try:
        yield
    finally:
        _ROOTS.reset(token)
