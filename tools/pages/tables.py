"""The reference of what can be chosen by name: labels, parameters, formats, what travels along."""

from collections.abc import Iterator
from pathlib import Path

from pages.markdown import cell, page_of_table, table
from pxr import Sdf

from spin_usd.exchange.layout.export_format import FormatOption
from spin_usd.exchange.table import EXPORT_FORMATS
from spin_usd.labels.label import Label
from spin_usd.labels.table import DEFAULT_LABELS, LABELS
from spin_usd.stage.augment.parameters import PARAMETERS

STAGES = Path(__file__).resolve().parents[2] / "stages"
BUNDLED = {
    "Targets": "targets/*/*.usda",
    "Cameras": "cameras/*.usda",
    "Presets": "presets/*.usda",
    "Lights": "lights/*.usda",
    "Environments": "environments/*.usda",
}


def labels() -> str:
    """Return the page of labels."""
    head = "# Labels\n\nWhat `render --labels` takes. [Labels](dataset.md#labels) explains how they are meant.\n"
    rows = ((f"`{name}`", cell(", ".join(_written(name))), cell(LABELS[name].channels.meaning)) for name in LABELS)
    return page_of_table(head, ("label", "written", "what it is"), rows)


def _written(name: str) -> Iterator[str]:
    label = LABELS[name]
    yield label.suffix
    if name in DEFAULT_LABELS:
        yield "by default"
    elif isinstance(label, Label) and label.of_several:
        yield "of several bodies"


def parameters() -> str:
    """Return the page of parameters."""
    head = (
        "# Parameters of augmentations\n\nWhat a specification can sample; `spin-usd augment --list` says the same.\n"
    )
    rows = ((f"`{each.name}`", cell(each.kind), each.unit, cell(each.description)) for each in PARAMETERS.values())
    return page_of_table(head, ("parameter", "kind", "unit", "meaning"), rows)


def formats() -> str:
    """Return the page of export formats."""
    lines = ["# Export formats\n\nWhat `export --to` takes, and its options: see [Export](../how-to/export.md).\n"]
    for each in EXPORT_FORMATS.values():
        lines.append(f"## {each.name}\n\nA dataset {cell(each.holds)}.\n")
        lines += (f"- {cell(sentence)}" for sentence in each.layout_for(each.values({})).conventions)
        if each.options:
            lines += ["", table(("`--option`", "default", "meaning"), map(_option, each.options))]
        lines.append("")
    return "\n".join(lines)


def _option(option: FormatOption) -> tuple[str, str, str]:
    meaning = f"{option.meaning}: {', '.join(option.choices)}" if option.choices else option.meaning
    return f"`{option.name}`", f"`{option.default}`", cell(meaning)


def bundled() -> str:
    """Return the page of what travels along."""
    lines = ["# What travels along\n\nNames that `author` takes, and what each says of itself.\n"]
    for title, pattern in BUNDLED.items():
        paths = (p for p in sorted(STAGES.glob(pattern)) if title != "Targets" or p.stem == p.parent.name)
        rows = ((f"`{path.stem}`", cell(Sdf.Layer.FindOrOpen(str(path)).documentation)) for path in paths)
        lines += [f"## {title}\n", table(("name", "what it is"), rows), ""]
    return "\n".join(lines)
