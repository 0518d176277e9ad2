"""MTL material libraries: constant colours and textures in, UsdPreviewSurface's inputs out."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.formats.texture_file import color_space, has_alpha, is_grey, texture_beside
from spin_usd.scene.asset import RAW, SRGB, ImageFile, ImageMap, ImageTransform, ModelMaterial
from spin_usd.scene.material import PRESENCE, Material
from spin_usd.scene.texture import Color

COLOR, NUMBER = "color", "number"
CONSTANTS = dict.fromkeys(("Kd", "Ke", "Ks"), COLOR) | dict.fromkeys(("Ns", "Pr", "Pm", "Pc", "Pcr", "d", "Tr"), NUMBER)
UNMODELLED = {"Ps": "sheen", "aniso": "anisotropy"}
HIGHEST = {"Ke": 1e6, "Ns": 1e6}  # of a statement's numbers; of the others 1
AGREEMENT = 0.01  # exporters round d and Tr apart
INPUTS = {
    "map_kd": "diffuseColor",
    "map_ke": "emissiveColor",
    "map_d": "opacity",
    "map_pr": "roughness",
    "map_pm": "metallic",
    "map_pc": "clearcoat",
    "map_pcr": "clearcoatRoughness",
    "norm": "normal",
}
FACTORS = {
    "map_kd": "Kd",
    "map_ke": "Ke",
    "map_d": "d",
    "map_pr": "Pr",
    "map_pm": "Pm",
    "map_pc": "Pc",
    "map_pcr": "Pcr",
}
PLAIN = {"Pr": "roughness", "Pm": "metallic", "Pc": "clearcoat", "Pcr": "clearcoat_roughness"}
FIELDS = {"Kd": "diffuse_color", "Ke": "emissive_color", "d": "opacity"} | PLAIN
COLORS, NORMAL = ("map_kd", "map_ke"), "norm"
HEIGHTS = ("map_bump", "bump", "disp")
CHANNELS = {"r": "r", "g": "g", "b": "b", "m": "a"}
ARGUMENTS = {"-mm": 2, "-o": 3, "-s": 3, "-t": 3}  # the others have one
CARRIED = ("-s", "-o", "-clamp", "-imfchan", "-colorspace")
SPACES = {"srgb": SRGB, "linear": RAW, "raw": RAW}
NEUTRAL = {"-mm": (0.0, 1.0), "-t": (0.0, 0.0, 0.0), "-bm": (1.0,)}
WITHOUT_EFFECT = ("-blendu", "-blendv", "-texres", "-boost")  # filtering of a texture, not its content


@dataclass(frozen=True, kw_only=True)
class MapStatement:
    """`options` by name with their arguments, and the file's name as written."""

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

    Texture statements, such as `map_Kd -s 2 2 -clamp on wood.png`, are images for UsdPreviewSurface. A map is
    multiplied by its constant, as the format defines ("MTL material format", 1995): map_Kd by Kd, map_d by d. -s and -o
    are read as by today's importers (three.js, Blender): st times -s plus -o. Colours of 8 bits are taken as sRGB.
    Raises InputError for a map without an input.
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
        color_space=_color_space(statement, color_space(file) if is_color else RAW),
        output="rgb" if is_color or key == NORMAL else _channel(statement, file),
        placement=_placement(statement),
        wrap=("clamp", "clamp") if _clamped(statement) else ("repeat", "repeat"),
        scale=(*factor, 1.0) if isinstance(factor, tuple) else (factor,) * 4,
    )
    if key == NORMAL:
        image = replace(image, scale=(2.0, 2.0, 2.0, 1.0), bias=(-1.0, -1.0, -1.0, 0.0))
    if image.color_space == SRGB and not is_color:
        notes.append("its numbers are decoded from sRGB, as -colorspace has it; most images of numbers are linear")
    if _clamped(statement):
        notes.append("beyond the clamped image its edge goes on, not the plain material")
    if factor in (0.0, (0.0, 0.0, 0.0)):
        notes.append(f"is multiplied by {constant}, which is 0")
    return INPUTS[key], image, notes


def _refuse_options(statement: MapStatement) -> None:
    """Raise InputError for options that change the texture's content and have no equivalent in USD."""
    for option, given in statement.options.items():
        if option in (*CARRIED, *WITHOUT_EFFECT):
            continue
        neutral = NEUTRAL.get(option, ())
        if not neutral or any(_argument_number(text, statement) != n for text, n in zip(given, neutral, strict=False)):
            raise InputError(f"USD has no equivalent of its option {option} {' '.join(given)}")


