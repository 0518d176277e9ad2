"""glTF's metallic-roughness materials as UsdPreviewSurface. Source: glTF 2.0, sections 3.8 and 3.9, and the extensions
KHR_texture_transform, KHR_materials_ior, KHR_materials_emissive_strength, KHR_materials_clearcoat and EXT_texture_webp.

A texture is multiplied by its factor after it is made linear. glTF's (0, 0) is the image's upper left corner, USD's the
lower left: v = 1 - t. KHR_texture_transform turns counter-clockwise as seen on the image, as its text and its example
say and its readers do; the matrix printed with them turns the other way (KhronosGroup/glTF issue 1563).
"""

from dataclasses import dataclass, field, replace
from math import cos, degrees, sin
from typing import Any

from spin_usd.errors import InputError
from spin_usd.formats.mesh.gltf_document import Document, at
from spin_usd.scene.material import INFINITY, LIMITS, PRESENCE, Material
from spin_usd.scene.source.asset import RAW, SRGB, ImageMap, ImageTransform, ModelMaterial
from spin_usd.scene.texture import RGBA, Color, Primvar

TRANSFORM = "KHR_texture_transform"
IOR, STRENGTH, CLEARCOAT = "KHR_materials_ior", "KHR_materials_emissive_strength", "KHR_materials_clearcoat"
WEBP = "EXT_texture_webp"
MATERIAL_EXTENSIONS = (TRANSFORM, IOR, STRENGTH, CLEARCOAT, WEBP)
WRAPS = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
NEAREST = 9728
OPAQUE, MASK = "OPAQUE", "MASK"
DISPLAY_COLOR = "displayColor"
ONE: RGBA = (1.0, 1.0, 1.0, 1.0)


@dataclass
class _Reading:
    """One material while it is read, for parts that have the texture coordinates `sets`."""

    document: Document
    name: str
    sets: frozenset[int]
    images: dict[str, ImageMap] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def factor(self, name: str, value: Any, low: float = 0.0, high: float = 1.0) -> float:
        """Return the factor that glTF calls `name`; outside its limits the nearer of them, with a note."""
        taken = min(max(float(value), low), high)
        if taken != value:
            self.notes.append(f"material {self.name!r}: its {name} is {float(value):g}, and {taken:g} was taken")
        return taken

    def factors(self, name: str, values: Any) -> tuple[float, ...]:
        return tuple(self.factor(name, value) for value in values)

    def add(self, name: str, info: dict[str, Any] | None, kind: str, **uses: Any) -> None:
        """Add the texture `info` for the input `name`, or a note why not; `kind` is what glTF calls it."""
        if info is None:
            return
        try:
            self.images[name] = _image(self.document, info, self.sets, **uses)
        except InputError as error:
            self.notes.append(f"material {self.name!r}: its {kind} is not carried over: {error.found}")
            return
        sampler = _sampler(self.document, info)
        if sampler.get("magFilter") == NEAREST:
            self.notes.append(f"material {self.name!r}: its {kind} asks for nearest texels and is interpolated")


def read_material(
    document: Document, index: int, *, sets: frozenset[int], colored: bool
) -> tuple[ModelMaterial, list[str]]:
    """Read the material `index` for parts with the texture coordinates `sets`, and notes.

    Where `colored`, the parts' displayColor, into which the factor has been multiplied, is the diffuse colour.
    """
    entry = at(document.entries("materials"), index)
    reading = _Reading(document, entry.get("name") or f"material_{index}", sets)
    factors, extensions = entry.get("pbrMetallicRoughness", {}), entry.get("extensions", {})
    reading.factors("baseColorFactor", factors.get("baseColorFactor", ONE))
    base = base_color(entry)
    strength = reading.factor(
        "emissiveStrength", extensions.get(STRENGTH, {}).get("emissiveStrength", 1), high=INFINITY
    )
    emissive = _color(reading.factors("emissiveFactor", entry.get("emissiveFactor", (0, 0, 0))), strength)
    metallic = reading.factor("metallicFactor", factors.get("metallicFactor", 1))
    roughness = reading.factor("roughnessFactor", factors.get("roughnessFactor", 1))
    coat = extensions.get(CLEARCOAT, {})
    coated = reading.factor("clearcoatFactor", coat.get("clearcoatFactor", 0))
    coat_roughness = reading.factor("clearcoatRoughnessFactor", coat.get("clearcoatRoughnessFactor", 0))
    constants = Material(
        path=reading.name,
        diffuse_color=Primvar(name=DISPLAY_COLOR) if colored else base[:3],
        emissive_color=emissive,
        metallic=metallic,
        roughness=roughness,
        clearcoat=coated,
        clearcoat_roughness=coat_roughness if coated else Material(path="").clearcoat_roughness,
        ior=reading.factor("ior", extensions.get(IOR, {}).get("ior", 1.5), LIMITS["ior"].low, LIMITS["ior"].high),
    )
    if not colored:
        reading.add("diffuseColor", factors.get("baseColorTexture"), "baseColorTexture", space=SRGB, scale=base)
    packed, both = factors.get("metallicRoughnessTexture"), (1.0, roughness, metallic, 1.0)
    reading.add("roughness", packed, "metallicRoughnessTexture", output="g", scale=both)
    if packed is not None and "roughness" in reading.images:
        reading.images["metallic"] = replace(reading.images["roughness"], output="b")
    reading.add("emissiveColor", entry.get("emissiveTexture"), "emissiveTexture", space=SRGB, scale=(*emissive, 1.0))
    _add_normal(reading, entry.get("normalTexture"))
    _add_occlusion(reading, entry.get("occlusionTexture"))
    if coated:
        reading.add("clearcoat", coat.get("clearcoatTexture"), "clearcoatTexture", output="r", scale=(coated,) * 4)
        rough, scale = coat.get("clearcoatRoughnessTexture"), (coat_roughness,) * 4
        reading.add("clearcoatRoughness", rough, "clearcoatRoughnessTexture", output="g", scale=scale)
        if "clearcoatNormalTexture" in coat:
            reading.notes.append(f"material {reading.name!r}: its clearcoatNormalTexture has no input in USD")
    constants = _with_opacity(reading, entry, constants, base)
    return ModelMaterial(constants=constants, images=reading.images), reading.notes


