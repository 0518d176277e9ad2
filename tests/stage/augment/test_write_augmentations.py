"""Augmentations over an authored stage: what is written, what the pictures get, and that bad ones write nothing."""

import shutil
import subprocess
import sys

import numpy as np
import pytest
from pxr import Sdf

from spin_usd.basics.resources import bundled_names, stages
from spin_usd.commands.author.augment import augment_stage
from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError
from spin_usd.scene.derived.content_keys import KeyMaker, RenderSettings, geometry_key
from spin_usd.scene.effort import Effort
from spin_usd.stage.augment import write_augmentations as augmenting
from spin_usd.stage.augment.replace_files import FOLDER, SET
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.store.hidden_folder import hidden_folder
from tests.cases.image_files import write_image_file

POSES = stages() / "examples" / "tango_speedplus_poses.json"
SETTINGS = RenderSettings(renderer="raycast", effort=Effort(samples=1), seed=0)
CELLS = [name for name in bundled_names("specification") if name.startswith("ablation")]
KILLED = (
    "import os, pathlib, sys; from spin_usd.store.hidden_folder import hidden_folder\n"
    "with hidden_folder(pathlib.Path(sys.argv[1]), 'augment', beside='dataset.usda') as hidden:\n"
    "    hidden.beside.write_text('#usda 1.0'); os.kill(os.getpid(), 9)"
)
HEAD = 'schema = "augment-1"\nseed = 5\n'


@pytest.fixture(scope="module")
def authored(tmp_path_factory):
    folder = tmp_path_factory.mktemp("authored") / "stage"
    author_stage(poses=POSES, target="cubesat", camera="speedplus", environment="earth", out=folder, frames="0:3")
    return folder


@pytest.fixture
def stage(authored, tmp_path):
    """The root layer of a copy of the stage, three pictures of a CubeSat before the Earth."""
    shutil.copytree(authored, tmp_path / "stage")
    return tmp_path / "stage" / "dataset.usda"


@pytest.fixture
def spec(tmp_path):
    """Writes a specification of one augmentation `a`."""

    def write(body, name="spec"):
        path = tmp_path / f"{name}.toml"
        path.write_text(f'{HEAD}[[augmentation]]\nname = "a"\n{body}')
        return str(path)

    return write


