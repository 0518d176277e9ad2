"""Folders of others that are made to harm: `check` ends soon with findings or a sentence, reads nothing outside the
folder, and shows no control characters of the set."""

import io
import json
import os
import struct
import time
import zipfile
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd import check
from spin_usd.errors import InputError
from spin_usd.exchange.sets.set_folder import SetFolder

SOON = 20.0  # seconds, of which reading a right set takes less than one
SECRET = "secret-of-the-user"
ESCAPE = "\x1b[31mred\x07"
SCRIPT = "<img src=x onerror=alert(1)>"
COUNT = 10


def entry(number, **other):
    q = Rotation.random(random_state=number).as_quat(scalar_first=True).tolist()
    return {"filename": f"img{number}.png", "q_vbs2tango_true": q, "r_Vo2To_vbs_true": [0.1, 0.2, 5.0]} | other


def png(size=(64, 48)) -> bytes:
    image = np.random.default_rng(0).integers(0, 255, size[::-1], np.uint8)
    return cv2.imencode(".png", image)[1].tobytes()


@pytest.fixture
def folder(tmp_path):
    """A set in the layout of SPEED+, COUNT pictures of noise."""
    made = tmp_path / "set"
    (made / "images").mkdir(parents=True)
    for number in range(COUNT):
        (made / "images" / f"img{number}.png").write_bytes(png())
    K = [[100, 0, 32], [0, 100, 24], [0, 0, 1]]
    (made / "camera.json").write_text(json.dumps({"Nu": 64, "Nv": 48, "cameraMatrix": K, "distCoeffs": [0.0] * 5}))
    listed(made, [entry(number) for number in range(COUNT)])
    return made


def listed(folder, entries) -> None:
    text = entries if isinstance(entries, str) else json.dumps(entries)
    (folder / "train.json").write_text(text)


def rules(folder, **options) -> dict[str, str]:
    """Return the messages of findings by rule; the time is bounded."""
    start = time.monotonic()
    found = {finding.code: finding.message for finding in check(folder, **options).findings}
    assert time.monotonic() - start < SOON
    return found


def test_links_that_lead_out_are_neither_read_nor_copied(folder, tmp_path) -> None:
    """To an image, to a list, to a folder: all outside."""
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "img3.png").write_bytes(png())
    (outside / "test.json").write_text(json.dumps([entry(1, filename=SECRET)]))
    (folder / "images" / "img3.png").unlink()
    (folder / "images" / "img3.png").symlink_to(outside / "img3.png")
    (folder / "test.json").symlink_to("../outside/test.json")
    (folder / "more").symlink_to(outside)
    found = rules(folder)
    assert "3 links lead out" in found["files"]
    assert "1 of 10" in found["image-lost"]
    assert SECRET not in str(found)
    assert not {"images/img3.png", "test.json", "more/test.json"} & SetFolder(folder).files


def test_links_in_circles_end(folder) -> None:
    (folder / "images" / "img3.png").unlink()
    (folder / "images" / "img3.png").symlink_to("img3.png")
    (folder / "images" / "again").symlink_to(folder)
    (folder / "a.json").symlink_to("b.json")
    (folder / "b.json").symlink_to("a.json")
    assert "image-lost" in rules(folder)


def test_links_inside_the_folder_are_read(folder) -> None:
    (folder / "images" / "img3.png").rename(folder / "images" / "other.png")
    (folder / "images" / "img3.png").symlink_to("other.png")
    assert "image-lost" not in rules(folder)


@pytest.mark.parametrize("name", ["images/img3.png", "camera.json", "validation.json"])
def test_a_pipe_is_not_waited_for(folder, name) -> None:
    (folder / name).unlink(missing_ok=True)
    os.mkfifo(folder / name)
    found = rules(folder)
    assert ("image-lost" in found) == name.startswith("images")


def test_a_folder_that_cannot_be_listed_is_said(folder, monkeypatch) -> None:
    """Root may list all, so the system's refusal is made."""
    listing = os.scandir

    def refuse(path):
        if Path(path).name == "images":
            raise PermissionError(13, "Permission denied")
        return listing(path)

    monkeypatch.setattr(os, "scandir", refuse)
    assert "cannot be listed (Permission denied)" in rules(folder)["unreadable"]


@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 0.99])
def test_images_that_are_cut_short(folder, share) -> None:
    for path in (folder / "images").iterdir():
        path.write_bytes(path.read_bytes()[: int(path.stat().st_size * share)])
    assert "unreadable" in rules(folder)


