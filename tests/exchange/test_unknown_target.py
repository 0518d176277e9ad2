"""The export of an unknown target: the pictures with or without masks and poses, and the true shape apart from them."""

import json
from typing import Any

import numpy as np
import pytest
import trimesh

from spin_usd.errors import InputError, UnsupportedError
from spin_usd.exchange.layout.models import Model
from spin_usd.exchange.layout.true_shape import read_shape_truth, visible_points
from spin_usd.geometry.triangles import distances_to
from spin_usd.reading.dataset import Dataset
from tests.conftest import REPOSITORY
from tests.exchange.conftest import contents, write_export

RULES = REPOSITORY / "schemas"


@pytest.fixture(scope="module")
def exported(rendered, tmp_path_factory):
    out = tmp_path_factory.mktemp("unknown") / "out"
    write_export(rendered, "unknown_target", out)
    return out


@pytest.fixture(scope="module")
def withheld(rendered, tmp_path_factory):
    out = tmp_path_factory.mktemp("withheld") / "out"
    write_export(rendered, "unknown_target", out, options={"masks": "no", "poses": "no"})
    return out


def model_of(mesh, part=1) -> Model:
    part = np.full(len(mesh.faces), part, np.uint16)
    return Model(points=np.asarray(mesh.vertices, float), faces=np.asarray(mesh.faces, np.int32), face_part=part)


def test_frames_have_the_records_camera_pose_and_sun(exported, rendered) -> None:
    frames = json.loads((exported / "frames.json").read_text())["frames"]
    for frame, picture in zip(frames, Dataset(rendered), strict=True):
        assert frame["K"] == picture.camera_matrix.tolist()
        assert frame["distortion"] == picture.distortion.tolist()
        assert frame["T_cam_body"] == picture.T_cam_body.tolist()
        assert frame["sun_cam"] == list(picture.recorded.sun.towards_cam)
        assert frame["exposure"] == picture.recorded.appearance.exposure
        assert (exported / frame["image"]).is_file()
        assert (exported / frame["mask"]).is_file()
        assert "time_s" not in frame


@pytest.mark.slow
def test_masks_and_poses_move_into_the_truth(withheld, exported) -> None:
    validate(withheld)
    frames = json.loads((withheld / "frames.json").read_text())["frames"]
    assert not {"mask", "T_cam_body"} & set().union(*frames)
    assert not (withheld / "masks").exists()
    truth, _ = read_shape_truth(withheld / "truth")
    given, _ = read_shape_truth(exported / "truth")
    assert (truth.poses, given.poses) == (False, True)
    assert [each.T_cam_body for each in truth.pictures] == [each.T_cam_body for each in given.pictures]
    for each, same in zip(truth.pictures, given.pictures, strict=True):
        assert (withheld / each.mask).read_bytes() == (exported / same.mask).read_bytes()


def validate(folder) -> None:
    import jsonschema

    for file, schema in (("frames.json", "unknown-target-1"), ("truth/truth.json", "shape-truth-1")):
        rules = json.loads((RULES / f"{schema}.schema.json").read_text())
        jsonschema.validate(json.loads((folder / file).read_text()), rules)


def test_documents_keep_to_their_schemas(exported) -> None:
    validate(exported)


def test_the_mesh_and_its_points_are_the_same_surface(exported) -> None:
    truth, points = read_shape_truth(exported / "truth")
    mesh = trimesh.load_mesh(exported / "truth" / "mesh.ply", process=False)
    assert len(points.points) == 100_000
    assert truth.shape.diameter == pytest.approx(np.linalg.norm(mesh.extents), rel=0.5)
    some = points.points[::500]
    assert max(distances_to(point, mesh.triangles).min() for point in some) < 1e-6  # trimesh holds float64
    assert {str(each) for each in np.unique(points.parts)} <= set(truth.shape.parts)
    np.testing.assert_allclose(np.linalg.norm(points.normals, axis=1), 1, atol=1e-6)


def test_dense_pose_lies_on_the_truth(exported, rendered) -> None:
    corners = trimesh.load_mesh(exported / "truth" / "mesh.ply", process=False).triangles
    picture = Dataset(rendered)[0]
    seen = picture.dense_pose[picture.segmentation > 0].astype(np.float64)
    assert max(distances_to(point, corners).min() for point in seen[::30]) < 1e-6  # metres: the label is float32


@pytest.mark.slow
def test_equal_datasets_give_equal_files(exported, rendered, tmp_path) -> None:
    write_export(rendered, "unknown_target", tmp_path / "again")
    assert contents(tmp_path / "again") == contents(exported)


def test_hidden_surfaces_have_no_points() -> None:
    outer, inner = trimesh.creation.box((2, 2, 2)), trimesh.creation.icosphere(radius=0.5)
    both: Any = trimesh.util.concatenate([outer, inner])
    found = visible_points(model_of(both), 5000)
    assert np.abs(found.points).max(axis=1) == pytest.approx(1)  # none is on the sphere
    assert found.seen == pytest.approx(outer.area / both.area, abs=0.02)
    np.testing.assert_allclose((found.normals * found.points).sum(1), 1, atol=1e-9)  # outwards
    inside_out = outer.copy()
    inside_out.invert()
    again = visible_points(model_of(inside_out), 5000)
    np.testing.assert_allclose((again.normals * again.points).sum(1), 1, atol=1e-9)


def test_occupancy_is_the_inside_of_closed_pieces(exported) -> None:
    with np.load(exported / "truth" / "occupancy.npz") as grid:
        occupied, low, step = grid["occupied"], grid["low"], float(grid["step"])
    places = np.argwhere(occupied)[::97]
    mesh = trimesh.load_mesh(exported / "truth" / "mesh.ply", process=True)
    pieces = [piece for piece in mesh.split(only_watertight=True) if piece.is_watertight]
    assert pieces
    centres = low + (places + 0.5) * step
    assert np.mean(np.any([piece.contains(centres) for piece in pieces], axis=0)) > 0.98


def test_a_missing_target_is_named(rendered, tmp_path) -> None:
    with pytest.raises(InputError, match="has no target 'ghost'"):
        write_export(rendered, "unknown_target", tmp_path / "out", target="ghost")


def test_a_folder_that_is_no_truth_is_refused(exported, tmp_path) -> None:
    with pytest.raises(InputError, match=r"has no truth.json; give the folder truth of an export"):
        read_shape_truth(tmp_path)
    for name in ("truth.json", "mesh.ply", "points.ply"):
        (tmp_path / name).write_bytes(b"{}")
    with pytest.raises(InputError, match="is not the truth of a shape"):
        read_shape_truth(tmp_path)
    (tmp_path / "truth.json").write_bytes((exported / "truth" / "truth.json").read_bytes())
    with pytest.raises(InputError, match=r"points\.ply"):
        read_shape_truth(tmp_path)


def test_a_flat_dot_has_no_surface_to_see() -> None:
    points = np.zeros((3, 3))
    dot = Model(points=points, faces=np.array([[0, 1, 2]], np.int32), face_part=np.ones(1, np.uint16))
    with pytest.raises(UnsupportedError, match="has no surface"):
        visible_points(dot, 10)
