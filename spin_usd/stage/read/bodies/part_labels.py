"""Semantic labels: the part of the target that a prim is, and its class."""

from dataclasses import dataclass, replace

from pxr import Usd

from spin_usd.errors import StageError
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import DEFAULT_TIME, TEXTS, read

UNKNOWN = "unknown"
MAX_LABEL = 255


@dataclass(frozen=True, kw_only=True)
class Labels:
    """The labels that a prim inherits, and the class that its descendants inherit.

    They are the part's prim path, its name ("" where no ancestor names one) and its class.
    """

    part_path: str = ""
    part_name: str = ""
    part_class: str = UNKNOWN
    class_name: str = UNKNOWN
    merged: frozenset[str] = frozenset()
    """Names of parts that are one part wherever they occur."""

    @property
    def part_key(self) -> tuple[str, str]:
        """The key that all prims of one part share: the name of a merged part, else the path."""
        return ("name", self.part_name) if self.part_name in self.merged else ("path", self.part_path)

    def below(self, prim: Usd.Prim) -> "Labels":
        """Return the labels of `prim`, whose parent has these; its own labels win."""
        class_name = _label(prim, schema.CLASS_LABELS) or self.class_name
        name = _label(prim, schema.PART_LABELS)
        if not name:
            return replace(self, class_name=class_name)
        path = str(prim.GetPath())
        return replace(self, part_path=path, part_name=name, part_class=class_name, class_name=class_name)

    def of_gprim(self, prim: Usd.Prim) -> "Labels":
        """Return the labels of a gprim that inherits these: its own part where no ancestor is one."""
        if self.part_path:
            return self
        path, name = str(prim.GetPath()), str(prim.GetName())
        return replace(self, part_path=path, part_name=name, part_class=self.class_name, merged=frozenset())


def labels_of_target(target: Usd.Prim) -> Labels:
    """Return the labels that the prims below the target inherit."""
    merged = target.GetAttribute(schema.TARGET_MERGED_PARTS)
    return Labels(merged=frozenset(read(merged, DEFAULT_TIME, *TEXTS) or ())).below(target)


def _label(prim: Usd.Prim, name: str) -> str:
    """Return the first label of a taxonomy on `prim` itself; "" where it has none."""
    labels = read(prim.GetAttribute(name), DEFAULT_TIME, *TEXTS) or [""]
    label = str(labels[0])
    if len(label) > MAX_LABEL or not (label.isprintable() or not label):
        raise StageError(
            f"holds a label that is too long or not printable: {label[:40]!r}", where=f"{prim.GetPath()}.{name}"
        )
    return label
