"""The library of materials: what its tool writes, what it says of itself, and what Cycles makes of it."""

import itertools
import re
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Usd, UsdGeom, UsdShade, UsdValidation

from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.scene.derived.lookup import extremes
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DomeLight
from spin_usd.scene.texture import Texture
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.bodies.preview_surface import read_template
from spin_usd.stage.read.bodies.texture_nodes import NodeReader
from tests.cases import scenes
from tests.conftest import REPOSITORY

sys.path.insert(0, str(REPOSITORY / "tools"))

from materials import optical_constants, optics
from materials.layers import write_layers
from materials.table import LIBRARY

FOLDER = REPOSITORY / "stages" / "materials"
TEXTURES = sorted(path.name for path in (FOLDER / "textures").iterdir())
KINDS = {"foil", "cloth", "cell", "panel", "paint", "mirror", "metal", "composite", "glass", "plastic", "optics"}
METALS = {"aluminium": "ALUMINIUM", "titanium": "TITANIUM", "stainless_steel": "STEEL", "gold_plating": "GOLD",
          "copper": "COPPER", "silver": "SILVER"}  # fmt: skip
PAINTS = {"white_paint": 0.26, "black_paint": 0.95, "antenna_radome": 0.26}  # solar absorptance, head-on
MAX_TEXTURE_BYTES, MAX_ALL_BYTES = 260_000, 500_000  # they are kept in the repository
MAX_LEVELS = 1  # of 255: what arithmetic on another machine may change in a texture
LEAN = 1.2 / 255  # a mean normal's: no level of 8 bits is 0, the next one is half a step of 2/255 away

REFLECTED = 0.02  # of the light that arrives: what Schlick's formula may differ from Fresnel's
EXACT = 1e-3  # of the light: dielectrics have Fresnel's own formula, 16,000 paths
ROUGH = 0.04  # of the light: Cycles' rough surfaces reflect several times, and each time a part is absorbed
PIXEL_NOISE = 0.02  # of the light: the brightest of a thousand pixels of 256 samples
CONSERVED = 1e-3  # of the light: noise of the mean of these pixels
SMOOTH = 0.05  # a roughness that changes no reflectance: slopes of 0.0025
ANGLES = (0.0, 30.0, 60.0)
AT_REST = Transform(to="cam", of="dome", rotation=np.eye(3), translation=np.zeros(3))
WHITE = DomeLight(path="/White", T_cam_dome=AT_REST, radiance=(1.0,) * 3)
NARROW = Camera(width=16, height=16, fx=1600.0, fy=1600.0, cx=8.0, cy=8.0, distortion=(0.0,) * 5)
ROUND = replace(NARROW, fx=48.0, fy=48.0)
RADIUS, RINGS = 0.5, 24
QUICK = "gold_foil"  # of what takes seconds for each: the one that is always tried
SLOW = [name if name == QUICK else pytest.param(name, marks=pytest.mark.slow) for name in LIBRARY]


@cache
def stage_of(name):
    """Opened once: a prim lives no longer than its stage."""
    return Usd.Stage.Open(str(FOLDER / f"{name}.usda"))


def limits(name):
    return stage_of(name).GetDefaultPrim().GetCustomDataByKey("spin")


@pytest.fixture(scope="module")
def material():
    """The material of that name as the renderer is given it."""
    nodes = NodeReader(time=Usd.TimeCode.Default(), images=Images())
    return lambda name: read_template(UsdShade.Material(stage_of(name).GetDefaultPrim()), nodes).material({"st"})


def plain(name, material, roughness=SMOOTH):
    """The material of the layer without what pictures do to it."""
    values = LIBRARY[name].plain
    coat = SMOOTH if material.clearcoat else material.clearcoat_roughness
    fields = {"diffuse_color": values.colour, "metallic": values.metallic, "roughness": roughness, "normal": None}
    return replace(material, clearcoat_roughness=coat, **fields)


