"""Count the work left out of pictures because their scenes do not need it, with reasons, for `plan --explain`."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from msgspec import Meta

from spin_usd.basics.json_fields import Count, one_of
from spin_usd.planning.work import BEHIND, NOISE, THROUGH_OPTICS
from spin_usd.processes.open_renderer import renderer_entry
from spin_usd.renderers.skipped import BITS, Facts, SkippedWork, skipped_work
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.scene import Scene

RENDER, BACKGROUND, OPTICS, DETECTOR, LABELS = "render", "background", "optics", "detector", "labels"
NOWHERE, NONE = "the target is nowhere else", "the stage has none"
ONE_RAY = "a label is of the face that one ray through the pixel's centre meets"
ABSENT: Sequence[tuple[str, str, str, Callable[[Scene], bool]]] = (
    (RENDER, "pixels outside the target's region", NOWHERE, lambda scene: scene.picture_region != scene.camera.frame),
    (RENDER, "depth of field", "the camera is a pinhole", lambda scene: scene.thin_lens is None),
    (RENDER, "motion blur", "the exposure is an instant", lambda scene: scene.shutter is None),
    (DETECTOR, "metering", "the exposure is given", lambda scene: scene.sensor.auto_exposure is None),
    (LABELS, "light, materials, samples and blur", ONE_RAY, lambda _: True),
)
"""Outside the path tracer: part of the work, the work left out, why, and whether a scene goes without."""
FEATURES = ((BACKGROUND, BEHIND, NONE), (OPTICS, THROUGH_OPTICS, NONE), (DETECTOR, (NOISE,), "its gain is not set"))
"""Likewise, for features of work.features."""
KEPT = "geometry is not simplified: labels need every face as it is, and the picture shows the same"

Item = tuple[str, str, str, str]
"""A part of the work, and SkippedWork's what, why and same."""


@dataclass(frozen=True, kw_only=True)
class SkippedCount:
    """Work that is skipped (see SkippedWork)."""

    part: Annotated[str, one_of(RENDER, BACKGROUND, OPTICS, DETECTOR, LABELS), Meta(description="Part of the work.")]
    what: str
    why: str
    same: Annotated[str, Meta(description="Whether the result is equal to the bit, or nearly.")]
    pictures: Annotated[Mapping[str, Count], Meta(description="How many pictures of each variant that has any.")]


class SkippedWorkCounter:
    """Counts the work that the pictures of a variant go without."""

    def __init__(self, settings: RenderSettings) -> None:
        self._settings = settings
        self._counts: Counter[Item] = Counter()
        self._known: dict[str, tuple[SkippedWork, ...]] = {}

    def add(self, scene: Scene, radiance: str, has: Collection[str]) -> None:
        """Note the picture of `scene`, whose radiance key is given, and the features of work.features that it `has`."""
        self._counts.update((part, what, why, BITS) for part, what, why, is_absent in ABSENT if is_absent(scene))
        self._counts.update(
            (part, what, why, BITS) for part, names, why in FEATURES for what in names if what not in has
        )
        if not renderer_entry(self._settings.renderer).skips_work:
            return
        if radiance not in self._known:
            self._known[radiance] = skipped_work(Facts(scene=scene, effort=self._settings.effort))
        self._counts.update((RENDER, each.what, each.why, each.same) for each in self._known[radiance])

    def taken(self) -> list[Any]:
        """Return the items and their counts as JSON, and start the next variant at none."""
        counts, self._counts = self._counts, Counter()
        return [[*item, count] for item, count in counts.items()]


def skipped_counts(counted: Iterable[tuple[str, Sequence[Any]]]) -> tuple[SkippedCount, ...]:
    """Sum up results of `SkippedWorkCounter.taken` for some of the pictures of variants, given with their names.

    Returns the sums in the order of the parts of the work, then of first mention.
    """
    found: dict[Item, Counter[str]] = {}
    for variant, items in counted:
        for part, what, why, same, count in items:
            found.setdefault((part, what, why, same), Counter())[variant] += count
    parts = (RENDER, BACKGROUND, OPTICS, DETECTOR, LABELS)
    return tuple(
        SkippedCount(part=part, what=what, why=why, same=same, pictures=dict(counts))
        for (part, what, why, same), counts in sorted(found.items(), key=lambda pair: parts.index(pair[0][0]))
    )
