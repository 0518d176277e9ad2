"""BOP and SwissCube: the same poses, depth and masks as the dataset has, in their places and conventions."""

import json

import cv2
import numpy as np
import pytest
import trimesh

from spin_usd.errors import UnsupportedError
from spin_usd.exchange.bop import depth_scale
from spin_usd.exchange.layout.exported_dataset import ExportedDataset
from spin_usd.exchange.layout.rectified_picture import resampling
from spin_usd.formats.image_file import read_image
from spin_usd.reading.dataset import Dataset
from tests.exchange.conftest import PLAIN, clone, write_export

HALF_PIXEL = np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
EDGE = 1.5  # pixels: outlines of masks are off by half a pixel, and thin tips fall between the centres of pixels


@pytest.fixture(scope="module")
def pictures(rendered):
    return Dataset(rendered)


@pytest.fixture(scope="module")
def bop(rendered, tmp_path_factory):
    """All pictures without their distortion, two to train and one to test."""
    out = tmp_path_factory.mktemp("bop") / "out"
    write_export(rendered, "bop", out, options={"rectify": "yes"}, split="train=0.6,test=0.4")
    return out


@pytest.fixture(scope="module")
def swisscube(rendered, tmp_path_factory):
    out = tmp_path_factory.mktemp("swisscube") / "out"
    write_export(rendered, "swisscube", out, options={"rectify": "yes"})
    return out


def scenes(export):
    """Each scene's folder, image number, and entries of its files by their names."""
    for scene in sorted(path.parent for path in export.rglob("scene_gt.json")):
        entries = {path.stem: json.loads(path.read_text()) for path in scene.glob("*.json")}
        for number in entries["scene_gt"]:
            yield scene, number, {name: entry[number] for name, entry in entries.items()}


def test_each_picture_is_in_one_scene(bop) -> None:
    found = [(str(scene.relative_to(bop)), number) for scene, number, _ in scenes(bop)]
    assert sorted(number for _, number in found) == ["0", "1", "2"]
    assert {scene for scene, _ in found} == {"train/000000", "test/000000"}
    for scene, number, _ in scenes(bop):
        for name in ("gray/{}.png", "depth/{}.png", "mask/{}_000000.png", "mask_visib/{}_000000.png"):
            assert (scene / name.format(f"{int(number):06d}")).is_file()


def test_the_cards_have_the_cameras_of_their_files(bop, swisscube) -> None:
    """BOP's first pixel has its centre at (0, 0), SwissCube's half a pixel from the corner; both without distortion."""
    for export, centre in ((bop, "(0, 0) is the first pixel's centre"), (swisscube, "(0, 0) is the corner")):
        *_, (_, _, entry) = scenes(export)
        fx, _, cx, _, fy, cy, *_ = entry["scene_camera"]["cam_K"]
        card = (export / "README.md").read_text()
        assert f"| {fx} | {fy} | {cx} | {cy} | none |" in card
        assert f"Here {centre}" in card


def test_poses_are_the_datasets_in_millimetres(bop, pictures) -> None:
    for _, number, entry in scenes(bop):
        (pose,) = entry["scene_gt"]
        wanted = pictures[int(number)].T_cam_body
        np.testing.assert_allclose(np.reshape(pose["cam_R_m2c"], (3, 3)), wanted[:3, :3], atol=1e-15)
        np.testing.assert_allclose(np.array(pose["cam_t_m2c"]) / 1000, wanted[:3, 3], rtol=1e-15)
        assert pose["obj_id"] == 1


def test_k_is_half_a_pixel_less(bop, pictures) -> None:
    for _, number, entry in scenes(bop):
        K = np.reshape(entry["scene_camera"]["cam_K"], (3, 3))
        np.testing.assert_array_equal(K + HALF_PIXEL, pictures[int(number)].camera_matrix)
    camera = json.loads((bop / "camera.json").read_text())
    assert (camera["cx"], camera["cy"], camera["width"], camera["height"]) == (K[0, 2], K[1, 2], 240, 150)


