"""The context in which an orbit is computed."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.orbits.epochs import Epochs
from spin_usd.orbits.propagation import J2, propagated

LONGEST_S = 3e6  # takes 12 s, up to eight times for two craft


@dataclass(frozen=True, kw_only=True, eq=False)
class OrbitContext:
    """The context in which an orbit is computed."""

    epochs: Epochs
    folder: Path
    """Folder of the scenario's files."""
    j2: bool = True
    other: Float | None = None
    """(6,) the other craft's state at second 0; None if unknown."""
    notes: dict[str, None] = field(default_factory=dict)
    """Sentences for the user, in their order."""

    def path(self, name: str) -> Path:
        return self.folder / name

    def pole(self) -> Float:
        """The Earth's pole (3,) in the middle of the scenario."""
        middle = Epochs(self.epochs.epoch, self.epochs.seconds[len(self.epochs.seconds) // 2 :][:1])
        return np.asarray(middle.R_gcrf_itrf[0, :, 2])

    def propagated(self, start: Float, where: str) -> Float:
        """Return the states (N, 6), GCRF, propagated from `start` at second 0."""
        if not np.isfinite(start).all() or not np.linalg.norm(np.cross(start[:3], start[3:])) > 0:
            raise InputError("is not an orbit about the Earth", where=where, do="check the numbers and their units")
        if np.abs(self.epochs.seconds).max() > LONGEST_S:
            do = "give an ephemeris (oem, spice) for longer"
            raise InputError(f"is propagated for more than {LONGEST_S / 86400:.0f} days", where=where, do=do)
        try:
            return propagated(start, self.epochs.seconds, self.pole(), J2 if self.j2 else 0.0)
        except InputError as error:
            raise InputError(error.found, where=where, do=error.do) from None
