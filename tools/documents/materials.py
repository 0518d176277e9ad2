"""The block made of the library of materials, which `tools/build_materials` writes."""

from pathlib import Path

from materials.library_material import LibraryMaterial
from materials.table import LIBRARY

from spin_usd.accuracy.tables import in_markdown

HEAD = ("name", "what it is", "kind", "colour", "roughness", "pattern, mm", "source")


def materials(figures: Path) -> str:
    """Return a row for each material of the library."""
    table = in_markdown(HEAD, [_row(name, material) for name, material in LIBRARY.items()])
    return table.replace("---:", "---")  # its columns are words


def _row(name: str, material: LibraryMaterial) -> list[str]:
    colour = " ".join(f"{value:.2f}" if value >= 0.1 else f"{value:.3f}" for value in material.body)
    low, high = material.roughness
    roughness = f"{material.plain.roughness:.2f}; {low:.2f} to {high:.2f}"
    pattern = " x ".join(f"{1000 * size:.0f}" for size in material.pattern or ())
    return [f"`{name}`", material.about, material.kind, colour, roughness, pattern, material.source]
