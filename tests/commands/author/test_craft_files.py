"""Craft from seeds as targets of `author`: labels of their parts, the same stage twice, both looks."""

import csv
import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import spin_usd
from spin_usd.commands.author.in_child import author_stage
from spin_usd.craft.craft import KINDS
from spin_usd.craft.make_craft import CraftChoice, make_craft
from spin_usd.errors import InputError, UnsupportedError
from spin_usd.planning.in_child import open_plan
from spin_usd.planning.plan_calls import OpenPlan
from spin_usd.sampling.poses import ball_of
from spin_usd.scene.scene import FrameId
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.composition.stage_hash import hash_and_files
from spin_usd.stage.read.stage_reader import StageReader

SAMPLE = "range=9 count=2"


def authored(out: Path, target: str, **options: object) -> Path:
    report = author_stage(sample=SAMPLE, target=target, camera="speedplus", resolution="120x75", out=out, **options)
    return Path(report.root)


def test_a_craft_of_a_seed_is_labelled_as_it_was_made(tmp_path: Path) -> None:
    root = authored(tmp_path / "stage", "craft:12")
    assert not [finding for finding in check_stage(root) if finding.severity == "error"]
    spin_usd.render(root, out=tmp_path / "set", renderer="raycast", labels="segmentation,dense_pose")
    dataset, craft = spin_usd.Dataset(tmp_path / "set"), make_craft(CraftChoice(seed=12))
    parts = {part.name: part.class_name for part in dataset.parts.values()}
    assert parts == {part.name: KINDS[part.kind] for part in craft.parts}
    low, high = np.min([p.bounds[0] for p in craft.parts], axis=0), np.max([p.bounds[1] for p in craft.parts], axis=0)
    for picture in dataset:
        seen = picture.dense_pose[picture.segmentation > 0]
        assert len(seen) > 50
        assert (seen >= low - 1e-5).all()
        assert (seen <= high + 1e-5).all()
        assert set(picture.keypoints.names) == set(craft.keypoints)


def test_the_same_seed_is_the_same_stage_and_another_is_another(tmp_path: Path) -> None:
    roots = [authored(tmp_path / name, f"craft:{seed}") for name, seed in (("a", 3), ("b", 3), ("c", 4))]
    one, same, other = (hash_and_files(StageReader(root).stage, root.parent)[0] for root in roots)
    assert one == same
    assert one != other


