"""One picture measured: its settings' renders, a reference that is good enough for them, and their figures."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict

from msgspec import to_builtins

from spin_usd.accuracy.measurement import (
    Configuration,
    Failure,
    Figures,
    MeasuredPicture,
    Measurement,
    Saving,
)
from spin_usd.accuracy.sweep import base_effort, settings_to_measure
from spin_usd.commands.measure.calls import (
    COMPARE_LABELS,
    FIND_ERRORS,
    FIND_FIGURES,
    FIND_SAVINGS,
    FIND_SKIPPED_WORK,
    MAKE_PAIRS,
    FindErrors,
    FindFigures,
    FindSavings,
    MakePairs,
    RenderOnce,
    SeedPairs,
)
from spin_usd.commands.measure.campaign import BLENDER, PART, RAYCAST, Campaign, Series, weight
from spin_usd.commands.measure.processes import Processes, ProcessKind
from spin_usd.errors import InputError, SpinError
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.processes.call import Answer, Call, Request
from spin_usd.scene.effort import QUALITIES, Effort
from spin_usd.store.measurement_file import read_measurement

FIRST_PARTS = 4  # whose spread estimates the reference's error, and so how many more are needed
MARGIN = 1.1  # factor on the estimated number of parts
REFERENCE_BOUNCES = 32  # paths end at random long before, in proportion to the light they still carry
EVERYTHING = "everything"  # all of the work at once
RENDERS = 2  # for each timed one: the first warms the process up


class PictureTask:
    """The measurement of one picture; with `savings` also of the savings by leaving work out of it."""

    def __init__(self, campaign: Campaign, picture: PlannedPicture, *, savings: bool = False) -> None:
        self._campaign, self._picture = campaign, picture
        request = campaign.request
        settings = settings_to_measure(
            max_samples=request.max_samples,
            several_lights=picture.light_groups > 1,
            glossy="glossy" in picture.features,
            others=tuple(QUALITIES.values()),
        )
        self._settings = {setting: self._series(setting) for setting in settings}
        samples = max(min(PART * request.max_samples, request.reference_samples // FIRST_PARTS), 1)
        self._part = Effort(samples=samples, bounces=REFERENCE_BOUNCES)
        self._most_parts = max(request.reference_samples // samples, FIRST_PARTS)
        self._savings = SavingsTask(campaign, picture) if savings else None
        self._failures: list[Failure] = []
        asked = [request.seeds, request.reference_share, request.reference_samples, asdict(self._part), savings]
        self.key = campaign.result_key(
            "picture", picture.index, picture.exposure, [asdict(each) for each in settings], asked
        )
        campaign.expect(picture, [*self._settings.values(), *self._parts(FIRST_PARTS)])

    def measured(self, processes: Processes) -> Measurement:
        """Measure all of it. A picture whose reference failed is not among the frames, a setting that failed not among
        the figures; the failures give the reasons, and renders are kept for the next run."""
        runs = self._campaign.runs
        try:
            found = read_measurement(runs.result(self.key))
        except InputError:
            found = self._made(processes)
            if not found.failures:
                runs.write_result(self.key, to_builtins(found))
        if not found.failures:
            renders = self.keys - {self.key}
            self._campaign.percent_done.did(renders)
            runs.remove(renders)
        return found

    @property
    def keys(self) -> set[str]:
        """Keys of all possible results of the picture."""
        series = [*self._settings.values(), *self._parts(self._most_parts)]
        saved = self._savings.keys if self._savings else ()
        return {self.key, *saved, *(key for each in series for key in each.keys)}

    def _made(self, processes: Processes) -> Measurement:
        by_kind: dict[ProcessKind, dict[Configuration, Series]] = {BLENDER: {}, RAYCAST: {}}
        for setting, series in self._settings.items():
            by_kind[series.kind][setting] = series
        made = self._rendered(processes, by_kind[BLENDER])
        labels = self._asked(processes, BLENDER, "labels", COMPARE_LABELS, self._picture.index)
        saved = self._savings
        if saved:
            saved.render(processes)
        made |= self._rendered(processes, by_kind[RAYCAST])
        reference, capped = self._reference(processes, [each.keys for each in made.values()])
        frames, figures = self._figures(processes, made, reference, capped=capped) if reference else ((), ())
        return self._campaign.measurement(
            frames=frames,
            figures=figures,
            labels=(labels,) if labels else (),
            savings=saved.savings(processes, reference) if frames and saved else (),
            failures=(*self._failures, *(saved.failures if saved else ())),
        )

    def _rendered(self, processes: Processes, wanted: Mapping[Configuration, Series]) -> dict[Configuration, Series]:
        """Render these settings, and return the settings whose renders are complete."""
        reasons = self._campaign.make(processes, self._picture, list(wanted.values()))
        failed = {setting: why for setting, why in zip(wanted, reasons, strict=True) if why is not None}
        for setting, why in failed.items():
            self._fail(setting.text, why)
        return {setting: series for setting, series in wanted.items() if setting not in failed}

    def _reference(self, processes: Processes, runs: Sequence[Sequence[str]]) -> tuple[list[str], bool]:
        """Return keys of the parts of a reference that is good enough for the settings with these runs, and whether it
        was cut off before that; no keys if it failed."""
        count = FIRST_PARTS if runs else 0
        while count:
            parts = self._parts(count)
            keys = [key for part in parts for key in part.keys]
            failed = [why for why in self._campaign.make(processes, self._picture, parts) if why is not None]
            if failed:
                self._fail("reference", failed[0])
                break
            asked = FindErrors(index=self._picture.index, reference=keys, runs=list(map(list, runs)))
            errors = self._asked(processes, RAYCAST, "errors", FIND_ERRORS, asked)
            if errors is None:
                break
            wanted = self._campaign.request.reference_share * min(errors.settings)
            if errors.reference <= wanted or count == self._most_parts:
                return keys, errors.reference > wanted
            needed = math.ceil(MARGIN * count * errors.reference / wanted) if wanted else self._most_parts
            count = min(max(needed, count + 1), self._most_parts)
        return [], False

    def _figures(
        self, processes: Processes, made: Mapping[Configuration, Series], reference: Sequence[str], *, capped: bool
    ) -> tuple[tuple[MeasuredPicture, ...], tuple[Figures, ...]]:
        asked = FindFigures(
            index=self._picture.index,
            seed=self._campaign.seed,
            reference=list(reference),
            reference_samples=len(reference) * self._part.samples,
            capped=capped,
            settings=list(made),
            runs=[list(series.keys) for series in made.values()],
        )
        found = self._asked(processes, RAYCAST, "figures", FIND_FIGURES, asked)
        return ((found.picture,), tuple(found.figures)) if found else ((), ())

    def _asked(
        self, processes: Processes, kind: ProcessKind, what: str, call: Call[Request, Answer], request: Request
    ) -> Answer | None:
        """Return the answer of a process of that kind; if it fails, note that `what` failed and return None."""
        (answer,) = processes.run(kind, call, [request])
        if isinstance(answer, SpinError):
            self._fail(what, str(answer))
            return None
        return answer

    def _fail(self, what: str, why: str) -> None:
        self._failures.append(Failure(frame=self._picture.frame, what=what, reason=why))

    def _series(self, setting: Configuration) -> Series:
        kind, numbers = ProcessKind(renderer=setting.renderer), range(self._campaign.request.seeds)
        return self._campaign.series(self._picture, kind, setting.effort, self._campaign.seeds("setting", numbers))

    def _parts(self, count: int) -> list[Series]:
        """Return the first `count` parts of the reference, each one render: several processes share them."""
        seeds = self._campaign.seeds("reference", range(count))
        return [self._campaign.series(self._picture, BLENDER, self._part, [seed]) for seed in seeds]


class SavingsTask:
    """The savings measured on one picture, with the base effort."""

    def __init__(self, campaign: Campaign, picture: PlannedPicture) -> None:
        self._campaign, self._picture = campaign, picture
        self._effort = base_effort(campaign.request.max_samples)
        self._seeds = campaign.seeds("setting", range(campaign.request.seeds))
        self._runs: dict[str, SeedPairs] = {}
        self.failures: list[Failure] = []

    @property
    def keys(self) -> set[str]:
        """Keys of its renders."""
        return {key for runs in self._runs.values() for key in (*runs.with_it, *runs.without)}

    def render(self, processes: Processes) -> None:
        """Render the picture with and without each work that it leaves out, and with and without all of them."""
        campaign, index = self._campaign, self._picture.index
        (found,) = processes.run(BLENDER, FIND_SKIPPED_WORK, [RenderOnce(index=index, effort=self._effort)])
        if isinstance(found, SpinError):
            self._fail("work left out", str(found))
        works = _works([] if isinstance(found, SpinError) else found)
        self._runs = {what: self._pairs(what, work) for what, work in works.items()}
        missing = [what for what in works if not self._is_there(what)]
        requests = [
            MakePairs(
                index=index, effort=self._effort, work=works[what], seeds=list(self._seeds), pairs=self._runs[what]
            )
            for what in missing
        ]
        answers = processes.run(BLENDER, MAKE_PAIRS, requests, lambda key: campaign.percent_done.did([key]))
        for what, answer in zip(missing, answers, strict=True):
            if isinstance(answer, SpinError):
                self._fail(f"with {what}", str(answer))
                failed = self._runs.pop(what)
                campaign.percent_done.did([*failed.with_it, *failed.without])

    def savings(self, processes: Processes, reference: Sequence[str]) -> tuple[Saving, ...]:
        """Return the savings, weighted by the reference, given by its parts' keys."""
        asked = FindSavings(index=self._picture.index, reference=list(reference), runs=self._runs)
        (found,) = processes.run(RAYCAST, FIND_SAVINGS, [asked])
        if isinstance(found, SpinError):
            self._fail("savings", str(found))
            return ()
        return tuple(found)

    def _pairs(self, what: str, work: Sequence[str]) -> SeedPairs:
        """Return keys of the renders with and without that work, seed by seed, and count them as expected work."""
        of = [self._picture.radiance, asdict(self._effort), what, list(work)]
        with_it, without = (
            [self._campaign.key("saving", side, of, seed) for seed in self._seeds] for side in ("with_it", "without")
        )
        cost = RENDERS * weight(self._picture, self._effort)
        self._campaign.percent_done.expect(dict.fromkeys([*with_it, *without], cost))
        return SeedPairs(with_it=with_it, without=without)

    def _is_there(self, what: str) -> bool:
        """Return whether all its renders are there: times of different processes are not compared."""
        keys = [*self._runs[what].with_it, *self._runs[what].without]
        there = all(self._campaign.runs.has(key) for key in keys)
        if there:
            self._campaign.percent_done.did(keys)
        return there

    def _fail(self, what: str, why: str) -> None:
        self.failures.append(Failure(frame=self._picture.frame, what=what, reason=why))


def _works(names: Sequence[str]) -> dict[str, list[str]]:
    """Return each work that is left out by itself, and all together if there are several."""
    together = {EVERYTHING: list(names)} if len(names) > 1 else {}
    return {name: [name] for name in names} | together
