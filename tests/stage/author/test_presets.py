"""Presets: what they say is what an authored stage says and a Scene holds; what they cannot say is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdValidation

from spin_usd.basics.resources import bundled, bundled_names, stages
from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError
from spin_usd.scene.light import DiskLight, DistantLight
from spin_usd.scene.sensor import Optics
from spin_usd.sensor.detector import detect
from spin_usd.stage.author.presets import open_preset
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.png import png

NAMES = ("spin_lightbox", "spin_sunlamp", "spin_synthetic")
OTHERS = ("ideal", "lightbox", "star_tracker", "sunlamp")
POSES = stages() / "examples" / "tango_speedplus_poses.json"
EFFICACY = 124_261 / 1361  # lm/W: the published illuminance of the Sun over its irradiance
FILTER = 0.4717  # the published colour filter, a factor on everything before the picture is cut off at white
FLOAT32 = 1e-6  # relative: USD keeps these numbers as float32
LUX = 1e-4  # relative: the layers give irradiances with five digits

# SPIN's own settings, from its preset files: lux of the Sun, lux of each fill light (or None), shadows, look, bloom
# (intensity, scatter, threshold in the gamma of 2.2 that its interface has), whether there is grain.
PUBLISHED = {
    "spin_synthetic": (3_500, 150, False, "matt", (0.0, 0.936, 1.4), True),
    "spin_lightbox": (124_261, None, True, "reflective", (1.0, 0.936, 1.46), True),
    "spin_sunlamp": (124_261, None, True, "reflective", (0.358, 1.0, 2.97), False),
}
EMPTY = """#usda 1.0
(
    defaultPrim = "World"
)
def Xform "World"
{
%s
}
"""


@pytest.fixture(scope="module")
def authored(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The root layer of a stage for each preset, and one without."""
    folder = tmp_path_factory.mktemp("presets")
    return {name: made(folder / name, None if name == "none" else name) for name in (*NAMES, *OTHERS, "none")}


def made(out: Path, preset: str | Path | None, target: str | Path = "cubesat") -> Path:
    report = author_stage(poses=POSES, target=target, camera="speedplus", out=out, frames="0:1", preset=preset)
    return Path(report.root)


def written(tmp_path: Path, below_world: str) -> Path:
    path = tmp_path / "preset.usda"
    path.write_text(EMPTY % below_world)
    return path


def test_the_published_presets_are_there() -> None:
    assert sorted(bundled_names("preset")) == sorted((*PUBLISHED, *OTHERS))


@pytest.mark.parametrize("name", [*NAMES, *OTHERS])
def test_usd_finds_nothing_to_complain_about(authored: dict[str, Path], name: str) -> None:
    registry = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    for path in (authored[name], bundled("preset", name)):
        stage = Usd.Stage.Open(str(path))
        assert [e.GetMessage() for e in UsdValidation.ValidationContext(registry).Validate(stage)] == []


@pytest.mark.parametrize("name", [*NAMES, *OTHERS])
def test_our_own_check_finds_nothing(authored: dict[str, Path], name: str) -> None:
    assert check_stage(authored[name]) == ()


@pytest.mark.parametrize("name", NAMES)
def test_a_stage_has_exactly_what_the_preset_says(authored: dict[str, Path], name: str) -> None:
    """Every camera setting in the layer is an attribute that USD or our schema knows, with the layer's value."""
    stage, preset = Usd.Stage.Open(str(authored[name])), open_preset(bundled("preset", name))
    camera, said = stage.GetPrimAtPath("/World/Camera"), preset.flat.GetPrimAtPath("/World/Camera").properties
    assert len(said) > 12
    for attribute in said:
        assert camera.GetAttribute(attribute.name).Get() == attribute.default, attribute.name
        assert camera.GetAttribute(attribute.name).GetTypeName() == attribute.typeName
        assert not camera.GetAttribute(attribute.name).IsCustom(), f"the schema does not know {attribute.name}"


