"""spin_usd: labelled, traceable, reproducible imagery of a target spacecraft from layered USD stages.

The commands as functions: `author`, `augment`, `plan`, `render`, `merge`, `check`, `measure`, `reproduce`, `debug`,
`export` and `show`. They take what the commands take, by the same names, return what was done, and raise a `SpinError`
where a command would end with one sentence. `Dataset` reads what was rendered, a `Picture` at a time.

Each name is loaded when it is first used. Stages are opened and pictures rendered in child processes: neither USD nor
Blender is ever loaded into the caller's.
"""

from importlib import import_module

TYPE_CHECKING = False  # as type checkers know it; typing itself takes longer to load than all else here
if TYPE_CHECKING:
    from spin_usd.api.augment import augment
    from spin_usd.api.author import author
    from spin_usd.api.check import check
    from spin_usd.api.debug import debug
    from spin_usd.api.export import export
    from spin_usd.api.measure import measure
    from spin_usd.api.merge import merge
    from spin_usd.api.plan import plan
    from spin_usd.api.render import render
    from spin_usd.api.reproduce import reproduce
    from spin_usd.api.show import show
    from spin_usd.dataset.read.dataset import Dataset
    from spin_usd.dataset.read.picture import Picture
    from spin_usd.errors import SpinError

__version__ = "0.1.0"

__all__ = [
    "Dataset",
    "Picture",
    "SpinError",
    "__version__",
    "augment",
    "author",
    "check",
    "debug",
    "export",
    "measure",
    "merge",
    "plan",
    "render",
    "reproduce",
    "show",
]

_MODULES = {
    "Dataset": "spin_usd.dataset.read.dataset",
    "Picture": "spin_usd.dataset.read.picture",
    "SpinError": "spin_usd.errors",
    "augment": "spin_usd.api.augment",
    "author": "spin_usd.api.author",
    "check": "spin_usd.api.check",
    "debug": "spin_usd.api.debug",
    "export": "spin_usd.api.export",
    "measure": "spin_usd.api.measure",
    "merge": "spin_usd.api.merge",
    "plan": "spin_usd.api.plan",
    "render": "spin_usd.api.render",
    "reproduce": "spin_usd.api.reproduce",
    "show": "spin_usd.api.show",
}


def __getattr__(name: str) -> object:
    """Load what is asked for (PEP 562)."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(_MODULES[name]), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
