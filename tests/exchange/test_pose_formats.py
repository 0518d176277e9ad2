"""Every format of pose lists, written by hand in its own conventions, gives the pose that was meant."""

import io
import json
import tarfile
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.errors import InputError
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.geometry.camera import Camera

EXACT = 1e-9
# A quarter turn about z, by hand: the body's x axis points down in the picture (camera's y), its y axis left.
HALF = 0.5**0.5
QUARTER = [HALF, 0.0, 0.0, HALF]
ROWS = [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
PLACE = [0.25, -0.5, 4.0]
# SPEED+, synthetic img000014, with its first keypoint, which the published camera shows at these pixels.
Q14, R14 = [0.556984, -0.711815, 0.168095, -0.393487], [-0.423949, -0.14451, 6.509727]
CORNER, PIXEL = [-0.37, -0.385, 0.3215], [739.956, 796.962]
SPEEDPLUS_CAMERA = Camera(
    width=1920,
    height=1200,
    fx=2988.5795163815555,
    fy=2988.3401159176124,
    cx=960,
    cy=600,
    distortion=(
        -0.22383016606510672,
        0.51409797089106379,
        -0.00066499611998340662,
        -0.00021404771667484594,
        -0.13124227429077406,
    ),
)
NEAR_PIXEL = 2e-3  # the published pixels have three decimals, the pose six


def matrix(q):
    return Rotation.from_quat(q, scalar_first=True).as_matrix()


def speedplus(folder: Path, q, t) -> Path:
    return saved(folder / "train.json", [{"filename": "a.jpg", "q_vbs2tango_true": q, "r_Vo2To_vbs_true": t}])


def speed(folder: Path, q, t) -> Path:
    return saved(folder / "train.json", [{"filename": "a.jpg", "q_vbs2tango": q, "r_Vo2To_vbs_true": t}])


def stream_2(folder: Path, q, t) -> Path:
    w, x, y, z = q
    row = ",".join(map(repr, [*t, x, y, z, w]))
    return saved(folder / "train.csv", f"filename,sequence,Tx,Ty,Tz,Qx,Qy,Qz,Qw\na.png,GT001,{row}\n")


def bop(folder: Path, q, t) -> Path:
    rows, millimetres = matrix(q).ravel().tolist(), [1000 * each for each in t]
    body = {"cam_R_m2c": rows, "cam_t_m2c": millimetres, "obj_id": 1}
    other = {"cam_R_m2c": np.eye(3).ravel().tolist(), "cam_t_m2c": [0, 0, 1], "obj_id": 2}
    return saved(folder / "train" / "000003" / "scene_gt.json", {"7": [other, body]})


def coco(folder: Path, q, t) -> Path:
    """The target of the least category comes second."""
    other = {"category_id": 2, "name": "debris", "q_cam_body": [1, 0, 0, 0], "t_cam_body": [0, 0, 1]}
    pose = {"category_id": 1, "name": "tango", "q_cam_body": q, "t_cam_body": t}
    image = {"id": 4, "file_name": "a.jpg", "width": 8, "height": 8, "poses": [other, pose]}
    document = {"info": {}, "images": [image], "annotations": [], "categories": []}
    return saved(folder / "annotations" / "train.json", document)


def record(folder: Path, q, t) -> Path:
    said = {"schema": "record-1", "frame": "a", "index": 0, "pose": {"q_cam_body": q, "t_cam_body": t}}
    return saved(folder / "records" / "nominal" / "a.json", said)


def urso(folder: Path, q, t) -> Path:
    """x forward, y right, z up; the scalar last; the sign of y goes with its mirrored axis."""
    (w, a, b, c), (x, y, z) = q, t
    saved(folder / "train_images.csv", "a.png\n")
    row = ",".join(map(repr, (z, x, -y, a, -b, c, w)))
    return saved(folder / "train_poses_gt.csv", f"x,y,z,q1,q2,q3,q4\n{row}\n")


def parquet(folder: Path, q, t) -> Path:
    path = folder / "data" / "train-00000-of-00001.parquet"
    path.parent.mkdir(parents=True, exist_ok=True)
    pyarrow.parquet.write_table(pyarrow.table({"name": ["a"], "q_cam_body": [q], "t_cam_body": [t]}), path)
    return path


def nerfstudio(folder: Path, q, t) -> Path:
    """The camera in the body's axes, x right, y up, looking along -z: y and z turn their signs."""
    to_camera = Rotation.from_quat(q, scalar_first=True)
    centre = -to_camera.inv().apply(t)
    rows = [[*row, place] for row, place in zip((matrix(q).T * (1, -1, -1)).tolist(), centre.tolist(), strict=True)]
    frame = {"file_path": "./images/a.png", "transform_matrix": [*rows, [0, 0, 0, 1]]}
    return saved(folder / "transforms.json", {"fl_x": 100, "frames": [frame]})


def colmap(folder: Path, q, t) -> Path:
    numbers = " ".join(map(repr, [*q, *t]))
    text = f"# Image list with two lines of data per image:\n#\n7 {numbers} 1 left/a.png\n1.5 2.5 -1\n"
    return saved(folder / "sparse" / "0" / "images.txt", text)


def croissant(folder: Path, q, t) -> Path:
    head = "name,split,variant,frame,q_w,q_x,q_y,q_z,t_x,t_y,t_z"
    return saved(folder / "pictures.csv", f"{head}\na,train,nominal,a,{','.join(map(repr, [*q, *t]))}\n")


def own_table(folder: Path, q, t) -> Path:
    """Semicolons, capitals, a column of no use, the scalar last."""
    row = ";".join(map(repr, (*t, *q[1:], q[0])))
    return saved(folder / "poses.csv", f"Image;Note;Tx;Ty;Tz;QX;QY;QZ;QW\na.png;night;{row}\n")


def own_matrices(folder: Path, q, t) -> Path:
    """A rotation matrix; the pictures have no names of their own."""
    row = "\t".join(map(repr, (*matrix(q).ravel().tolist(), *t)))
    heads = [f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3)]
    return saved(folder / "poses.csv", "\t".join([*heads, "pos_x", "pos_y", "pos_z"]) + f"\n{row}\n")