@pytest.mark.parametrize(
    "wrong",
    ["NaN", "Infinity", "-Infinity", "1e999", "1" * 400, "null", '"x"', "[]", "{}", "true", "1e308", "9e18", "-0.0"],
)
def test_numbers_that_are_none(folder, wrong) -> None:
    """In the place of z: a sentence or a finding, or, for minus zero, behind the camera."""
    listed(folder, (folder / "train.json").read_text().replace("5.0]", f"{wrong}]", 3))
    assert {"pose-numbers", "behind-camera", "unreadable", "distance", "pose-image"} & rules(folder).keys()


@pytest.mark.parametrize("encoding", ["utf-16", "utf-32", "latin-1"])
def test_lists_in_other_encodings(folder, encoding) -> None:
    text = (folder / "train.json").read_text().replace("img3", "imgé")
    (folder / "test.json").write_bytes(text.encode("utf-8"))
    (folder / "train.json").write_bytes(text.encode(encoding))
    with_others = rules(folder)
    assert "image-lost" in with_others  # of the list that can be read
    (folder / "test.json").unlink()
    with pytest.raises(InputError):
        check(folder)


@pytest.mark.parametrize("opening", ["[", '{"a":'])
def test_deeply_nested_json(folder, opening) -> None:
    listed(folder, '[{"filename": "img0.png", "q_vbs2tango_true": ' + opening * 200_000)
    with pytest.raises(InputError):
        check(folder)


@pytest.mark.parametrize(
    "name",
    ["../outside.png", "../../../../etc/passwd", "/etc/passwd", "images/../../outside.png", "\x00", "", "." * 5000,
     "a" * 100_000, "C:\\windows\\win.ini", "//host/share/x.png", "\ud800"],
)  # fmt: skip
def test_names_that_lead_out_find_nothing(folder, tmp_path, name) -> None:
    (tmp_path / "outside.png").write_bytes(png())
    listed(folder, [*(entry(number) for number in range(1, COUNT)), entry(0, filename=name)])
    assert "1 of 10" in rules(folder, report=tmp_path / "page")["image-lost"]


def test_text_of_a_set_is_escaped_on_the_terminal_and_on_the_page(folder, tmp_path, spin_usd) -> None:
    """Names of images, of classes and of files."""
    for place, text in enumerate((ESCAPE, SCRIPT, "\u202egnp.exe")):
        (folder / "images" / f"{text}.png").write_bytes(png())
        named = [entry(0, filename=f"{text}.png"), entry(1, filename=f"{text}.jpg")]
        listed(folder, [*named, *(entry(number) for number in range(2, COUNT))])
        page = tmp_path / f"page{place}"
        told = spin_usd("check", folder, "--report", page, code=1)
        assert "duplicate" in told.stdout
        assert not {"\x1b", "\x07", "\u202e"} & {*told.stdout, *told.stderr}
        shown = (page / "index.html").read_text()
        assert SCRIPT not in shown
        assert text != SCRIPT or "&lt;img src=x onerror" in shown


def test_file_names_outside_of_unicode(folder, spin_usd, tmp_path) -> None:
    name = os.fsencode(folder) + b"/images/img9\xff.png"
    with open(name, "wb") as file:
        file.write(png())
    told = spin_usd("check", folder, "--report", tmp_path / "page", code=1)
    assert "unlabelled" in told.stdout or "pose" in told.stdout


