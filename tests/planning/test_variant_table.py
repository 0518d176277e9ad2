"""Plans: keys are those of freshly read scenes, the table counts each pass once, and measured costs scale the next."""

import json
import shutil

import pytest

from spin_usd.files.folder import Folder
from spin_usd.picture.kinds import BEAUTY_PASS, LABEL_PASS
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.cost import Timings, expected_bytes, expected_work, read_measured, write_measured
from spin_usd.planning.make_plan import Plan, make_plan
from spin_usd.planning.request import PlanRequest
from spin_usd.planning.variant_table import MANY, VariantRow, in_lines, variant_table
from spin_usd.planning.work import CommonWork, PictureWork
from spin_usd.scene.derived.content_keys import KeyMaker, RenderSettings, geometry_key
from spin_usd.scene.effort import Effort
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.store.pictures_left import WantedFiles
from tests.cases.requests import request_for

OPTIONS = CommonWork(renderer="blender", effort=Effort(samples=16), kinds=("image", "depth"), frame_pixels=1000)
WANTED = WantedFiles(kinds=OPTIONS.kinds, options={}, image_suffix=".png")
SETTINGS = RenderSettings(renderer="raycast", effort=Effort(samples=3), seed=5)
AUGMENTATIONS = """#usda 1.0
over "World" (
    prepend variantSets = "augmentation"
)
{
    variantSet "augmentation" = {
        "bright" {
            over "Lights" {
                over "Sun" {
                    float inputs:intensity = 3000
                }
            }
        }
        "low" {
            over "Lights" {
                over "Sun" {
                    float3 xformOp:rotateXYZ.timeSamples = {
                        0: (50, 0, 30),
                        3: (60, 9, 0),
                    }
                }
            }
        }
        "stopped" {
            over "Camera" {
                float exposure.timeSamples = {
                    0: 0.5,
                    7: 2,
                }
            }
        }
    }
}
"""
MATT_LOOK = """#usda 1.0
over "World" (
    prepend variantSets = "augmentation"
)
{
    variantSet "augmentation" = {
        "matt" {
            over "Target" {
                over "Model" (
                    variants = {
                        string look = "matt"
                    }
                )
                {
                }
            }
        }
    }
}
"""


@pytest.fixture
def augmented(small_stage, tmp_path):
    """The small stage, under a root layer with variants that change light, light's direction over time, and sensor."""
    root = shutil.copytree(small_stage.parent, tmp_path / "stage") / "augmented.usda"
    text = small_stage.read_text().replace("@./layers/poses.usdc@", "@./plan.usda@, @./layers/poses.usdc@", 1)
    root.with_name("plan.usda").write_text(AUGMENTATIONS)
    root.write_text(text)
    return root


def asked(stage, processes=1, variants=("all",), renderer=SETTINGS.renderer, explain=False):
    options = {"variants": variants, "frames": "1:7:2", "renderer": renderer, "seed": SETTINGS.seed}
    question = PlanRequest(request=request_for(stage, effort=SETTINGS.effort, **options), explain=explain)
    return make_plan(question, processes=processes, progress=lambda *_: None)


def planned(variant, index, geometry, radiance, exposure):
    return PlannedPicture(
        variant=variant,
        index=index,
        frame=f"f{index}",
        time_code=float(index),
        geometry=geometry,
        radiance=radiance,
        exposure=exposure,
        targets="t",
        region=(0, 0, 10, 10),
        target_pixels=60,
        light_groups=1,
        features=(),
    )


@pytest.mark.slow
def test_keys_are_those_of_scenes_read_alone_however_the_work_is_shared(augmented, monkeypatch) -> None:
    alone = asked(augmented)
    assert [p.name for p in alone.pictures[:3]] == [f"nominal/{name}" for name in alone.names[1:7:2]]
    for picture in alone.pictures:
        reader = StageReader(augmented, variant=picture.variant)
        scene, region = reader.scene(reader.frames[picture.index]), picture.region
        assert picture.geometry == geometry_key(scene)
        assert picture.radiance == KeyMaker(SETTINGS).keys(scene).radiance
        assert picture.exposure == KeyMaker(SETTINGS).keys(scene).exposure
        assert region == (*(getattr(scene.picture_region, side) for side in ("x0", "y0", "x1", "y1")),)
    monkeypatch.setattr("spin_usd.planning.make_plan.SHARED_FROM", 2)
    shared = asked(augmented, processes=2)
    assert (shared.pictures, shared.stages) == (alone.pictures, alone.stages)
    cost = variant_table(alone, OPTIONS, WANTED)
    assert [row.counts for row in cost.rows] == [(3, 3, 3, 3), (3, 0, 0, 3), (3, 0, 3, 3), (3, 0, 0, 3)]


def a_plan(pictures, variants):
    return Plan(
        root=None,
        settings=SETTINGS,
        variants=variants,
        known_variants=variants,
        names=(),
        frames=(),
        stages={},
        origin={},
        content=None,
        pictures=tuple(pictures),
    )


