"""`spin-usd score`: perfect predictions score nothing, known errors what they are, and hostile files get a sentence."""

import csv
import json

import numpy as np
import pytest

import spin_usd as package
from spin_usd.commands.score.predictions import read_predictions
from spin_usd.errors import InputError

COLUMNS = ("filename", "qw", "qx", "qy", "qz", "x", "y", "z")


@pytest.fixture(scope="module")
def truth(rendered):
    """Rows of true poses by COLUMNS."""
    return [[p.frame + ".jpg", *p.q_cam_body.tolist(), *p.t_cam_body.tolist()] for p in package.Dataset(rendered)]


def written(folder, rows, *, head=True, delimiter=","):
    file = folder / "predictions.csv"
    with file.open("w", newline="") as opened:
        csv.writer(opened, delimiter=delimiter).writerows([COLUMNS, *rows] if head else rows)
    return file


@pytest.mark.parametrize(("head", "delimiter"), [(True, ","), (False, ";")])
def test_a_perfect_prediction_scores_nothing(rendered, truth, head, delimiter, tmp_path) -> None:
    report = package.score(written(tmp_path, truth, head=head, delimiter=delimiter), truth=rendered)
    assert report.all.scores == pytest.approx({"speed": 0, "speedplus": 0, "speedplus_2021": 0}, abs=1e-12)
    assert report.model.add_m["mean"] == pytest.approx(0, abs=1e-12)
    assert report.model.mssd_recall == report.model.mspd_recall == report.model.add_found == 1
    assert not report.notes
    assert not report.missing


def test_a_known_shift_is_what_is_reported(rendered, truth, tmp_path) -> None:
    shifted = [[*row[:5], row[5] + 0.1, *row[6:]] for row in truth]
    report = package.score(written(tmp_path, shifted), truth=rendered)
    away = np.linalg.norm(np.array([row[5:] for row in truth], float), axis=1)
    assert report.all.position_m == pytest.approx({"mean": 0.1, "median": 0.1, "p90": 0.1}, abs=1e-12)
    assert report.all.scores["speed"] == pytest.approx((0.1 / away).mean(), abs=1e-12)
    assert report.model.add_m["median"] == pytest.approx(0.1, abs=1e-12)
    assert [each.picture for each in report.worst] == [
        truth[place][0].removesuffix(".jpg") for place in np.argsort(away, kind="stable")
    ]


def test_a_pose_list_is_a_truth_too(truth, tmp_path) -> None:
    names = ("filename", "q_vbs2tango_true", "r_Vo2To_vbs_true")
    poses = [dict(zip(names, (row[0], row[1:5], row[5:]), strict=True)) for row in truth]
    (tmp_path / "poses.json").write_text(json.dumps(poses))
    for predictions in (written(tmp_path, truth), tmp_path / "poses.json"):
        report = package.score(predictions, truth=tmp_path / "poses.json")
        assert report.all.scores["speed"] == pytest.approx(0, abs=1e-12)


def test_keypoints_give_the_pose_back(rendered, truth, tmp_path) -> None:
    results = [
        {
            "image_id": p.frame,
            "keypoints": np.c_[p.keypoint_pixels - 0.5, np.ones(len(p.keypoint_pixels))].ravel().tolist(),
        }
        for p in package.Dataset(rendered)
    ]
    (tmp_path / "by_name.json").write_text(json.dumps(results))
    assert package.score(tmp_path / "by_name.json", truth=rendered).all.scores["speed"] < 1e-6
    for number, result in enumerate(results):
        result["image_id"] = number + 1
    (tmp_path / "by_number.json").write_text(json.dumps(results))
    images = [{"id": number + 1, "file_name": f"{p.frame}.png"} for number, p in enumerate(package.Dataset(rendered))]
    (tmp_path / "coco.json").write_text(json.dumps({"images": images}))
    report = package.score(tmp_path / "by_number.json", truth=rendered, annotations=tmp_path / "coco.json")
    assert report.all.scores["speed"] < 1e-6
    with pytest.raises(InputError, match=r"image 1 that nothing names.*--annotations"):
        package.score(tmp_path / "by_number.json", truth=rendered)


