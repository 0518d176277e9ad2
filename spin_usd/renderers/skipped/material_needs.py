"""The inputs of a target's materials that its picture depends on: others are neither uploaded nor looked up."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.scene.derived.lookup import extremes
from spin_usd.scene.material import LIMITS, PRESENCE, Material
from spin_usd.scene.model import Scene
from spin_usd.scene.shape import Shape
from spin_usd.scene.target import Target
from spin_usd.scene.texture import Primvar, Texture

BLACK = (0.0, 0.0, 0.0)
FACING = (0.0, 0.0, 1.0)
FALLBACK = Material(path="")
NAMED = tuple(LIMITS.items())


@dataclass(frozen=True, kw_only=True, eq=False)
class Surfaces:
    """The surfaces of `target`. materials: its materials as far as they matter: an input that changes nothing has its
    fallback, one that is the same everywhere is a constant · unseen: indices of those that no face shows, which are
    plain grey here."""

    target: Target
    materials: tuple[Material, ...]
    unseen: frozenset[int]

    @property
    def seen(self) -> Iterator[tuple[int, Material]]:
        """The materials that faces show, by their indices."""
        return ((i, material) for i, material in enumerate(self.materials) if i not in self.unseen)

    @cached_property
    def idle(self) -> tuple[str, ...]:
        """The inputs, by UsdPreviewSurface's names, that a visible material has and that it does not need as they
        are."""
        own = self.target.materials
        pairs = [(getattr(own[i], name), getattr(m, name), said.name) for i, m in self.seen for name, said in NAMED]
        changed = {said for given, kept, said in pairs if given is not kept and given != kept}
        return tuple(said.name for _, said in NAMED if said.name in changed)

    @cached_property
    def diffuse(self) -> bool:
        """True where all of it reflects by Lambert's law and nothing else."""
        return all(is_diffuse(material) for _, material in self.seen)

    @cached_property
    def transparent(self) -> bool:
        """True where rays may go on through some of it."""
        return any(not is_opaque(material) for _, material in self.seen)

    @cached_property
    def emissive(self) -> bool:
        return any(material.emissive_color != BLACK for _, material in self.seen)

    @cached_property
    def normal_mapped(self) -> bool:
        """True where some of it is shaded along other normals than its faces' own."""
        smooth = any(shape.smooth.any() for shape in self.target.mesh.shapes)
        return smooth or any(m.normal is not None for _, m in self.seen)

    @cached_property
    def albedo(self) -> float:
        """The most that it reflects of any colour's light, where all of it is diffuse."""
        shapes = self.target.mesh.shapes
        return max(float(_range(m.diffuse_color, _showing(shapes, i))[1].max()) for i, m in self.seen)

    @cached_property
    def primvars(self) -> frozenset[str]:
        """The names of the primvars that pictures and labels read."""
        cut = [replace(Material(path=""), opacity=m.opacity) for m in self.target.materials if m.cut_out]
        return frozenset(name for m in (*self.materials, *cut) for name in _read(m))


@dataclass(frozen=True, kw_only=True, eq=False)
class SceneSurfaces:
    """The surfaces of all bodies of a scene, of `each` in their order."""

    each: tuple[Surfaces, ...]

    @property
    def idle(self) -> tuple[str, ...]:
        """The inputs, by UsdPreviewSurface's names, that some body has and does not need."""
        return tuple(dict.fromkeys(name for one in self.each for name in one.idle))

    @property
    def diffuse(self) -> bool:
        """True where all bodies reflect by Lambert's law and nothing else."""
        return all(one.diffuse for one in self.each)

    @property
    def transparent(self) -> bool:
        """True where rays may go on through some of them."""
        return any(one.transparent for one in self.each)

    @property
    def emissive(self) -> bool:
        return any(one.emissive for one in self.each)

    @property
    def normal_mapped(self) -> bool:
        """True where some of them is shaded along other normals than its faces' own."""
        return any(one.normal_mapped for one in self.each)

    @property
    def albedo(self) -> float:
        """The most that any of them reflects of any colour's light, where all are diffuse."""
        return max(one.albedo for one in self.each)


def scene_surfaces(scene: Scene) -> SceneSurfaces:
    """Return the surfaces of all bodies of `scene`."""
    return SceneSurfaces(each=tuple(surfaces_of(body.target) for body in scene.bodies))


