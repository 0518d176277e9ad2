"""glTF's metallic-roughness materials as UsdPreviewSurface.

Source: glTF 2.0, sections 3.8 and 3.9, and the extensions KHR_texture_transform, KHR_materials_ior,
KHR_materials_emissive_strength, KHR_materials_clearcoat and EXT_texture_webp. A texture is multiplied by its factor
after it is made linear. glTF's (0, 0) is the image's upper left corner, USD's the lower left: v = 1 - t.
KHR_texture_transform turns counter-clockwise as seen on the image, as its text and its example say and its readers do;
the matrix printed with them turns the other way (KhronosGroup/glTF issue 1563).
"""

from dataclasses import dataclass, field, replace
from math import cos, degrees, sin
from typing import Any

from spin_usd.errors import InputError
from spin_usd.formats.mesh.gltf_document import Document
from spin_usd.formats.mesh.gltf_json import JsonObject
from spin_usd.scene.asset import RAW, SRGB, ImageMap, ImageTransform, ModelMaterial
from spin_usd.scene.material import INFINITY, LIMITS, PRESENCE, Material
from spin_usd.scene.texture import RGBA, Color, Primvar

TRANSFORM = "KHR_texture_transform"
IOR, STRENGTH, CLEARCOAT = "KHR_materials_ior", "KHR_materials_emissive_strength", "KHR_materials_clearcoat"
WEBP = "EXT_texture_webp"
MATERIAL_EXTENSIONS = (TRANSFORM, IOR, STRENGTH, CLEARCOAT, WEBP)
REPEAT = 10497
WRAPS = {REPEAT: "repeat", 33071: "clamp", 33648: "mirror"}
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

    def factor(self, of: JsonObject, name: str, default: float, low: float = 0.0, high: float = 1.0) -> float:
        """Return the factor that glTF calls `name`; outside its limits the nearer of them, with a note."""
        return self._clamped(name, of.number(name, default), low, high)

    def factors(self, of: JsonObject, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(self._clamped(name, value) for value in of.numbers(name, default))

    def _clamped(self, name: str, value: float, low: float = 0.0, high: float = 1.0) -> float:
        taken = min(max(value, low), high)
        if taken != value:
            self.notes.append(f"material {self.name!r}: its {name} is {value:g}, and {taken:g} was taken")
        return taken

    def add(self, name: str, of: JsonObject, kind: str, **uses: Any) -> None:
        """Add the texture in `of` for the input `name`, or a note why not; `kind` is glTF's name for it."""
        if kind not in of:
            return
        info = of.object(kind)
        try:
            self.images[name] = _image(self.document, info, self.sets, **uses)
        except InputError as error:
            self.notes.append(f"material {self.name!r}: its {kind} is not carried over: {error.found}")
            return
        sampler = _sampler(self.document, info)
        if sampler.whole("magFilter", 0) == NEAREST:
            self.notes.append(f"material {self.name!r}: its {kind} specifies nearest texels, but is interpolated")


def read_material(
    document: Document, index: int, *, sets: frozenset[int], colored: bool
) -> tuple[ModelMaterial, list[str]]:
    """Read the material `index` for parts with the texture coordinates `sets`, and notes.

    Where `colored`, the parts' displayColor, into which the factor has been multiplied, is the diffuse colour.
    """
    entry = document.entry("materials", index)
    reading = _Reading(document, entry.text("name", f"material_{index}"), sets)
    factors, extensions = entry.object("pbrMetallicRoughness"), entry.object("extensions")
    reading.factors(factors, "baseColorFactor", ONE)
    base = base_color(entry)
    strength = reading.factor(extensions.object(STRENGTH), "emissiveStrength", 1, high=INFINITY)
    emissive = _color(reading.factors(entry, "emissiveFactor", (0, 0, 0)), strength)
    metallic = reading.factor(factors, "metallicFactor", 1)
    roughness = reading.factor(factors, "roughnessFactor", 1)
    coat, ior = extensions.object(CLEARCOAT), LIMITS["ior"]
    coated = reading.factor(coat, "clearcoatFactor", 0)
    coat_roughness = reading.factor(coat, "clearcoatRoughnessFactor", 0)
    constants = Material(
        path=reading.name,
        diffuse_color=Primvar(name=DISPLAY_COLOR) if colored else base[:3],
        emissive_color=emissive,
        metallic=metallic,
        roughness=roughness,
        clearcoat=coated,
        clearcoat_roughness=coat_roughness if coated else Material(path="").clearcoat_roughness,
        ior=reading.factor(extensions.object(IOR), "ior", 1.5, ior.low, ior.high),
    )
    if not colored:
        reading.add("diffuseColor", factors, "baseColorTexture", space=SRGB, scale=base)
    both = (1.0, roughness, metallic, 1.0)
    reading.add("roughness", factors, "metallicRoughnessTexture", output="g", scale=both)
    if "roughness" in reading.images:
        reading.images["metallic"] = replace(reading.images["roughness"], output="b")
    reading.add("emissiveColor", entry, "emissiveTexture", space=SRGB, scale=(*emissive, 1.0))
    _add_normal(reading, entry)
    _add_occlusion(reading, entry)
    if coated:
        reading.add("clearcoat", coat, "clearcoatTexture", output="r", scale=(coated,) * 4)
        scale = (coat_roughness,) * 4
        reading.add("clearcoatRoughness", coat, "clearcoatRoughnessTexture", output="g", scale=scale)
        if "clearcoatNormalTexture" in coat:
            reading.notes.append(f"material {reading.name!r}: its clearcoatNormalTexture has no input in USD")
    constants = _with_opacity(reading, entry, constants, base)
    return ModelMaterial(constants=constants, images=reading.images), reading.notes


def base_color(entry: JsonObject) -> RGBA:
    """Return the material's baseColorFactor, within its limits."""
    factors = entry.object("pbrMetallicRoughness").numbers("baseColorFactor", ONE)
    red, green, blue, alpha = (min(max(x, 0.0), 1.0) for x in factors)
    return red, green, blue, alpha


def has_base_texture(entry: JsonObject) -> bool:
    return "baseColorTexture" in entry.object("pbrMetallicRoughness")


def _color(factor: tuple[float, ...], strength: float) -> Color:
    red, green, blue = (x * strength for x in factor)
    return red, green, blue


def _add_normal(reading: _Reading, entry: JsonObject) -> None:
    scale = entry.object("normalTexture").number("scale", 1)
    uses = {"scale": (2 * scale, 2 * scale, 2.0, 1.0), "bias": (-scale, -scale, -1.0, 0.0)}
    reading.add("normal", entry, "normalTexture", **uses)
    if "normal" in reading.images and scale != 1:
        reading.notes.append(
            f"material {reading.name!r}: the scale {scale:g} of its normalTexture is kept, and USD's validator, which "
            "expects 1, warns of it"
        )


def _add_occlusion(reading: _Reading, entry: JsonObject) -> None:
    strength = entry.object("occlusionTexture").number("strength", 1)
    scale, bias = (strength,) * 4, (1 - strength,) * 4
    reading.add("occlusion", entry, "occlusionTexture", output="r", scale=scale, bias=bias)


def _with_opacity(reading: _Reading, entry: JsonObject, constants: Material, base: RGBA) -> Material:
    """alphaMode: MASK is a cut-out, BLEND the opacity of a surface, OPAQUE has no alpha."""
    mode = entry.text("alphaMode", OPAQUE)
    cutoff = max(entry.number("alphaCutoff", 0.5), 0.0)
    if mode == OPAQUE or (mode == MASK and cutoff == 0):
        return constants
    if "diffuseColor" in reading.images:
        reading.images["opacity"] = replace(reading.images["diffuseColor"], output="a")
    if mode == MASK and cutoff > 1:
        reading.images.pop("opacity", None)
        return replace(constants, opacity=0.0, opacity_threshold=1.0)  # fully transparent
    if mode == MASK:
        return replace(constants, opacity=base[3], opacity_threshold=cutoff)
    return replace(constants, opacity=base[3], opacity_mode=PRESENCE)


def _image(
    document: Document,
    info: JsonObject,
    sets: frozenset[int],
    *,
    space: str = RAW,
    output: str = "rgb",
    scale: RGBA = ONE,
    bias: RGBA = (0.0, 0.0, 0.0, 0.0),
) -> ImageMap:
    """Raises InputError for an image that cannot be had, or texture coordinates that the part lacks."""
    texture = document.entry("textures", info.whole("index"))
    webp = texture.object("extensions").object(WEBP)
    holder = webp if "source" in webp else texture
    if "source" not in holder:
        raise InputError(f"its image is only there as {', '.join(texture.object('extensions')) or 'none'}")
    move = info.object("extensions").object(TRANSFORM)
    coordinates = move.whole("texCoord", info.whole("texCoord", 0))
    if coordinates not in sets:
        raise InputError(f"a part that has it lacks TEXCOORD_{coordinates}")
    sampler = _sampler(document, info)
    return ImageMap(
        file=document.image(holder.whole("source")),
        color_space=space,
        output=output,
        primvar=primvar(coordinates),
        placement=_placement(move),
        wrap=(_wrap(sampler, "wrapS"), _wrap(sampler, "wrapT")),
        scale=scale,
        bias=bias,
    )


def primvar(texture_coordinates: int) -> str:
    """USD's name for glTF's TEXCOORD_n."""
    return f"st{texture_coordinates}" if texture_coordinates else "st"


def _sampler(document: Document, info: JsonObject) -> JsonObject:
    texture = document.entry("textures", info.whole("index"))
    return document.entry("samplers", texture.whole("sampler")) if "sampler" in texture else texture.object("sampler")


def _wrap(sampler: JsonObject, name: str) -> str:
    found = WRAPS.get(sampler.whole(name, REPEAT))
    if found is None:
        raise sampler.wrong(name, f"one of {', '.join(map(str, WRAPS))}")
    return found


def _placement(move: JsonObject) -> ImageTransform:
    """Return the placement (u, v) = offset + R(rotation) (scale * (u, v)), with v = 1 - t on both sides."""
    angle = move.number("rotation", 0)
    (over, down), (su, sv) = move.numbers("offset", (0, 0)), move.numbers("scale", (1, 1))
    translation = float(over + sv * sin(angle)), float(1 - down - sv * cos(angle))
    return ImageTransform(scale=(float(su), float(sv)), rotation_deg=degrees(angle), translation=translation)