@pytest.mark.parametrize("name", NAMES)
def test_a_scene_has_the_published_settings(authored: dict[str, Path], name: str) -> None:
    sun_lux, fill_lux, shadows, look, (intensity, scatter, threshold), grain = PUBLISHED[name]
    reader = StageReader(authored[name])
    scene = reader.scene(reader.frames[0])
    fills, (sun,) = ([light for light in scene.lights if ("Fill" in light.path) == fill] for fill in (True, False))
    assert luminance(sun.irradiance) * EFFICACY == pytest.approx(sun_lux, rel=LUX)
    assert sun.shadows == shadows
    assert sun.angle == pytest.approx(np.radians(0.06), rel=FLOAT32)
    assert [luminance(fill.irradiance) * EFFICACY for fill in fills] == pytest.approx(
        [fill_lux] * 3 if fill_lux else [], rel=LUX
    )
    assert not any(fill.shadows for fill in fills)
    assert scene.optics.bloom_intensity == pytest.approx(intensity, rel=FLOAT32)
    assert scene.optics.bloom_scatter == pytest.approx(scatter, rel=FLOAT32)
    assert scene.optics.bloom_threshold == pytest.approx(FILTER * threshold**2.2, rel=LUX)
    assert (scene.sensor.gain > 0) == grain
    assert scene.optics.psf_sigma == scene.sensor.full_well == 0
    assert scene.sensor.channels == "mono"
    assert scene.sensor.contrast == pytest.approx(1 - 9 / 100, rel=FLOAT32)
    assert (scene.sensor.time, scene.sensor.iso) == pytest.approx((1 / 200, 200), rel=FLOAT32)
    assert scene.thin_lens is not None
    assert scene.thin_lens.focus == pytest.approx(6.45, rel=FLOAT32)
    assert scene.thin_lens.radius == pytest.approx(17.513e-3 / 32 / 2, rel=1e-4)  # the focal length's own digits
    assert not scene.environment.planets
    assert not scene.environment.back_plate
    assert look_of(authored[name]) == look


@pytest.mark.parametrize(
    ("name", "kinds", "look"),
    [("lightbox", [DistantLight, DistantLight], "reflective"), ("sunlamp", [DiskLight], "reflective")],
)
def test_a_test_bed_has_its_own_lights_and_no_glow(
    authored: dict[str, Path], name: str, kinds: list[type], look: str
) -> None:
    """Lightbox has a lamp and its room's light."""
    reader = StageReader(authored[name])
    scene = reader.scene(reader.frames[0])
    assert [type(light) for light in scene.lights] == kinds
    assert scene.optics.bloom_intensity == 0
    assert look_of(authored[name]) == look


def test_the_lightbox_has_the_level_and_noise_of_the_real_pictures(authored: dict[str, Path]) -> None:
    """Shared figures on the bed, which nothing of ours measured: a level of 25 to 45 of 255, noise of 6.1 to 6.3, of
    neighbours' differences, and its correlations of 0.18 in a row and 0.27 in a column."""
    reader = StageReader(authored["lightbox"])
    dark = np.zeros((480, 640, 1), np.float32)
    image = detect(dark, reader.scene(reader.frames[0]).sensor, seed=0).astype(float)
    rest = image - image.mean()
    assert 25 < image.mean() < 45
    assert 6.0 <= np.sqrt(np.square(np.diff(image, axis=1)).mean() / 2) <= 6.4
    assert (rest[:, 1:] * rest[:, :-1]).mean() / rest.var() == pytest.approx(0.18, abs=0.05)
    assert (rest[1:] * rest[:-1]).mean() / rest.var() == pytest.approx(0.27, abs=0.05)


def test_auto_exposure_reaches_the_published_limits(authored: dict[str, Path]) -> None:
    """EV 15 to 9.28 with a compensation of +1: full scale is 1.2 x 2^EV cd/m2 (Lagarde and de Rousiers, 2014)."""
    reader = StageReader(authored["spin_lightbox"])
    sensor = reader.scene(reader.frames[0]).sensor
    assert sensor.auto_exposure is not None
    full_scale = [EFFICACY * FILTER / (sensor.exposure * 2**stops) for stops in sensor.auto_exposure.stops]
    assert full_scale == pytest.approx([1.2 * 2 ** (15 - 1), 1.2 * 2 ** (9.28 - 1)], rel=LUX)


