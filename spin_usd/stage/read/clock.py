"""The seconds of a stage's time codes."""

from itertools import pairwise

import numpy as np
from pxr import Sdf, Usd

from spin_usd.errors import InputError, StageError
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import read_samples

SAME_S = 1e-6  # seconds: sums of steps round by less


class Clock:
    """Seconds by time codes: between the pictures' own times in a straight line, where they have such, else by the
    stage's timeCodesPerSecond.

    samples: the seconds of the pictures by their time codes · timed: whether two pictures or more have them.
    """

    def __init__(self, stage: Usd.Stage) -> None:
        """Read the times. Raises StageError for such as go back."""
        prim = stage.GetDefaultPrim()
        attribute = prim.GetAttribute(schema.CAPTURE_TIME) if prim else None
        samples = read_samples(attribute, Sdf.ValueTypeNames.Double) if attribute else []
        for (_, before), (time_code, seconds) in pairwise(samples):
            if seconds <= before:
                found = f"is {seconds:g} s at time code {time_code:g}, not after the {before:g} s before it"
                raise StageError(
                    found,
                    where=f"{prim.GetPath()}.{schema.CAPTURE_TIME}",
                    do="let each picture be after the one before",
                )
        self.samples = dict(samples)
        self.timed = len(samples) > 1
        self._codes, self._seconds = np.array(list(self.samples)), np.array(list(self.samples.values()))
        self._rate = float(stage.GetTimeCodesPerSecond())

    def seconds(self, time_code: float) -> float:
        """Return the seconds of a time code."""
        return _line(self._codes, self._seconds, time_code) if self.timed else time_code / self._rate

    def refuse_outside(self, seconds: float, stage: object) -> None:
        """Raise InputError for a time before the first picture's or after the last one's, where nothing is known."""
        if not self.timed or self._seconds[0] - SAME_S <= seconds <= self._seconds[-1] + SAME_S:
            return
        found = (
            f"has no time {seconds:.9g} s: its pictures are from {self._seconds[0]:.9g} to {self._seconds[-1]:.9g} s"
        )
        raise InputError(found, where=stage, do="give a time between them")

    def time_code(self, seconds: float) -> float:
        """Return the time code of seconds."""
        return _line(self._seconds, self._codes, seconds) if self.timed else seconds * self._rate


def _line(known: np.ndarray, values: np.ndarray, at: float) -> float:
    """Return the value at `at` on the straight lines through the known ones, the first and the last of which go on."""
    i = int(np.clip(np.searchsorted(known, at, "right") - 1, 0, len(known) - 2))
    share = (at - known[i]) / (known[i + 1] - known[i])
    return float(values[i] + share * (values[i + 1] - values[i]))