def files(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def scenes(root, variant="a"):
    reader = StageReader(root, variant=variant)
    return [reader.scene(frame) for frame in reader.frames]


PER_FRAME = """
[augmentation.sample]
"sun.direction" = { distribution = "directions", per = "frame" }
"exposure.stops" = { distribution = "normal", mean = 0, sigma = 0.3, unit = "stops", per = "frame" }
"""


def test_the_same_specification_gives_the_same_bytes(stage, spec, tmp_path) -> None:
    shutil.copytree(stage.parent, tmp_path / "other")
    for root in (stage, tmp_path / "other" / "dataset.usda"):
        augment_stage(stage=root, spec=spec(PER_FRAME))
    first = files(stage.parent)
    assert first == files(tmp_path / "other")
    augment_stage(stage=stage, spec=spec(PER_FRAME))
    assert files(stage.parent) == first


def test_another_parameter_changes_no_other_draw(stage, spec) -> None:
    augment_stage(stage=stage, spec=spec(PER_FRAME))
    before = scenes(stage)
    more = PER_FRAME + '"sun.factor" = { distribution = "uniform", low = 0.5, high = 2 }\n'
    augment_stage(stage=stage, spec=spec(more))
    after = scenes(stage)
    assert [s.lights[0].direction_cam for s in after] == [s.lights[0].direction_cam for s in before]
    assert [s.sensor for s in after] == [s.sensor for s in before]
    assert len({s.lights[0].direction_cam for s in after}) == 3


def test_fewer_pictures_have_the_draws_they_had(stage, spec, tmp_path) -> None:
    augment_stage(stage=stage, spec=spec(PER_FRAME))
    author_stage(poses=POSES, target="cubesat", camera="speedplus", out=tmp_path / "few", frames="1:2")
    augment_stage(stage=tmp_path / "few" / "dataset.usda", spec=spec(PER_FRAME))
    (one,), three = scenes(tmp_path / "few" / "dataset.usda"), scenes(stage)
    np.testing.assert_allclose(one.lights[0].direction_cam, three[1].lights[0].direction_cam, atol=1e-12)


def test_another_specification_replaces_the_first(stage, spec) -> None:
    plain = files(stage.parent)
    augment_stage(stage=stage, spec="relight")
    augment_stage(stage=stage, spec=spec(PER_FRAME))
    left = set(files(stage.parent)) - set(plain)
    own = {"layers/augmentations.usda", "layers/augmentations/a.usda"}
    assert left == {*own, "layers/augmentations/SHA256SUMS"}
    subprocess.run(["sha256sum", "--check", "--strict", "SHA256SUMS"], cwd=stage.parent / FOLDER / SET, check=True)
    assert StageReader(stage).variants == ("nominal", "a")


@pytest.mark.parametrize(
    ("name", "runs"),
    [
        ("augmentations", 0),
        ("augmentations.usda", 0),
        ("augmentations/notes.txt", 0),
        ("augmentations.usda", 1),
        ("augmentations/a.usda", 1),
        ("augmentations/notes.txt", 1),
    ],
)
def test_what_a_user_put_or_edited_there_is_not_replaced(stage, spec, name, runs) -> None:
    """Before the first run and after it; once it is out of the way, a run goes on."""
    for _ in range(runs):
        augment_stage(stage=stage, spec=spec(PER_FRAME))
    own = stage.parent / FOLDER / name
    own.parent.mkdir(exist_ok=True)
    own.write_text((own.read_text() if own.exists() else "#usda 1.0\n") + "# Mine.\n")
    before = files(stage.parent)
    with pytest.raises(InputError, match=f"{name}: is not as spin-usd wrote it, .*; move it elsewhere"):
        augment_stage(stage=stage, spec="relight")
    assert files(stage.parent) == before
    own.unlink()
    if name == "augmentations.usda":
        stage.write_text(stage.read_text().replace("        @./layers/augmentations.usda@,\n", ""))
    augment_stage(stage=stage, spec="relight")


def test_a_link_of_the_users_is_not_replaced(stage, spec, tmp_path) -> None:
    augment_stage(stage=stage, spec=spec(PER_FRAME))
    link = stage.parent / FOLDER / SET / "mine"
    link.symlink_to(tmp_path)
    with pytest.raises(InputError, match="mine: is a link, and would be replaced"):
        augment_stage(stage=stage, spec="relight")
    assert link.is_symlink()


def test_out_replaces_its_own_root_and_no_other_file(stage, spec) -> None:
    more = stage.parent / "more.usda"
    augment_stage(stage=stage, spec="relight", out=more)
    augment_stage(stage=stage, spec=spec(PER_FRAME), out=more)
    assert StageReader(more).variants == ("nominal", "a")
    more.write_text(f"{more.read_text()}# Mine.\n")
    before = files(stage.parent)
    with pytest.raises(InputError, match=r"more\.usda: exists already, and is not the root layer"):
        augment_stage(stage=stage, spec="relight", out=more)
    assert files(stage.parent) == before


def test_the_root_keeps_its_text_and_its_sublayers(stage, spec) -> None:
    text = stage.read_text().replace("#usda 1.0\n", "#usda 1.0\n# A comment.\n", 1)
    stage.write_text(text)
    augment_stage(stage=stage, spec=spec(PER_FRAME))
    after = stage.read_text()
    line = "        @./layers/augmentations.usda@,\n"
    assert after.count(line) == 1
    assert after.replace(line, "") == text


def test_out_is_another_root_and_the_stage_stays(stage, spec) -> None:
    before = files(stage.parent)
    augment_stage(stage=stage, spec=spec(PER_FRAME), out=stage.parent / "more.usda")
    after = files(stage.parent)
    assert {name: after[name] for name in before} == before
    assert StageReader(stage.parent / "more.usda").variants == ("nominal", "a")
    assert len(scenes(stage.parent / "more.usda")) == 3
    with pytest.raises(InputError, match="is not in the stage's folder"):
        augment_stage(stage=stage, spec=spec(PER_FRAME), out=stage.parent.parent / "x.usda")


def test_many_pictures_go_into_a_binary_layer(stage, spec, monkeypatch) -> None:
    augment_stage(stage=stage, spec=spec(PER_FRAME))
    in_text = [scene.lights[0].direction_cam for scene in scenes(stage)]
    monkeypatch.setattr(augmenting, "MAX_FRAMES_IN_TEXT", 2)
    augment_stage(stage=stage, spec=spec(PER_FRAME))
    assert (stage.parent / "layers" / "augmentations" / "a.usdc").is_file()
    assert [scene.lights[0].direction_cam for scene in scenes(stage)] == in_text


def test_provenance_names_the_specification(stage, spec) -> None:
    augment_stage(stage=stage, spec=spec(PER_FRAME))
    layer = Sdf.Layer.FindOrOpen(str(stage.parent / "layers" / "augmentations" / "a.usda"))
    said = layer.customLayerData["spin"]["spec"]
    assert (said["name"], said["seed"], len(said["sha256"])) == ("spec", "5", 64)


def test_drawn_values_are_stronger_than_the_selected_variants(stage, spec) -> None:
    body = 'select = { camera = "rich" }\n[augmentation.sample]\n'
    augment_stage(stage=stage, spec=spec(body + '"optics.glare" = { distribution = "fixed", value = 0.25 }'))
    optics = scenes(stage)[0].optics
    assert optics.glare == 0.25
    assert optics.psf_sigma > 0  # rich's own


def test_factors_are_of_the_selected_variants_values(stage, spec) -> None:
    body = 'select = { environment = "plain" }\n'
    augment_stage(stage=stage, spec=spec(body))
    own = {light.path: light.irradiance for light in scenes(stage)[0].lights}
    sample = '[augmentation.sample]\n"fill.factor" = { distribution = "fixed", value = 2 }'
    augment_stage(stage=stage, spec=spec(body + sample))
    now = {light.path: light.irradiance for light in scenes(stage)[0].lights}
    strongest = max(own, key=lambda path: own[path])
    assert len(own) > 1
    for path, irradiance in own.items():
        np.testing.assert_allclose(now[path], np.array(irradiance) * (1 if path == strongest else 2), rtol=1e-6)


def test_the_eight_cells_are_eight_pictures(stage) -> None:
    found = set()
    for name in CELLS:
        augment_stage(stage=stage, spec=name, out=stage.parent / f"{name}.usda")
        scene = scenes(stage.parent / f"{name}.usda", name)[0]
        found.add((scene.optics, scene.lights, scene.bodies[0].target.key))
    assert len(CELLS) == len(found) == 8


def test_isda_differs_in_light_materials_and_background_with_the_same_labels(stage) -> None:
    augment_stage(stage=stage, spec="isda")
    variants = [scenes(stage, f"isda_{i}") for i in (1, 2, 3)]
    for three in zip(*variants, strict=True):
        assert len({scene.lights[0].direction_cam for scene in three}) == 3
        assert len({scene.bodies[0].target.key for scene in three}) == 3
        assert len({geometry_key(scene) for scene in three}) == 1
        for scene in three:
            to_sun = -np.array(scene.lights[0].direction_cam)
            assert to_sun[2] <= np.cos(np.radians(30)) + 1e-6


@pytest.mark.slow
def test_relighting_needs_one_render(stage) -> None:
    augment_stage(stage=stage, spec="relight")
    every = [scenes(stage, f"relight_{i + 1}")[0] for i in range(10)]
    assert len({scene.sensor for scene in every}) == 10
    plain = scenes(stage, "nominal")[0]
    behind = [scene for scene in every if not scene.environment.planets]
    assert len(behind) == len(every)  # its backgrounds have no planet: nothing but the Sun lights the target
    assert len({KeyMaker(SETTINGS).keys(scene).radiance for scene in every}) == 1
    assert KeyMaker(SETTINGS).keys(plain).radiance != KeyMaker(SETTINGS).keys(every[0]).radiance


def shown(root, variant):
    """Return the level of each picture's background: photographs are of one each."""
    plates = [scene.environment.back_plate for scene in scenes(root, variant)]
    assert {(len(plate.images), plate.probability, plate.roll, plate.mirror) for plate in plates} == {(1, 1, (0, 0), 0)}
    return [float(plate.images[0].pixels[0, 0, 0]) for plate in plates]


def test_photographs_of_a_folder_are_behind_variants_or_each_picture_by_chance(stage, spec, tmp_path) -> None:
    (tmp_path / "photos").mkdir()
    for level in range(0, 250, 25):
        write_image_file(tmp_path / "photos" / f"{level}.png", np.full((6, 9, 3), level))
    one = 'count = 5\n[augmentation.sample]\n"background" = { distribution = "choice", folder = "photos" }\n'
    each = one.replace(" }", ', per = "frame" }').replace("count = 5", "count = 2")
    both = spec(f'{one}[[augmentation]]\nname = "each"\n{each}')
    augment_stage(stage=stage, spec=both)
    written = files(stage.parent)
    augment_stage(stage=stage, spec=both)
    assert files(stage.parent) == written
    shutil.rmtree(tmp_path / "photos")  # the stage has its own, each once
    drawn = [shown(stage, f"a_{i}") for i in range(1, 6)]
    assert all(len({*levels}) == 1 for levels in drawn)
    assert len({levels[0] for levels in drawn}) > 2
    framed = [shown(stage, f"each_{i}") for i in (1, 2)]
    assert all(len({*levels}) > 1 for levels in framed)
    assert framed[0] != framed[1]
    copies = [name for name in written if name.startswith("layers/augmentations/photographs/")]
    assert len(copies) == len({level for levels in (*drawn, *framed) for level in levels})
    assert not [finding for finding in check_stage(stage) if finding.code != "variant-same"]


def test_photographs_of_one_name_are_not_written_over_one_another(stage, spec, tmp_path) -> None:
    files = [tmp_path / name for name in ("a/sky.png", "b/sky.png", "b/sky_1.png")]
    for level, file in enumerate(files):
        file.parent.mkdir(exist_ok=True)
        write_image_file(file, np.full((6, 9, 3), 50 * level))
    names = [f'"{file.relative_to(tmp_path)}"' for file in files]
    augment_stage(
        stage=stage,
        spec=spec(f'count = 3\n{SAMPLE}"background" = {{ distribution = "in_turn", values = [{", ".join(names)}] }}'),
    )
    assert len({shown(stage, f"a_{i}")[0] for i in (1, 2, 3)}) == 3


SAMPLE = "[augmentation.sample]\n"
SUN = SAMPLE + '"sun.direction" = { distribution = "directions"%s }\n[augmentation.constraints]\n'


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ('select = { camera = "rihc" }', "augmentation a: select.camera: the variant set 'camera' has no 'rihc'"),
        ('select = { weather = "rich" }', "select.weather: the stage has no variant set 'weather'"),
        (
            SAMPLE + '"material.Gold.roughness" = { distribution = "fixed", value = 1 }',
            "material.Gold.roughness: no target has a material 'Gold'; it has .*Aluminium",
        ),
        (
            SAMPLE + '"optics.glare" = { distribution = "uniform", low = 0.5, high = 1.001 }',
            "optics.glare: could be 0.5 to 1.001; choose numbers from 0 to 1",
        ),
        (
            SAMPLE + '"exposure.stops" = { distribution = "normal", mean = 0, sigma = 1, low = 60, unit = "stops" }',
            "exposure.stops: fewer than 0.001 of all values about 0",
        ),
        (
            SAMPLE + '"background" = { distribution = "choice", values = ["mars"] }',
            "there is no environment named 'mars'",
        ),
        (
            SAMPLE + '"background" = { distribution = "choice", values = ["earth"], per = "frame" }',
            "background: an environment cannot change from picture to picture; let it choose among pictures",
        ),
        (
            SAMPLE + '"background" = { distribution = "choice", folder = ".." }',
            "background: '..' lies outside the specification's folder",
        ),
        (SAMPLE + '"background" = { distribution = "choice", folder = "stage" }', "stage: contains no picture; put"),
        (
            SAMPLE + '"background" = { distribution = "fixed", value = "stage" }',
            "background: 'stage' is a folder; write .* folder = \"stage\" }",
        ),
        (
            SAMPLE + '"material.*.roughness" = { distribution = "fixed", value = 1 }\n'
            '"material.Aluminium.roughness" = { distribution = "fixed", value = 1 }',
            "material.Aluminium.roughness: sets .*inputs:roughness, and so does material.*.roughness",
        ),
        (
            SUN % ', per = "frame"' + "sun_from_boresight_deg = 100\nsun_from_boresight_at_most_deg = 90",
            r"augmentation a: no sample of sun.direction of 1000 meets sun_from_boresight_\S+ = \d+ in picture img\d+",
        ),
        (SUN % "" + "target_lit_deg = 1e-6", "meets target_lit_deg = 1e-06 in picture img"),
        (
            SAMPLE + '"lens.k1" = { distribution = "fixed", value = -5 }',
            "augmentation a: lens.k1: .*invert",
        ),
        (
            SAMPLE + '"sensor.gain" = { distribution = "fixed", value = 0, unit = "electrons/step" }',
            "augmentation a: .*fullWell: is 32400, but the sensor has no gain",
        ),
        (
            SAMPLE + '"/World/Camera.nothing" = { distribution = "fixed", value = 3 }',
            "/World/Camera.nothing: the stage has no such attribute",
        ),
    ],
)
def test_what_cannot_be_is_one_sentence_and_nothing_is_written(stage, spec, body, sentence) -> None:
    before = files(stage.parent)
    with pytest.raises(InputError, match=sentence):
        augment_stage(stage=stage, spec=spec(body))
    assert files(stage.parent) == before
    assert not list(stage.parent.rglob(".*"))