def test_the_look_changes_the_picture_and_no_label(authored: dict[str, Path]) -> None:
    readers = [StageReader(authored[name]) for name in ("spin_synthetic", "spin_lightbox")]
    matt, reflective = (reader.scene(reader.frames[0]).bodies[0].target for reader in readers)
    assert matt.mesh.key == reflective.mesh.key
    assert matt.parts == reflective.parts
    assert matt.keypoint_names == reflective.keypoint_names
    np.testing.assert_array_equal(matt.keypoints, reflective.keypoints)
    assert not set(matt.materials) & set(reflective.materials)
    assert not any(material.cut_out for material in reflective.materials)


def test_a_preset_leaves_the_lens_alone(authored: dict[str, Path]) -> None:
    without, lightbox = (StageReader(authored[name]) for name in ("none", "spin_lightbox"))
    assert without.scene(without.frames[0]).camera == lightbox.scene(lightbox.frames[0]).camera


def test_the_ideal_preset_takes_blur_and_noise_away_and_nothing_else(authored: dict[str, Path]) -> None:
    without, ideal = (
        reader.scene(reader.frames[0]) for name in ("none", "ideal") for reader in [StageReader(authored[name])]
    )
    assert without.optics.psf_sigma > 0
    assert without.sensor.read_noise > 0
    assert ideal.optics == Optics()
    assert ideal.sensor == replace(without.sensor, gain=0.0, full_well=0.0, read_noise=0.0)


def test_without_a_preset_nothing_of_it_is_there(authored: dict[str, Path]) -> None:
    folder = authored["none"].parent
    assert not (folder / "layers" / "model.usda").exists()
    assert "preset" not in (folder / "dataset.usda").read_text()


def test_an_augmentation_overrides_every_choice_of_a_preset(authored: dict[str, Path]) -> None:
    """What comes from a preset stays behind references, so that a variant on /World is stronger."""
    stage = Usd.Stage.Open(str(authored["spin_lightbox"]))
    world = stage.GetDefaultPrim()
    variants = world.GetVariantSets().AddVariantSet("augmentation")
    variants.AddVariant("other")
    variants.SetVariantSelection("other")
    with variants.GetVariantEditContext():
        stage.OverridePrim("/World/Target/Model").GetVariantSet("look").SetVariantSelection("matt")
        stage.OverridePrim("/World/Lights/Sun").GetAttribute("inputs:intensity").Set(7.0)
        stage.OverridePrim("/World/Camera").GetAttribute("focusDistance").Set(3.0)
    assert stage.GetPrimAtPath("/World/Target/Model").GetVariantSet("look").GetVariantSelection() == "matt"
    assert stage.GetPrimAtPath("/World/Lights/Sun").GetAttribute("inputs:intensity").Get() == 7
    assert stage.GetPrimAtPath("/World/Camera").GetAttribute("focusDistance").Get() == 3


def test_missing_pieces_are_the_usual_ones(tmp_path: Path, authored: dict[str, Path]) -> None:
    preset = written(tmp_path, 'over "Camera" { float focusDistance = 4 }'.replace("{ ", "{\n").replace(" }", "\n}"))
    folder = made(tmp_path / "out", preset).parent / "layers"
    for name in ("lights", "environment"):
        assert (folder / f"{name}.usda").read_text() == (
            authored["none"].parent / "layers" / f"{name}.usda"
        ).read_text()
    assert Sdf.Layer.FindOrOpen(str(folder / "camera.usda")).GetAttributeAtPath("/Camera.focusDistance").default == 4