def test_depth_and_masks_are_the_labels_without_distortion(bop, pictures) -> None:
    for scene, number, entry in scenes(bop):
        picture, stem = pictures[int(number)], f"{int(number):06d}"
        plain = resampling(picture.camera)
        scale = entry["scene_camera"]["depth_scale"]
        depth = read_image(scene / "depth" / f"{stem}.png")[0] * scale
        np.testing.assert_allclose(depth, plain.nearest(picture.depth) * 1000, atol=scale * 0.501)
        for folder in ("mask", "mask_visib"):
            mask, _ = read_image(scene / folder / f"{stem}_000000.png")
            np.testing.assert_array_equal(mask, np.where(plain.nearest(picture.mask(1)), 255, 0))
        image, _ = read_image(scene / "gray" / f"{stem}.png")
        np.testing.assert_array_equal(image, plain.interpolated(picture.image))


def test_opencv_projects_the_model_onto_the_mask(bop) -> None:
    """From the export alone: model, pose and K give the box of the mask, and `bbox_obj`."""
    model = trimesh.load_mesh(bop / "models" / "obj_000001.ply", process=False)
    for scene, number, entry in scenes(bop):
        (pose,), (seen,) = entry["scene_gt"], entry["scene_gt_info"]
        turn, _ = cv2.Rodrigues(np.reshape(pose["cam_R_m2c"], (3, 3)))
        K = np.reshape(entry["scene_camera"]["cam_K"], (3, 3))
        pixels = cv2.projectPoints(model.vertices, turn, np.array(pose["cam_t_m2c"]), K, None)[0].reshape(-1, 2)
        box = np.concatenate([pixels.min(0), pixels.max(0)])
        mask, _ = read_image(scene / "mask" / f"{int(number):06d}_000000.png")
        rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
        np.testing.assert_allclose(box, [columns[0], rows[0], columns[-1], rows[-1]], atol=EDGE)
        of_mask = [columns[0], rows[0], columns[-1] - columns[0], rows[-1] - rows[0]]
        assert seen["bbox_obj"] == seen["bbox_visib"] == of_mask  # bop_toolkit's misc.calc_2d_bbox
        assert seen["px_count_visib"] == seen["px_count_valid"] == np.count_nonzero(mask)
        assert seen["visib_fract"] == 1


@pytest.fixture(scope="module")
def facing(tmp_path_factory, spin_usd):
    """Pictures of a box that faces the camera, without distortion: its silhouette is a rectangle, whose sides lie
    anywhere between the centres of pixels."""
    folder = tmp_path_factory.mktemp("facing")
    trimesh.creation.box((1, 0.8, 0.6)).export(folder / "box.stl")
    camera = {"Nu": 96, "Nv": 72, "ppx": 1e-5, "ppy": 1e-5, "cameraMatrix": [[130, 0, 48], [0, 130, 36], [0, 0, 1]]}
    places = [(0.013, 0.021, 5.0), (-0.31, 0.17, 5.07), (0.23, -0.29, 6.131), (0.501, 0.333, 7.77)]
    poses = [
        {"filename": f"p{i}.png", "q_vbs2tango": [1, 0, 0, 0], "r_Vo2To_vbs_true": place}
        for i, place in enumerate(places)
    ]
    for name, value in (("camera", camera), ("poses", poses)):
        (folder / f"{name}.json").write_text(json.dumps(value))
    chosen = ("--target", folder / "box.stl", "--units-per-metre", 1, "--camera", folder / "camera.json")
    spin_usd("author", "--poses", folder / "poses.json", *chosen, "--out", folder / "stage")
    spin_usd("render", folder / "stage", "--out", folder / "dataset", "--renderer", "raycast", "--samples", 1)
    return folder / "dataset"


def test_the_box_of_a_whole_target_is_its_masks(facing, tmp_path) -> None:
    write_export(facing, "bop", tmp_path / "out")
    found = list(scenes(tmp_path / "out"))
    assert len(found) == 4
    for scene, number, entry in found:
        (seen,) = entry["scene_gt_info"]
        mask, _ = read_image(scene / "mask" / f"{int(number):06d}_000000.png")
        rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
        wanted = [columns[0], rows[0], columns[-1] - columns[0], rows[-1] - rows[0]]
        assert seen["bbox_obj"] == seen["bbox_visib"] == wanted


