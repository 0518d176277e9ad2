"""Image files come back bit for bit, are read alike by others, and never pass for whole when they are not."""

import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio  # noqa: N813
import PIL.Image
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spin_usd.errors import InputError, OutputError, UnsupportedError
from spin_usd.formats.image_file import read_image, write_image
from spin_usd.labels.table import LABELS

RGB, XYZ, GREY, Z = ("R", "G", "B"), ("X", "Y", "Z"), ("Y",), ("Z",)
SPECIAL = [0.0, -0.0, 1e-45, -1e38, np.inf, -np.inf, np.nan, 1e7 + 1, 1 / 3]


def kinds():
    """Suffix, number type and channel names of everything there is but JPEG."""
    return st.sampled_from(
        [(".exr", np.float32, c) for c in (Z, XYZ, RGB)]
        + [(".png", kind, c) for kind in (np.uint8, np.uint16) for c in (GREY, RGB)]
    )


@given(kinds(), st.data())
def test_every_bit_comes_back(tmp_path_factory, kind, data) -> None:
    suffix, dtype, channels = kind
    shape = data.draw(hnp.array_shapes(min_dims=2, max_dims=2, max_side=9)) + (() if len(channels) == 1 else (3,))
    array = data.draw(hnp.arrays(dtype, shape))
    path = tmp_path_factory.mktemp("image") / f"a{suffix}"
    write_image(path, array, channels=channels)
    found, names = read_image(path)
    assert names == channels
    assert found.dtype == dtype
    assert found.shape == shape
    assert found.tobytes() == array.tobytes()


def test_numbers_that_others_lose_come_back(tmp_path) -> None:
    """Part ids that half floats round, and floats that a conversion would change."""
    ids = np.array([[60001, 2049, 65535]], np.uint16)
    write_image(tmp_path / "a.png", ids, channels=GREY)
    np.testing.assert_array_equal(read_image(tmp_path / "a.png")[0], ids)
    floats = np.array([SPECIAL], np.float32)
    write_image(tmp_path / "a.exr", floats, channels=Z)
    assert read_image(tmp_path / "a.exr")[0].tobytes() == floats.tobytes()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_other_programs_read_the_same_png(tmp_path, dtype) -> None:
    grey = np.random.default_rng(0).integers(0, np.iinfo(dtype).max, (30, 41), dtype, endpoint=True)
    write_image(tmp_path / "a.png", grey, channels=GREY)
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "a.png"), cv2.IMREAD_UNCHANGED), grey)
    np.testing.assert_array_equal(np.asarray(PIL.Image.open(tmp_path / "a.png")), grey)
    rgb = np.random.default_rng(0).integers(0, np.iinfo(dtype).max, (30, 41, 3), dtype, endpoint=True)
    write_image(tmp_path / "a.png", rgb, channels=RGB)
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "a.png"), cv2.IMREAD_UNCHANGED)[..., ::-1], rgb)


def test_exr_is_what_its_header_says(tmp_path) -> None:
    array = np.random.default_rng(0).normal(size=(17, 23, 3)).astype(np.float32)
    write_image(tmp_path / "a.exr", array, channels=XYZ)
    spec = oiio.ImageInput.open(str(tmp_path / "a.exr")).spec()
    assert (spec.width, spec.height, spec.x, spec.y) == (23, 17, 0, 0)
    assert (spec.full_width, spec.full_height) == (23, 17)
    assert tuple(spec.channelnames) == XYZ
    assert spec.format == oiio.FLOAT
    assert spec.get_string_attribute("compression") == "zip"


def test_the_header_of_an_exr_says_what_its_numbers_are(tmp_path) -> None:
    channels = LABELS["dense_pose"].channels
    array = np.random.default_rng(0).normal(size=(5, 4, 3)).astype(np.float32)
    write_image(tmp_path / "a.exr", array, channels=channels.names, header=channels.header("dense_pose"))
    spec = oiio.ImageInput.open(str(tmp_path / "a.exr")).spec()
    said = {"spin:kind": "dense_pose", "spin:unit": "m", "spin:frame": "body", "ImageDescription": channels.meaning}
    said |= {"spin:channel:R": "x", "spin:channel:G": "y", "spin:channel:B": "z"}
    assert {name: spec.get_string_attribute(name) for name in said} == said


def test_channels_keep_their_names_in_any_order(tmp_path) -> None:
    array = np.random.default_rng(0).normal(size=(5, 4, 3)).astype(np.float32)
    write_image(tmp_path / "a.exr", array, channels=("Z", "X", "Y"))
    found, names = read_image(tmp_path / "a.exr")
    assert names == XYZ
    np.testing.assert_array_equal(found, array[..., [1, 2, 0]])


