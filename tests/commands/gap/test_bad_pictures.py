"""What `gap` says of folders, names, sizes and poses that do not fit, and of pictures that it changes first."""

import json
import re
from itertools import pairwise

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from spin_usd.commands.gap.real_pictures import pairs_in, read_grey
from spin_usd.errors import InputError, RenderError

SIZE = (240, 150)


@pytest.fixture(scope="module")
def pictures(real):
    """The pictures of the planted camera, as arrays."""
    files = sorted((real / "camera").iterdir())
    return {file.stem: cv2.imread(str(file), cv2.IMREAD_UNCHANGED) for file in files}


@pytest.fixture(scope="module")
def mixed(gap, small_stage, poses, pictures, tmp_path_factory):
    """One comparison of a picture as it is, one of 16 bits, one in colour, one of twice the size, one whose pose puts
    the target behind the camera, one of another size, and one that is damaged."""
    folder = tmp_path_factory.mktemp("mixed")
    names = [pose["filename"].partition(".")[0] for pose in poses]
    listed = [dict(pose, filename=f"{name}.png") for name, pose in zip(names, poses, strict=True)]
    first = pictures[names[0]]
    plain, deep, colour, twice, behind, other, damaged = names[:7]
    for name, image in {
        plain: pictures[plain],
        deep: pictures[deep].astype(np.uint16) * 257,
        colour: np.stack([pictures[colour] * share for share in (0.4, 1, 0.8)], -1).astype(np.uint8),
        twice: np.repeat(np.repeat(pictures[twice], 2, 0), 2, 1),
        behind: pictures[behind],
        other: first[:100],
        damaged: first,
    }.items():
        assert cv2.imwrite(str(folder / f"{name}.png"), image)
    (folder / f"{damaged}.png").write_bytes((folder / f"{damaged}.png").read_bytes()[:200])
    for pose in listed:
        if pose["filename"].startswith(behind):
            pose["r_Vo2To_vbs_true"] = [-metres for metres in pose["r_Vo2To_vbs_true"]]
    (folder / "poses.json").write_text(json.dumps(listed[:8]))
    report = gap(folder, small_stage, poses=folder / "poses.json")
    return report, {"plain": plain, "deep": deep, "colour": colour, "twice": twice, "behind": behind, "other": other,
                    "damaged": damaged}, names  # fmt: skip


def test_pictures_that_cannot_be_compared_are_left_out_with_the_reason(mixed) -> None:
    report, of, _ = mixed
    assert set(report.left_out) == {of["behind"], of["other"], of["damaged"]}
    assert "is 240 x 100, and the stage's camera makes 240 x 150" in report.left_out[of["other"]]
    assert "--resolution 240x100" in report.left_out[of["other"]]
    assert "pixels of the target" in report.left_out[of["behind"]]
    assert of["damaged"] in report.left_out[of["damaged"]]
    assert [each.name for each in report.pictures] == [of[name] for name in ("plain", "deep", "colour", "twice")]


def test_notes_say_what_was_done_to_a_picture(mixed) -> None:
    report, of, names = mixed
    notes = {each.name: each.notes for each in report.pictures}
    assert notes[of["plain"]] == notes[of["deep"]] == []
    assert any("is in colour: its luminance is compared" in note for note in notes[of["colour"]])
    assert any("averaged over 2 x 2 pixels" in note for note in notes[of["twice"]])
    assert any(f"{of['colour']} is in colour" in note for note in report.notes)
    assert any("no picture" in note and names[7] in note for note in report.notes)


def test_sixteen_bits_are_the_same_grey(mixed) -> None:
    report, of, _ = mixed
    plain, deep = (next(each for each in report.pictures if each.name == of[name]) for name in ("plain", "deep"))
    assert deep.real["black_level"] == pytest.approx(plain.real["black_level"], abs=0.3)
    assert deep.real["noise"] == pytest.approx(plain.real["noise"], rel=0.1)