def test_a_preset_may_compose_and_its_files_are_brought_along(tmp_path: Path) -> None:
    """A file of one's own over a published preset, with an image of the same name in two folders."""
    skies = {name: png(np.full((2, 4, 3), grey), color=2) for name, grey in (("a", 40), ("b", 90))}
    for folder, sky in skies.items():
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "sky.png").write_bytes(sky)
    domes = "".join(
        f'def DomeLight "{name}"\n{{\nasset inputs:texture:file = @./{name}/sky.png@\n}}\n' for name in ("a", "b")
    )
    path = written(tmp_path, f'over "Lights"\n{{\n{domes}}}')
    over = path.read_text().replace("(\n", f"(\n    subLayers = [@{bundled('preset', 'spin_sunlamp')}@]\n", 1)
    path.write_text(over)
    root = made(tmp_path / "out", path)
    stage = Usd.Stage.Open(str(root))
    for name in ("a", "b"):
        asset = stage.GetPrimAtPath(f"/World/Lights/{name}").GetAttribute("inputs:texture:file").Get()
        assert Path(asset.resolvedPath).read_bytes() == skies[name]
        assert Path(asset.resolvedPath).is_relative_to(root.parent)
        assert asset.path.startswith("./lights/")
    assert stage.GetPrimAtPath("/World/Lights/Sun").GetAttribute("inputs:intensity").Get() == 1361
    assert look_of(root) == "reflective"


@pytest.mark.parametrize(
    ("below_world", "words"),
    [
        ('over "Camera"\n{\ndouble spin:lens:fx = 3\n}', ("spin:lens:fx", "/World/Camera")),
        ('over "Camera"\n{\nfloat focalLength = 3\n}', ("focalLength", "/World/Camera")),
        ('def Sphere "Moon"\n{\n}', ("/World/Moon", "preset")),
        ('over "Camera"\n{\ndef Sphere "Hood"\n{\n}\n}', ("/World/Camera/Hood", "preset")),
        ("double visible = 3", ("visible", "/World")),
        ('over "Target"\n{\nover "Model"\n{\ntoken visibility = "invisible"\n}\n}', ("visibility", "Model")),
        ('def "Lights" (\nprepend references = @./gone.usda@\n)\n{\n}', ("gone.usda", "preset.usda")),
        ('def "Lights"\n{\nasset inputs:texture:file = @./gone.png@\n}', ("gone.png", "not there")),
    ],
)  # fmt: skip
def test_what_a_preset_cannot_say_is_refused_by_name(tmp_path: Path, below_world: str, words: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as caught:
        made(tmp_path / "out", written(tmp_path, below_world))
    assert all(word in str(caught.value) for word in words), caught.value
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_an_unknown_preset_lists_those_there_are(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match="ideal, lightbox, spin_lightbox, spin_sunlamp, spin_synthetic, star_tracker, sunlamp"
    ):
        made(tmp_path / "out", "moonlamp")


def test_a_file_that_is_no_preset_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="World"):
        made(tmp_path / "out", stages() / "environments" / "sun.usda")


def test_a_target_without_looks_keeps_its_own_and_says_so(tmp_path: Path) -> None:
    box = tmp_path / "box.usda"
    box.write_text('#usda 1.0\n(\ndefaultPrim = "Box"\nmetersPerUnit = 1\nupAxis = "Z"\n)\ndef Cube "Box"\n{\n}\n')
    box.write_text(box.read_text().replace("{\n}", "{\ncolor3f[] primvars:displayColor = [(1, 0, 0)]\n}"))
    report = author_stage(poses=POSES, target=box, camera="speedplus", out=tmp_path / "out", preset="spin_lightbox")
    assert [note for note in report.notes if "look" in note]
    assert not (tmp_path / "out" / "layers" / "model.usda").exists()


def luminance(rgb: tuple[float, float, float]) -> float:
    """Rec. 709."""
    return float(np.dot(rgb, (0.2126, 0.7152, 0.0722)))


def look_of(root: Path) -> str:
    stage = Usd.Stage.Open(str(root))
    return str(stage.GetPrimAtPath("/World/Target/Model").GetVariantSet("look").GetVariantSelection())