def huge_png() -> bytes:
    """A PNG whose head claims 65,535 x 65,535 pixels."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", 65535, 65535, 16, 6, 0, 0, 0)
    pixels = zlib.compress(bytes(1 << 20))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


@pytest.mark.children
def test_a_png_that_claims_more_pixels_than_memory_holds(folder) -> None:
    (folder / "images" / "img3.png").write_bytes(huge_png())
    assert "unreadable" in rules(folder)


def spacesense(folder, depth: bytes) -> None:
    axes = "target_spacecraft_in_camera_"
    columns = [f"{axes}pos_{axis}(m)" for axis in "xyz"] + [f"{axes}quat_{axis}" for axis in "wxyz"]
    for kind in ("image", "depth"):
        (folder / kind).mkdir(parents=True)
    (folder / "image" / "1.png").write_bytes(png())
    (folder / "depth" / "1.npz").write_bytes(depth)
    (folder / "pose_ground_truth.csv").write_text(f"timestamp,{','.join(columns)}\n1,5,0,0,1,0,0,0\n")


def npz(head: bytes, body: bytes, name="depth.npy") -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(name, b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + body)
    return made.getvalue()


@pytest.mark.parametrize(
    "depth",
    [
        npz(b"{'descr': '<f8', 'fortran_order': False, 'shape': (200000, 200000)}\n", bytes(1 << 20)),
        npz(b"{'descr': '<f8', 'fortran_order': False, 'shape': (64, 48)}\n", b"short"),
        npz(b"{'descr': '|O', 'fortran_order': False, 'shape': (2,)}\n", b"cos\nsystem\n"),
        npz(b"{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 9)}\n", b""),
        npz(b"{'descr': '<f8', 'fortran_order': False, 'shape': (10**9, 10**9, 0)}\n", b""),
        npz(b"not a head\n", b""),
        npz(b"", b"", name="readme.txt"),
        zipfile.ZipFile(io.BytesIO(), "w") and b"PK\x05\x06" + bytes(18),
        b"no archive",
        b"",
    ],
)
def test_arrays_that_are_bombs_or_damaged(tmp_path, depth) -> None:
    spacesense(tmp_path / "set", depth)
    assert "unreadable" in rules(tmp_path / "set")


def coco(folder, segmentation) -> None:
    (folder / "images").mkdir(parents=True)
    (folder / "images" / "a.png").write_bytes(png())
    note = {"id": 1, "image_id": 1, "category_id": 1, "bbox": [1, 2, 3, 4], "segmentation": segmentation}
    image = {"id": 1, "file_name": "a.png", "width": 64, "height": 48}
    document = {"images": [image], "annotations": [note], "categories": [{"id": 1, "name": "a"}]}
    (folder / "train.json").write_text(json.dumps(document))


@pytest.mark.parametrize(
    "segmentation",
    [
        {"size": [48, 64], "counts": [10**400]},
        {"size": [48, 64], "counts": [2**62, 2**62, 2**62]},
        {"size": [48, 64], "counts": [-5, 3077]},
        {"size": [48, 64], "counts": [3071.5, "x", None]},
        {"size": [48, 64], "counts": "o" * 1_000_000},
        {"size": [48, 64], "counts": "~é\x00"},
        {"size": [48, 64], "counts": "11"},
        {"size": [65535, 65535], "counts": [65535 * 65535]},
        {"size": [10**30, 10**30], "counts": [1]},
        {"size": [-1, -1], "counts": [1]},
        {"size": [48.5, None], "counts": []},
        {"size": "48", "counts": [0, 3072]},
        [[1, 2, 3]],
        [[1e300] * 6, [float("nan")] * 8],
        [[0.0] * 100_001],
        [["x", None, {}, 1, 2, 3]],
        5,
        "x",
    ],
    ids=str,
)
def test_run_lengths_and_outlines_that_overflow(tmp_path, segmentation) -> None:
    """A mask that cannot be read is no reason to leave out what else the set has."""
    coco(tmp_path / "set", segmentation)
    rules(tmp_path / "set")


@pytest.mark.parametrize(
    "text",
    ["filename,class,bbox\n" + "a.png,aqua,[1 2 3 4]" + "," * 1_000_000 + "x\n",
     "filename,class,bbox\n" + "a.png,aqua,[1 2 3 4],5\n",
     "filename,class,bbox,bbox\na.png,aqua,1,2\n",
     "filename,class,bbox\na.png,aqua,\"" + "x" * 200_000 + "\n",
     "filename,class,bbox\n\x00\n",
     "filename,class,bbox\na.png\n"],
    ids=range(6),
)  # fmt: skip
def test_tables_of_broken_rows(tmp_path, text) -> None:
    folder = tmp_path / "set"
    (folder / "train").mkdir(parents=True)
    (folder / "train" / "a.png").write_bytes(png())
    (folder / "train.csv").write_text(text)
    (folder / "val.csv").write_text('filename,class,bbox\na.png,aqua,"[1, 2, 3, 4]"\n')
    assert {"unreadable", "box-empty"} & rules(folder).keys()


@pytest.mark.slow
def test_two_hundred_thousand_empty_files(folder) -> None:
    """They cost their listing alone."""
    more = folder / "more"
    more.mkdir()
    for number in range(200_000):
        os.close(os.open(more / f"{number}.png", os.O_CREAT, 0o600))
    assert "duplicate" in rules(folder)