@pytest.fixture(scope="module")
def posed(gap, small_stage, poses, real, tmp_path_factory):
    """The pictures of one comparison: of a target that is said to be a fifth nearer than it is, of one that is said to
    be turned by 40 degrees, and of two with their poses."""
    near, turned, *right = (dict(pose) for pose in poses[:4])
    near["r_Vo2To_vbs_true"] = [0.8 * metres for metres in near["r_Vo2To_vbs_true"]]
    attitude = Rotation.from_quat(turned["q_vbs2tango_true"], scalar_first=True)
    attitude *= Rotation.from_euler("xy", [40, 20], degrees=True)
    turned["q_vbs2tango_true"] = attitude.as_quat(scalar_first=True).tolist()
    file = tmp_path_factory.mktemp("posed") / "poses.json"
    file.write_text(json.dumps([near, turned, *right]))
    return gap(real / "nominal", small_stage, poses=file).pictures


def test_a_wrong_range_is_noted_by_the_silhouette(posed) -> None:
    """The edges lie inside the labels'."""
    assert posed[0].silhouette["median"] < -4
    assert any("check its pose, camera and model" in note for note in posed[0].notes)


def test_a_wrong_attitude_is_seen_by_the_spread_of_the_silhouette(posed) -> None:
    """A target that is turned is as large as before: its edges lie outside here and inside there."""
    assert posed[1].silhouette["spread"] > 2.5
    assert posed[1].ours["correlation"] < 0.6


def test_the_right_poses_from_a_list_are_those_of_the_stage(posed) -> None:
    for picture in posed[2:]:
        assert picture.ours["correlation"] > 0.99
        assert abs(picture.silhouette["median"]) <= 1
        assert picture.silhouette["spread"] <= 1.5


def test_no_picture_that_fits_is_an_error(gap, small_stage, pictures, tmp_path) -> None:
    name, image = next(iter(pictures.items()))
    cv2.imwrite(str(tmp_path / f"{name}.png"), image[:, :100])
    with pytest.raises(RenderError, match=r"no picture could be compared: .* is 100 x 150"):
        gap(tmp_path, small_stage)


@pytest.mark.parametrize(
    ("given", "saying"),
    [
        ({"fit": "ligth"}, "there is no fit 'ligth'"),
        ({"write": "bed"}, "write is given without fit light"),
        ({"fit": "camera", "write": "bed"}, "add --fit light"),
        ({"fit": "light", "write": "bed.toml"}, "give a name that ends in .usda"),
    ],
)
def test_unknown_options_are_refused(gap, tmp_path, given, saying) -> None:
    with pytest.raises(InputError, match=re.escape(saying)):
        gap(tmp_path, tmp_path, **given)


def test_fits_are_done_in_their_order() -> None:
    from spin_usd.commands.gap.options import FITS, GapOptions

    def options(fit):
        return GapOptions("real", "stage", out="out", fit=fit).fits

    assert options("all") == options("light,all") == FITS
    assert options("camera,camera") == ("camera",)
    assert options("camera,light") == options(["camera", "light"]) == ("light", "camera")
    assert options(()) == ()


def test_a_folder_without_pictures_is_refused(tmp_path) -> None:
    (tmp_path / "notes.txt").write_text("none")
    with pytest.raises(InputError, match="holds no pictures"):
        pairs_in(tmp_path, None, ["img000001"])
    with pytest.raises(InputError, match="is not a folder"):
        pairs_in(tmp_path / "none", None, ["img000001"])


def test_names_that_match_nothing_are_refused_with_an_example_of_both(tmp_path) -> None:
    (tmp_path / "shot_7.png").touch()
    with pytest.raises(InputError, match=r"such as shot_7, has a name in the stage, such as img000001.*--poses"):
        pairs_in(tmp_path, None, ["img000001", "img000002"])


def test_pictures_are_found_in_folders_and_lone_ones_are_noted(tmp_path) -> None:
    for place in ("a/rgb/000001.png", "b/rgb/000001.png", "b/rgb/000002.png", ".hidden.png", "b/mask.txt"):
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / place).touch()
    pairs, notes = pairs_in(tmp_path, None, ["a_000001", "b_000001"])
    assert [pair.name for pair in pairs] == ["a_000001", "b_000001"]
    assert [pair.file.removeprefix(str(tmp_path)) for pair in pairs] == ["/a/rgb/000001.png", "/b/rgb/000001.png"]
    assert [pair.frame for pair in pairs] == ["a_000001", "b_000001"]
    assert any("1 picture left out" in note and "b/rgb/000002.png" in note for note in notes)


