"""The loop's laws: the loss falls; the same pictures give the same losses in another layout; a kill changes nothing."""

import csv
import json
import os
import signal
import subprocess
import time

import numpy as np
import pytest

from tests.conftest import REPOSITORY
from tests.train.conftest import PYTHON, TINY

pytestmark = pytest.mark.slow

SAME = 1e-5  # of a loss: the same sums, of poses that were written and read
CROP_PIXEL = 1.0  # "under one pixel at its own resolution"


def result(folder):
    return json.loads((folder / "training.json").read_text())


def poses(file):
    with file.open() as opened:
        return {
            row["filename"]: [float(row[k]) for k in ("qw", "qx", "qy", "qz", "x", "y", "z")]
            for row in csv.DictReader(opened)
        }


def test_the_loss_falls_and_predictions_are_scored(baseline, tango, tmp_path, spin_usd) -> None:
    baseline(tango, "--out", tmp_path, "--steps", 120, *TINY, "--test", f"own={tango}")
    losses = result(tmp_path)["losses"]
    assert np.mean(losses[-5:]) < 0.5 * np.mean(losses[:5])
    found = json.loads(spin_usd("score", tmp_path / "own.csv", "--truth", tango, "--json").stdout)
    assert found["all"]["pictures"] == 16
    assert found["missing"] == 0


def test_an_exported_folder_gives_the_same_losses(baseline, tango, tmp_path, spin_usd) -> None:
    """The same poses and images, in the layout of SPEED+."""
    spin_usd(
        "export",
        tango,
        "--to",
        "speedplus",
        "--out",
        tmp_path / "speedplus",
        "--option",
        "image=png",
        "--option",
        "masks=none",
    )
    points = tmp_path / "points.json"
    from spin_usd import Dataset

    points.write_text(json.dumps(Dataset(tango).keypoints.points.tolist()))
    (exported,) = (tmp_path / "speedplus" / "synthetic").glob("*.json")
    baseline(tango, "--out", tmp_path / "own", "--steps", 5, *TINY)
    baseline(exported, "--keypoints", points, "--out", tmp_path / "theirs", "--steps", 5, *TINY)
    assert result(tmp_path / "theirs")["losses"] == pytest.approx(result(tmp_path / "own")["losses"], rel=SAME)


def test_a_pack_gives_the_same_losses_and_poses(baseline, tango, tmp_path) -> None:
    """With boxes that are off, and images that are black where no crop goes."""
    from train.pack import write_pack
    from train.pictures import read_set

    write_pack(tmp_path / "pack.npz", read_set(tango))
    for name, pictures in (("own", tango), ("pack", tmp_path / "pack.npz")):
        baseline(pictures, "--out", tmp_path / name, "--steps", 20, *TINY[:-1], "--test", f"own={pictures}")
    assert result(tmp_path / "pack")["losses"] == result(tmp_path / "own")["losses"]
    assert (tmp_path / "pack" / "own.csv").read_bytes() == (tmp_path / "own" / "own.csv").read_bytes()


def test_a_killed_training_goes_on_to_the_same_poses(baseline, tango, tmp_path, monkeypatch) -> None:
    arguments = ("--steps", "60", *TINY, "--test", f"own={tango}", "--save-every", "1")
    baseline(tango, "--out", tmp_path / "whole", *arguments)
    command = [PYTHON, "-m", "train.baseline", tango, "--out", tmp_path / "killed", *arguments]
    process = subprocess.Popen(
        command, env=os.environ | {"PYTHONPATH": str(REPOSITORY / "tools")}, stdout=subprocess.DEVNULL
    )
    while not (tmp_path / "killed" / "checkpoint.pt").is_file():
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert not (tmp_path / "killed" / "training.json").exists()
    baseline(tango, "--out", tmp_path / "killed", *arguments)
    assert result(tmp_path / "killed")["losses"] == result(tmp_path / "whole")["losses"]
    assert (tmp_path / "killed" / "own.csv").read_bytes() == (tmp_path / "whole" / "own.csv").read_bytes()


@pytest.mark.campaign
@pytest.mark.timeout(900)
def test_sixteen_pictures_are_learned_by_heart(baseline, tango, tmp_path) -> None:
    """Keypoints of the predicted poses are under one pixel of the crop from the true ones, in the median picture."""
    from train.pictures import crop_of, keypoint_pixels, read_set

    from spin_usd.geometry.rotation import matrices_from_quaternions

    baseline(tango, "--out", tmp_path, "--steps", 600, "--batch", 16, "--no-jitter", "--test", f"own={tango}")
    found, pictures, errors = poses(tmp_path / "own.csv"), read_set(tango), []
    for picture in pictures.pictures:
        true = keypoint_pixels(picture, pictures.points)
        pose = np.array(found[picture.name])
        cam = pictures.points @ matrices_from_quaternions(pose[None, :4])[0].T + pose[4:]
        away = np.linalg.norm(picture.camera.project(cam) - true, axis=1)
        errors.append(away.mean() * 128 / crop_of(true).side)
    assert np.median(errors) < CROP_PIXEL
