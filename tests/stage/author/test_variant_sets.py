"""The variant sets camera, environment and materials: all their combinations, on every kind of stage."""

import shutil
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from pxr import Usd

from spin_usd.basics.resources import bundled_names, stages
from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError
from spin_usd.scene.derived.content_keys import KeyMaker, RenderSettings, geometry_key
from spin_usd.scene.derived.shown_materials import shown_materials
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.scene import Scene
from spin_usd.scene.sensor import Optics
from spin_usd.scene.texture import Primvar, Texture
from spin_usd.stage.author.camera_layer import DETECTOR, PSF_SIGMA
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.root_layers import over_stage

POSES = stages() / "examples" / "tango_speedplus_poses.json"
VARIANT_SETS = ("camera", "environment", "materials")
CELLS = tuple(product(("plain", "rich"), repeat=3))
SETTINGS = RenderSettings(renderer="raycast", effort=Effort(samples=1), seed=0)
NO_COLOUR = (0.0, 0.0, 0.0)  # where a mesh has faces without the primvar
# W/m2 of the group's Sun: Kopp and Lean (2011); SPIN's 3,500 lux at its 124,261 lux for 1361 W/m2.
SUN = {"rich": 1361.0, "plain": 3_500 * 1361 / 124_261}
DIGITS = 1e-4  # relative: the layers give irradiances with five digits