def test_pictures_become_grey_in_steps_of_eight_bits(tmp_path) -> None:
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (SIZE[1], SIZE[0])).astype(np.uint8)
    for name, values in {
        "grey": image,
        "deep": image.astype(np.uint16) * 257,
        "three": np.stack([image] * 3, -1),
    }.items():
        cv2.imwrite(str(tmp_path / f"{name}.png"), values)
        grey, _, notes = read_grey(tmp_path / f"{name}.png", SIZE)
        assert grey == pytest.approx(image.astype(float), abs=1e-3)
        assert notes == []


@pytest.mark.parametrize("channels", [2, 4])
def test_transparency_is_no_light(tmp_path, channels) -> None:
    """Grey or colour with an alpha, which files of cut-out objects have."""
    image = np.full((SIZE[1], SIZE[0], channels), 40, np.uint8)
    image[..., -1] = 255
    Image.fromarray(image).save(tmp_path / "cut.png")
    grey, _, notes = read_grey(tmp_path / "cut.png", SIZE)
    assert grey == pytest.approx(np.full(grey.shape, 40.0))
    assert notes == ["has transparency, which is ignored"]


def test_a_multiple_of_the_size_is_averaged(tmp_path) -> None:
    image = np.arange(6 * 9, dtype=np.uint8).reshape(6, 9)
    cv2.imwrite(str(tmp_path / "large.png"), image)
    grey, by, (note,) = read_grey(tmp_path / "large.png", (3, 2))
    assert grey == pytest.approx(image.reshape(2, 3, 3, 3).mean((1, 3)))
    assert by == 3
    assert "3 x 3" in note


@pytest.mark.parametrize("size", [(241, 150), (240, 151), (120, 75), (480, 150), (24, 15)])
def test_other_sizes_are_refused(tmp_path, size) -> None:
    cv2.imwrite(str(tmp_path / "odd.png"), np.zeros(size[::-1], np.uint8))
    with pytest.raises(InputError, match=f"is {size[0]} x {size[1]}, and the stage's camera makes 240 x 150"):
        read_grey(tmp_path / "odd.png", SIZE)


def test_names_are_not_repeated(poses) -> None:
    names = sorted(pose["filename"] for pose in poses)
    assert all(a != b for a, b in pairwise(names))


def test_hidden_folders_and_those_of_labels_hold_no_pictures(tmp_path) -> None:
    """But one whose name begins so does."""
    places = (
        ".thumbnails/a.png",
        "mask_visib/a.png",
        "models/a.png",
        "depth/a.png",
        "rgb/a.png",
        "normal_exposure/b.png",
    )
    for place in places:
        (tmp_path / place).parent.mkdir()
        (tmp_path / place).touch()
    pairs, _ = pairs_in(tmp_path, None, ["a", "b"])
    assert [pair.file.removeprefix(str(tmp_path)) for pair in pairs] == ["/rgb/a.png", "/normal_exposure/b.png"]


def test_a_jpeg_that_is_cut_off_is_noted(tmp_path) -> None:
    cv2.imwrite(str(tmp_path / "whole.jpg"), np.random.default_rng(0).integers(0, 255, SIZE[::-1], np.uint8))
    whole = (tmp_path / "whole.jpg").read_bytes()
    (tmp_path / "cut.jpg").write_bytes(whole[: len(whole) * 2 // 3])
    assert read_grey(tmp_path / "whole.jpg", SIZE)[2] == []
    assert read_grey(tmp_path / "cut.jpg", SIZE)[2] == ["is cut off: part of it is missing"]


@pytest.mark.parametrize("name", ["index.html", "fitted"])
def test_files_of_others_are_not_replaced(gap, small_stage, real, tmp_path, name) -> None:
    (tmp_path / name).mkdir()
    (tmp_path / name / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match=f"holds {name}, but no gap.json of ours; give another folder"):
        gap(real / "nominal", small_stage, out=tmp_path)
    assert (tmp_path / name / "mine.txt").read_text() == "mine"


def test_a_preset_replaces_nothing(gap, small_stage, real, tmp_path) -> None:
    """The stage least of all."""
    before = small_stage.read_bytes()
    for path, saying in (
        (small_stage, "exists already; give --write another name"),
        (tmp_path / "no/x.usda", "is not a folder"),
    ):
        with pytest.raises(InputError, match=saying):
            gap(real / "nominal", small_stage, fit="light", write=path)
    assert small_stage.read_bytes() == before
