"""Crops and heatmaps: what is taught is where the keypoints are, and what is read of it gives the pose back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import spin_usd
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.fisheye import Fisheye

CELLS = 1e-3  # of a heatmap's pixel: float32 logarithms
PIXELS = 1e-9
DEGREES, METRES = 0.05, 0.02  # of the pose that heatmaps of 32 x 32 give back


def test_places_go_into_the_crop_and_back() -> None:
    from train.pictures import crop_of

    pixels = np.array([[10.25, 20.5], [80.0, 33.3], [41.0, 90.75]])
    crop = crop_of(pixels).moved(0.1, -0.2, 1.3)
    assert crop.from_crop(crop.to_crop(pixels, 128), 128) == pytest.approx(pixels, abs=PIXELS)


@given(x=st.integers(-20, 60), y=st.integers(-20, 60), side=st.sampled_from((16, 32, 64)))
def test_a_crop_shows_what_its_places_say(x, y, side) -> None:
    """The middle of a bright square is where `to_crop` has it, to the half pixel; beyond the picture all is black."""
    from train.pictures import Crop

    image = np.zeros((60, 70), np.uint8)
    image[20:28, 40:48] = 255
    crop = Crop(x=x, y=y, side=side)
    seen = crop.of_image(image, 64).astype(float)
    corners = crop.to_crop(np.array([[40.0, 20.0], [48.0, 28.0]]), 64)
    if seen.sum() and (corners >= 0).all() and (corners <= 64).all():
        down, across = np.indices(seen.shape) + 0.5
        middle = np.array([(across * seen).sum(), (down * seen).sum()]) / seen.sum()
        assert middle == pytest.approx(corners.mean(0), abs=0.5 if side < 64 else PIXELS)


@given(x=st.floats(2, 30), y=st.floats(2, 30))
def test_the_peak_of_a_gaussian_is_found(x, y) -> None:
    from train.heatmaps import peaks

    from spin_usd.reading.picture import heatmaps_of

    maps = heatmaps_of(np.array([[x, y]]), (32, 32), size=(32, 32), sigma=1.0)
    assert peaks(maps)[0] == pytest.approx(np.array([[x, y]]), abs=CELLS)


@pytest.mark.slow
def test_what_is_taught_gives_the_pose_back(tango) -> None:
    """Perfect heatmaps make the true pose, through the lens."""
    from train.heatmaps import pose_of, taught
    from train.pictures import read_set

    from spin_usd.geometry.rotation import matrices_from_quaternions

    pictures = read_set(tango)
    for picture in pictures.pictures:
        _, maps = taught(picture, pictures.points, 128, None)
        q, t = pose_of(maps, picture, pictures.points, 128)
        turn = matrices_from_quaternions(q[None])[0] @ picture.T_cam_body[:3, :3].T
        assert np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))) < DEGREES
        assert np.linalg.norm(t - picture.T_cam_body[:3, 3]) < METRES


def test_a_pack_gives_each_picture_back(tmp_path) -> None:
    """Through either lens, and the image but for what no crop shows."""
    from train.heatmaps import taught
    from train.pack import write_pack
    from train.pictures import PictureSet, PosedPicture, read_set

    image = np.random.default_rng(0).integers(256, size=(60, 80), dtype=np.uint8)
    T_cam_body = np.eye(4)
    T_cam_body[:3, 3] = (0.3, 0, 5)
    frame = {"width": 80, "height": 60, "fx": 100, "fy": 100, "cx": 40, "cy": 30}
    pictures = [
        PosedPicture(
            name=f"img{place}",
            camera=Camera(**frame, distortion=lens),
            T_cam_body=T_cam_body,
            image=lambda: image,
        )
        for place, lens in enumerate(((0.1, 0, 0.001, 0, 0), Fisheye(0.01, 0, 0, 0)))
    ]
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    write_pack(tmp_path / "two.npz", PictureSet(pictures=pictures, points=points))
    found = read_set(tmp_path / "two.npz")
    assert np.array_equal(found.points, points)
    for own, packed in zip(pictures, found.pictures, strict=True):
        assert (packed.name, packed.camera) == (own.name, own.camera)
        assert np.array_equal(packed.T_cam_body, T_cam_body)
        for seed in range(50):
            (crop, maps), (there, maps_there) = (
                taught(each, points, 64, np.random.default_rng(seed)) for each in (own, packed)
            )
            assert np.array_equal(crop, there)
            assert np.array_equal(maps, maps_there)


@pytest.mark.slow
def test_appearances_are_dealt_out_in_turn(tango, tmp_path, spin_usd) -> None:
    """Of three variants a row of one shows each as often, and a row of three all of them."""
    from train.pictures import read_set

    spec = tmp_path / "three.toml"
    spec.write_text(
        'schema = "augment-1"\n[[augmentation]]\nname = "a"\ncount = 3\n'
        '[augmentation.sample]\n"sun.factor" = { distribution = "uniform", low = 0.5, high = 2 }\n'
    )
    stage = tango.parent / "stage"
    spin_usd("augment", stage, "--spec", spec, "--out", stage / "three.usda")
    render = ("--variants", "a_*", "--renderer", "raycast", "--labels", "none", "--frames", "0:6", "--samples", "1")
    spin_usd("render", stage / "three.usda", "--out", tmp_path / "three", *render)
    one = [each.name for each in read_set(tmp_path / "three", appearances=1).pictures]
    assert sorted(name[-3:] for name in one) == ["a_1", "a_1", "a_2", "a_2", "a_3", "a_3"]
    assert len({name[:-4] for name in one}) == 6
    assert len({each.name for each in read_set(tmp_path / "three").pictures}) == 18


def test_a_folder_that_is_no_dataset_is_refused(tmp_path) -> None:
    from train.pictures import read_set

    with pytest.raises(spin_usd.SpinError):
        read_set(tmp_path)
