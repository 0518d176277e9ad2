"""Pose lists: the real ones, and every way in which a file can be wrong."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.errors import InputError
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.formats.chosen_frames import chosen_frames, slice_of

GOOD = {"filename": "img000001.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 5]}
UNIT = 1e-15  # a few units in the last place of a double


def write(tmp_path: Path, document: Any) -> Path:
    path = tmp_path / "poses.json"
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return path


@pytest.mark.parametrize(
    ("file", "count", "first"),
    [
        ("speedplus/sunlamp.json", 2791, "img000001"),
        ("speedplus/synthetic_validation.json", 11994, "img000014"),
        ("shirt/roe1.json", 2371, "img000001"),
    ],
)
def test_the_real_lists_are_read_whole(shared: Path, file: str, count: int, first: str) -> None:
    poses = read_pose_list(shared / "data" / file)
    raw = json.loads((shared / "data" / file).read_text())["poses"]
    assert (len(poses), poses.names[0]) == (count, first)
    assert np.abs(np.linalg.norm(poses.q_cam_body, axis=1) - 1).max() < UNIT
    assert np.array_equal(poses.t_cam_body, [entry["r_Vo2To_vbs_true"] for entry in raw])
    turned = Rotation.from_quat(poses.q_cam_body, scalar_first=True)
    given = Rotation.from_quat([entry["q_vbs2tango_true"] for entry in raw], scalar_first=True)
    assert (turned * given.inv()).magnitude().max() < 1e-7  # SciPy normalises too; acos near 1 costs half the digits


def test_all_the_sets_spellings_mean_the_same(tmp_path: Path) -> None:
    speed = {"filename": "img000001", "q_vbs2tango": [1, 0, 0, 0], "r_Vo2To_vbs": [0, 0, 5]}
    lists = [[GOOD], {"poses": [GOOD]}, [speed], {"poses": [speed], "note": "more"}]
    read = [read_pose_list(write(tmp_path, document)) for document in lists]
    assert {poses.names for poses in read} == {("img000001",)}
    assert all(np.array_equal(poses.t_cam_body, [[0, 0, 5]]) for poses in read)


def test_only_image_extensions_are_dropped(tmp_path: Path) -> None:
    names = ["a.JPG", "b.0001", "c.tiff", "d.e.png"]
    poses = read_pose_list(write(tmp_path, [GOOD | {"filename": name} for name in names]))
    assert poses.names == ("a", "b.0001", "c", "d.e")


def test_quaternions_of_few_decimals_are_normalised_with_a_note(tmp_path: Path) -> None:
    """Four decimals leave a norm off by up to 1e-4; the rotation is the nearest."""
    exact = np.array([0.123456789, -0.4, 0.6, 0.0])
    exact[3] = np.sqrt(1 - exact @ exact)
    rounded = np.round(exact, 4)
    poses = read_pose_list(write(tmp_path, [GOOD, GOOD | {"filename": "b.jpg", "q_vbs2tango_true": rounded.tolist()}]))
    np.testing.assert_allclose(poses.q_cam_body[1], rounded / np.linalg.norm(rounded), atol=UNIT)
    (note,) = poses.notes
    assert note.startswith("1 of 2 quaternions were normalised: norms are off 1 by up to ")
    assert "entry 1 ('b')" in note
    assert not read_pose_list(write(tmp_path, [GOOD])).notes


def test_a_target_behind_the_camera_is_legal(tmp_path: Path) -> None:
    assert len(read_pose_list(write(tmp_path, [GOOD | {"r_Vo2To_vbs_true": [0, 0, -5]}]))) == 1


@pytest.mark.parametrize(
    ("document", "found"),
    [
        ([GOOD | {"q_vbs2tango_true": [math.nan, 0, 0, 1]}], r"entry 0 .*NaN"),
        ([GOOD | {"r_Vo2To_vbs_true": [0, 0, math.inf]}], r"entry 0 .*infinity"),
        ([GOOD | {"r_Vo2To_vbs_true": [0, 0, 10**400]}], r"entry 0 .*infinity"),
        ([GOOD | {"q_vbs2tango_true": [0, 0, 0, 0]}], r"entry 0 .*zero"),
        ([GOOD | {"q_vbs2tango_true": [1, 0, 0, 0.1]}], r"entry 0 .*norm 1\.00498"),
        ([GOOD | {"q_vbs2tango_true": [1, 0, 0]}], r"entry 0 .*4 numbers"),
        ([GOOD | {"r_Vo2To_vbs_true": [0, 0, 1, 2]}], r"entry 0 .*3 numbers"),
        ([GOOD | {"r_Vo2To_vbs_true": ["0", 0, 1]}], r"entry 0 .*not a number"),
        ([GOOD | {"r_Vo2To_vbs_true": [True, 0, 1]}], r"entry 0 .*not a number"),
        ([GOOD | {"r_Vo2To_vbs_true": None}], r"entry 0 .*3 numbers"),
        ([{"filename": "a"}], r"entry 0 .*q_vbs2tango"),
        ([{"filename": "a", "q_vbs2tango": [1, 0, 0, 0]}], r"entry 0 .*r_Vo2To_vbs"),
        ([GOOD, {"q_vbs2tango": [1, 0, 0, 0]}], r"entry 1.*'filename'"),
        ([GOOD | {"filename": 5}], r"entry 0: has the filename 5, which is not text"),
        ([GOOD | {"filename": None}], r"entry 0: has the filename null, which is not text"),
        ([GOOD, GOOD | {"filename": "img000001.png"}], r"entry 1 .*entry 0"),
        ([GOOD, GOOD | {"filename": "IMG000001"}], r"entry 1 .*entry 0"),
        ([GOOD | {"filename": "a/.."}], r"entry 0.*\.\."),
        ([GOOD | {"filename": "a\nb"}], r"entry 0.*letters"),
        ([GOOD | {"filename": ""}], r"entry 0.*letters"),
        ([GOOD | {"filename": "a" * 201}], r"entry 0.*200"),
        ([GOOD | {"filename": "img.tmp-1.jpg"}], r"entry 0.*not '\.tmp-'"),
        ([GOOD, 7], r"entry 1.*int"),
        ([], r"empty"),
        ({"poses": []}, r"empty"),
        ({"frames": [GOOD]}, r"no list of poses"),
        (3, r"no list of poses"),
        ('[{"filename": "img0', r"not JSON.*whole"),
        ("", r"not JSON"),
        ("[" * 100_000, r"nested more than"),
        ("[" + "9" * 10_000 + "]", r"too long"),
    ],
)
def test_bad_lists_are_refused_in_one_sentence_that_names_file_and_entry(
    tmp_path: Path, document: Any, found: str
) -> None:
    path = write(tmp_path, document)
    with pytest.raises(InputError, match=found) as caught:
        read_pose_list(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_or_binary_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_pose_list(tmp_path / "none.json")
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(InputError, match="not a text file"):
        read_pose_list(tmp_path / "binary.json")


@pytest.mark.parametrize("text", ["0:4", "::2", "-3:", "5:1:-2", ":", " 1 : 3 "])
def test_frames_are_pythons_slices(tmp_path: Path, text: str) -> None:
    poses = read_pose_list(write(tmp_path, [GOOD | {"filename": f"i{i}"} for i in range(6)]))
    fields = [int(field) if field.strip() else None for field in text.split(":")]
    assert chosen_frames(poses, text).names == poses.names[slice(*fields)]
    assert chosen_frames(poses, None) is poses


@pytest.mark.parametrize("text", ["", "3", "a:b", "0:1:2:3", "0:4:0", "1.5:2"])
def test_other_frames_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="0:100:5"):
        slice_of(text)


def test_frames_that_choose_nothing_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="none of 1"):
        chosen_frames(read_pose_list(write(tmp_path, [GOOD])), "7:9")
