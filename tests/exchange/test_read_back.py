"""What is exported is read back: the same poses, from every format, by the export's folder."""

import csv
import shutil

import numpy as np
import pytest

from spin_usd.commands.author.in_child import author_stage
from spin_usd.exchange.events import EVENT_FORMATS
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.exchange.table import EXPORT_FORMATS
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.reading.dataset import Dataset
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.events import make_events, write_events
from tests.exchange.conftest import PLAIN, clone, write_export

EXACT = 1e-9
FRAMES = 5
SPLIT = "train=0.4,validation=0.4,test=0.2"
ONE_SPLIT = {"shirt", "tum", "video", "spades", "rosbag2"}  # a trajectory is one
WITHOUT_POSES = {"video", "kitti", "rosbag2", "unknown_target"} | {each.name for each in EVENT_FORMATS}
"""Formats that hold no poses, or whose poses are not read back."""
SHARDS = {"webdataset": ".tar", "parquet": ".parquet", "video": ".mp4", "evt3": ".raw", "aedat4": ".aedat4"}
SHARDS |= {"rosbag2": ".mcap", "dat": ".dat", "es": ".es", "events_csv": ".csv"}
"""The endings of files of many pictures."""
NUMBERED = {"bop", "swisscube", "urso", "spades"}  # pictures are called after their numbers


@pytest.fixture(scope="module")
def dataset(rendered, tmp_path_factory):
    """Pictures of poses with all digits, one of them by a rotation with w = 0."""
    q = np.random.default_rng(7).normal(size=(FRAMES, 4))
    q[0, 0] = 0
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    t = np.random.default_rng(8).uniform((-0.5, -0.5, 4), (0.5, 0.5, 9), (FRAMES, 3))
    pictures = [
        {"frame": f"img{i:06}", "time": 5.0 + 0.5 * i, "camera": PLAIN, "q": q[i].tolist(), "t": t[i].tolist()}
        for i in range(FRAMES)
    ]
    folder = clone(rendered, tmp_path_factory.mktemp("back") / "dataset", pictures)
    shutil.copytree(rendered / "stage", folder / "stage")  # some formats have the bodies' models
    write_events(folder / "events" / "nominal.h5", make_events(1000))
    return folder


def poses_of(dataset):
    """R_cam_body and t_cam_body by frame, as the dataset has them."""
    return {each.frame: (each.T_cam_body[:3, :3], each.t_cam_body) for each in Dataset(dataset)}


def frames_of(export, to, names):
    """The frame of each name that was read back."""
    if to == "tum":  # whose pictures are called after their stamps
        return [f"img{number:06}" for number in range(len(names))]
    if to not in NUMBERED:
        return names
    with (export / "pictures.csv").open() as file:
        rows = list(csv.DictReader(file))
    if to == "spades":
        return [f"img{int(name.removesuffix('_RT000').removeprefix('img')):06}" for name in names]
    if to == "urso":
        return [rows[int(name.removesuffix("_rgb"))]["frame"] for name in names]
    return [f"img{int(name.rpartition('_')[2]):06}" for name in names]


@pytest.mark.parametrize("to", sorted(EXPORT_FORMATS.keys() - WITHOUT_POSES))
def test_an_exports_folder_is_a_pose_list(dataset, tmp_path, to) -> None:
    write_export(dataset, to, tmp_path / to, split=None if to in ONE_SPLIT else SPLIT)
    poses, wanted = read_pose_list(tmp_path / to), poses_of(dataset)
    frames = frames_of(tmp_path / to, to, poses.names)
    assert sorted(frames) == sorted(wanted)
    for frame, rotation, t in zip(frames, matrices_from_quaternions(poses.q_cam_body), poses.t_cam_body, strict=True):
        np.testing.assert_allclose(rotation, wanted[frame][0], rtol=0, atol=EXACT)
        np.testing.assert_allclose(t, wanted[frame][1], rtol=0, atol=EXACT)


@pytest.mark.parametrize("to", sorted(EXPORT_FORMATS))
def test_the_list_of_pictures_says_where_each_one_is(dataset, tmp_path, to) -> None:
    write_export(dataset, to, tmp_path / to)
    with (tmp_path / to / "pictures.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["frame"] for row in rows} == set(poses_of(dataset))
    assert all((tmp_path / to / row["file"]).is_file() for row in rows)
    endings = SHARDS.get(to, (".jpg", ".png"))
    assert all(row["file"].endswith(endings) for row in rows)


def test_a_bop_list_is_known_by_what_it_holds(dataset, tmp_path) -> None:
    write_export(dataset, "bop", tmp_path / "bop")
    (scene,) = (tmp_path / "bop").glob("*/*/scene_gt.json")
    other = shutil.copy(scene, scene.with_name("poses_of_my_run.json"))
    poses, wanted = read_pose_list(other), read_pose_list(scene)
    assert poses.names == wanted.names
    np.testing.assert_array_equal(poses.q_cam_body, wanted.q_cam_body)


@pytest.mark.parametrize("to", ["coco", "webdataset", "croissant", "parquet"])
def test_poses_of_pictures_that_do_not_show_the_target_come_back(blanked, tmp_path, to) -> None:
    write_export(blanked, to, tmp_path / to)
    poses, wanted = read_pose_list(tmp_path / to), poses_of(blanked)
    assert poses.names == ("a", "b")
    np.testing.assert_allclose(poses.t_cam_body, [wanted[name][1] for name in poses.names], rtol=0, atol=EXACT)


def test_an_export_becomes_a_stage_of_the_same_poses(dataset, tmp_path) -> None:
    write_export(dataset, "bop", tmp_path / "bop")
    report = author_stage(poses=tmp_path / "bop", target="tango", camera="speedplus", out=tmp_path / "stage")
    reader, wanted = StageReader(report.root), poses_of(dataset)
    assert len(reader.frames) == FRAMES
    for frame in reader.frames:
        rotation, t = wanted[f"img{int(frame.name.rpartition('_')[2]):06}"]
        pose = reader.bodies[0].pose_at(frame.time_code)
        np.testing.assert_allclose(pose.rotation, rotation, rtol=0, atol=EXACT)
        np.testing.assert_allclose(pose.translation, t, rtol=0, atol=EXACT)


def test_a_datasets_folder_is_a_pose_list(dataset) -> None:
    poses, wanted = read_pose_list(dataset), poses_of(dataset)
    assert poses.names == tuple(sorted(wanted))
    for frame, t in zip(poses.names, poses.t_cam_body, strict=True):
        np.testing.assert_allclose(t, wanted[frame][1], rtol=0, atol=EXACT)


@pytest.mark.parametrize("seed", range(3))
def test_a_dataset_is_split_as_its_export_is(two_variants, tmp_path, seed) -> None:
    """All variants of a pose are in one part."""
    write_export(two_variants, "coco", tmp_path / "out", split="train=0.5,test=0.5", seed=seed)
    with (tmp_path / "out" / "pictures.csv").open() as file:
        rows = list(csv.DictReader(file))
    for name, part in zip(("train", "test"), Dataset(two_variants).split(0.5, 0.5, seed=seed), strict=True):
        assert set(part.names) == {(row["frame"], row["variant"]) for row in rows if row["split"] == name}
        assert len(part) == 6