def test_what_two_variants_share_counts_for_the_first() -> None:
    pictures = [planned("a", 0, "g", "r", "e"), planned("b", 0, "g", "r", "f"), planned("c", 0, "g", "s", "h")]
    cost = variant_table(a_plan(pictures, ("a", "b", "c")), OPTIONS, WANTED)
    assert [row.counts for row in cost.rows] == [(1, 1, 1, 1), (1, 0, 0, 1), (1, 0, 1, 1)]
    assert cost.total.counts == (3, 1, 2, 3)
    assert cost.rows[0].seconds > cost.rows[2].seconds > cost.rows[1].seconds > 0
    assert cost.rows[0].bytes > cost.rows[2].bytes > cost.rows[1].bytes > 0


def test_many_variants_that_cost_alike_share_a_line() -> None:
    rows = [
        VariantRow(name=f"v{i}", pictures=5, label_passes=5 * (i == 0), renders=5, exposures=5, seconds=1.0, bytes=2.0)
        for i in range(MANY + 1)
    ]
    first, others = in_lines(rows)
    assert (first.name, others.name, others.variants, others.renders) == ("v0", f"v1 to v{MANY}", MANY, 5 * MANY)
    assert in_lines(rows[:3]) == rows[:3]


def test_what_a_run_took_scales_what_is_expected_next(tmp_path) -> None:
    task = PictureWork(picture=planned("a", 0, "g", "r", "e"), label_pass=True, render=True)
    expected = expected_work(task, OPTIONS)
    of_run = Timings()
    for _ in range(100):
        of_run.add(expected, {kind: 3 * seconds for kind, seconds in expected.items()})
    place = (Folder(tmp_path), "measured.json")
    for _ in range(2):
        write_measured(*place, of_run, work=tmp_path)
    scaled = read_measured(*place).scaled(expected, slower=5)
    for kind in (LABEL_PASS, BEAUTY_PASS):
        assert scaled[kind] == pytest.approx(3 * expected[kind])
    assert Timings().scaled(expected, slower=5) == {kind: 5 * seconds for kind, seconds in expected.items()}
    assert expected_bytes(task, OPTIONS) > 0


@pytest.mark.parametrize("text", ["", "{", "[]", '{"expected": 3}', '{"expected": {"stage": NaN}, "taken": {}}'])
def test_damaged_measurements_are_none(tmp_path, text) -> None:
    (tmp_path / "measured.json").write_text(text)
    assert read_measured(Folder(tmp_path), "measured.json") == Timings()


@pytest.mark.slow
def test_the_command_counts_what_a_dataset_lacks(spin_usd, augmented, tmp_path) -> None:
    options = ["--renderer", "raycast", "--samples", "1"]
    spin_usd("render", augmented, "--out", tmp_path / "data", "--frames", "0:2", *options)
    command = [
        "plan",
        augmented,
        "--out",
        tmp_path / "data",
        "--variants",
        "nominal,bright",
        "--frames",
        "0:3",
        *options,
    ]
    told = json.loads(spin_usd(*command, "--json").stdout)
    assert told["finished"] == 2
    assert [(r["name"], r["pictures"], r["label_passes"], r["renders"]) for r in told["rows"]] == [
        ("nominal", 1, 1, 1),
        ("bright", 3, 0, 0),
    ]
    assert "bright" in spin_usd(*command).stdout


@pytest.mark.slow
def test_what_is_left_out_is_counted_by_variant_whoever_plans(augmented, monkeypatch) -> None:
    alone = asked(augmented, explain=True, renderer="blender")
    assert {each.what for each in alone.skipped} >= {
        "light tree",
        "stars",
        "pixels outside the target's region",
    }
    for each in alone.skipped:
        assert all(1 <= count <= 3 for count in each.pictures.values())
    expected = dict.fromkeys(alone.variants, 3)
    assert next(each for each in alone.skipped if each.what == "light tree").pictures == expected
    monkeypatch.setattr("spin_usd.planning.make_plan.SHARED_FROM", 2)
    assert asked(augmented, processes=2, explain=True, renderer="blender").skipped == alone.skipped
    assert asked(augmented, renderer="blender").skipped == ()
    assert "light tree" not in {each.what for each in asked(augmented, explain=True).skipped}  # the preview has none


def test_the_command_explains_what_is_left_out_of_which_pictures(spin_usd, small_stage, tmp_path) -> None:
    root = shutil.copytree(small_stage.parent, tmp_path / "stage") / "looks.usda"
    root.with_name("look.usda").write_text(MATT_LOOK)
    root.write_text(small_stage.read_text().replace("@./layers/poses.usdc@", "@./look.usda@, @./layers/poses.usdc@", 1))
    command = ["plan", root, "--variants", "all", "--frames", "0:2", "--explain"]
    told = json.loads(spin_usd(*command, "--json").stdout)["skipped"]
    of = {(each["part"], each["what"]): each for each in told}
    assert of["render", "light tree"]["pictures"] == {"nominal": 2, "matt": 2}
    assert of["optics", "glare"]["pictures"] == {"nominal": 2, "matt": 2}
    text = spin_usd(*command).stdout
    assert "render: no light tree: there is nothing to choose among (the same bits; all pictures)" in text
    assert "all pictures)" in text
    assert "geometry is not simplified" in text