def test_what_a_killed_run_left_is_removed_and_what_another_run_writes_is_not(stage, spec) -> None:
    (stage.parent / "layers" / ".augmentations.1073741824").mkdir()
    (stage.parent / ".dataset.1073741824.usda").write_text("mine")
    with hidden_folder(stage.parent, "augment", beside=stage.name) as other:
        other.beside.write_text("#usda 1.0")
        others = set(stage.parent.rglob(".*"))
        subprocess.run([sys.executable, "-c", KILLED, stage.parent])
        assert len(set(stage.parent.rglob(".*")) - others) == 3  # the folder, the lock in it and the root layer
        augment_stage(stage=stage, spec=spec(PER_FRAME))
        assert set(stage.parent.rglob(".*")) == others


def test_a_constant_direction_holds_in_all_pictures(stage, spec) -> None:
    augment_stage(stage=stage, spec=spec(SUN % "" + "target_lit_deg = 60\nsun_from_boresight_deg = 140"))
    for scene in scenes(stage):
        to_sun = -np.array(scene.lights[0].direction_cam)
        centre = scene.bodies[0].T_cam_body.translation
        assert -to_sun @ centre / np.linalg.norm(centre) >= np.cos(np.radians(61))  # of the bound's middle, not of 0
        assert to_sun[2] <= np.cos(np.radians(140)) + 1e-6