def test_groups_add_up_and_the_page_is_written(rendered, truth, tmp_path, spin_usd) -> None:
    out = tmp_path / "page"
    done = spin_usd("score", written(tmp_path, truth), "--truth", rendered, "--out", out, "--json")
    report = json.loads(done.stdout)
    for by in {group["by"] for group in report["groups"]}:
        assert sum(group["pictures"] for group in report["groups"] if group["by"] == by) == len(truth)
    page = (out / "index.html").read_text()
    assert page.count("data:image/jpeg;base64") == len(truth)
    assert "<svg" in page
    assert json.loads((out / "score.json").read_text()) == report
    assert sorted(path.name for path in tmp_path.iterdir()) == ["page", "predictions.csv"]


def test_what_a_prediction_says_twice_is_the_same(tmp_path) -> None:
    pose = {"filename": "a.png", "q_cam_body": [1, 0, 0, 0], "t_cam_body": [0, 0, 6]}
    file = tmp_path / "a.json"
    file.write_text(json.dumps([{**pose, "r_Vo2To_vbs": [0, 0, 6]}]))
    (found,) = read_predictions(file)
    assert found.pose.tolist() == [1, 0, 0, 0, 0, 0, 6]
    file.write_text(json.dumps([{**pose, "r_Vo2To_vbs": [0, 0, 7]}]))
    with pytest.raises(InputError, match=r"entry 0: has 'r_Vo2To_vbs' and 't_cam_body', which differ"):
        read_predictions(file)
    heads = "filename,qw,qx,qy,qz,x,y,z,z"
    (tmp_path / "a.csv").write_text(f"{heads}\na.png,1,0,0,0,0,0,6,7\n")
    with pytest.raises(InputError, match=r"a\.csv, line 1: has the heading 'z' twice"):
        read_predictions(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda rows: rows[1:], r"1 of 3 pictures have no prediction, the first img000001 of nominal"),
        (lambda rows: [*rows, rows[0]], r"1 prediction, the first in .*line 5 \('img000001'\), is of a picture that"),
        (lambda rows: [*rows, ["other.png", *rows[0][1:]]], r"1 prediction.*'other'.* is of no picture of the truth"),
        (lambda rows: [[rows[0][0], "nan", *rows[0][2:]], *rows[1:]], r"1 prediction.* holds NaN, infinity or no"),
        (lambda rows: [[rows[0][0], 0, 0, 0, 0, *rows[0][5:]], *rows[1:]], r"1 prediction.* or no rotation"),
        (lambda rows: [[rows[0][0], "x", *rows[0][2:]], *rows[1:]], r"1 prediction.* holds NaN"),
        (lambda rows: [rows[0][:-1], *rows[1:]], r"line 2: has 7 cells, expected 8"),
        (lambda rows: [], r"holds no predictions"),
    ],
)
def test_hostile_predictions_get_a_sentence_that_counts(rendered, truth, change, said, tmp_path) -> None:
    with pytest.raises(InputError, match=said):
        package.score(written(tmp_path, change([list(row) for row in truth])), truth=rendered)


def test_partial_scores_what_is_usable(rendered, truth, tmp_path) -> None:
    rows = [["other.png", *truth[0][1:]], [truth[0][0], "nan", *truth[0][2:]], truth[1]]
    report = package.score(written(tmp_path, rows), truth=rendered, partial=True)
    assert (report.all.pictures, report.missing) == (1, 2)
    assert len(report.notes) == 3


def test_other_orders_and_norms_are_told(rendered, truth, tmp_path) -> None:
    last = [[row[0], *row[2:5], row[1], *row[5:]] for row in truth]
    assert any("scalar last" in note for note in package.score(written(tmp_path, last), truth=rendered).notes)
    back = [[row[0], row[1], *(-x for x in row[2:5]), *row[5:]] for row in truth]
    notes = package.score(written(tmp_path, back), truth=rendered).notes
    assert any("from the camera's axes to the body's" in note for note in notes)
    long = [[row[0], *(3 * x for x in row[1:5]), *row[5:]] for row in truth]
    report = package.score(written(tmp_path, long), truth=rendered)
    assert report.all.scores["speed"] == pytest.approx(0, abs=1e-12)
    assert "3 of 3 quaternions have another norm than 1 (3 to 3), and were normalised" in report.notes