def reflectance(blender, material, angle):
    """What a plate that is turned by this angle, in degrees, reflects (3,) towards the camera of light from all
    around: as much as it would reflect of a ray from there, in all directions."""
    corners = np.array([[-1, -1, 0], [-1, 1, 0], [1, 1, 0], [1, -1, 0.0]])
    half = np.radians(angle) / 2
    plate = scenes.target(corners, np.array([[0, 1, 2], [0, 2, 3]]), materials=[material])
    pose = scenes.pose(q=(np.cos(half), np.sin(half), 0, 0))
    scene = scenes.scene(plate, camera=NARROW, T_cam_body=pose, lights=[WHITE])
    return blender.radiance(scene, Effort(samples=64), seed=0).rgb.reshape(-1, 3).mean(0)


def sphere():
    """A smooth ball of diameter 1 with st in metres: its target's arguments."""
    down, around = np.meshgrid(np.linspace(0.01, 0.99, RINGS), np.linspace(0, 1, 2 * RINGS + 1), indexing="ij")
    polar, turn = np.pi * down, 2 * np.pi * around
    unit = np.stack([np.sin(polar) * np.cos(turn), np.cos(polar), np.sin(polar) * np.sin(turn)], -1).reshape(-1, 3)
    st = np.stack([around * 2 * np.pi * RADIUS, (1 - down) * np.pi * RADIUS], -1).reshape(-1, 2)
    row, column = np.meshgrid(np.arange(RINGS - 1), np.arange(2 * RINGS), indexing="ij")
    first = (row * (2 * RINGS + 1) + column).ravel()
    below = first + 2 * RINGS + 1
    faces = np.concatenate([np.stack([first, first + 1, below], -1), np.stack([first + 1, below + 1, below], -1)])
    return {
        "points": RADIUS * unit,
        "faces": faces,
        "corner_normals": unit[faces],
        "primvars": {"st": st[faces].astype(np.float32)},
    }


def furnace(blender, material):
    """What a ball of the material returns in white surroundings: the mean over its pixels, and the brightest of
    them."""
    scene = scenes.scene(scenes.target(materials=[material], **sphere()), camera=ROUND, lights=[WHITE])
    picture = blender.radiance(scene, Effort(samples=256), seed=0)
    inside = picture.rgb[picture.rgba[..., 3] > 0.999]
    return inside.mean(0).max(), inside.max()


def drawn(name, material):
    """The material at each end of what it says may be drawn in place of its numbers."""
    allowed = limits(name)
    colours = [material.diffuse_color, *(coloured(material.diffuse_color, each) for each in allowed["colors"])]
    for roughness, colour in itertools.product((0.05, *allowed["roughness"], 1.0), colours):
        yield replace(material, diffuse_color=colour, roughness=float(roughness))


def coloured(own, drawn):
    """A colour in place of its own, or a factor on a picture."""
    if not isinstance(own, Texture):
        return tuple(map(float, drawn))
    return replace(own, scale=(*(s * float(f) for s, f in zip(own.scale, drawn, strict=False)), own.scale[3]))


def test_the_committed_layers_are_what_the_table_makes(tmp_path) -> None:
    write_layers(tmp_path, LIBRARY)
    written, kept = ({path.name: path.read_text() for path in folder.glob("*.usda")} for folder in (tmp_path, FOLDER))
    assert written == kept


@pytest.mark.slow
def test_the_tool_writes_the_committed_textures(tmp_path) -> None:
    subprocess.run([sys.executable, REPOSITORY / "tools" / "build_materials", tmp_path], check=True)
    assert sorted(path.name for path in (tmp_path / "textures").iterdir()) == TEXTURES
    for name in TEXTURES:
        made, kept = (pixels(folder / "textures" / name) for folder in (tmp_path, FOLDER))
        assert made.shape == kept.shape, name
        assert np.abs(made - kept).max() <= MAX_LEVELS, name