def test_a_file_and_a_further_body_can_be_craft_too(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('seed = 5\nfamily = "cubesat"\nsize = 0.3\n')
    report = author_stage(
        sample=SAMPLE, target=file, camera="speedplus", out=tmp_path / "stage", also=["craft:9:distance=3..4"]
    )
    own = "axes are the craft's own, z away from its launcher"
    assert {note for note in report.notes if "axes" in note} == {
        f"body {own}: poses are meant in these",
        f"craft_9.usdc: its {own}: its poses are meant in these",
    }
    reader = StageReader(report.root)
    names = [body.target.name for body in reader.scene(reader.frames[0]).bodies]
    assert names == ["mine", "craft_9"]
    with pytest.raises(InputError, match="no seed"):
        authored(tmp_path / "no", "craft:x")
    file.write_text('family = "cubesat"\nsize = 3\n')
    for options in ({"target": str(file)}, {"target": "tango", "also": [f"{file}:distance=3..4"]}):
        with pytest.raises(InputError, match=r"mine.toml: size: a cubesat is at most"):
            authored(tmp_path / "no", **options)
    with pytest.raises(InputError, match=r"craft:0\.\.3' is several craft, and a further body is one"):
        authored(tmp_path / "no", "tango", also=["craft:0..3"])


def test_a_range_in_diameters_is_of_the_craft_that_each_picture_shows(tmp_path: Path) -> None:
    sample = "range_diameters=1.5..2 inside=1 count=8"
    report = author_stage(sample=sample, target="craft:0..7", camera="spark", resolution="64", out=tmp_path / "stage")
    reader = StageReader(report.root)
    bodies = [reader.scene(frame).bodies[0] for frame in reader.frames]
    diameters = np.array([2 * ball_of(body.target.mesh.points.astype(float))[1] for body in bodies])
    shares = np.linalg.norm([body.T_cam_body.translation for body in bodies], axis=1) / diameters
    assert ((shares > 1.5 - 1e-6) & (shares < 2 + 1e-6)).all()
    assert diameters.max() > 3 * diameters.min()  # in metres none of these ranges would do for all
    with pytest.raises(InputError, match="has both range and range_diameters"):
        author_stage(sample="range=3 range_diameters=2 count=1", target="tango", camera="spark", out=tmp_path / "no")


@pytest.fixture(scope="module")
def in_turn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dataset of eight pictures of four craft."""
    folder = tmp_path_factory.mktemp("turns")
    sample = "range=9 u_share=0.45..0.55 v_share=0.45..0.55 count=8"
    author_stage(sample=sample, target="craft:0..3", camera="spark", resolution="120x75", out=folder / "stage", seed=1)
    labels = "depth,segmentation,dense_pose,instance"
    spin_usd.render(folder / "stage/dataset.usda", out=folder / "set", renderer="raycast", labels=labels)
    return folder


def test_pictures_show_craft_in_turn_as_often_as_one_another(in_turn: Path) -> None:
    dataset = spin_usd.Dataset(in_turn / "set")
    assert [target.name for target in dataset.targets] == [f"craft_{i}" for i in range(4)]
    shown = [[target.name for target in picture.targets] for picture in dataset]
    assert {len(each) for each in shown} == {1}
    assert Counter(name for (name,) in shown) == dict.fromkeys((f"craft_{i}" for i in range(4)), 2)
    assert shown[:4] != sorted(shown[:4])


def test_the_root_layer_names_the_set(in_turn: Path) -> None:
    documentation = StageReader(in_turn / "stage/dataset.usda").stage.GetRootLayer().documentation
    assert documentation.startswith("8 pictures of 4 craft, shown in turn: time code i is picture i.")


def test_views_of_craft_in_turn_are_of_all_pictures(tmp_path: Path) -> None:
    """Counts are of the set's pictures, not of the pictures of one craft."""
    rows = [f"p{i},1,0,0,0,{x},0,20" for i, x in enumerate((0, 0, 80))]
    (tmp_path / "poses.csv").write_text("\n".join(["name,qw,qx,qy,qz,x,y,z", *rows]))
    report = author_stage(
        poses=tmp_path / "poses.csv", target="craft:0..1", camera="speedplus", resolution="120x75", out=tmp_path / "s"
    )
    outside = "in 1 of 3 pictures the target is outside the frame (p2)"
    assert [note for note in report.notes if note.startswith(outside)]
    assert not [note for note in report.notes if "the only picture" in note]
    found = [finding for finding in check_stage(report.root) if finding.code == "target-outside"]
    assert [(each.severity, each.message.startswith(outside)) for each in found] == [("warning", True)]
    assert report.views.pictures == 3
    assert set(report.sizes) == {"craft_0", "craft_1"}
    assert max(report.sizes.values()) == pytest.approx(max(report.views.size), rel=1e-6)


def test_labels_are_of_the_craft_that_is_shown(in_turn: Path) -> None:
    dataset = spin_usd.Dataset(in_turn / "set")
    classes: dict[str, set[str]] = {}
    for picture in dataset:
        (target,) = picture.targets
        seen = set(np.unique(picture.segmentation).tolist()) - {0}
        assert {dataset.parts[part].target for part in seen} == {target.id}
        assert set(np.unique(picture.label("instance")).tolist()) == {0, target.id}
        craft = make_craft(CraftChoice(seed=int(target.name.removeprefix("craft_"))))
        assert picture.keypoints.names == tuple(craft.keypoints)
        np.testing.assert_allclose(picture.keypoints.points, list(craft.keypoints.values()), atol=1e-6)
        classes[target.name] = {dataset.parts[part].class_name for part in seen}
    assert set.union(*classes.values()) <= set(KINDS.values())
    assert not [finding for finding in spin_usd.check(in_turn / "set").findings if finding.severity == "error"]
    assert not [finding for finding in check_stage(in_turn / "stage/dataset.usda") if finding.severity == "error"]


def test_a_picture_of_a_set_in_turn_is_made_again(in_turn: Path) -> None:
    last = list(spin_usd.Dataset(in_turn / "set"))[-1]
    assert spin_usd.reproduce(in_turn / "set", last.frame).same


def test_exports_name_the_craft_of_each_picture(in_turn: Path, tmp_path: Path) -> None:
    dataset = spin_usd.Dataset(in_turn / "set")
    of_frame = {picture.frame: picture.targets[0] for picture in dataset}
    spin_usd.export(in_turn / "set", to="bop", out=tmp_path / "bop")
    poses = json.loads(next((tmp_path / "bop").rglob("scene_gt.json")).read_text())
    assert sorted(row["obj_id"] for rows in poses.values() for row in rows) == sorted(t.id for t in of_frame.values())
    assert len(list((tmp_path / "bop/models").glob("*.ply"))) == 4
    spin_usd.export(in_turn / "set", to="coco", out=tmp_path / "coco")
    found = json.loads(
        next(path for path in (tmp_path / "coco").rglob("*.json") if "annotations" in path.read_text()).read_text()
    )
    images = {each["id"]: Path(each["file_name"]).stem for each in found["images"]}
    names = {each["id"]: each["name"] for each in found["categories"]}
    shown = {images[each["image_id"]]: names[each["category_id"]] for each in found["annotations"]}
    assert shown == {frame: target.name for frame, target in of_frame.items()}
    spin_usd.export(in_turn / "set", to="spark", out=tmp_path / "spark", option=["layout=2022-stream1"])
    rows = list(csv.DictReader((tmp_path / "spark/train.csv").open()))
    assert {Path(row["filename"]).stem: row["class"] for row in rows} == {k: t.name for k, t in of_frame.items()}


@pytest.mark.parametrize("to", ["unknown_target", "colmap", "nerfstudio"])
def test_views_of_one_craft_are_exported_alone(to: str, in_turn: Path, tmp_path: Path) -> None:
    with pytest.raises(UnsupportedError, match=f"6 of 8 pictures do not show craft_0, and {to} holds views of one"):
        spin_usd.export(in_turn / "set", to=to, out=tmp_path / to)
    report = spin_usd.export(in_turn / "set", to=to, out=tmp_path / to, target="craft_2")
    assert (report.pictures, report.left_out) == (2, 6)
    shown = {picture.frame for picture in spin_usd.Dataset(in_turn / "set") if picture.targets[0].name == "craft_2"}
    assert {path.stem for path in (tmp_path / to / "images").iterdir()} == shown


def test_the_shapes_of_craft_in_turn_vary_too(tmp_path: Path) -> None:
    spec = tmp_path / "spec.toml"
    moved = '"part.Bus.shift.x" = { distribution = "fixed", value = 0.25, unit = "m" }'
    spec.write_text(
        f'schema = "augment-1"\nseed = 0\n[[augmentation]]\nname = "moved"\n[augmentation.sample]\n{moved}\n'
    )
    root = authored(tmp_path / "stage", "craft:0..1", augment=spec)
    drawn, varied = StageReader(root), StageReader(root, variant="moved")
    for frame, same in zip(drawn.frames, varied.frames, strict=True):
        (one,), (other,) = (reader.scene(each).bodies for reader, each in ((drawn, frame), (varied, same)))
        assert one.target.name == other.target.name
        assert np.abs(other.target.mesh.box - one.target.mesh.box).max() > 0.05


def test_a_selected_variant_is_selected_in_all_craft_in_turn(tmp_path: Path) -> None:
    matt = authored(tmp_path / "matt", "craft:0..2", variant="look=matt")
    plain = tmp_path / "plain.toml"
    plain.write_text('schema = "augment-1"\n[[augmentation]]\nname = "p"\nselect = { materials = "plain" }\n')
    drawn = authored(tmp_path / "drawn", "craft:0..2", augment=plain)
    readers = {
        "matt": StageReader(matt),
        "plain": StageReader(drawn, variant="p"),
        "reflective": StageReader(drawn),
    }
    shown = {name: [_metals(reader, frame) for frame in reader.frames] for name, reader in readers.items()}
    assert shown["matt"] == shown["plain"] == [0] * len(readers["matt"].frames)
    assert all(shown["reflective"])


def _metals(reader: StageReader, frame: FrameId) -> int:
    """Return how many materials of what a picture shows are metallic."""
    return sum(each.metallic != 0 for body in reader.scene(frame).bodies for each in body.target.materials)


@pytest.mark.parametrize("target", ["craft:0..1", "craft:0"])
def test_an_unknown_variant_is_refused_in_the_craft_that_were_asked_for(target: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        authored(tmp_path / "stage", target, variant="look=shiny")
    assert str(refused.value) == f"{target}: /craft_0 has no variant look=shiny; choose matt, reflective"


@pytest.mark.parametrize("option", ["leave_out", "materials", "keypoints"])
def test_what_changes_one_model_is_refused_for_craft_in_turn(option: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"craft in turn, and --{option.replace('_', '-')} is for one target"):
        authored(tmp_path / "stage", "craft:0..2", **{option: "Omni1"})


def test_planning_reports_each_craft_that_it_reads(in_turn: Path) -> None:
    """So that the time limit of a child counts for one craft, not for a thousand."""
    reports: list[tuple[object, ...]] = []
    open_plan(OpenPlan(stage=str(in_turn / "stage/dataset.usda")), lambda *report: reports.append(report))
    assert reports == [("reading: body", done, 4) for done in (1, 2, 3)]
