"""The texture statements of MTL, such as `map_Kd -s 2 2 -clamp on wood.png`, as images for UsdPreviewSurface.

A map is multiplied by its constant, as the format says ("MTL material format", 1995): map_Kd by Kd, map_d by d. -s and
-o are read as today's importers do (three.js, Blender): st times -s plus -o. Colours of 8 bits are taken as sRGB.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.formats.texture_file import color_space, has_alpha, is_grey, texture_beside
from spin_usd.scene.asset import RAW, ImageFile, ImageMap, ImageTransform
from spin_usd.scene.material import Material

INPUTS = {
    "map_kd": "diffuseColor",
    "map_ke": "emissiveColor",
    "map_d": "opacity",
    "map_pr": "roughness",
    "map_pm": "metallic",
    "norm": "normal",
}
FACTORS = {"map_kd": "Kd", "map_ke": "Ke", "map_d": "d", "map_pr": "Pr", "map_pm": "Pm"}
FIELDS = {"Kd": "diffuse_color", "Ke": "emissive_color", "d": "opacity", "Pr": "roughness", "Pm": "metallic"}
COLORS, NORMAL = ("map_kd", "map_ke"), "norm"
HEIGHTS = ("map_bump", "bump", "disp")
CHANNELS = {"r": "r", "g": "g", "b": "b", "m": "a"}
ARGUMENTS = {"-mm": 2, "-o": 3, "-s": 3, "-t": 3}  # the others have one
CARRIED = ("-s", "-o", "-clamp", "-imfchan")
NEUTRAL = {"-mm": (0.0, 1.0), "-t": (0.0, 0.0, 0.0), "-bm": (1.0,)}
WITHOUT_EFFECT = ("-blendu", "-blendv", "-texres", "-boost")  # how a texture is filtered, not what it shows


@dataclass(frozen=True, kw_only=True)
class MapStatement:
    """`options` by name with their arguments, and the file's name as it is written."""

    key: str
    options: Mapping[str, tuple[str, ...]]
    file: str
    where: str


def is_map(key: str) -> bool:
    """Return whether a statement's keyword assigns a texture."""
    return key.lower().startswith(("map_", "bump", "norm", "disp", "refl", "decal"))


def map_statement(key: str, rest: str, where: str) -> MapStatement:
    """Return the statement `key rest`: options, then the file's name, which may hold spaces. Raises InputError."""
    options: dict[str, tuple[str, ...]] = {}
    rest = rest.strip()
    while rest.startswith("-"):
        option, *arguments = rest.split()
        wanted = ARGUMENTS.get(option, 1)
        given = 0
        while given < min(wanted, len(arguments)) and (wanted != 3 or _is_number(arguments[given])):
            given += 1
        options[option] = tuple(arguments[:given])
        for _ in range(given + 1):
            rest = rest.partition(" ")[2].lstrip()
    if not rest:
        raise InputError(f"{key} names no file", where=where)
    return MapStatement(key=key, options=options, file=rest, where=where)


def image_of(
    statement: MapStatement, library: Path, folder: Path, material: Material, stated: set[str]
) -> tuple[str, ImageMap, list[str]]:
    """Return (input, image, notes) for `material`, whose constants `stated` were given; the image lies within `folder`.

    Raises InputError for what has no place.
    """
    key = statement.key.lower()
    if key not in INPUTS:
        height = "it is a height map, and UsdPreviewSurface has normal maps (norm)"
        raise InputError(height if key in HEIGHTS else "UsdPreviewSurface has no input for it")
    _refuse_options(statement)
    file = texture_beside(library, statement.file, folder)
    is_color, constant = key in COLORS, FACTORS.get(key)
    factor = getattr(material, FIELDS[constant]) if constant and constant in stated else 1.0
    notes = []
    if constant == "Kd" and factor == (0.0, 0.0, 0.0):
        factor = 1.0
        notes.append("its material's Kd of 0 was ignored, as CAD programs write it beside a map")
    image = ImageMap(
        file=file,
        color_space=color_space(file) if is_color else RAW,
        output="rgb" if is_color or key == NORMAL else _channel(statement, file),
        placement=_placement(statement),
        wrap=("clamp", "clamp") if _clamped(statement) else ("repeat", "repeat"),
        scale=(*factor, 1.0) if isinstance(factor, tuple) else (factor,) * 4,
    )
    if key == NORMAL:
        image = replace(image, scale=(2.0, 2.0, 2.0, 1.0), bias=(-1.0, -1.0, -1.0, 0.0))
    if _clamped(statement):
        notes.append("beyond the clamped image its edge goes on, not the plain material")
    if factor in (0.0, (0.0, 0.0, 0.0)):
        notes.append(f"is multiplied by {constant}, which is 0")
    return INPUTS[key], image, notes


def _refuse_options(statement: MapStatement) -> None:
    """Raise InputError for options that change what the texture shows and that USD has no equivalent of."""
    for option, given in statement.options.items():
        if option in (*CARRIED, *WITHOUT_EFFECT):
            continue
        neutral = NEUTRAL.get(option, ())
        if not neutral or any(_number(text, statement) != n for text, n in zip(given, neutral, strict=False)):
            raise InputError(f"USD has no equivalent of its option {option} {' '.join(given)}")


def _channel(statement: MapStatement, file: ImageFile) -> str:
    """Return the channel of a scalar texture: as -imfchan says, else opacity where the image has it, else its grey."""
    asked = (*statement.options.get("-imfchan", ()), "")[0].lower()
    if asked in CHANNELS:
        return CHANNELS[asked]
    if not asked and statement.key.lower() == "map_d" and has_alpha(file):
        return "a"
    if is_grey(file):
        return "r"
    raise InputError("USD cannot take the luminance of a coloured image; give a grey one, or -imfchan")


def _placement(statement: MapStatement) -> ImageTransform:
    su, sv = _pair(statement, "-s", 1.0)
    ou, ov = _pair(statement, "-o", 0.0)
    return ImageTransform(scale=(su, sv), translation=(ou, ov))


def _pair(statement: MapStatement, option: str, missing: float) -> tuple[float, float]:
    u, v, *_ = (*(_number(text, statement) for text in statement.options.get(option, ())), missing, missing)
    return u, v


def _clamped(statement: MapStatement) -> bool:
    return statement.options.get("-clamp", ()) == ("on",)


def _number(text: str, statement: MapStatement) -> float:
    if not _is_number(text):
        raise InputError(f"{text[:40]!r} is not a number", where=statement.where)
    return float(text)


def _is_number(text: str) -> bool:
    try:
        return abs(float(text)) < float("inf")
    except ValueError:
        return False