@pytest.mark.parametrize(
    ("suffix", "dtype", "channels"), [(".exr", np.float32, Z), (".png", np.uint16, GREY), (".jpg", np.uint8, GREY)]
)
def test_equal_images_are_equal_bytes(tmp_path, suffix, dtype, channels) -> None:
    """Whenever and wherever they are written."""
    array = (np.arange(600).reshape(20, 30) % 251).astype(dtype)
    (tmp_path / "elsewhere").mkdir()
    paths = [tmp_path / f"a{suffix}", tmp_path / "elsewhere" / f"b{suffix}"]
    write_image(paths[0], array, channels=channels)
    time.sleep(1.01 - time.time() % 1)  # into the next second: EXR's own clock counts these
    write_image(paths[1], array, channels=channels)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_jpeg_shows_the_picture(tmp_path) -> None:
    y, x = np.mgrid[0:120, 0:160]
    grey = (127 + 100 * np.sin(x / 13) * np.cos(y / 9)).astype(np.uint8)
    write_image(tmp_path / "a.jpg", grey, channels=GREY)
    assert np.abs(read_image(tmp_path / "a.jpg")[0].astype(int) - grey).mean() < 1
    noise = np.random.default_rng(0).integers(0, 256, (120, 160, 3)).astype(np.uint8)
    write_image(tmp_path / "n.jpg", noise, channels=RGB)


@pytest.mark.parametrize(
    ("name", "dtype", "channels"),
    [
        ("a.exr", np.float64, Z),
        ("a.exr", np.uint16, Z),
        ("a.png", np.float32, GREY),
        ("a.png", np.int32, GREY),
        ("a.png", np.uint8, ("U", "V")),
        ("a.png", np.uint8, (*RGB, "A")),
        ("a.jpg", np.uint16, GREY),
        ("a.tif", np.uint8, GREY),
        ("a", np.uint8, GREY),
    ],
)
def test_what_a_file_cannot_hold_is_refused(tmp_path, name, dtype, channels) -> None:
    with pytest.raises(UnsupportedError, match=name):
        write_image(tmp_path / name, np.zeros((2, 2, len(channels)), dtype), channels=channels)
    assert not any(tmp_path.iterdir())


def test_channels_must_fit_the_array(tmp_path) -> None:
    with pytest.raises(UnsupportedError, match="does not have the channels"):
        write_image(tmp_path / "a.exr", np.zeros((2, 2), np.float32), channels=XYZ)


@pytest.mark.parametrize("name", ["a.exr", "a.png", "a.jpg"])
def test_a_missing_folder_is_said(tmp_path, name) -> None:
    dtype = np.float32 if name.endswith("exr") else np.uint8
    with pytest.raises(OutputError, match=r"missing.*cannot be written"):
        write_image(tmp_path / "missing" / name, np.zeros((2, 2), dtype), channels=GREY)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize("name", ["a.exr", "a.png", "a.jpg"])
def test_a_full_disk_is_said(tmp_path, name) -> None:
    """OpenImageIO's own calls report success here."""
    (tmp_path / name).symlink_to("/dev/full")
    noise = np.random.default_rng(0).integers(0, 256, (64, 64)).astype(np.float32 if name.endswith("exr") else np.uint8)
    with pytest.raises(OutputError, match=name):
        write_image(tmp_path / name, noise, channels=GREY)


def test_a_file_cut_while_it_is_written_is_said_in_a_sentence(tmp_path) -> None:
    """A limit on the size of a file stands for the disk."""
    code = (
        "import pathlib, resource, signal, numpy as np; from spin_usd.errors import OutputError;"
        "from spin_usd.formats.image_file import write_image; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "noise = np.random.default_rng(0).integers(0, 2**16, (64, 64)).astype(np.uint16);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))\n"
        f"try: write_image(pathlib.Path({str(tmp_path / 'a.png')!r}), noise, channels=('Y',))\n"
        "except OutputError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "a.png: does not fit into memory, or a file's largest size (" in done.stdout, done
    assert done.stdout.count("\n") == 1


@pytest.mark.parametrize("name", ["a.exr", "a.png"])
@pytest.mark.parametrize("kept", [0.0, 0.02, 0.5, 0.9, 0.99])
def test_a_cut_file_is_refused(tmp_path, name, kept) -> None:
    noise = np.random.default_rng(0).integers(0, 2**16, (64, 64))
    path = tmp_path / name
    write_image(path, noise.astype(np.float32 if name == "a.exr" else np.uint16), channels=GREY)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(kept * len(whole))])
    with pytest.raises(InputError, match=name):
        read_image(path)


@pytest.mark.parametrize("content", [b"", b"not an image", bytes(1000)])
def test_what_is_no_image_is_refused(tmp_path, content) -> None:
    (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(InputError, match=r"a\.png"):
        read_image(tmp_path / "a.png")


def test_what_is_no_file_is_refused(tmp_path) -> None:
    for path in (tmp_path, tmp_path / "missing.png"):
        with pytest.raises(InputError, match="cannot be read"):
            read_image(path)
