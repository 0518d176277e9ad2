"""Datasets of a craft that is not quite as drawn: labels, records and reports agree on its shape."""

import numpy as np
import pytest

import spin_usd
from spin_usd.commands.diff.run import diff
from spin_usd.geometry.part_axes import nearest
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.shaped import BENT, BULGED, VARIANTS, WING, author_shaped

FLOAT32 = 2e-6  # metres, of a dense pose in single precision on a craft of a metre


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    return author_shaped(tmp_path_factory.mktemp("shapes"))


@pytest.fixture(scope="module")
def dataset(stage):
    folder = stage.parent.parent / "dataset"
    labels = ["depth", "segmentation", "dense_pose"]
    spin_usd.render(stage, out=folder, renderer="raycast", variants="all", labels=labels, workers=1)
    return spin_usd.Dataset(folder)


def pictures(dataset, variant):
    return [picture for picture in dataset if picture.variant == variant]


def wing_ids(dataset):
    return [number for number, part in dataset.parts.items() if part.name in WING.split("+")]


def test_identity_values_give_the_same_labels_to_the_byte_and_an_old_record(dataset) -> None:
    for drawn, same in zip(pictures(dataset, "nominal"), pictures(dataset, "as_drawn"), strict=True):
        for kind in ("depth", "segmentation", "dense_pose"):
            files = [picture.record["files"][kind]["sha256"] for picture in (drawn, same)]
            assert files[0] == files[1]
        assert same.record["provenance"]["keys"]["geometry"] == drawn.record["provenance"]["keys"]["geometry"]
        assert not {"shape", "shaped_keypoints"} & same.record["targets"][0].keys()


def test_the_dense_pose_of_a_moved_part_is_T_times_the_drawn_surface(dataset, stage) -> None:
    reader = StageReader(stage)
    target = reader.scene(reader.frames[0]).bodies[0].target
    seen = 0
    for picture in pictures(dataset, "moved"):
        shapes = {part["name"]: np.array(part["T_body_drawn"]) for part in picture.record["targets"][0]["shape"]}
        for part in target.parts:
            T = shapes.get(part.name, np.eye(4))
            there = picture.dense_pose[picture.segmentation == part.id].astype(np.float64)[::20]
            if len(there):
                drawn = (there - T[:3, 3]) @ np.linalg.inv(T[:3, :3]).T
                surface = target.mesh.points[target.mesh.faces[target.mesh.face_part == part.id]]
                assert nearest(drawn, surface)[0].max() < FLOAT32
                seen += part.name in shapes
    assert seen


def test_a_missing_part_has_no_pixel_and_its_keypoints_are_missing(dataset) -> None:
    assert any(np.isin(picture.segmentation, wing_ids(dataset)).any() for picture in pictures(dataset, "nominal"))
    for picture in pictures(dataset, "gone"):
        assert not np.isin(picture.segmentation, wing_ids(dataset)).any()
        (target,) = picture.record["targets"]
        parts = [(each["part"] or "").rpartition("/")[2] in WING.split("+") for each in target["shaped_keypoints"]]
        assert any(parts)
        for (u, v, state), missing, point in zip(target["keypoints"], parts, target["shaped_keypoints"], strict=True):
            assert (state == "missing") == missing
            assert (u is None and v is None) == missing == (point["true"] is None)
            assert point["drawn"]
        np.testing.assert_array_equal(np.isnan(picture.keypoint_pixels[:, 0]), parts)
        assert all(part["missing"] for part in target["shape"])


def test_records_have_the_shape_and_both_places_of_keypoints(dataset) -> None:
    for picture in pictures(dataset, "every"):
        (target,) = picture.record["targets"]
        shape = {part["name"]: part for part in target["shape"]}
        assert shape.keys() == {"Body", *WING.split("+")}
        assert shape["Body"]["bulge"] == pytest.approx(BULGED)
        assert shape["WingPlusX"]["bend"] == pytest.approx(BENT)
        points = target["shaped_keypoints"]
        np.testing.assert_allclose([each["drawn"] for each in points], dataset.keypoints.points, atol=1e-12)
        pixels = picture.camera.project(
            np.array([each["true"] for each in points]) @ picture.T_cam_body[:3, :3].T + picture.T_cam_body[:3, 3]
        )
        np.testing.assert_allclose(picture.targets[0].keypoints, pixels, atol=1e-6)
        np.testing.assert_allclose(picture.keypoint_pixels, pixels, atol=1e-6)


def test_every_picture_is_reproduced_to_the_byte(dataset) -> None:
    for variant in ("moved", "gone", "every"):
        assert spin_usd.reproduce(dataset.root, "img000001", variant=variant).same


def test_the_checks_find_no_error(dataset, stage) -> None:
    for path in (dataset.root, stage):
        assert not [each for each in spin_usd.check(path).findings if each.severity == "error"]


def test_the_difference_from_the_drawn_craft_is_listed(stage) -> None:
    report = diff(stage, "nominal", "every", progress=lambda *_: None)
    changed = {each.where.rpartition("/")[2] for each in report.differences}
    assert {"WingPlusX.xformOp:transform:shape", "WingPlusX.spin:shape:bend", "Body.spin:shape:bulge"} <= changed


def test_it_is_planned_and_resumed(dataset, stage) -> None:
    again = spin_usd.render(
        stage, out=dataset.root, renderer="raycast", variants="all", labels=["depth", "segmentation", "dense_pose"]
    )
    assert (again.made, again.pictures) == (0, 2 * (1 + len(VARIANTS)))
    plan = spin_usd.plan(stage, variants="all", renderer="raycast")
    assert sum(plan.pictures.values()) == again.pictures
