"""COLLADA's common materials as UsdPreviewSurface.

Source: COLLADA 1.4.1, chapter 7. Specular and shininess are read as MTL's Ks and Ns; colours are taken as linear,
images of 8 bits as sRGB. Exporters differ in the meaning of transparency: a constant that makes a surface invisible is
taken as opaque, since nobody exports an invisible surface. Blender writes the metallic value of node materials as
reflectivity.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from urllib.parse import urlsplit
from xml.etree.ElementTree import Element

from spin_usd.errors import InputError
from spin_usd.files.model_root import root_of
from spin_usd.formats.mesh.dae_document import DaeDocument
from spin_usd.formats.mesh.mtl_file import changed
from spin_usd.formats.referenced_file import name_of
from spin_usd.formats.texture_file import color_space, has_alpha, texture_beside
from spin_usd.scene.asset import RAW, ImageFile, ImageMap, ModelMaterial
from spin_usd.scene.material import PRESENCE, Material
from spin_usd.scene.texture import Color

GLOSSY = ("phong", "blinn")
SHADINGS = (*GLOSSY, "lambert", "constant")
BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
WRAPS = {"WRAP": "repeat", "MIRROR": "mirror", "CLAMP": "clamp", "BORDER": "clamp", "NONE": "clamp"}
LUMINANCE = (0.212671, 0.715160, 0.072169)  # COLLADA's own


@dataclass
class _Effect:
    """An effect while it is read: `said` has its values by COLLADA's names, `coordinates` the primvars by the names in
    its textures, `first` the primvar of the others."""

    document: DaeDocument
    effect: Element
    said: Element
    name: str
    coordinates: Mapping[str, str]
    first: str | None
    images: dict[str, ImageMap] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def note(self, text: str) -> None:
        self.notes.append(f"material {self.name!r}: {text}")

    def color(self, name: str, default: Color) -> Color:
        """Return the colour that COLLADA calls `name`, within 0 and 1; white under a texture."""
        if self.said.find(f"{name}/texture") is not None:
            return WHITE
        element = self._value(name, "color")
        if element is None:
            return default
        values = [*self.document.numbers(element), 0.0, 0.0, 0.0][:3]
        red, green, blue = (self._clamped(name, value, 1.0) for value in values)
        return red, green, blue

    def number(self, name: str, default: float, high: float) -> float:
        element = self._value(name, "float")
        if element is None:
            return default
        return self._clamped(name, float(self.document.numbers(element, 1)[0]), high)

    def _value(self, name: str, kind: str) -> Element | None:
        """Return the element with the value: its own, or the parameter's that it names."""
        param = self.said.find(f"{name}/param")
        if param is None:
            return self.said.find(f"{name}/{kind}")
        named = (each.find(kind) for each in self.effect.iter("newparam") if each.get("sid") == param.get("ref"))
        return next((each for each in named if each is not None), None)

    def _clamped(self, name: str, value: float, high: float) -> float:
        taken = min(max(value, 0.0), high) if value == value else 0.0
        if taken != value:
            self.note(f"its {name} is {value:g}, and {taken:g} was taken")
        return taken

    def add(self, name: str, kind: str) -> None:
        """Add the texture that COLLADA calls `kind` for the input `name`, or a note why not."""
        texture = self.said.find(f"{kind}/texture")
        if texture is None:
            return
        try:
            self.images[name] = self._image(texture)
        except InputError as error:
            self.note(f"its {kind} texture is not carried over: {error.found}")

    def _image(self, texture: Element) -> ImageMap:
        """Raises InputError for an image that cannot be had, or texture coordinates that the part lacks."""
        coordinates = self.coordinates.get(texture.get("texcoord", ""), self.first)
        if coordinates is None:
            raise InputError("a part that has it lacks texture coordinates")
        sampler, file = self._sampled(texture.get("texture", ""))
        wraps = [] if sampler is None else [sampler.findtext(name, "WRAP").strip() for name in ("wrap_s", "wrap_t")]
        s, t = (WRAPS.get(wrap, "repeat") for wrap in wraps or ("WRAP", "WRAP"))
        return ImageMap(file=file, color_space=color_space(file), primvar=coordinates, wrap=(s, t))

    def _sampled(self, sid: str) -> tuple[Element | None, ImageFile]:
        """Return the sampler of that name, and the image that it samples; or the image of that id alone."""
        params = {each.get("sid"): each for each in self.effect.iter("newparam")}
        sampler = params[sid].find("sampler2D") if sid in params else None
        image = sid
        if sampler is not None:
            surface = params.get(sampler.findtext("source", "").strip())
            instance = sampler.find("instance_image")
            if instance is not None:
                image = instance.get("url", "").removeprefix("#")
            elif surface is not None:
                image = surface.findtext("surface/init_from", "").strip()
        element = self.document.named("image", f"#{image}")
        if element is None:
            raise InputError(f"the image {image[:80]!r} is not in the file")
        named = (element.findtext("init_from/ref") or element.findtext("init_from") or "").strip()
        url = urlsplit(named) if named.startswith("file:") else None
        path = self.document.path
        return sampler, texture_beside(
            path, name_of(url.path if url else named, root_of(path), path.parent), root_of(path)
        )


