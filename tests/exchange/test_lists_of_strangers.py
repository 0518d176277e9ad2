"""Pose lists as strangers have them: transforms already applied, folders in names, units, times, empty pictures."""

import gzip
import io
import json
import tarfile

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.errors import InputError
from spin_usd.exchange.read_pose_list import read_pose_list

EXACT = 1e-12
Q, T = np.array([0.5, -0.1, 0.7, 0.5]) / np.linalg.norm([0.5, -0.1, 0.7, 0.5]), np.array([0.3, -0.2, 7.0])


def saved(path, content):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def matrix(q, t):
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = Rotation.from_quat(q, scalar_first=True).as_matrix(), t
    return made


def same_pose(poses, q=Q, t=T) -> None:
    turned = Rotation.from_quat(poses.q_cam_body[0], scalar_first=True)
    assert (turned * Rotation.from_quat(q, scalar_first=True).inv()).magnitude() < 1e-7
    np.testing.assert_allclose(poses.t_cam_body[0], t, rtol=0, atol=EXACT * 10)


@pytest.mark.parametrize("scale", [1.0, 0.25])
def test_what_nerfstudio_applied_is_undone(tmp_path, scale) -> None:
    """COLMAP's list of the same scene agrees."""
    c2w = np.linalg.inv(matrix(Q, T)) @ np.diag([1, -1, -1, 1])
    applied = matrix(Rotation.from_euler("xyz", [0.3, -1, 2]).as_quat(scalar_first=True), [0.5, -2, 1])
    moved = applied @ c2w
    moved[:3, 3] *= scale
    document = {
        "applied_transform": applied[:3].tolist(), "applied_scale": scale,
        "frames": [{"file_path": "images/a.png", "transform_matrix": moved.tolist()}],
    }  # fmt: skip
    same_pose(read_pose_list(saved(tmp_path / "transforms.json", document)))
    line = " ".join(map(str, (1, *Q, *T, 1, "a.png")))
    same_pose(read_pose_list(saved(tmp_path / "images.txt", f"# c\n{line}\n\n")))


def test_the_two_lists_of_one_scene_agree(shared) -> None:
    folder = shared / "data" / "strangers"
    first, second = (read_pose_list(folder / name) for name in ("transforms.json", "images.txt"))
    np.testing.assert_allclose(first.t_cam_body, second.t_cam_body, atol=EXACT)
    np.testing.assert_allclose(np.abs((first.q_cam_body * second.q_cam_body).sum(1)), 1, atol=EXACT)


def csv(*names):
    return "filename,qw,qx,qy,qz,x,y,z\n" + "".join(f'"{name}",0,1,0,0,0,0,6\n' for name in names)


@pytest.mark.parametrize(
    ("listed", "names"),
    [
        (["train/cam0/000001.png", "train/cam1/000001.png"], ["cam0_000001", "cam1_000001"]),
        (["left/a.png", "right/b.png"], ["a", "b"]),
        (["IMG 1.jpg", "IMG(1).jpg", "IMG 1 .jpg"], ["IMG_1", "IMG_1_", "IMG_1__2"]),
        (["../b.jpg"], ["b"]),
    ],
)
def test_names_are_made_names_of_pictures_with_a_note(tmp_path, listed, names) -> None:
    poses = read_pose_list(saved(tmp_path / "a.csv", csv(*listed)))
    assert poses.names == tuple(names)
    assert bool(poses.notes) == any(each.rpartition("/")[2].rpartition(".")[0] not in names for each in listed) or (
        "cam0_000001" in names
    )


def test_a_name_that_stands_twice_is_refused_still(tmp_path) -> None:
    with pytest.raises(InputError, match="names the same picture"):
        read_pose_list(saved(tmp_path / "a.csv", csv("x/a.png", "x/a.png")))


def test_folders_of_others(shared) -> None:
    folder = shared / "data" / "strangers" / "folders_in_names"
    for name in ("images.txt", "transforms.json"):
        assert read_pose_list(folder / name).names == ("left_000000", "right_000000")