@lru_cache(maxsize=16)
def surfaces_of(target: Target) -> Surfaces:
    """Return the surfaces of `target`, computed once for all of its pictures."""
    materials, unseen = [], []
    for index, material in enumerate(target.materials):
        where = _showing(target.mesh.shapes, index)
        materials.append(as_it_matters(material, where) if where else Material(path=material.path))
        if not where:
            unseen.append(index)
    return Surfaces(target=target, materials=tuple(materials), unseen=frozenset(unseen))


Where = Sequence[tuple[Shape, NDArray[np.bool_]]]
"""Shapes, with those of their faces (F,) that show a material: of each shape some."""


def _showing(shapes: Sequence[Shape], index: int) -> Where:
    """Return the faces that show the material `index`."""
    found = ((shape, np.asarray(shape.face_material == index)) for shape in shapes)
    return [(shape, faces) for shape, faces in found if faces.any()]


def as_it_matters(material: Material, where: Where) -> Material:
    """`material`, shown there, with fallbacks for all that changes nothing there."""
    values = {name: _constant(getattr(material, name), name, where) for name, _ in NAMED}
    plain = replace(material, **values)
    if plain.cut_out and _range(plain.opacity, where)[0].min() >= plain.opacity_threshold:
        plain = replace(plain, opacity=1.0, opacity_threshold=0.0)
    return replace(plain, **{name: getattr(FALLBACK, name) for name in _idle(plain)})


def is_opaque(material: Material) -> bool:
    return material.opacity == 1 and not material.cut_out


def is_diffuse(material: Material) -> bool:
    """Return whether it reflects by Lambert's law and nothing else."""
    if material.clearcoat != 0 or not _is_solid(material):
        return False
    return material.specular_color == BLACK if material.use_specular_workflow else _is_index_1(material)


def _is_index_1(material: Material) -> bool:
    return material.metallic == 0 and material.ior == 1


def _is_solid(material: Material) -> bool:
    """Return whether no light passes through it, where it is not cut out."""
    return material.opacity == 1 or material.cut_out or material.opacity_mode == PRESENCE


def _idle(material: Material) -> Iterator[str]:
    """Yield the inputs on which nothing depends."""
    if material.use_specular_workflow:
        yield from ("metallic", "ior")
    else:
        yield "specular_color"
        if material.metallic == 1 and _is_solid(material):
            yield "ior"
    if material.clearcoat == 0:
        yield "clearcoat_roughness"
    if is_diffuse(material):
        yield "roughness"
    if is_opaque(material) or material.cut_out:
        yield "opacity_mode"


def _constant(value: Any, name: str, where: Where) -> Any:
    """Return a texture or primvar that is the same on all the faces as a number or tuple; else `value`."""
    if not isinstance(value, (Texture, Primvar)):
        return value
    low, high = _range(value, where)
    if len(low) != LIMITS[name].size or (low != high).any():
        return value
    numbers = tuple(low.tolist())
    if name == "normal":  # another one leans along its own texture's axes
        return None if numbers == FACING else value
    return numbers if len(numbers) > 1 else numbers[0]


def _range(value: Any, where: Where) -> Float:
    """Return (2, C) the lowest and the highest of each component of an input on the faces."""
    if isinstance(value, Texture):
        return extremes(value)
    if isinstance(value, Primvar):
        if any(value.name not in shape.primvars for shape, _ in where):  # refused when it is rendered
            return np.array([[-np.inf], [np.inf]])
        numbers = [shape.primvars[value.name][faces].astype(np.float64) for shape, faces in where]
        return np.stack([np.min([n.min((0, 1)) for n in numbers], 0), np.max([n.max((0, 1)) for n in numbers], 0)])
    return np.stack([np.atleast_1d(np.asarray(value, np.float64))] * 2)


def _read(material: Material) -> Iterator[str]:
    """Yield the names of the primvars that it reads."""
    for value in vars(material).values():
        if isinstance(value, Primvar):
            yield value.name
        elif isinstance(value, Texture) and value.coordinates.primvar is not None:
            yield value.coordinates.primvar
    if material.normal is not None:
        yield material.tangent_primvar
