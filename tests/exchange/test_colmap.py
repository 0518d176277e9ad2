"""COLMAP's text model: tracks and images agree, points are seen where Embree sees them, the lens is held exactly."""

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from spin_usd.errors import InputError
from spin_usd.exchange.colmap import camera_line
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.formats.image_file import read_image
from spin_usd.geometry.camera import Camera
from spin_usd.reading.dataset import Dataset
from tests.exchange.conftest import PLAIN, blank, clone, write_export

FAR = 1.0  # footprints of a pixel: what a point can be off, and yet be seen as far as pixels tell
HIDDEN = 0.005  # of the points in pictures, by what is thinner than a pixel; 0.001 where it was measured
FOUND = 0.7  # of the points that are seen; the others are near edges, or grazed
CAMERA = Camera(width=240, height=150, fx=300, fy=301, cx=120.5, cy=75)


@pytest.fixture(scope="module")
def colmap(rendered, tmp_path_factory):
    out = tmp_path_factory.mktemp("colmap") / "out"
    write_export(rendered, "colmap", out, split="train=0.7,test=0.3")
    return out


def lines(export, name):
    text = (export / "sparse" / "0" / f"{name}.txt").read_text()
    return [line.split() for line in text.splitlines() if not line.startswith("#")]


def images(export):
    """Each image's words, its pixels (N, 2), and the numbers of its points."""
    rows = lines(export, "images")
    for head, seen in zip(rows[::2], rows[1::2], strict=True):
        numbers = np.reshape(np.array(seen, float), (-1, 3))
        yield head, numbers[:, :2], numbers[:, 2].astype(int).tolist()


def test_tracks_are_what_images_list(colmap) -> None:
    wanted = defaultdict(list)
    for head, _, numbers in images(colmap):
        for place, number in enumerate(numbers):
            wanted[number].append([int(head[0]), place])
    found = {int(row[0]): np.reshape(np.array(row[8:], int), (-1, 2)).tolist() for row in lines(colmap, "points3D")}
    assert found == wanted
    assert max(map(len, found.values())) > 1


def test_pixels_are_projections_and_their_colours_the_images(colmap, rendered) -> None:
    rows = {int(row[0]): np.array(row[1:7], float) for row in lines(colmap, "points3D")}
    colours = defaultdict(set)
    for head, pixels, numbers in images(colmap):
        picture = Dataset(rendered).picture(head[-1].removesuffix(".png"))
        points = np.array([rows[number][:3] for number in numbers])
        pose = picture.T_cam_body
        np.testing.assert_array_equal(picture.camera.project(points @ pose[:3, :3].T + pose[:3, 3]), pixels)
        columns, lines_of = pixels.astype(int).T
        for number, value in zip(numbers, picture.image[lines_of, columns].tolist(), strict=True):
            colours[number].add(value)
    taken = [rows[number][3] in values for number, values in colours.items()]
    assert np.mean(taken) > 0.9  # the others are no longer listed in the image that they were taken from


def test_points_are_seen_where_embree_sees_them(colmap, rendered, tmp_path) -> None:
    write_export(rendered, "bop", tmp_path / "bop", options={"rectify": "yes"})
    model = trimesh.load_mesh(tmp_path / "bop" / "models" / "obj_000001.ply", process=False).apply_scale(1e-3)
    rows = lines(colmap, "points3D")
    places, points = {int(row[0]): i for i, row in enumerate(rows)}, np.array([row[1:4] for row in rows], float)
    listed, hidden, shares = 0, 0, []
    for head, _, numbers in images(colmap):
        picture = Dataset(rendered).picture(head[-1].removesuffix(".png"))
        eye = np.linalg.inv(picture.T_cam_body)[:3, 3]
        away = np.linalg.norm(points - eye, axis=1)
        starts = np.repeat(eye[None], len(points), 0)
        hits, rays, _ = model.ray.intersects_location(starts, points - eye, multiple_hits=False)
        first = np.full(len(points), np.inf)
        first[rays] = np.linalg.norm(hits - eye, axis=1)
        seen = np.abs(first - away) < FAR * away / picture.camera.fx
        said = np.isin(np.arange(len(points)), [places[number] for number in numbers])
        listed += int(said.sum())
        hidden += int((said & ~seen).sum())
        shares.append((said & seen).sum() / seen.sum())
    assert hidden < HIDDEN * listed
    assert np.mean(shares) > FOUND


