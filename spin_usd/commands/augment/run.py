"""Sampled variants of a stage."""

from pathlib import Path
from types import NoneType

from spin_usd.commands.augment.options import AugmentOptions
from spin_usd.commands.author.reports import AUGMENT, AugmentReport, AugmentStage, ParameterRow
from spin_usd.options import takes
from spin_usd.processes.ask_child import ask_child
from spin_usd.processes.call import Call
from spin_usd.processes.child import Child
from spin_usd.store.stage_path import existing_stage

PARAMETER_LIST = Call("spin_usd.commands.augment.parameter_list:parameter_list", NoneType, list[ParameterRow])


@takes(AugmentOptions)
def augment(options: AugmentOptions) -> AugmentReport:
    """Add the augmentations of a specification to a stage, one variant each. Another run replaces them.

    Raises InputError that names the specification, the augmentation and its fault; then nothing is written.
    """
    root, spec = existing_stage(Path(options.stage)), str(options.spec)
    out = None if options.out is None else str(options.out)
    reads = f"{root} or {spec}"
    request = AugmentStage(stage=str(root), spec=spec, out=out)
    return ask_child(AUGMENT, request, reads=reads, progress=options.progress, writes=(root.parent,))


def parameters() -> list[ParameterRow]:
    """List the parameters that a specification can sample, each with its name, description, units and limits."""
    with Child() as child:
        return child.call(PARAMETER_LIST, None)