def test_the_command(stage, spec, spin_usd) -> None:
    done = spin_usd("augment", stage, "--spec", spec(PER_FRAME))
    assert "1 augmentation of spec: a" in done.stdout
    many = spin_usd("augment", stage, "--spec", spec("count = 12"))
    assert "12 augmentations of spec: a_1, a_2, a_3, a_4, a_5, a_6, a_7, a_8, a_9, ..., a_12)" in many.stdout
    done = spin_usd("augment", stage, "--spec", "isad", code=2)
    assert "there is no specification named 'isad'; name one of ablation_camera" in done.stderr
    assert len(done.stderr.splitlines()) == 1


EACH = """
[augmentation.sample]
"material.each.roughness" = { distribution = "uniform", low = 0, high = 1 }
"""


def test_each_material_has_a_value_of_its_own(stage, spec) -> None:
    """It is that of the material's own parameter, and stays where another is given its own."""

    def roughness(body):
        augment_stage(stage=stage, spec=spec(body))
        return {each.path: each.roughness for each in scenes(stage)[0].bodies[0].target.materials}

    found = roughness(EACH)
    assert len(set(found.values())) == len(found) > 2
    path = sorted(found)[1]
    name = path.rsplit("/", 1)[1]
    alone = roughness(EACH.replace("each", name))
    assert alone[path] == found[path]
    fixed = roughness(EACH + f'"material.{name}.roughness" = {{ distribution = "fixed", value = 0.25 }}\n')
    assert fixed == found | {path: 0.25}


def test_random_materials_are_other_ones_in_each_picture_and_lose_no_connection(stage) -> None:
    augment_stage(stage=stage, spec="random_materials")
    assert not [finding for finding in check_stage(stage) if finding.code == "connection-lost"]
    targets = [scene.bodies[0].target for scene in scenes(stage, "random_materials")]
    colours = [[material.diffuse_color for material in target.materials] for target in targets]
    assert len({str(each) for each in colours}) == len(colours)
    assert all(isinstance(colour, tuple) for each in colours for colour in each)