def _channel(statement: MapStatement, file: ImageFile) -> str:
    """Return the channel of a scalar texture: from -imfchan, else opacity if the image has it, else its grey."""
    asked = (*statement.options.get("-imfchan", ()), "")[0].lower()
    if asked in CHANNELS:
        return CHANNELS[asked]
    if not asked and statement.key.lower() == "map_d" and has_alpha(file):
        return "a"
    if is_grey(file):
        return "r"
    raise InputError("USD cannot take the luminance of a coloured image; give a grey one, or -imfchan")


def _color_space(statement: MapStatement, usual: str) -> str:
    """Return the colour space of -colorspace, an option of tinyobjloader; without it the usual one."""
    given = (*statement.options.get("-colorspace", ()), "")[0]
    if given and given.lower() not in SPACES:
        raise InputError(f"its colour space {given!r} is not sRGB or linear")
    return SPACES[given.lower()] if given else usual


def _placement(statement: MapStatement) -> ImageTransform:
    su, sv = _pair(statement, "-s", 1.0)
    ou, ov = _pair(statement, "-o", 0.0)
    return ImageTransform(scale=(su, sv), translation=(ou, ov))


def _pair(statement: MapStatement, option: str, missing: float) -> tuple[float, float]:
    u, v, *_ = (*(_argument_number(text, statement) for text in statement.options.get(option, ())), missing, missing)
    return u, v


def _clamped(statement: MapStatement) -> bool:
    return statement.options.get("-clamp", ()) == ("on",)


def _argument_number(text: str, statement: MapStatement) -> float:
    if not _is_number(text):
        raise InputError(f"{text[:40]!r} is not a number", where=statement.where)
    return float(text)


def _is_number(text: str) -> bool:
    try:
        return abs(float(text)) < float("inf")
    except ValueError:
        return False


@dataclass(frozen=True, kw_only=True)
class Statements:
    """The statements of one material on its opacity, None where it has none."""

    d: float | None = None
    tr: float | None = None


def tr_is_opacity(library: Collection[Statements]) -> bool:
    """Return whether the writer of a library gives Tr the meaning of d.

    To most programs Tr is 1 - d, to others another name of d: MeshLab, openMVS and mvs-texturing wrote `Tr 1` and no d
    of opaque materials for years (MeshLab issue 1399, openMVS pull request 1285, mvs-texturing pull request 97),
    IfcOpenShell both with one value (its issue 140). A library has one writer: if it has `Tr 1` for a material with
    only Tr, and nowhere `Tr 0`, 1 means opaque, since nobody exports an invisible material.
    """
    alone = {said.tr for said in library if said.d is None and said.tr is not None}
    return 1.0 in alone and 0.0 not in alone


def opacity(said: Statements, tr_is_d: bool) -> float:
    """Opacity from 0 to 1; 1 if not stated.

    `d` takes precedence, since only `d`, not `Tr`, is in the format's own text.
    """
    if said.d is not None:
        return said.d
    if said.tr is None:
        return 1.0
    return said.tr if tr_is_d else 1 - said.tr


def opacity_note(said: Statements, tr_is_d: bool) -> str | None:
    """Return a note for the user on a material whose opacity `tr_is_opacity` decided, or whose statements disagree."""
    if said.tr is None:
        return None
    if said.d is not None:
        agrees = abs(said.d - (1 - said.tr)) <= AGREEMENT
        return None if agrees else f"d {said.d:g} and Tr {said.tr:g} contradict each other: d was taken"
    if tr_is_d:
        return (
            f"Tr {said.tr:g} without d was taken as opacity {said.tr:g}, because its library has Tr 1 and nowhere "
            "Tr 0, as MeshLab writes for opaque materials; write d to override"
        )
    return f"Tr {said.tr:g} without d was taken as opacity {1 - said.tr:g}; write d to override" if said.tr else None


@dataclass
class _Entry:
    """A material while the file is read."""

    constants: Material
    stated: set[str] = field(default_factory=set)
    """The constants that it gives."""
    maps: list[MapStatement] = field(default_factory=list)
    opacity: Statements = field(default_factory=Statements)
    moved: list[str] = field(default_factory=list)
    """Sentences on the statements that are not taken as they stand."""