def test_masks_have_the_images_name_and_an_ending(colmap, rendered) -> None:
    for head, _, _ in images(colmap):
        picture = Dataset(rendered).picture(head[-1].removesuffix(".png"))
        mask, _ = read_image(colmap / "masks" / f"{head[-1]}.png")
        np.testing.assert_array_equal(mask, np.where(picture.mask(1), 255, 0))
        assert (colmap / "images" / head[-1]).is_file()


def test_splits_are_lists_of_names(colmap) -> None:
    listed = [name for split in ("train", "test") for (name,) in lines(colmap, split)]
    assert sorted(listed) == sorted(head[-1] for head, _, _ in images(colmap))


@pytest.mark.parametrize(
    ("lens", "words"),
    [
        ((0, 0, 0, 0, 0), "PINHOLE 240 150 300.0 301.0 120.5 75.0"),
        ((0.1, 0, 0, 0.2, 0), "OPENCV 240 150 300.0 301.0 120.5 75.0 0.1 0.0 0.0 0.2"),
        ((0.1, 0, 0, 0, 0.3), "FULL_OPENCV 240 150 300.0 301.0 120.5 75.0 0.1 0.0 0.0 0.0 0.3 0.0 0.0 0.0"),
    ],
)
def test_the_model_of_a_camera_is_the_simplest_that_holds_it(lens, words) -> None:
    assert camera_line(1, replace(CAMERA, distortion=lens)) == f"1 {words}"


def test_each_camera_has_a_line_and_a_picture_of_nothing_an_empty_one(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "set", [{"frame": "a"}, {"frame": "b", "camera": PLAIN}])
    write_export(dataset, "colmap", tmp_path / "out")
    assert [row[:2] for row in lines(tmp_path / "out", "cameras")] == [["1", "FULL_OPENCV"], ["2", "PINHOLE"]]
    assert [head[8:] for head, _, _ in images(tmp_path / "out")] == [["1", "a.png"], ["2", "b.png"]]
    assert "its images are of 2 cameras" in read_pose_list(tmp_path / "out").notes[-1]
    blanked = clone(rendered, tmp_path / "blanked", [{"frame": "a"}, {"frame": "b"}])
    blank(blanked, "a")
    write_export(blanked, "colmap", tmp_path / "blank", options={"points": "50"})
    assert [len(numbers) > 0 for _, _, numbers in images(tmp_path / "blank")] == [False, True]
    assert len(lines(tmp_path / "blank", "points3D")) <= 50
    assert read_pose_list(tmp_path / "blank").names == ("a", "b")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1 1 0 0 0 0 0 5 1\n\n", r"images\.txt, line 1: has 9 words, which is not an image; give IMAGE_ID"),
        ("# a\n\n1 1 0 0 0 0 0 x 1 a.png\n\n", r"line 3: contains text that is not a number before the image's name"),
        ("1 1 0 0 0 0 0 nan 1 a.png\n\n", "the pose holds NaN or infinity"),
        ("1 1 1 0 0 0 0 5 1 a.png\n\n", r"norm 1\.41421356, expected 1; give a unit quaternion, scalar first"),
        ("# nothing\n", "holds no poses"),
    ],
)
def test_what_is_wrong_with_a_list_is_said(tmp_path, text, words) -> None:
    (tmp_path / "images.txt").write_text(text)
    with pytest.raises(InputError, match=words):
        read_pose_list(tmp_path / "images.txt")


@pytest.mark.parametrize("points", ["", "\n", "10.5 20.5 -1\n", "1 2 3 4 5 6\n\n", "# none\n"])
def test_images_with_and_without_lines_of_points_are_all_read(tmp_path, points) -> None:
    names = ("a.png", "b 2.png", "7", "d.png")
    lines = [f"{i} 1 0 0 0 0.{i} 0 6 1 {name}\n{points}" for i, name in enumerate(names)]
    (tmp_path / "images.txt").write_text("# Image list\n" + "".join(lines))
    poses = read_pose_list(tmp_path / "images.txt")
    assert poses.names == ("a", "b_2", "7", "d")
    assert poses.t_cam_body[:, 0].tolist() == [0, 0.1, 0.2, 0.3]