def test_heads_with_units_and_a_separator_line(tmp_path) -> None:
    semicolons = "sep=;\nname;qw;qx;qy;qz;x;y;z\na;0;1;0;0;0;0;6\n"
    assert read_pose_list(saved(tmp_path / "b.csv", semicolons)).t_cam_body.tolist() == [[0, 0, 6]]
    for unit, z in (("[m]", 6), ("(mm)", 6000), ("[cm]", 600)):
        text = f"name,qw,qx,qy,qz,x {unit},y {unit},z {unit}\na,0,1,0,0,0,0,{z}\n"
        assert read_pose_list(saved(tmp_path / "c.csv", text)).t_cam_body[0] == pytest.approx([0, 0, 6], abs=EXACT)
    with pytest.raises(InputError, match="position in ft"):
        read_pose_list(saved(tmp_path / "c.csv", "name,qw,qx,qy,qz,x [ft],y [ft],z [ft]\na,0,1,0,0,0,0,6\n"))


def trajectories():
    """The pose as a camera's in the world: (file name, content, name of the picture)."""
    world = np.linalg.inv(matrix(Q, T))
    x, y, z, w = Rotation.from_matrix(world[:3, :3]).as_quat()
    p = " ".join(map(repr, world[:3, 3].tolist()))
    row = " ".join(map(repr, world[:3].ravel().tolist()))
    return [
        ("traj.txt", f"1.5 {p} {x!r} {y!r} {z!r} {w!r}\n".replace("np.float64(", "").replace(")", ""), "1.5"),
        ("euroc.csv",
         "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_x [m/s]\n"
         + ",".join(map(str, (1403636579763555584, *world[:3, 3], w, x, y, z, 0.5))) + "\n", "1403636579763555584"),
        ("00.txt", row + "\n", "000000"),
    ]  # fmt: skip


@pytest.mark.parametrize("which", range(3))
def test_trajectories_of_a_camera_are_turned_round(tmp_path, which) -> None:
    name, content, picture = trajectories()[which]
    poses = read_pose_list(saved(tmp_path / name, content))
    same_pose(poses)
    assert poses.names == (picture,)
    assert "poses of a camera in a world" in poses.notes[0]


def test_bops_empty_pictures_second_bodies_and_few_decimals(tmp_path) -> None:
    turned = Rotation.from_euler("xyz", [0.3, -1, 2]).as_matrix()
    body = {"obj_id": 1, "cam_R_m2c": np.round(turned, 4).ravel().tolist(), "cam_t_m2c": [0, 0, 6000]}
    file = saved(tmp_path / "s" / "scene_gt.json", {"0": [], "1": [body], "2": [body, body]})
    poses = read_pose_list(file)
    assert poses.names == ("s_000001", "s_000002")
    assert len(poses.notes) == 3
    assert "left out 1 image without bodies, such as 0" in poses.notes[0]
    assert "several bodies in 1 image, such as 2 with obj_id 1, 1: the first" in poses.notes[1]
    assert "2 of 2 matrices were made rotations" in poses.notes[2]
    assert 1e-5 < float(poses.notes[2].split("up to ")[1].split()[0]) < 1e-3
    body["cam_R_m2c"] = (matrix(Q, T)[:3, :3] * 1000).ravel().tolist()
    with pytest.raises(InputError, match="is a rotation times 1000"):
        read_pose_list(saved(file, {"1": [body]}))


def test_a_compressed_tar_is_read_and_a_pointer_is_said_to_be_one(tmp_path) -> None:
    record = {"frame": "a", "pose": {"q_cam_body": Q.tolist(), "t_cam_body": T.tolist()}}
    data, plain = json.dumps(record).encode(), io.BytesIO()
    with tarfile.open(fileobj=plain, mode="w") as tar:
        header = tarfile.TarInfo("a.json")
        header.size = len(data)
        tar.addfile(header, io.BytesIO(data))
    (tmp_path / "a.tar.gz").write_bytes(gzip.compress(plain.getvalue()))
    same_pose(read_pose_list(tmp_path / "a.tar.gz"))
    pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:" + "a" * 64 + "\nsize 1234567\n"
    for name in ("a.json", "a.csv", "a.tar", "images.txt", "a.parquet"):
        with pytest.raises(InputError, match=r"pointer of Git LFS.*run git lfs pull"):
            read_pose_list(saved(tmp_path / name, pointer))


