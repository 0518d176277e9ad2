"""Limits of BOP: depth that 16 bits do not hold, and silhouettes that nobody knows."""

from spin_usd.errors import UnsupportedError
from spin_usd.exchange.layout.bop_entries import MILLIMETRES, UINT16_MAX
from spin_usd.exchange.layout.exported_dataset import ExportedDataset
from spin_usd.exchange.layout.exported_picture import AMODAL
from spin_usd.exchange.layout.limits import INSTANCE
from spin_usd.exchange.layout.survey import Survey, reach
from spin_usd.scene.body import OCCLUDER

SCALES = (0.1, 1.0)
"""Steps of depth, millimetres. Beyond the last they would be too coarse: BOP's tools decide what is visible at 5 mm and
15 mm."""


def depth_fits(survey: Survey) -> None:
    """Raise UnsupportedError where a target is so far away that 16 bits do not hold its depth."""
    far, picture = survey.farthest
    deepest, most = far + reach(survey.targets), SCALES[-1] * UINT16_MAX / MILLIMETRES
    if deepest > most:
        found = f"has its target up to {deepest:g} m away, and 16 bits of {SCALES[-1]:g} mm end at {most:g} m"
        raise UnsupportedError(found, where=picture, do="export without depth: --option depth=no")


def depth_scale(dataset: ExportedDataset) -> float:
    """Return the finest of SCALES that holds the depth of all targets in all pictures; the last where none does, and
    where there are occluders, of which nobody knows how far they are."""
    if any(part.target == OCCLUDER for part in dataset.dataset.parts.values()):
        return SCALES[-1]
    deepest = (dataset.farthest + reach(dataset.dataset.targets)) * MILLIMETRES
    return next((scale for scale in SCALES if deepest <= scale * UINT16_MAX), SCALES[-1])


def amodal_known(survey: Survey) -> None:
    """Raise UnsupportedError where a body can hide another, and pictures do not say what is behind it."""
    if survey.bodies > 1 and survey.kinds[AMODAL] < survey.tally.total():
        found = f"the dataset has several bodies, and {survey.format} has masks of each as if nothing else were there"
        raise UnsupportedError(found, do=f"render it with --labels default,{INSTANCE},{AMODAL}")