def webdataset(folder: Path, q, t) -> Path:
    said = json.dumps({"schema": "record-1", "frame": "a", "pose": {"q_cam_body": q, "t_cam_body": t}}).encode()
    with tarfile.open(folder / "train-000000.tar", "w") as tar:
        for name, data in (("a.image.png", b"no image"), ("a.json", said)):
            member = tarfile.TarInfo(name)
            member.size = len(data)
            tar.addfile(member, io.BytesIO(data))
    return folder / "train-000000.tar"


def saved(path: Path, content) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content, indent=1))
    return path


FORMATS = (
    speedplus,
    speed,
    stream_2,
    bop,
    coco,
    record,
    webdataset,
    urso,
    croissant,
    own_table,
    own_matrices,
    nerfstudio,
    colmap,
    parquet,
)
NAMES = {bop: "000003_000007", own_matrices: "img000000"}


@pytest.mark.parametrize("write", FORMATS)
def test_a_quarter_turn_is_one(tmp_path, write) -> None:
    """The file, and the folder that it lies in."""
    file = write(tmp_path, QUARTER, PLACE)
    for given in (file, tmp_path):
        poses = read_pose_list(given)
        assert poses.names == (NAMES.get(write, "a"),)
        assert matrix(poses.q_cam_body[0]) == pytest.approx(np.array(ROWS).reshape(3, 3), abs=EXACT)
        assert poses.t_cam_body[0] == pytest.approx(PLACE, abs=EXACT)


@pytest.mark.parametrize("write", FORMATS)
def test_a_published_pose_puts_its_keypoint_where_it_is_published(tmp_path, write) -> None:
    unit = (np.array(Q14) / np.linalg.norm(Q14)).tolist()
    poses = read_pose_list(write(tmp_path, unit, R14))
    seen = SPEEDPLUS_CAMERA.project(matrix(poses.q_cam_body[0]) @ CORNER + poses.t_cam_body[0])
    assert seen == pytest.approx(PIXEL, abs=NEAR_PIXEL)