def read_mtl(path: Path, lines: Iterable[str], folder: Path) -> tuple[dict[str, ModelMaterial], list[str]]:
    """Read the materials in the `lines` by name, and notes. `folder` is the model's, which no texture may leave.

    Raises InputError that names `path` and the line.
    """
    found: dict[str, _Entry] = {}
    entry = None
    for number, line in enumerate(lines, 1):
        where = f"{path}, line {number}"
        key, *rest = [""] if line.lstrip().startswith("#") else line.strip().split(None, 1)[:2] or [""]
        if key == "newmtl":
            name = rest[0] if rest else ""
            entry = found[name] = _Entry(Material(path=name))
        elif entry is None or not key:
            continue
        elif is_map(key):
            entry.maps.append(map_statement(key, "".join(rest), where))
        elif key in UNMODELLED and _number("".join(rest).split(), where):
            entry.moved.append(f"its {UNMODELLED[key]} ({key} {rest[0]}) is left out: UsdPreviewSurface has none")
        elif key in CONSTANTS:
            _state(entry, key, "".join(rest).partition("#")[0].split(), where)
    tr_is_d = tr_is_opacity([entry.opacity for entry in found.values()])
    notes: list[str] = []
    return {name: _finished(entry, tr_is_d, path, folder, notes) for name, entry in found.items()}, notes


def _finished(entry: _Entry, tr_is_d: bool, path: Path, folder: Path, notes: list[str]) -> ModelMaterial:
    """Return the material with its opacity and textures, and notes on decisions and on losses."""
    constants = replace(entry.constants, opacity=opacity(entry.opacity, tr_is_d))
    about = f"material {constants.path!r} of {path.name}"
    decided = opacity_note(entry.opacity, tr_is_d)
    notes += [f"{about}: {remark}" for remark in (*entry.moved, *([decided] if decided else []))]
    images: dict[str, ImageMap] = {}
    for statement in entry.maps:
        try:
            name, image, remarks = image_of(statement, path, folder, constants, entry.stated)
        except InputError as error:
            if error.where is not None:
                raise
            notes.append(f"{about}: {statement.key} {statement.file} is not carried over: {error.found}")
            continue
        images[name] = image
        notes += [f"{about}: {statement.key} {statement.file}: {remark}" for remark in remarks]
    if constants.opacity != 1 or "opacity" in images:  # d dissolves the whole surface, its gloss too
        constants = replace(constants, opacity_mode=PRESENCE)
    return ModelMaterial(constants=constants, images=images)


def _state(entry: _Entry, key: str, fields: list[str], where: str) -> None:
    """Apply the statement `key` to the material.

    Numbers out of range are clamped, with a note: Blender wrote Ns -1.96 for years.
    """
    if fields[:1] == ["-halo"]:  # of d: fading towards the silhouette, which a surface's opacity cannot do
        entry.moved.append("the option -halo of its d is ignored")
        fields = fields[1:]
    color = _color(fields, where) if CONSTANTS[key] == COLOR else (_number(fields, where),) * 3
    high = HIGHEST.get(key, 1.0)
    r, g, b = (min(max(value, 0.0), high) for value in color)
    if (r, g, b) != color:
        entry.moved.append(f"{key} {' '.join(fields)} is not within 0 and {high:g}: the nearest number there was taken")
    entry.stated.add("d" if key == "Tr" else key)
    if key == "d":
        entry.opacity = replace(entry.opacity, d=r)
    elif key == "Tr":
        entry.opacity = replace(entry.opacity, tr=r)
    else:
        entry.constants = changed(entry.constants, key, (r, g, b))


def changed(material: Material, key: str, value: Color) -> Material:
    """Return `material` with a statement's colour, or with its number, repeated in `value`.

    Kd is the diffuse colour. MTL's Ks and Ns belong to a Phong lobe that no surface has, so they are read as exporters
    mean them: the mean of Ks as Disney's "specular", a head-on reflectance of 0.08 Ks (B. Burley, "Physically-Based
    Shading at Disney", 2012), and Ns as the Blinn-Phong exponent, roughness^2 = sqrt(2 / (Ns + 2)) (B. Karis, "Specular
    BRDF Reference", 2013). Pm and Pr, where there, are metallic and roughness. Colours are taken as linear.
    """
    if key == "Kd":
        return replace(material, diffuse_color=value)
    if key == "Ke":
        return replace(material, emissive_color=value)
    if key == "Ks":
        head_on = (0.08 * sum(value) / 3) ** 0.5
        return replace(material, ior=(1 + head_on) / (1 - head_on))
    if key == "Ns":
        return replace(material, roughness=(2 / (value[0] + 2)) ** 0.25)
    plain: dict[str, Any] = {PLAIN[key]: value[0]}
    return replace(material, **plain)


def _color(fields: list[str], where: str) -> Color:
    if len(fields) == 1:
        fields = fields * 3
    if len(fields) != 3:
        raise InputError(f"{' '.join(fields)[:40]!r} is not a colour", where=where)
    r, g, b = (_number([text], where) for text in fields)
    return r, g, b


def _number(fields: list[str], where: str) -> float:
    try:
        value = float(fields[0])
    except (ValueError, IndexError):
        value = float("nan")
    if not isfinite(value):
        raise InputError(f"{' '.join(fields)[:40]!r} is not a number", where=where)
    return value