def bindings(instance: Element) -> dict[str, tuple[str, dict[str, int]]]:
    """Return for each symbol that an instance binds the URL of its material, and the sets of texture coordinates by the
    names that the material's textures have for them."""
    found = {}
    for each in instance.iterfind("bind_material/technique_common/instance_material"):
        sets = {
            bound.get("semantic", ""): int(number)
            for bound in each.findall("bind_vertex_input")
            if (number := bound.get("input_set", "0")).isdecimal() and number.isascii() and len(number) < 4
        }
        found[each.get("symbol", "")] = each.get("target", ""), sets
    return found


def read_dae_material(
    document: DaeDocument, material: Element, coordinates: Mapping[str, str], first: str | None
) -> tuple[ModelMaterial, list[str]]:
    """Read a material for parts whose primvars are these, by the names that its textures have for them, `first` where
    they name none of those; and notes. Raises InputError."""
    name = material.get("name") or material.get("id") or "material"
    instance = material.find("instance_effect")
    effect = None if instance is None else document.named("effect", instance.get("url"))
    profile = None if effect is None else effect.find("profile_COMMON")
    said = next(
        (each for each in (() if profile is None else profile.iterfind("technique/*")) if each.tag in SHADINGS), None
    )
    if effect is None or said is None:
        note = f"material {name!r} has no common shading, and is shown grey"
        return ModelMaterial(constants=Material(path=name)), [note]
    reading = _Effect(document, effect, said, name, coordinates, first)
    constants = Material(
        path=name,
        diffuse_color=BLACK if said.tag == "constant" else reading.color("diffuse", BLACK),
        emissive_color=reading.color("emission", BLACK),
    )
    if said.tag not in GLOSSY:
        constants = changed(constants, "Ks", BLACK)
    elif said.find("specular/texture") is not None:
        reading.note("its specular texture is not carried over")
    elif said.find("specular") is not None:
        constants = changed(constants, "Ks", reading.color("specular", BLACK))
    if said.tag in GLOSSY and said.find("shininess") is not None:
        constants = changed(constants, "Ns", (reading.number("shininess", 0.0, 1e6),) * 3)
    if said.find("index_of_refraction") is not None and _by_blender(document):
        constants = replace(constants, metallic=reading.number("reflectivity", 0.0, 1.0))
    reading.add("diffuseColor", "diffuse")
    reading.add("emissiveColor", "emission")
    if next(effect.iter("bump"), None) is not None:
        reading.note("its bump texture is not carried over")
    constants = _with_opacity(reading, constants)
    return ModelMaterial(constants=constants, images=reading.images), reading.notes


def _by_blender(document: DaeDocument) -> bool:
    """Return whether Blender wrote the file. For a material without nodes it writes no index of refraction, and a
    leftover specular intensity of versions before 2.8 as reflectivity, which does not mean metal."""
    tools = document.root.iterfind("asset/contributor/authoring_tool")
    return any((tool.text or "").strip().startswith("Blender") for tool in tools)


def _with_opacity(reading: _Effect, constants: Material) -> Material:
    """Return the material with the opacity from `transparent` and `transparency`, in the mode of the first."""
    transparent = reading.said.find("transparent")
    if transparent is None and reading.said.find("transparency") is None:
        return constants
    mode = "A_ONE" if transparent is None else transparent.get("opaque", "A_ONE")
    share = reading.number("transparency", 1.0, 1.0)
    if transparent is not None and transparent.find("texture") is not None:
        return _with_opacity_texture(reading, constants, mode, share)
    element = None if transparent is None else transparent.find("color")
    values = [] if element is None else [*reading.document.numbers(element)]
    red, green, blue, alpha = values if len(values) == 4 else (1.0,) * 4
    light = sum(weight * value for weight, value in zip(LUMINANCE, (red, green, blue), strict=True))
    taken = {
        "A_ONE": alpha * share,
        "A_ZERO": 1 - alpha * share,
        "RGB_ZERO": 1 - light * share,
        "RGB_ONE": light * share,
    }
    opacity = min(max(taken.get(mode, 1.0), 0.0), 1.0)
    if not opacity > 0:
        reading.note("its transparency, which would make it invisible, as exporters write for opaque ones, was ignored")
        return constants
    return replace(constants, opacity=opacity, opacity_mode=PRESENCE) if opacity < 1 else constants


def _with_opacity_texture(reading: _Effect, constants: Material, mode: str, share: float) -> Material:
    reading.add("opacity", "transparent")
    image = reading.images.pop("opacity", None)
    if image is None:
        return constants
    if mode != "A_ONE" or not has_alpha(image.file) or not share:
        reading.note(f"its texture of transparency ({mode}) is not carried over")
        return constants
    reading.images["opacity"] = replace(image, output="a", color_space=RAW, scale=(share,) * 4)
    return replace(constants, opacity=share, opacity_mode=PRESENCE)