def test_urso_sees_points_as_its_loader_does(tmp_path) -> None:
    """By the loader's own formulas: K has a negative fy, a quaternion's matrix is the transpose of Hamilton's, and the
    body's y is mirrored (UrsoNet: urso.py, se3lib.quat2SO3, utils.plot_axes)."""
    unit = np.array(Q14) / np.linalg.norm(Q14)
    pose = read_pose_list(urso(tmp_path, unit.tolist(), R14))
    x, y, z, *q = map(float, (tmp_path / "train_poses_gt.csv").read_text().splitlines()[1].split(","))
    jpl = Rotation.from_quat(q).as_matrix().T
    right, up, forward = jpl @ (np.array(CORNER) * (1, -1, 1)) + (y, z, x)
    theirs = (640 + 640 * right / forward, 480 - 640 * up / forward)
    ours = Camera(width=1280, height=960, fx=640, fy=640, cx=640, cy=480).project(
        matrix(pose.q_cam_body[0]) @ CORNER + pose.t_cam_body[0]
    )
    assert ours == pytest.approx(theirs, abs=1e-9)


def test_all_lists_of_a_folder_are_read(tmp_path) -> None:
    """Those of the same names get their lists' names."""
    for split in ("train", "validation"):
        written = speedplus(tmp_path / "synthetic", QUARTER, PLACE) if split == "train" else None
        if written is None:
            entry = {"filename": "b.jpg", "q_vbs2tango_true": QUARTER, "r_Vo2To_vbs_true": PLACE}
            saved(tmp_path / "synthetic" / "validation.json", [entry])
    saved(tmp_path / "synthetic" / "camera.json", {"Nu": 8})
    assert read_pose_list(tmp_path).names == ("a", "b")
    speedplus(tmp_path / "lightbox", QUARTER, PLACE)
    names = ("lightbox_train_a", "synthetic_train_a", "synthetic_validation_b")
    assert read_pose_list(tmp_path).names == names


def test_sequences_with_the_same_file_names_differ_by_their_own(tmp_path) -> None:
    rows = [f"a.png,GT00{i},0,0,{i},0,0,0,1" for i in (1, 2)]
    file = saved(tmp_path / "train.csv", "\n".join(["filename,sequence,Tx,Ty,Tz,Qx,Qy,Qz,Qw", *rows]))
    assert read_pose_list(file).names == ("GT001_a", "GT002_a")


def test_records_are_read_in_the_order_of_the_stage(tmp_path) -> None:
    for index, frame in enumerate(("z", "a")):
        said = {"schema": "record-1", "frame": frame, "index": index}
        pose = {"pose": {"q_cam_body": QUARTER, "t_cam_body": PLACE}}
        saved(tmp_path / "records" / "nominal" / f"{frame}.json", said | pose)
    saved(tmp_path / "records" / "noisy" / "q.json", {"schema": "record-1"})
    assert read_pose_list(tmp_path).names == ("z", "a")


HEAD = "filename,sequence,Tx,Ty,Tz,Qx,Qy,Qz,Qw\n"
TURN = {"cam_R_m2c": ROWS, "cam_t_m2c": [0, 0, 1], "obj_id": 1}


