"""A stage of the microsat with variants whose parts are not as drawn."""

from pathlib import Path

import spin_usd

WING = "WingPlusX+CellsPlusX"
TURN, BENT, BULGED, SCALE, SHIFT = 20.0, 30.0, 0.01, 1.25, (0.02, -0.01, 0.03)
VARIANTS = {
    "as_drawn": {
        f"part.{WING}.turn": "0",
        f"part.{WING}.bent": "0",
        f"part.{WING}.shift.x": "0",
        f"part.{WING}.scale": "1",
        "part.Body.bulged": "0",
        "part.Antenna.missing": "false",
    },
    "moved": {
        f"part.{WING}.axis": "[1, 0, 0]",
        f"part.{WING}.turn": str(TURN),
        f"part.{WING}.scale": str(SCALE),
        **{f"part.{WING}.shift.{axis}": str(way) for axis, way in zip("xyz", SHIFT, strict=True)},
    },
    "bent": {f"part.{WING}.bent": str(BENT)},
    "bulged": {"part.Body.bulged": str(BULGED)},
    "gone": {f"part.{WING}.missing": "true"},
    "every": {f"part.{WING}.bent": str(BENT), f"part.{WING}.turn": str(TURN), "part.Body.bulged": str(BULGED)},
}
UNITS = {"turn": "deg", "bent": "deg", "bulged": "m", "x": "m", "y": "m", "z": "m"}


def specification(variants=VARIANTS) -> str:
    """The variants as a specification of augmentations."""
    lines = ['schema = "augment-1"']
    for name, values in variants.items():
        lines += ["[[augmentation]]", f'name = "{name}"', "[augmentation.sample]"]
        for parameter, value in values.items():
            unit = UNITS.get(parameter.rpartition(".")[2])
            given = f', unit = "{unit}"' if unit else ""
            lines.append(f'"{parameter}" = {{ distribution = "fixed", value = {value}{given} }}')
    return "\n".join(lines)


def author_shaped(folder: Path, frames: int = 2) -> Path:
    """Author the stage in a folder; return its root layer."""
    (folder / "shapes.toml").write_text(specification())
    spin_usd.author(
        sample="range=2.5..3.5 inside=1",
        count=frames,
        target="microsat",
        camera="speedplus",
        resolution=192,
        augment=folder / "shapes.toml",
        out=folder / "stage",
    )
    return folder / "stage" / "dataset.usda"
