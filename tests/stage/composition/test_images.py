"""Images as the specification of UsdUVTexture wants them: every format and depth, colour spaces, damage, limits."""

import struct
import zlib
from typing import Any

import cv2
import numpy as np
import OpenImageIO as oiio  # noqa: N813  as its documentation does
import pytest
from PIL import Image as PillowImage
from PIL import ImageOps
from pxr import Sdf, Usd, UsdUtils

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.derived import srgb
from spin_usd.stage.composition import images
from spin_usd.stage.composition.images import Images, image_in
from tests.cases.image_files import write_image_file
from tests.cases.png import gamma_chunk, png

FLOAT32 = 1e-6
JPEG_LOSS = 3 / 255  # a smooth picture at quality 95
RAMP = np.stack(np.meshgrid(np.arange(8) * 30, np.arange(6) * 40), -1)  # (6, 8, 2): even, and no two axes alike
RGB = np.concatenate([RAMP, RAMP[..., ::-1][..., :1] // 2], -1).astype(np.uint8)


@pytest.fixture
def decode(tmp_path):
    """The Decoded of a file in the stage's folder."""

    def read(name, color_space="raw", data=None, reader=None):
        if data is not None:
            (tmp_path / name).write_bytes(data)
        layer = Sdf.Layer.CreateNew(str(tmp_path / f"{len(list(tmp_path.iterdir()))}.usda"))
        stage = Usd.Stage.Open(layer)
        prim = stage.DefinePrim("/Texture")
        attribute = prim.CreateAttribute("inputs:file", Sdf.ValueTypeNames.Asset)
        attribute.Set(Sdf.AssetPath(f"./{name}"))
        return (reader or Images()).read(attribute.Get(), color_space, prim)

    return read


def test_png_of_8_and_16_bits(decode) -> None:
    alpha = np.full((6, 8, 1), 128)
    eight = decode("a.png", data=png(np.concatenate([RGB, alpha], -1), color=6)).image.pixels
    np.testing.assert_allclose(eight, np.concatenate([RGB, alpha], -1) / 255, atol=FLOAT32)
    wide = RGB.astype(int) * 257 + 3
    sixteen = decode("b.png", data=png(wide, color=2, depth=16)).image.pixels
    np.testing.assert_allclose(sixteen[..., :3], wide / 65535, atol=FLOAT32)
    assert (sixteen[..., 3] == 1).all()


def test_alpha_is_not_multiplied_into_the_colors(decode) -> None:
    clear = np.zeros((2, 2, 4), int)
    clear[..., 0] = 255
    np.testing.assert_array_equal(decode("a.png", data=png(clear, color=6)).image.pixels[..., 0], 1)


def test_grey_and_grey_with_alpha(decode) -> None:
    grey = RGB[..., :1].astype(int)
    found = decode("a.png", data=png(grey, color=0)).image.pixels
    np.testing.assert_allclose(found[..., :3], np.repeat(grey / 255, 3, -1), atol=FLOAT32)
    assert (found[..., 3] == 1).all()
    both = decode("b.png", data=png(np.concatenate([grey, 255 - grey], -1), color=4)).image.pixels
    np.testing.assert_allclose(both[..., [0, 3]], np.concatenate([grey, 255 - grey], -1) / 255, atol=FLOAT32)


@pytest.mark.parametrize("mode", ["L", "RGB", "CMYK"])
def test_jpeg(decode, tmp_path, mode) -> None:
    smooth = PillowImage.fromarray(np.kron(RGB, np.ones((16, 16, 1), np.uint8))).convert(mode)
    smooth.save(tmp_path / "a.jpg", quality=95, subsampling=0)
    expected = np.asarray(PillowImage.open(tmp_path / "a.jpg").convert("RGB"), float) / 255
    found = decode("a.jpg").image.pixels
    assert np.abs(found[..., :3] - expected).mean() < JPEG_LOSS
    assert (found[..., 3] == 1).all()


def test_float_files(decode, tmp_path) -> None:
    """EXR keeps numbers of any size; Radiance HDR has 8 bits of mantissa for the three together; TIFF as it is."""
    values = np.random.default_rng(1).uniform(0, 5, (6, 8, 3)).astype(np.float32)
    write_image_file(tmp_path / "a.exr", values)
    np.testing.assert_array_equal(decode("a.exr").image.pixels[..., :3], values)
    cv2.imwrite(str(tmp_path / "a.tif"), values[..., ::-1])
    np.testing.assert_array_equal(decode("a.tif").image.pixels[..., :3], values)
    cv2.imwrite(str(tmp_path / "a.hdr"), values[..., ::-1])
    largest = values.max(-1, keepdims=True)
    assert (np.abs(decode("a.hdr").image.pixels[..., :3] - values) <= largest / 64).all()


def test_srgb_decodes_colors_and_not_alpha(decode) -> None:
    half = np.full((2, 2, 4), 188)
    found = decode("a.png", "sRGB", data=png(half, color=6)).image.pixels
    np.testing.assert_allclose(found[..., :3], srgb.decode(np.array([188 / 255]))[0])
    np.testing.assert_allclose(found[..., 3], 188 / 255)


G22, LINEAR = gamma_chunk(1 / 2.2), gamma_chunk(1)
SRGB = (b"sRGB", b"\0")


@pytest.mark.parametrize(
    ("color", "depth", "chunks", "decoded"),
    [
        (2, 8, (), True),
        (6, 8, (), True),
        (0, 8, (), False),
        (4, 8, (), False),
        (2, 16, (), False),
        (2, 8, (LINEAR,), False),
        (0, 8, (SRGB,), True),
        (2, 16, (G22,), True),
        (2, 16, (SRGB,), True),
        (2, 8, (gamma_chunk(1 / 1.8),), False),
    ],
)
def test_auto_follows_the_metadata_and_then_bits_and_channels(decode, color, depth, chunks, decoded) -> None:
    """The table of the UsdPreviewSurface specification, "sourceColorSpace"."""
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[color]
    half = 188 * (257 if depth == 16 else 1)
    data = png(np.full((2, 2, channels), half), color=color, depth=depth, chunks=chunks)
    value = decode("a.png", "auto", data=data).image.pixels[0, 0, 0]
    raw = 188 / 255
    assert value == pytest.approx(srgb.decode(np.float32([raw]))[0] if decoded else raw, abs=FLOAT32)


def test_each_file_is_decoded_once_for_each_color_space(decode, monkeypatch) -> None:
    calls = []
    original = images._decode

    def decode_and_note(*arguments: Any, upright: bool) -> Any:
        calls.append(arguments)
        return original(*arguments, upright=upright)

    monkeypatch.setattr(images, "_decode", decode_and_note)
    reader = Images()
    data = png(RGB.astype(int), color=2)
    first = decode("a.png", "raw", data=data, reader=reader)
    assert decode("a.png", "raw", reader=reader) is first
    assert decode("a.png", "sRGB", reader=reader) is not first
    assert len(calls) == 2


def test_what_another_reader_has_decoded_is_not_decoded_again(decode) -> None:
    first = Images()
    image = decode("a.png", "raw", data=png(RGB.astype(int), color=2), reader=first)
    assert decode("a.png", "raw", reader=Images(before=first.decoded)) is image
    assert decode("a.png", "raw", reader=Images()) is not image


def test_an_image_within_a_package(tmp_path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.png").write_bytes(png(RGB.astype(int), color=2))
    stage = Usd.Stage.CreateNew(str(tmp_path / "in" / "root.usda"))
    stage.DefinePrim("/Texture").CreateAttribute("inputs:file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath("./a.png"))
    stage.Save()
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "in" / "root.usda"), str(tmp_path / "package.usdz"))
    opened = Usd.Stage.Open(str(tmp_path / "package.usdz"))
    prim = opened.GetPrimAtPath("/Texture")
    found = Images().read(prim.GetAttribute("inputs:file").Get(), "raw", prim).image
    np.testing.assert_allclose(found.pixels[..., :3], RGB / 255, atol=FLOAT32)
    assert found.name == "a.png"


def test_wrap_modes_in_the_metadata_and_black_without_them(decode, tmp_path) -> None:
    spec = oiio.ImageSpec(4, 4, 3, "half")
    spec.attribute("wrapmodes", "mirror,periodic")
    output = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    output.open(str(tmp_path / "a.exr"), spec)
    output.write_image(np.zeros((4, 4, 3), np.float32))
    output.close()
    assert decode("a.exr").wrap == ("mirror", "repeat")
    assert decode("a.png", data=png(RGB.astype(int), color=2)).wrap == ("black", "black")


@pytest.mark.parametrize("suffix", ["png", "jpg", "tif", "exr", "hdr", "tga"])
def test_a_file_cut_short_is_named(decode, tmp_path, suffix) -> None:
    noise = np.random.default_rng(0).random((64, 64, 3)).astype(np.float32)
    write_image_file(tmp_path / f"a.{suffix}", noise)
    data = (tmp_path / f"a.{suffix}").read_bytes()
    saying = rf"^/Texture: its image @./a.{suffix}@ (is cut short|cannot be decoded).*; (copy or )?make it again$"
    with pytest.raises(StageError, match=saying):
        decode(f"a.{suffix}", data=data[: int(len(data) * 0.7)])


def bomb():
    """A PNG of 60000 x 60000 pixels in 100 bytes."""
    whole = png(np.zeros((1, 1, 1), int), color=0)
    header = whole[12:29].replace(struct.pack(">II", 1, 1), struct.pack(">II", 60000, 60000), 1)
    return whole[:12] + header + struct.pack(">I", zlib.crc32(header)) + whole[33:]


@pytest.mark.parametrize(
    ("name", "data", "error", "saying"),
    [
        ("none.png", None, StageError, "does not exist"),
        ("text.png", b"no picture", StageError, "cannot be decoded"),
        ("empty.exr", b"", StageError, "cannot be decoded"),
        pytest.param("bomb.png", bomb(), StageError, "cannot be decoded", id="bomb"),
        ("a.gif", b"GIF89a", UnsupportedError, "is not of a kind that is read"),
        ("tile.<UDIM>.png", None, UnsupportedError, "is a set of tiles"),
    ],
)
def test_what_is_no_image_is_refused_by_name(decode, name, data, error, saying) -> None:
    with pytest.raises(error, match=f"^/Texture: its image @./{name}@ {saying}"):
        decode(name, data=data)


def test_numbers_that_are_not_finite_and_channels_without_a_meaning(decode, tmp_path) -> None:
    values = np.zeros((4, 4, 3), np.float32)
    values[1, 2, 0] = np.nan
    write_image_file(tmp_path / "nan.exr", values)
    with pytest.raises(StageError, match=r"nan.exr@ holds NaN or infinity"):
        decode("nan.exr")
    spec = oiio.ImageSpec(4, 4, 2, "float")
    spec.channelnames = ("depth", "id")
    output = oiio.ImageOutput.create(str(tmp_path / "ids.exr"))
    output.open(str(tmp_path / "ids.exr"), spec)
    output.write_image(values[..., :2])
    output.close()
    with pytest.raises(UnsupportedError, match=r"ids.exr@ has the channels"):
        decode("ids.exr")


def test_an_image_outside_the_stages_folder(tmp_path) -> None:
    """Also where no layer names it in so many words: here an expression makes the path."""
    (tmp_path / "secret.png").write_bytes(png(RGB.astype(int), color=2))
    (tmp_path / "in").mkdir()
    root = tmp_path / "in" / "root.usda"
    root.write_text(
        '#usda 1.0\n(\nexpressionVariables = {\nstring UP = ".."\n}\n)\ndef "Texture"\n{\n'
        'asset inputs:file = @`"${UP}/secret.png"`@\n}\n'
    )
    stage = Usd.Stage.Open(str(root))
    prim = stage.GetPrimAtPath("/Texture")
    assert prim.GetAttribute("inputs:file").Get().resolvedPath
    with pytest.raises(StageError, match=r"lies outside the stage's folder"):
        Images().read(prim.GetAttribute("inputs:file").Get(), "raw", prim)


def test_one_image_has_a_limit(decode, monkeypatch) -> None:
    monkeypatch.setattr(images, "MAX_PIXELS", 47)
    with pytest.raises(StageError, match=r"a.png@ has 8 x 6 pixels, more than 47"):
        decode("a.png", data=png(RGB.astype(int), color=2))


def test_all_images_together_have_a_limit(decode, monkeypatch) -> None:
    monkeypatch.setattr(images, "MAX_TOTAL_PIXELS", 60)
    reader, data = Images(), png(RGB.astype(int), color=2)
    decode("a.png", data=data, reader=reader)
    with pytest.raises(StageError, match=r"to more than 60 pixels"):
        decode("b.png", data=data, reader=reader)


@pytest.mark.parametrize("suffix", ["png", "jpg", "tif", "exr", "hdr"])
def test_a_damaged_file_has_a_size_and_a_key_until_its_numbers_are_asked_for(decode, tmp_path, suffix) -> None:
    write_image_file(tmp_path / f"a.{suffix}", np.random.default_rng(0).random((64, 80, 3)).astype(np.float32))
    data = (tmp_path / f"a.{suffix}").read_bytes()[:-1000]
    image = decode(f"a.{suffix}", data=data, reader=Images(check=False)).image
    assert image.size == (64, 80)
    assert len(image.key) == 64
    for read in (lambda: image.pixels, lambda: image.channel(3), lambda: image.extremes, lambda: list(image.bands())):
        with pytest.raises(StageError, match=rf"a.{suffix}: its image (is cut short|cannot be decoded)"):
            read()


def test_bands_and_channels_are_the_pixels(decode, tmp_path, monkeypatch) -> None:
    """Of rows and of tiles, whose last ones reach beyond the image."""
    monkeypatch.setattr(images, "BAND_PIXELS", 8 * 2)
    values = np.random.default_rng(2).random((37, 8, 4)).astype(np.float32)
    spec = oiio.ImageSpec(8, 37, 4, "float")
    spec.tile_width = spec.tile_height = 16
    tiled = oiio.ImageOutput.create(str(tmp_path / "tiled.exr"))
    tiled.open(str(tmp_path / "tiled.exr"), spec)
    tiled.write_image(values)
    tiled.close()
    (tmp_path / "rows.png").write_bytes(png((values * 255).astype(int), color=6))
    for name, bands in (("tiled.exr", 3), ("rows.png", 19)):
        image = decode(name, "sRGB").image
        found = list(image.bands())
        assert len(found) == bands
        assert (image.bounds[0] <= image.extremes[0]).all()
        assert (image.extremes[1] <= image.bounds[1]).all()
        np.testing.assert_array_equal(image.channel(3), np.concatenate(found)[..., 3])
        np.testing.assert_array_equal(image.pixels, np.concatenate(found))
        np.testing.assert_array_equal(image.extremes, [image.pixels.min((0, 1)), image.pixels.max((0, 1))])


def test_the_key_is_of_the_files_bytes_and_of_how_they_are_understood(decode) -> None:
    data = png(RGB.astype(int), color=2)
    one = decode("a.png", "raw", data=data).image
    assert one == decode("b.png", "raw", data=data).image
    assert one != decode("a.png", "sRGB").image
    assert decode("a.png", "sRGB").image == decode("a.png", "auto").image
    assert one != decode("c.png", "raw", data=png(RGB.astype(int) + 1, color=2)).image


@pytest.mark.parametrize("orientation", range(1, 9))
def test_photographs_stand_upright_by_their_exif(tmp_path, orientation) -> None:
    """Pillow is the authority. Smooth colours, so that what two decoders of JPEG make of them agrees."""
    y, x = np.mgrid[0:24, 0:40]
    stored = PillowImage.fromarray(np.stack([6 * x, 10 * y, 3 * (x + y)], -1).astype(np.uint8))
    exif = stored.getexif()
    exif[0x0112] = orientation
    stored.save(tmp_path / "a.jpg", quality=100, subsampling=0, exif=exif)
    with PillowImage.open(tmp_path / "a.jpg") as opened:
        upright = np.asarray(ImageOps.exif_transpose(opened))
    image = image_in(tmp_path / "a.jpg", "raw")
    assert image.size == upright.shape[:2]
    np.testing.assert_allclose(image.pixels[..., :3] * 255, upright, atol=1.5)