@pytest.mark.parametrize(
    ("name", "content", "word"),
    [
        ("train_poses_gt.csv", "x,y,z,q1,q2,q3,q4\n0,0,1,0,0,0,1\n", "cannot be read"),
        ("a.csv", HEAD + "a.png,GT1,0,0,far,0,0,0,1\n", "line 2: Tz is 'far'"),
        ("a.csv", HEAD + "a.png,GT1,0,0\n", "Qx is ''"),
        ("a.csv", HEAD + ",GT1,0,0,1,0,0,0,1\n", "no filename"),
        ("a.csv", HEAD + "a.png,GT1,0,0,nan,0,0,0,1\n", "line 2: Tz is 'nan', not a finite number"),
        (
            "a.csv",
            HEAD + "a.png,GT1,0,0,1,0,0,0,2\n",
            "a.csv, line 2 ('a'): the quaternion has norm 2, expected 1; give a unit quaternion, scalar last",
        ),
        ("a.csv", HEAD, "holds no poses"),
        ("a.csv", "name,qw,qx,qy,qz,x,y,z" + "\na,1,0,0,0,0,0,9" * 2, "line 3 ('a'): names the same picture as line 2"),
        ("a.csv", "name,qw,qx,qy,qz,x,y,z\n...,1,0,0,0,0,0,9", "line 2: has the filename '...'"),
        (
            "a.csv",
            "img,alpha,x,y,z\n1,2,3,4,5\n",
            "no columns of a rotation among img, alpha, x, y, z; name the columns",
        ),
        ("a.csv", "name,qw,qx,qy,qz\n1,2,3,4,5\n", "no columns of a position among name, qw"),
        ("a.csv", "name,qw,qx,qy,qz,x,y,z\na,1,0,0,0,0,far,9\n", "line 2: y is 'far'"),
        ("a.csv", "name,qw,qx,qy,qz,x,y,z\na,1,0,0,0,0,0,9,5\n", "line 2: has 9 cells for 8 headings; write numbers"),
        ("scene_gt.json", [], "not an object of images"),
        ("scene_gt.json", {"one": [TURN]}, "'one' is not a number"),
        ("scene_gt.json", {"1": []}, "holds no poses"),
        ("scene_gt.json", {"1": [TURN | {"cam_R_m2c": ROWS[:8]}]}, "cam_R_m2c is not a list of 9"),
        ("scene_gt.json", {"1": [TURN | {"cam_R_m2c": [2 * each for each in ROWS]}]}, "is a rotation times 2"),
        ("scene_gt.json", {"1": [TURN | {"cam_t_m2c": None}]}, "cam_t_m2c is not a list of 3"),
        ("a.json", {"images": [], "annotations": []}, "no image with poses"),
        ("a.json", {"images": 3, "annotations": []}, "no list of images"),
        ("a.json", {"images": [{"file_name": "a.jpg", "poses": 3}]}, "poses that are not a list of objects"),
        ("a.json", {"images": [{"file_name": "a.jpg", "poses": [{}]}]}, "q_cam_body is not a list of 4"),
        ("a.tar", "no tar", "is not a tar file"),
        ("a.json", {"schema": "record-1"}, "not a record with a pose"),
    ],
)
def test_what_is_wrong_with_a_list_is_said_in_one_sentence(tmp_path, name, content, word) -> None:
    file = saved(tmp_path / name, content)
    with pytest.raises(InputError) as raised:
        read_pose_list(file)
    assert word in str(raised.value)
    assert str(tmp_path) in str(raised.value) or name in str(raised.value)


@pytest.mark.parametrize("compressed", ["", "xz", "gz", "bz2"])
def test_a_shard_is_whole_or_refused(tmp_path, compressed) -> None:
    """All of its records are there in each of these; the zeros after the last member are not, or not all of the
    compression's own end."""
    plain = webdataset(tmp_path, QUARTER, PLACE).read_bytes()
    whole = tmp_path / "whole.tar"
    with tarfile.open(whole, f"w:{compressed}") as tar:  # type: ignore[call-overload]
        tar.add(tmp_path / "train-000000.tar", "a.txt")
        member = tarfile.TarInfo("a.json")
        member.size = len(said := json.dumps({"pose": {"q_cam_body": QUARTER, "t_cam_body": PLACE}}).encode())
        tar.addfile(member, io.BytesIO(said))
    assert read_pose_list(whole).names == ("a",)
    cut = tmp_path / "cut.tar"
    cut.write_bytes(whole.read_bytes()[:-8] if compressed else plain.rstrip(b"\0") + b"\0" * 100)
    with pytest.raises(InputError, match=r"cut\.tar: is (cut short|damaged|not a whole tar file)"):
        read_pose_list(cut)


def test_a_sparse_header_that_cannot_be_read_is_refused(tmp_path) -> None:
    with tarfile.open(tmp_path / "a.tar", "w", format=tarfile.PAX_FORMAT) as tar:
        member = tarfile.TarInfo("a.json")
        member.pax_headers = {"GNU.sparse.map": "no,number"}
        tar.addfile(member)
    with pytest.raises(InputError, match=r"a\.tar: is damaged"):
        read_pose_list(tmp_path / "a.tar")


def test_a_folder_with_lists_of_two_formats_is_refused_by_their_names(tmp_path) -> None:
    saved(tmp_path / "scene" / "scene_gt.json", {"1": [TURN]})
    saved(tmp_path / "scene" / "scene_gt_coco.json", {"info": {}})
    assert len(read_pose_list(tmp_path / "scene")) == 1
    assert read_pose_list(tmp_path).lists == "1 pose list in the format BOP"
    saved(tmp_path / "train.csv", HEAD + "a.png,GT1,0,0,5,0,0,0,1\n")
    named = r"SPARK's stream 2 \(train.csv\) and BOP \(scene/scene_gt.json\); give the file of one"
    with pytest.raises(InputError, match=named):
        read_pose_list(tmp_path)


def test_a_folder_without_lists_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match="no pose list"):
        read_pose_list(tmp_path)