@pytest.fixture(scope="module")
def authored(cubesat_stage: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(shutil.copytree(cubesat_stage.parent, tmp_path_factory.mktemp("cubesat") / "stage")) / "dataset.usda"


def author(out: Path, target: str | Path = "cubesat", **options: str | Path | None) -> Path:
    given: dict[str, Any] = dict(options)
    return Path(author_stage(poses=POSES, target=target, camera="speedplus", out=out, frames="0:2", **given).root)


def scene(root: Path, **selections: str) -> Scene:
    """The first picture of the stage with these variants selected."""
    text = "\n".join(f'string {name} = "{variant}"' for name, variant in selections.items())
    path = root.parent / ("_".join(("cell", *(n for pair in selections.items() for n in pair))) + ".usda")
    path.write_text(over_stage(frames=2, metadata=f"variants = {{\n{text}\n}}"))
    reader = StageReader(path)
    return reader.scene(reader.frames[0])


def radiance(taken: Scene) -> str:
    return KeyMaker(SETTINGS).keys(taken).radiance


@pytest.mark.parametrize("cell", CELLS, ids="-".join)
def test_each_group_does_what_it_says_whatever_the_others_are(authored: Path, cell: tuple[str, ...]) -> None:
    """The eight cells of the ablation: every group has its own values in all of them, and no label changes."""
    camera, environment, materials = cell
    base, taken = scene(authored), scene(authored, **dict(zip(VARIANT_SETS, cell, strict=True)))
    assert geometry_key(taken) == geometry_key(base)
    ideal = taken.optics == Optics() and taken.sensor.gain == taken.sensor.read_noise == taken.sensor.prnu == 0
    assert ideal == (camera == "plain")
    assert taken.sensor.auto_exposure is not None
    assert taken.sensor.exposure == pytest.approx(0.9 * np.pi / 1361, rel=1e-4)  # as the layers' doc says
    lights = [light for light in taken.lights if isinstance(light, DistantLight)]
    assert len(lights) == len(taken.lights) == (4 if environment == "plain" else 1)
    assert all(light.shadows == (environment == "rich") for light in lights)
    sun = max(lights, key=lambda light: sum(light.irradiance))
    assert luminance(sun.irradiance) == pytest.approx(SUN[environment], rel=DIGITS)
    assert len(taken.environment.planets) == (environment == "rich")
    assert all(shiny(taken) if materials == "rich" else matt(taken))
    assert shown_materials(taken.bodies[0].target).diffuse == (materials == "plain")


def matt(taken: Scene) -> list[bool]:
    return [
        (m.roughness, m.metallic, m.clearcoat, m.ior, m.use_specular_workflow) == (1, 0, 0, 1, False)
        for m in taken.bodies[0].target.materials
    ]


def shiny(taken: Scene) -> list[bool]:
    return [any(not each for each in matt(taken))]


def luminance(rgb: tuple[float, float, float]) -> float:
    """Rec. 709."""
    return float(np.dot(rgb, (0.2126, 0.7152, 0.0722)))


def test_a_group_alone_changes_only_its_own(authored: Path) -> None:
    base = scene(authored)
    for name in ("plain", "rich"):
        camera = scene(authored, camera=name)
        assert radiance(camera) == radiance(base)  # so that camera groups cost no render
        assert camera.camera == base.camera
        assert (camera.sensor, camera.optics) != (base.sensor, base.optics)
        for group in ("environment", "materials"):
            other = scene(authored, **{group: name})
            assert (other.sensor, other.optics) == (base.sensor, base.optics)
        assert [m.key for m in scene(authored, environment=name).bodies[0].target.materials] == [
            m.key for m in base.bodies[0].target.materials
        ]
        assert [light.path for light in scene(authored, materials=name).lights] == ["/World/Lights/Sun"]


def test_nothing_is_selected(authored: Path) -> None:
    stage = Usd.Stage.Open(str(authored))
    sets = stage.GetDefaultPrim().GetVariantSets()
    assert tuple(sets.GetNames()) == VARIANT_SETS
    assert not any(sets.GetAllVariantSelections().values())
    taken = scene(authored)
    assert (taken.optics, taken.sensor.gain) == (Optics(psf_sigma=PSF_SIGMA), DETECTOR["gain"])
    assert [light.path for light in taken.lights] == ["/World/Lights/Sun"]


@pytest.mark.parametrize(
    ("environment", "preset"),
    [
        pytest.param(environment, preset, marks=[pytest.mark.slow] if preset and environment != "earth" else [])
        for environment, preset in product(bundled_names("environment"), (None, *bundled_names("preset")))
    ],
)
def test_every_authored_stage_has_them_and_no_findings(tmp_path: Path, preset: str | None, environment: str) -> None:
    """A preset's own effects, and its own environment, are gone where a group is plain."""
    root = author(tmp_path / "stage", preset=preset, environment=environment)
    assert check_stage(root) == ()
    plain = scene(root, **dict.fromkeys(VARIANT_SETS, "plain"))
    assert (plain.optics, plain.sensor.gain) == (Optics(), 0)
    assert not plain.environment.planets
    assert not plain.environment.stars
    assert not plain.environment.back_plate
    assert len(scene(root, environment="rich").environment.planets) == 1


@pytest.mark.parametrize("lights", bundled_names("lights"))
def test_every_layer_of_lights_is_switched_off(tmp_path: Path, lights: str) -> None:
    root = author(tmp_path / "stage", lights=lights)
    assert check_stage(root) == ()
    assert [light.path for light in scene(root, environment="rich").lights] == ["/World/Lights/RichSun"]


def test_the_same_bytes_wherever_they_are_written(authored: Path, tmp_path: Path) -> None:
    again = author(tmp_path / "again").parent / "layers"
    for name in ("variant_sets.usda", "variant_sets/plain.usda", "variant_sets/rich.usda"):
        assert (again / name).read_bytes() == (authored.parent / "layers" / name).read_bytes()
        assert str(tmp_path) not in (again / name).read_text()


def test_a_model_without_looks_is_made_matt(tmp_path: Path) -> None:
    """One with textures for its roughness: the number beats the connection. rich is the model as it is."""
    sphere = trimesh.creation.icosphere(subdivisions=1)
    uv = sphere.vertices[:, :2] / 2 + 0.5
    texture = trimesh.visual.texture
    image = Image.new("RGB", (4, 4), (0, 90, 200))
    material = texture.TextureVisuals(
        uv=uv,
        material=trimesh.visual.material.PBRMaterial(
            metallicRoughnessTexture=image, baseColorFactor=[200, 100, 50, 255], metallicFactor=1.0
        ),
    )
    trimesh.Trimesh(sphere.vertices, sphere.faces, visual=material).export(tmp_path / "ball.glb")
    root = author(tmp_path / "stage", tmp_path / "ball.glb")
    assert check_stage(root) == ()
    base, plain, rich = scene(root), scene(root, materials="plain"), scene(root, materials="rich")
    assert any(isinstance(m.roughness, Texture) for m in base.bodies[0].target.materials)
    assert all(matt(plain))
    assert [m.diffuse_color for m in plain.bodies[0].target.materials] == [
        m.diffuse_color for m in base.bodies[0].target.materials
    ]
    assert radiance(rich) == radiance(base)


FOREIGN = {
    "its own look set": """
def Xform "Craft" (
    variants = { string look = "dusty" }
    prepend variantSets = "look"
)
{
    def Cube "Body" ( prepend apiSchemas = ["MaterialBindingAPI"] )
    {
        rel material:binding = </Craft/Gold>
    }
    MATERIAL
    variantSet "look" = {
        "dusty" {
        }
    }
}""",
    "colours without a material": """
def Xform "Craft"
{
    def Cube "Body"
    {
        color3f[] primvars:displayColor = [(0.5, 0.25, 0.125)]
    }
    def Cube "Panel" ( prepend apiSchemas = ["MaterialBindingAPI"] )
    {
        rel material:binding = </Craft/Gold>
    }
    MATERIAL
}""",
    "its root is its only gprim": """
def Cube "Craft"
{
    color3f[] primvars:displayColor = [(0.5, 0.25, 0.125)]
}""",
    "materials in an instance": """
def Xform "Craft"
{
    def Xform "Left" (
        instanceable = true
        references = </Wing>
    )
    {
    }
}
def Xform "Wing"
{
    def Cube "Body" ( prepend apiSchemas = ["MaterialBindingAPI"] )
    {
        rel material:binding = </Wing/Gold>
    }
    MATERIAL
}""",
}
GOLD = """
    def Material "Gold"
    {
        token outputs:surface.connect = <ROOT/Gold/Surface.outputs:surface>
        def Shader "Surface"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.5, 0.25, 0.125)
            float inputs:metallic = 1
            int inputs:useSpecularWorkflow = 1
            float inputs:clearcoat = 1
            float inputs:roughness = 0.2
            token outputs:surface
        }
    }
"""


@pytest.mark.parametrize("kind", FOREIGN)
def test_any_usd_target_is_made_matt_in_its_own_colours(tmp_path: Path, kind: str) -> None:
    root_prim = "/Wing" if "instance" in kind else "/Craft"
    head = '#usda 1.0\n(\n    defaultPrim = "Craft"\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n'
    body = FOREIGN[kind].replace("MATERIAL", GOLD.replace("ROOT", root_prim))
    (tmp_path / "craft.usda").write_text(head + body)
    root = author(tmp_path / "stage", tmp_path / "craft.usda")
    base, plain, rich = scene(root), scene(root, materials="plain"), scene(root, materials="rich")
    assert not all(matt(base))
    assert all(matt(plain))
    for material in plain.bodies[0].target.materials:
        colour = material.diffuse_color
        seen = plain.bodies[0].target.mesh.primvars[colour.name] if isinstance(colour, Primvar) else np.array(colour)
        assert set(map(tuple, seen.reshape(-1, 3).tolist())) <= {(0.5, 0.25, 0.125), NO_COLOUR}
        assert (0.5, 0.25, 0.125) in map(tuple, seen.reshape(-1, 3).tolist())
    assert geometry_key(plain) == geometry_key(base)
    assert radiance(rich) == radiance(base)
    found = [finding for finding in check_stage(root) if finding.code.startswith(("variant", "scene"))]
    assert found == []


@pytest.mark.parametrize(
    ("text", "kind", "words"),
    [
        ('def DomeLight "Lights"\n{\n}\n', "lights", ("Lights", "below an Xform")),
        ('def Xform "Lights"\n{\ndef DistantLight "RichSun"\n{\n}\n}\n', "lights", ("RichSun", "environment=rich")),
        (
            'def Xform "Environment" (\nprepend apiSchemas = ["SpinStarsAPI"]\n)\n{\n}\n',
            "environment",
            ("Environment", "below an Xform"),
        ),
    ],
)
def test_what_cannot_be_switched_off_is_refused(tmp_path: Path, text: str, kind: str, words: tuple[str, ...]) -> None:
    path = tmp_path / "surroundings.usda"
    path.write_text(f'#usda 1.0\n(\ndefaultPrim = "{kind.capitalize()}"\nmetersPerUnit = 1\nupAxis = "Z"\n)\n{text}')
    with pytest.raises(InputError) as caught:
        author(tmp_path / "stage", **{kind: path})
    assert all(word in str(caught.value) for word in words), caught.value
    assert not (tmp_path / "stage").exists()