def test_a_trajectory_of_four_decimals_is_read_and_one_of_other_columns_refused(tmp_path) -> None:
    """TUM's ground truth has four decimals: norms are off 1 by some 1e-5."""
    file = tmp_path / "groundtruth.txt"
    file.write_text("1.5 1 2 3 0.6132 0.5962 -0.3311 -0.3986\n")
    (q,) = read_pose_list(file).q_cam_body
    assert np.abs(q) == pytest.approx(np.abs([-0.3986, 0.6132, 0.5962, -0.3311]), abs=1e-4)
    for line in ("1.5 1 2 3 0.6132 0.5962 -0.3311 -0.3986\n1.5 1 2 3 0 0 0 1 9\n", "1.5 1 2 3 0 0 0 1.08\n"):
        file.write_text(line)
        with pytest.raises(InputError, match=r"groundtruth.txt, line \d: "):
            read_pose_list(file)
    euroc = tmp_path / "data.csv"
    for heads in ("x [mm], p_y [m], p_z [m], q_w [], q_x [], q_y [], q_z []", "x, p_y, p_z, q_x, q_y, q_z, q_w"):
        euroc.write_text(f"#timestamp, p_{heads}\n1,0,0,1,1,0,0,0\n")
        with pytest.raises(InputError, match="has the columns"):
            read_pose_list(euroc)


HEAD = "name,qw,qx,qy,qz,x,y,z"
R11 = ",".join(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3))


@pytest.mark.parametrize(
    ("heads", "row", "found"),
    [
        (f"{HEAD},z", "a,1,0,0,0,0,0,6,7", "has the heading 'z' twice"),
        (f"{HEAD},Z", "a,1,0,0,0,0,0,6,7", "has the heading 'z' twice"),
        (f"{HEAD},z [mm]", "a,1,0,0,0,0,0,6,6000", "has the heading 'z' twice"),
        (f"{HEAD},tx,ty,tz", "a,1,0,0,0,0,0,6,0,0,7", "has two contradicting positions"),
        (f"{HEAD},q_w,q_x,q_y,q_z", "a,1,0,0,0,0,0,6,0,1,0,0", "has two contradicting rotations"),
        (f"{HEAD},{R11}", "a,1,0,0,0,0,0,6,1,0,0,0,-1,0,0,0,-1", "has two contradicting rotations"),
        ("name,qw,qx,qy,qz,x [Mm],y [Mm],z [Mm]", "a,1,0,0,0,0,0,6", "has a position in Mm"),
        ("name,qw,qx,qy,qz,x [km],y,z", "a,1,0,0,0,1e307,0,6", "has a position that overflows"),
    ],
)
def test_what_a_table_says_twice_is_refused(tmp_path, heads, row, found) -> None:
    with pytest.raises(InputError, match=found) as caught:
        read_pose_list(saved(tmp_path / "a.csv", f"{heads}\n{row}\n"))
    assert str(tmp_path / "a.csv") in str(caught.value)


def test_what_a_table_says_twice_alike_is_read(tmp_path) -> None:
    """The same rotation as a matrix, and as the other of its two quaternions; units in capitals."""
    turn = matrix(Q, T)[:3, :3].round(5).ravel()
    row = ",".join(map(str, ("a", *Q, *T, *-Q, *turn, *(T * 1000))))
    heads = f"{HEAD},quat_w,quat_x,quat_y,quat_z,{R11},tx (mm),ty (MM),tz (mm)"
    same_pose(read_pose_list(saved(tmp_path / "a.csv", f"{heads}\n{row}\n")))


def test_two_names_of_a_pose_in_json_agree(tmp_path) -> None:
    pose = {"filename": "a.png", "q_vbs2tango_true": Q.tolist(), "r_Vo2To_vbs_true": T.tolist()}
    same_pose(read_pose_list(saved(tmp_path / "a.json", [{**pose, "q_vbs2tango": (-Q).tolist()}])))
    with pytest.raises(InputError, match=r"a\.png.*has two contradicting positions"):
        read_pose_list(saved(tmp_path / "a.json", [{**pose, "r_Vo2To_vbs": (T * 2).tolist()}]))


def test_a_scale_without_bounds_names_its_file(tmp_path) -> None:
    document = {"applied_scale": 1e-320, "frames": [{"file_path": "a.png", "transform_matrix": matrix(Q, T).tolist()}]}
    with pytest.raises(InputError, match=r"transforms\.json: .*off by many powers of ten"):
        read_pose_list(saved(tmp_path / "transforms.json", document))