def test_the_model_is_measured(bop) -> None:
    model = trimesh.load_mesh(bop / "models" / "obj_000001.ply", process=False)
    info = json.loads((bop / "models" / "models_info.json").read_text())["1"]
    np.testing.assert_allclose([info[f"size_{axis}"] for axis in "xyz"], model.extents)
    np.testing.assert_allclose([info[f"min_{axis}"] for axis in "xyz"], model.bounds[0])
    assert np.max(model.extents) < info["diameter"] < np.linalg.norm(model.extents)


def test_the_test_asks_for_what_is_seen(bop) -> None:
    asked = json.loads((bop / "test_targets_bop19.json").read_text())
    numbers = [int(number) for scene, number, _ in scenes(bop) if scene.parent.name == "test"]
    assert asked == [{"im_id": number, "scene_id": 0, "obj_id": 1, "inst_count": 1} for number in numbers]


def test_swisscube_has_lists_and_corners_and_k_from_the_corner(swisscube, pictures) -> None:
    lines = (swisscube / "training.txt").read_text().splitlines()
    assert lines == [f"training/seq_000000/000000/rgb/{number:06d}.png" for number in range(3)]
    model = trimesh.load_mesh(swisscube / "models" / "obj_000001.ply", process=False)
    (corners,) = json.loads((swisscube / "swisscube_bbox.json").read_text())
    np.testing.assert_allclose(corners, model.bounding_box.vertices)  # what EPFL's script writes
    for scene, number, entry in scenes(swisscube):
        assert (scene / "rgb" / f"{int(number):06d}.png").is_file()
        np.testing.assert_array_equal(np.reshape(entry["scene_camera"]["cam_K"], (3, 3)), pictures[0].camera_matrix)
        mask, _ = read_image(scene / "mask_visib" / f"{int(number):06d}_000000.png")
        assert set(np.unique(mask)) == {0, 255}


@pytest.mark.parametrize("to", ["bop", "swisscube"])
def test_distortion_is_refused_unless_it_is_taken_out(rendered, tmp_path, to) -> None:
    with pytest.raises(UnsupportedError, match=r"has lens distortion.* --option rectify=yes"):
        write_export(rendered, to, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_depth_beyond_sixteen_bits_is_refused(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "set", [{"frame": "a", "camera": PLAIN, "t": [0, 0, 65]}])
    with pytest.raises(UnsupportedError, match=r"up to 65\.\d+ m away, and 16 bits of 1 mm end at 65.535 m"):
        write_export(dataset, "bop", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("farthest", "part_of", "scale"), [(5.0, 1, 0.1), (5.9, 1, 1.0), (5.0, 0, 1.0)])
def test_steps_of_depth_are_as_fine_as_the_range_allows(rendered, tmp_path, farthest, part_of, scale) -> None:
    """16 bits of 0.1 mm reach 6.5535 m; Tango reaches 0.87 m from its origin. Occluders may be anywhere."""
    dataset = clone(rendered, tmp_path / "set", [{"frame": "a"}])
    described = json.loads((dataset / "dataset.json").read_text())
    described["parts"]["1"]["target"] = part_of
    (dataset / "dataset.json").write_text(json.dumps(described))
    exported = ExportedDataset(
        dataset=Dataset(dataset), entries=(), splits=(), target="tango", farthest=farthest, options={}
    )
    assert depth_scale(exported) == scale


def test_bodies_that_hide_one_another_need_masks_of_each(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "set", [{"frame": "a", "camera": PLAIN}])
    described = json.loads((dataset / "dataset.json").read_text())
    described["parts"]["1"]["target"] = 0  # an occluder's
    (dataset / "dataset.json").write_text(json.dumps(described))
    with pytest.raises(UnsupportedError, match=r"several bodies, .* --labels default,instance"):
        write_export(dataset, "bop", tmp_path / "out")
