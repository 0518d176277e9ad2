"""Measure what it saves to leave out the work that a picture's scene does not need: it is made with that work, too."""

from collections.abc import Sequence
from dataclasses import asdict

from spin_usd.accuracy.measurement import Failure, Saving
from spin_usd.accuracy.sweep import base_effort
from spin_usd.commands.measure.campaign import BLENDER, RAYCAST, Campaign, weight
from spin_usd.commands.measure.processes import Job, Processes
from spin_usd.picture.planned_picture import PlannedPicture

EVERYTHING = "everything"  # all of the work at once
RENDERS = 2  # for each that is timed: the one before it warms the process up


class SavingsTask:
    """The savings measured on one picture, with the base effort."""

    def __init__(self, campaign: Campaign, picture: PlannedPicture) -> None:
        self._campaign, self._picture = campaign, picture
        self._effort = base_effort(campaign.request.max_samples)
        self._seeds = campaign.seeds("setting", range(campaign.request.seeds))
        self._runs: dict[str, dict[str, list[str]]] = {}
        self.failures: list[Failure] = []

    @property
    def keys(self) -> set[str]:
        """Keys of what was rendered for it."""
        return {key for runs in self._runs.values() for keys in runs.values() for key in keys}

    def render(self, processes: Processes) -> None:
        """Render the picture with and without each work that is left out of it, and with and without all of it."""
        campaign, effort = self._campaign, asdict(self._effort)
        found = campaign.asked(processes, self._picture, BLENDER, "skipped_work", effort=effort)
        if found.failed is not None:
            self._fail("what is left out", found.failed)
        works = _works(found.result or [])
        self._runs = {what: self._pairs(what, work) for what, work in works.items()}
        missing = [what for what in works if not self._is_there(what)]
        jobs = [
            Job(
                kind=BLENDER,
                what="make_pairs",
                arguments={
                    "index": self._picture.index,
                    "effort": effort,
                    "work": works[what],
                    "seeds": self._seeds,
                    **self._runs[what],
                },
            )
            for what in missing
        ]
        for what, answer in zip(
            missing, processes.run(jobs, on_made=lambda key: campaign.percent_done.did([key])), strict=True
        ):
            if answer.failed is not None:
                self._fail(f"with {what}", answer.failed)
                campaign.percent_done.did(key for keys in self._runs.pop(what).values() for key in keys)

    def savings(self, processes: Processes, reference: Sequence[str]) -> tuple[Saving, ...]:
        """Return the savings, weighted by the reference, which is given by its parts' keys."""
        how = {"reference": reference, "runs": self._runs}
        found = self._campaign.asked(processes, self._picture, RAYCAST, "savings", **how)
        if found.failed is not None:
            self._fail("savings", found.failed)
        return tuple(Saving(**each) for each in found.result or [])

    def _pairs(self, what: str, work: Sequence[str]) -> dict[str, list[str]]:
        """Return keys of the renders with and without that work, seed by seed, and count them as work to come."""
        of = [self._picture.radiance, asdict(self._effort), what, list(work)]
        pairs = {
            side: [self._campaign.key("saving", side, of, seed) for seed in self._seeds]
            for side in ("with_it", "without")
        }
        cost = RENDERS * weight(self._picture, self._effort)
        self._campaign.percent_done.expect({key: cost for keys in pairs.values() for key in keys})
        return pairs

    def _is_there(self, what: str) -> bool:
        """Return whether all renders of it are there: what was timed in another process is not compared."""
        keys = [key for side in self._runs[what].values() for key in side]
        there = all(self._campaign.runs.has(key) for key in keys)
        if there:
            self._campaign.percent_done.did(keys)
        return there

    def _fail(self, what: str, why: str) -> None:
        self.failures.append(Failure(frame=self._picture.frame, what=what, reason=why))


def _works(names: Sequence[str]) -> dict[str, list[str]]:
    """Return each work that is left out by itself, and all together where it is more than one."""
    together = {EVERYTHING: list(names)} if len(names) > 1 else {}
    return {name: [name] for name in names} | together