def base_color(entry: dict[str, Any]) -> RGBA:
    """Return the material's baseColorFactor, within its limits."""
    factors = entry.get("pbrMetallicRoughness", {})
    red, green, blue, alpha = (min(max(float(x), 0.0), 1.0) for x in factors.get("baseColorFactor", ONE))
    return red, green, blue, alpha


def has_base_texture(entry: dict[str, Any]) -> bool:
    return "baseColorTexture" in entry.get("pbrMetallicRoughness", {})


def _color(factor: Any, strength: float) -> Color:
    red, green, blue = (float(x) * float(strength) for x in factor)
    return red, green, blue


def _add_normal(reading: _Reading, info: dict[str, Any] | None) -> None:
    scale = float((info or {}).get("scale", 1))
    uses = {"scale": (2 * scale, 2 * scale, 2.0, 1.0), "bias": (-scale, -scale, -1.0, 0.0)}
    reading.add("normal", info, "normalTexture", **uses)
    if "normal" in reading.images and scale != 1:
        reading.notes.append(
            f"material {reading.name!r}: the scale {scale:g} of its normalTexture is kept, and USD's validator, which "
            "expects 1, warns of it"
        )


def _add_occlusion(reading: _Reading, info: dict[str, Any] | None) -> None:
    strength = float((info or {}).get("strength", 1))
    scale, bias = (strength,) * 4, (1 - strength,) * 4
    reading.add("occlusion", info, "occlusionTexture", output="r", scale=scale, bias=bias)


def _with_opacity(reading: _Reading, entry: dict[str, Any], constants: Material, base: RGBA) -> Material:
    """alphaMode: MASK is a cut-out, BLEND the share by which a surface is there, OPAQUE has no alpha."""
    mode = entry.get("alphaMode", OPAQUE)
    cutoff = max(float(entry.get("alphaCutoff", 0.5)), 0.0)
    if mode == OPAQUE or (mode == MASK and cutoff == 0):
        return constants
    if "diffuseColor" in reading.images:
        reading.images["opacity"] = replace(reading.images["diffuseColor"], output="a")
    if mode == MASK and cutoff > 1:
        reading.images.pop("opacity", None)
        return replace(constants, opacity=0.0, opacity_threshold=1.0)  # nothing of it is there
    if mode == MASK:
        return replace(constants, opacity=base[3], opacity_threshold=cutoff)
    return replace(constants, opacity=base[3], opacity_mode=PRESENCE)


def _image(
    document: Document,
    info: dict[str, Any],
    sets: frozenset[int],
    *,
    space: str = RAW,
    output: str = "rgb",
    scale: RGBA = ONE,
    bias: RGBA = (0.0, 0.0, 0.0, 0.0),
) -> ImageMap:
    """Raises InputError for an image that cannot be had, or texture coordinates that the part lacks."""
    texture = at(document.entries("textures"), info["index"])
    source = texture.get("extensions", {}).get(WEBP, {}).get("source", texture.get("source"))
    if source is None:
        raise InputError(f"its image is only there as {', '.join(texture.get('extensions', {})) or 'none'}")
    move = info.get("extensions", {}).get(TRANSFORM, {})
    coordinates = int(move.get("texCoord", info.get("texCoord", 0)))
    if coordinates not in sets:
        raise InputError(f"a part that has it lacks TEXCOORD_{coordinates}")
    sampler = _sampler(document, info)
    return ImageMap(
        file=document.image(source),
        color_space=space,
        output=output,
        primvar=primvar(coordinates),
        placement=_placement(move),
        wrap=(WRAPS[sampler.get("wrapS", 10497)], WRAPS[sampler.get("wrapT", 10497)]),
        scale=scale,
        bias=bias,
    )


def primvar(texture_coordinates: int) -> str:
    """USD's name for glTF's TEXCOORD_n."""
    return f"st{texture_coordinates}" if texture_coordinates else "st"


def _sampler(document: Document, info: dict[str, Any]) -> dict[str, Any]:
    texture = at(document.entries("textures"), info["index"])
    return at(document.entries("samplers"), texture["sampler"]) if "sampler" in texture else {}


def _placement(move: dict[str, Any]) -> ImageTransform:
    """Return the placement (u, v) = offset + R(rotation) (scale * (u, v)), with v = 1 - t on both sides."""
    angle = float(move.get("rotation", 0))
    (over, down), (su, sv) = move.get("offset", (0, 0)), move.get("scale", (1, 1))
    translation = float(over + sv * sin(angle)), float(1 - down - sv * cos(angle))
    return ImageTransform(scale=(float(su), float(sv)), rotation_deg=degrees(angle), translation=translation)