def pixels(file: Path) -> np.ndarray:
    return np.array(Image.open(file), dtype=np.int64)


@pytest.mark.parametrize("name", LIBRARY)
def test_a_layer_is_sound_and_holds_one_material_of_its_name(name) -> None:
    stage = stage_of(name)
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    assert [error.GetMessage() for error in context.Validate(stage)] == []
    (root,) = stage.GetPseudoRoot().GetChildren()
    assert root == stage.GetDefaultPrim()
    assert (root.GetName(), root.GetTypeName()) == (name, "Material")
    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == ("Z", 1.0)
    surface = UsdShade.Material(root).ComputeSurfaceSource()[0]
    assert (surface.GetPrim().GetName(), surface.GetIdAttr().Get()) == ("Surface", "UsdPreviewSurface")
    for prim in root.GetChildren():
        kind = UsdShade.Shader(prim).GetIdAttr().Get()
        assert kind != "UsdTransform2d" or prim.GetName().endswith("_place")
        if kind == "UsdUVTexture":
            fed = surface.GetInput(prim.GetName().removesuffix("Texture"))
            assert fed.GetConnectedSources()[0][0].source.GetPrim() == prim


@pytest.mark.parametrize("name", LIBRARY)
def test_a_layer_says_what_it_is_and_where_its_numbers_are_from(name) -> None:
    sentence, _, source = stage_of(name).GetRootLayer().documentation.partition(". ")
    assert 10 < len(sentence) < 120
    assert re.search(r"\((19|20)\d\d\)|table 11.3|ours", source)


@pytest.mark.parametrize("name", LIBRARY)
def test_what_may_be_drawn_holds_its_own_values_and_reflects_no_more_than_arrives(name, material) -> None:
    found, values = limits(name), material(name)
    assert found["kind"] in KINDS
    low, high = found["roughness"]
    assert 0 < low < LIBRARY[name].plain.roughness < high <= 1
    brightest = extremes(values.diffuse_color)[1] if isinstance(values.diffuse_color, Texture) else np.ones(3)
    assert len(found["colors"]) > 1
    assert (np.array(found["colors"]) * brightest <= 1).all()
    assert ("scale" in found) == (values.normal is not None)
    assert all(size > 0 for size in found.get("pattern", ()))


def test_textures_are_small_and_all_used() -> None:
    sizes = [(FOLDER / "textures" / name).stat().st_size for name in TEXTURES]
    assert max(sizes) < MAX_TEXTURE_BYTES
    assert sum(sizes) < MAX_ALL_BYTES
    text = "".join(path.read_text() for path in FOLDER.glob("*.usda"))
    assert [name for name in TEXTURES if f"@./textures/{name}@" not in text] == []


@pytest.mark.parametrize("name", [name for name in TEXTURES if name.endswith("_normal.png")])
def test_a_normal_map_holds_unit_normals_that_repeat_without_a_seam(name: str) -> None:
    colours = pixels(FOLDER / "textures" / name)
    normals = colours / 255 * 2 - 1
    assert np.abs(np.linalg.norm(normals, axis=-1) - 1).max() < 2 * np.sqrt(3) / 255  # a level in each channel
    assert normals[..., 2].min() > 0
    np.testing.assert_allclose(normals[..., :2].mean(axis=(0, 1)), 0, atol=LEAN)
    for axis in (0, 1):
        steps = np.abs(np.diff(colours, axis=axis, append=np.take(colours, [0], axis))).mean(axis=(1 - axis, 2))
        assert steps[-1] <= steps[:-1].max(), "the step across the seam is as any other"


