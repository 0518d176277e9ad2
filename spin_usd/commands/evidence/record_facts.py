"""Facts of a dataset's records: what went into its pictures, and the bounds of its labels' errors.

The bounds are figures of tools/figures/extremes.md, of labels judged in 80-bit arithmetic at extremes of range, lens
and shape: they follow from the roundings of float64 and float32, and every pixel of those cases satisfies them.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, metadata

import numpy as np

from spin_usd.commands.evidence.report import LabelBound, PictureSources
from spin_usd.reading.picture import Picture

DEPTH = 6.03e-8  # of itself
BODY = 8.8e-8  # of the target's radius
FACE = 1.9e-6  # of the target's radius: how near an edge float32 decides which face is seen
PLACE = 1.1e-14  # metres: a pose as read from the stage's text
BY_DEPTH, BY_BODY = ("depth", "range"), ("dense_pose",)
BY_FACE = ("segmentation", "instance", "classes", "mask_visible")
SMALLEST = 1e-3  # metres: of the distance to a target that the camera may touch


class RecordFacts:
    """Facts of some pictures."""

    def __init__(self, pictures: Iterable[Picture]) -> None:
        self._stages, self._renderers = Counter[str](), Counter[str]()
        self._files, self._versions = dict[str, set[str]](), dict[str, set[str]]()
        self._kinds = dict[str, None]()
        self._farthest = self._radius = self._face_px = 0.0
        for picture in pictures:
            self._add(picture)

    def _add(self, picture: Picture) -> None:
        made = picture.recorded.provenance
        self._stages[made.stage.hash] += 1
        self._renderers[made.render.renderer] += 1
        _gather(self._files, made.stage.files)
        _gather(self._versions, made.versions)
        self._kinds |= dict.fromkeys(picture.files)
        for target in picture.targets:
            radius = float(np.abs(target.box).max(0) @ np.abs(target.box).max(0)) ** 0.5
            nearest = max(target.range - radius, SMALLEST)
            self._radius = max(self._radius, radius)
            self._farthest = max(self._farthest, target.range + radius)
            self._face_px = max(self._face_px, FACE * radius * max(picture.camera.fx, picture.camera.fy) / nearest)

    @property
    def sources(self) -> PictureSources:
        """All that the pictures were made from."""
        return PictureSources(
            stages=sorted(self._stages),
            files={name: sorted(found) for name, found in sorted(self._files.items())},
            versions={name: sorted(found) for name, found in sorted(self._versions.items())},
            licences={name: licence for name in sorted(self._versions) if (licence := licence_of(name))},
            renderers=dict(self._renderers),
        )

    @property
    def label_bounds(self) -> dict[str, LabelBound]:
        """The bounds of the errors of poses and of labels, of those for which one is known."""
        depth = LabelBound(bound=DEPTH * self._farthest, unit="m", reason="float32, at the farthest point in the set")
        body = LabelBound(bound=BODY * self._radius, unit="m", reason="float32, of the target's radius")
        reason = "an id can be its neighbour's only as near as this to the edge between them"
        face = LabelBound(bound=self._face_px, unit="px", reason=reason)
        pose = LabelBound(bound=PLACE, unit="m", reason="float64, of the stage's own numbers")
        by_kind = dict.fromkeys(BY_DEPTH, depth) | dict.fromkeys(BY_BODY, body) | dict.fromkeys(BY_FACE, face)
        return {"pose": pose, **{kind: by_kind[kind] for kind in self._kinds if kind in by_kind}}

    def without_bound(self, labels: Iterable[str]) -> list[str]:
        """Return those of the `labels` that the pictures have, and whose errors have no known bound."""
        return [kind for kind in self._kinds if kind in labels and kind not in self.label_bounds]


def licence_of(package: str) -> str:
    """Return the licence that an installed package states, "" for none, and for what is not a package."""
    try:
        found = metadata(package)
    except PackageNotFoundError:
        return ""
    stated = found.get("License-Expression") or found.get("License") or ""
    kinds = [line.rpartition(" :: ")[2] for line in found.get_all("Classifier") or () if line.startswith("License")]
    return stated if stated and len(stated) < 80 and "\n" not in stated else ", ".join(kinds)


def _gather(known: dict[str, set[str]], found: Mapping[str, str]) -> None:
    for name, value in found.items():
        known.setdefault(name, set()).add(value)
