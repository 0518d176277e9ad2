"""The options of `gap`."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.basics.suggestion import suggestion
from spin_usd.errors import InputError
from spin_usd.options import (
    Argument,
    EffortOptions,
    ListeningToNotes,
    Option,
    RendererName,
    Seed,
    Stage,
    Workers,
    names_in,
)
from spin_usd.options import Variant as VariantName

FITS = ("light", "camera", "surface")
MAX_PANELS = 256


@dataclass(frozen=True)
class GapOptions(ListeningToNotes, EffortOptions):
    """The real pictures, the stage to compare with them, and the fits. Raises InputError for an unknown fit."""

    real: Annotated[str | Path, Argument("A folder of real pictures.")]
    stage: Stage
    _: KW_ONLY
    out: Annotated[str | Path, Option("Folder of the report: gap.json, index.html, and the fits as layers.", "FOLDER")]
    poses: Annotated[
        str | Path | None,
        Option("Poses of the real pictures, in any format that author reads, instead of those of the stage.", "PATH"),
    ] = None
    fit: Annotated[str | Sequence[str], Option("Fits, in this order: light, camera, surface; or all.", "NAME,...")] = ()
    panels: Annotated[
        int,
        Option(
            "How many panels, and as many Suns, around the target may shine in the fit of light; 0 for the stage's own "
            "lights alone.",
            "N",
            at_least=0,
            at_most=MAX_PANELS,
        ),
    ] = 42
    write: Annotated[
        str | Path | None,
        Option(
            "Also write what the fits found as distributions: this preset, and an augmentation beside it.", "FILE.usda"
        ),
    ] = None
    variant: VariantName = "nominal"
    renderer: RendererName = None
    seed: Seed = None
    workers: Workers = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in self.fits:
            if name not in FITS:
                raise InputError(f"there is no fit {name!r}", do=suggestion(name, FITS))
        if self.write is not None and "light" not in self.fits:
            raise InputError("write is given without fit light, of which it makes distributions", do="add --fit light")
        if self.write is not None and Path(self.write).suffix != ".usda":
            raise InputError("cannot be a preset", where=self.write, do="give a name that ends in .usda")

    @property
    def fits(self) -> tuple[str, ...]:
        """The fits in their order."""
        named = names_in(self.fit)
        if "all" in named:
            return FITS
        return tuple(sorted(set(named), key=lambda name: FITS.index(name) if name in FITS else -1))