@pytest.mark.parametrize(("name", "of"), METALS.items())
def test_a_metal_has_the_colour_of_its_index(name, of) -> None:
    """Head-on a metal reflects ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2)."""
    found = getattr(optical_constants, of)
    n, k = np.array(found.n), np.array(found.k)
    wanted = optics.colour(((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2))
    surface = UsdShade.Shader(stage_of(name).GetDefaultPrim().GetChild("Surface"))
    np.testing.assert_allclose(surface.GetInput("diffuseColor").Get(), wanted, atol=REFLECTED)


def test_colours_are_those_of_their_spectra() -> None:
    """A perfect mirror is white; what reflects long waves alone is red, and short ones blue."""
    waves = optical_constants.WAVELENGTHS
    np.testing.assert_array_equal(optics.colour(np.ones(len(waves))), 1)
    assert optics.colour(waves > 600).argmax() == 0
    assert optics.colour(waves < 475).argmax() == 2


@pytest.mark.parametrize("cosine", [1.0, 0.8, 0.5])
def test_films_without_thickness_are_not_there(cosine) -> None:
    below, air = optical_constants.SILICON.index, optical_constants.AIR
    bare = optics.fresnel(below, cosine)
    np.testing.assert_allclose(optics.film(air, air * 2.0, below, 0.0, cosine), bare)
    np.testing.assert_allclose(optics.slab(air, below, 1e6, cosine), bare)
    n = 1.5
    refracted = np.sqrt(1 - (1 - cosine**2) / n**2)
    across, along = (
        (cosine - n * refracted) / (cosine + n * refracted),
        (n * cosine - refracted) / (n * cosine + refracted),
    )
    np.testing.assert_allclose(optics.fresnel(n, cosine), (across**2 + along**2) / 2)


@pytest.mark.parametrize("name", LIBRARY)
def test_a_smooth_plate_reflects_what_theory_says(blender, material, name) -> None:
    """Metals: Fresnel's formula of n + ik; others: Fresnel's of the index, and of the rest the body's colour."""
    smooth = plain(name, material(name))
    for angle in ANGLES:
        wanted = LIBRARY[name].reflectance(np.cos(np.radians(angle)))
        tolerance = REFLECTED if smooth.metallic else EXACT
        np.testing.assert_allclose(reflectance(blender, smooth, angle), wanted, atol=tolerance)


@pytest.mark.parametrize("name", LIBRARY)
def test_a_plate_of_its_own_roughness_reflects_nearly_as_much(blender, material, name) -> None:
    own = plain(name, material(name), LIBRARY[name].plain.roughness)
    for angle in ANGLES:
        wanted = LIBRARY[name].reflectance(np.cos(np.radians(angle)))
        np.testing.assert_allclose(reflectance(blender, own, angle), wanted, atol=ROUGH)


@pytest.mark.parametrize(("name", "absorptance"), PAINTS.items())
def test_paint_absorbs_head_on_what_is_published(blender, material, name, absorptance) -> None:
    own = plain(name, material(name), LIBRARY[name].plain.roughness)
    np.testing.assert_allclose(reflectance(blender, own, 0), 1 - absorptance, atol=REFLECTED / 2)


@pytest.mark.parametrize("name", LIBRARY)
def test_in_a_matt_look_it_keeps_its_colour(blender, material, name) -> None:
    """Roughness 1, and neither metal nor coat nor index: what an author may make of any material."""
    matt = replace(plain(name, material(name), 1.0), metallic=0.0, clearcoat=0.0, ior=1.0)
    np.testing.assert_allclose(reflectance(blender, matt, 30), LIBRARY[name].plain.colour, atol=EXACT)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name == "gold_foil" else pytest.mark.slow) for name in LIBRARY]
)
def test_nothing_that_may_be_drawn_returns_more_than_arrives(blender, material, name) -> None:
    """A ball in white surroundings, at each end of its limits, and at roughness 0.05 and 1."""
    for each in drawn(name, material(name)):
        mean, brightest = furnace(blender, each)
        assert mean <= 1 + CONSERVED, each
        assert brightest <= 1 + PIXEL_NOISE, each
