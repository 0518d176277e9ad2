"""What it saves to leave out the work that a picture's scene does not need: it is made with that work, too."""

from collections.abc import Sequence
from dataclasses import asdict

from spin_usd.dataset.job import PlannedPicture
from spin_usd.dataset.measure.campaign import BLENDER, RAYCAST, Campaign, Series
from spin_usd.dataset.measure.pool import Pool
from spin_usd.measuring.measurement import Failure, Saving, Setting
from spin_usd.measuring.walk import base_effort


class SavingsTask:
    """Of a picture, with the base setting."""

    def __init__(self, campaign: Campaign, picture: PlannedPicture) -> None:
        self._campaign, self._picture = campaign, picture
        self._kept: dict[str, Series] = {}
        self._made: list[str] = []
        self.setting = Setting(renderer=BLENDER.renderer, effort=base_effort(campaign.request.most_samples))
        self.failures: list[Failure] = []

    @property
    def keys(self) -> set[str]:
        """Of what was rendered for it."""
        return {key for series in self._kept.values() for key in series.keys}

    def render(self, pool: Pool) -> None:
        """The picture with each work that the setting leaves out of it."""
        campaign, effort = self._campaign, self.setting.effort
        seeds = campaign.seeds("setting", range(campaign.request.seeds))
        found = campaign.asked(pool, self._picture, BLENDER, "left_out", effort=asdict(effort))
        if found.failed is not None:
            self._fail("what is left out", found.failed)
        for what in found.result or []:
            self._kept[what] = campaign.series(self._picture, BLENDER, effort, seeds, work=(what,))
        reasons = campaign.make(pool, self._picture, list(self._kept.values()))
        for what, why in zip(self._kept, reasons, strict=True):
            if why is None:
                self._made.append(what)
            else:
                self._fail(f"with {what}", why)

    def savings(self, pool: Pool, reference: Sequence[str], without: Sequence[str]) -> tuple[Saving, ...]:
        """Beside the setting's own renders, whose keys are `without`."""
        runs = {what: self._kept[what].keys for what in self._made}
        how = {"reference": reference, "without": without, "runs": runs}
        found = self._campaign.asked(pool, self._picture, RAYCAST, "savings", **how)
        if found.failed is not None:
            self._fail("savings", found.failed)
        return tuple(Saving(**each) for each in found.result or [])

    def _fail(self, what: str, why: str) -> None:
        self.failures.append(Failure(frame=self._picture.frame, what=what, reason=why))
