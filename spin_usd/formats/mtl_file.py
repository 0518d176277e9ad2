"""MTL material libraries: constant colours and textures in, UsdPreviewSurface's inputs out.

Kd is the diffuse colour. MTL's Ks and Ns belong to a Phong lobe that no surface has, so they are read as exporters mean
them: the mean of Ks as Disney's "specular", a head-on reflectance of 0.08 Ks (B. Burley, "Physically-Based Shading at
Disney", 2012), and Ns as the Blinn-Phong exponent, roughness^2 = sqrt(2 / (Ns + 2)) (B. Karis, "Specular BRDF
Reference", 2013). Pm and Pr, where there, are metallic and roughness. Colours are taken as linear.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.formats.mtl_maps import MapStatement, image_of, is_map, map_statement
from spin_usd.scene.asset import ImageMap, ModelMaterial
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Color


@dataclass
class _Entry:
    """A material while the file is read; `stated` are the constants that it gives."""

    constants: Material
    stated: set[str] = field(default_factory=set)
    maps: list[MapStatement] = field(default_factory=list)


def read_mtl(path: Path, text: str) -> tuple[dict[str, ModelMaterial], list[str]]:
    """The materials in `text` by name, and notes. Raises InputError that names `path` and the line."""
    found: dict[str, _Entry] = {}
    entry = None
    for number, line in enumerate(text.splitlines(), 1):
        where = f"{path}, line {number}"
        key, *rest = line.partition("#")[0].strip().split(None, 1)[:2] or [""]
        if key == "newmtl":
            name = rest[0] if rest else ""
            entry = found[name] = _Entry(Material(path=name))
        elif entry is None or not key:
            continue
        elif is_map(key):
            entry.maps.append(map_statement(key, "".join(rest), where))
        else:
            entry.constants = _changed(entry.constants, key, "".join(rest).split(), where)
            entry.stated.add("d" if key == "Tr" else key)
    notes: list[str] = []
    return {name: _with_images(entry, path, notes) for name, entry in found.items()}, notes


def _with_images(entry: _Entry, path: Path, notes: list[str]) -> ModelMaterial:
    """The material with its textures; those that cannot be carried over are noted."""
    images: dict[str, ImageMap] = {}
    about = f"material {entry.constants.path!r} of {path.name}"
    for statement in entry.maps:
        try:
            name, image, remarks = image_of(statement, path, entry.constants, entry.stated)
        except InputError as error:
            if error.where is not None:
                raise
            notes.append(f"{about}: {statement.key} {statement.file} is not carried over: {error.found}")
            continue
        images[name] = image
        notes += [f"{about}: {statement.key} {statement.file}: {remark}" for remark in remarks]
    return ModelMaterial(constants=entry.constants, images=images)


def _changed(material: Material, key: str, fields: list[str], where: str) -> Material:
    if key == "Kd":
        return replace(material, diffuse_color=_color(fields, where))
    if key == "Ks":
        head_on = (0.08 * sum(_color(fields, where)) / 3) ** 0.5
        return replace(material, ior=(1 + head_on) / (1 - head_on))
    if key == "Ke":
        return replace(material, emissive_color=_color(fields, where, high=1e6))
    if key == "Ns":
        return replace(material, roughness=(2 / (_number(fields, where, high=1e6) + 2)) ** 0.25)
    if key == "Pr":
        return replace(material, roughness=_number(fields, where))
    if key == "Pm":
        return replace(material, metallic=_number(fields, where))
    if key == "d":
        return replace(material, opacity=_number(fields, where))
    if key == "Tr":
        return replace(material, opacity=1 - _number(fields, where))
    return material


def _color(fields: list[str], where: str, high: float = 1.0) -> Color:
    if len(fields) == 1:
        fields = fields * 3
    if len(fields) != 3:
        raise InputError(f"{' '.join(fields)[:40]!r} is not a colour", where=where)
    r, g, b = (_number([text], where, high) for text in fields)
    return r, g, b


def _number(fields: list[str], where: str, high: float = 1.0) -> float:
    try:
        value = float(fields[0])
    except (ValueError, IndexError):
        raise InputError(f"{' '.join(fields)[:40]!r} is not a number", where=where) from None
    if not 0 <= value <= high:
        raise InputError(f"{value!r} is not within 0 and {high:g}", where=where)
    return value
