"""spin_usd: labelled, traceable, reproducible imagery of a target spacecraft from layered USD stages.

The commands as functions: `author`, `augment`, `plan`, `render`, `merge`, `check`, `measure`, `reproduce`, `debug`,
`export`, `score`, `gap`, `evidence` and `show`. They have the same options as the commands, return a report, and raise
a `SpinError` where a command would end with an error message. `Dataset` reads a dataset, a `Picture` at a time;
`FreshDataset` gives each picture a new appearance on each access, and `Simulator` makes pictures on request, in memory.
Stages are opened and pictures rendered in child processes: neither USD nor Blender is loaded into the caller's.
"""

from importlib import import_module

TYPE_CHECKING = False  # as type checkers know it; typing itself takes longer to load than all else here
if TYPE_CHECKING:
    from spin_usd.commands.augment.run import augment
    from spin_usd.commands.author.run import author
    from spin_usd.commands.check.run import check
    from spin_usd.commands.debug.run import debug
    from spin_usd.commands.evidence.run import evidence
    from spin_usd.commands.export.run import export
    from spin_usd.commands.gap.run import gap
    from spin_usd.commands.measure.run import measure
    from spin_usd.commands.merge.run import merge
    from spin_usd.commands.plan.run import plan
    from spin_usd.commands.render.run import render
    from spin_usd.commands.reproduce.run import reproduce
    from spin_usd.commands.score.run import score
    from spin_usd.commands.show.run import show
    from spin_usd.errors import SpinError
    from spin_usd.reading.dataset import Dataset
    from spin_usd.reading.picture import Picture
    from spin_usd.simulator.fresh_dataset import FreshDataset
    from spin_usd.simulator.simulator import Simulator

__version__ = "0.1.0"

__all__ = [
    "Dataset",
    "FreshDataset",
    "Picture",
    "Simulator",
    "SpinError",
    "__version__",
    "augment",
    "author",
    "check",
    "debug",
    "evidence",
    "export",
    "gap",
    "measure",
    "merge",
    "plan",
    "render",
    "reproduce",
    "score",
    "show",
]

_MODULES = {
    "Dataset": "spin_usd.reading.dataset",
    "FreshDataset": "spin_usd.simulator.fresh_dataset",
    "Picture": "spin_usd.reading.picture",
    "Simulator": "spin_usd.simulator.simulator",
    "SpinError": "spin_usd.errors",
}
"""Where those lie that are no commands."""


def __getattr__(name: str) -> object:
    """Load the name when it is first used (PEP 562)."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from spin_usd.basics.faults import reading

    with reading():
        found = globals()[name] = getattr(import_module(_MODULES.get(name, f"spin_usd.commands.{name}.run")), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
