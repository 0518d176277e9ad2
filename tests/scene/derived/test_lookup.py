"""Looking up textures and primvars: against OpenCV's bilinear look-up with borders, and laws of wrapping."""

import itertools

import cv2
import numpy as np
import pytest

from spin_usd.scene.derived.lookup import is_there, look_up, material_values, placed, values_at
from spin_usd.scene.material import Material
from spin_usd.scene.texture import WRAPS, Coordinates, Image, Primvar, Texture, Tiles
from tests.cases.scenes import target

REMAP = 1 / 32  # OpenCV looks up at 1/32 of a texel: the largest step of a value between neighbours, times that
EXACT = 1e-12
RNG = np.random.default_rng(5)
IMAGE = Image(name="noise", pixels=RNG.random((5, 8, 4), np.float32))
ST = RNG.uniform(-2, 3, (500, 2))


def texture(**fields):
    return Texture(path="/t", image=IMAGE, **fields)


def rgba_at(st, **fields):
    return np.concatenate([look_up(texture(output=output, **fields), st) for output in ("rgb", "a")], 1)


@pytest.mark.parametrize(("wrap", "border"), [("clamp", cv2.BORDER_REPLICATE), ("black", cv2.BORDER_CONSTANT),
                                              ("repeat", cv2.BORDER_WRAP), ("mirror", cv2.BORDER_REFLECT)])  # fmt: skip
def test_looks_up_as_opencv_does_an_image_padded_with_its_border(wrap, border) -> None:
    margin = 4 * max(IMAGE.pixels.shape[:2])
    padded = cv2.copyMakeBorder(IMAGE.pixels, margin, margin, margin, margin, border, value=(0, 0, 0, 0))
    height, width = IMAGE.pixels.shape[:2]
    x, y = ST[:, 0] * width - 0.5 + margin, (1 - ST[:, 1]) * height - 0.5 + margin
    wanted = cv2.remap(padded, x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR).reshape(-1, 4)
    assert np.abs(rgba_at(ST, wrap=(wrap, wrap)) - wanted).max() < REMAP


def test_texel_centres_are_the_texels_and_the_lower_left_corner_is_the_origin() -> None:
    height, width = IMAGE.pixels.shape[:2]
    rows, columns = np.mgrid[:height, :width].reshape(2, -1)
    st = np.stack([(columns + 0.5) / width, 1 - (rows + 0.5) / height], -1)
    for wrap in WRAPS:
        assert np.allclose(rgba_at(st, wrap=(wrap, wrap)), IMAGE.pixels[rows, columns], atol=EXACT)
    assert st[rows == height - 1, 1].max() < st[rows == 0, 1].min()


def test_each_axis_wraps_its_own_way() -> None:
    """A picture that is a product of its axes: so is its look-up, whatever the wraps."""
    s, t = RNG.random(8), RNG.random(5)
    product = Image(name="p", pixels=np.repeat((t[:, None] * s)[..., None], 4, 2))
    across = Image(name="s", pixels=np.tile(s[None, :, None], (5, 1, 4)))
    down = Image(name="t", pixels=np.tile(t[:, None, None], (1, 8, 4)))
    for wraps in itertools.product(WRAPS, WRAPS):
        values = [
            look_up(Texture(path="/t", image=image, wrap=wrap), ST)
            for image, wrap in ((product, wraps), (across, (wraps[0], "clamp")), (down, ("clamp", wraps[1])))
        ]
        assert np.allclose(values[0], values[1] * values[2], atol=1e-6)  # float32 texels


def test_scale_and_bias_come_last_and_each_output_is_its_channel() -> None:
    scale, bias = (2.0, 3.0, 4.0, 5.0), (0.1, 0.2, 0.3, 0.4)
    plain = rgba_at(ST, wrap=("black", "repeat"))
    for i, output in enumerate("rgba"):
        found = look_up(texture(output=output, wrap=("black", "repeat"), scale=scale, bias=bias), ST)
        assert np.allclose(found[:, 0], plain[:, i] * scale[i] + bias[i], atol=EXACT)


def test_coordinates_follow_their_matrix() -> None:
    where = Coordinates(matrix=(0.0, -2.0, 0.25, 1.0, 3.0, -1.0))
    assert np.allclose(placed(where, np.array([[0.5, 0.125]])), [[0.0, -0.125]], atol=EXACT)


def test_each_tile_is_an_image_clamped_to_its_own_square() -> None:
    other = Image(name="o", pixels=RNG.random((3, 2, 4), np.float32))
    images = (((0, 0), IMAGE), ((1, 0), other), ((0, 2), IMAGE))
    tiled = Texture(path="/t", image=Tiles(name="t", images=images))
    found = look_up(tiled, ST)
    wanted = np.zeros((len(ST), 3))
    for corner, image in images:
        inside = (np.floor(ST) == corner).all(1)
        assert inside.sum() > 5
        wanted[inside] = look_up(Texture(path="/t", image=image, wrap=("clamp", "clamp")), ST[inside] - corner)
    np.testing.assert_array_equal(found, wanted)
    low, high = tiled.image.extremes
    assert (found.min(0) >= low[:3]).all()
    assert (found.max(0) <= high[:3]).all()


def test_an_edge_belongs_to_the_tile_beside_it_if_there_is_one() -> None:
    other = Image(name="o", pixels=RNG.random((3, 2, 4), np.float32))
    corners = np.array([[1.0, 0.5], [2.0, 0.5], [0.5, 1.0]])
    tiled = look_up(Texture(path="/t", image=Tiles(name="t", images=(((0, 0), IMAGE), ((1, 0), other)))), corners)
    clamped = {"wrap": ("clamp", "clamp")}
    np.testing.assert_array_equal(
        tiled[0], look_up(Texture(path="/t", image=other, **clamped), np.array([[0.0, 0.5]]))[0]
    )
    np.testing.assert_array_equal(
        tiled[1], look_up(Texture(path="/t", image=other, **clamped), np.array([[1.0, 0.5]]))[0]
    )
    np.testing.assert_array_equal(tiled[2], look_up(texture(**clamped), np.array([[0.5, 1.0]]))[0])


POINTS, FACES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]]), np.array([[0, 1, 2], [1, 3, 2]])
CORNERS = RNG.random((2, 3, 2)).astype(np.float32)
FACE, WEIGHTS = np.array([0, 1, 1], np.int32), np.array([[1, 0, 0], [0, 1, 0], [0.25, 0.5, 0.25]])


def test_primvars_are_interpolated_over_their_faces() -> None:
    mesh = target(POINTS, FACES, primvars={"st": CORNERS}).mesh
    found = values_at(Primvar(name="st"), mesh, FACE, WEIGHTS)
    assert np.allclose(found[:2], [CORNERS[0, 0], CORNERS[1, 1]])
    assert np.allclose(found[2], WEIGHTS[2] @ CORNERS[1])
    looked = values_at(texture(), mesh, FACE, WEIGHTS)
    assert np.allclose(looked, look_up(texture(), found))
    constant = texture(coordinates=Coordinates(primvar=None, constant=(0.3, 0.6)))
    assert np.allclose(values_at(constant, mesh, FACE, WEIGHTS), look_up(texture(), np.array([[0.3, 0.6]])))


def test_each_face_takes_its_own_material_and_holes_are_below_the_threshold() -> None:
    opacity = np.array([[0.2, 0.2, 0.2], [0.2, 0.5, 0.8]], np.float32)[..., None]
    holed = Material(path="/a", opacity=Primvar(name="o"), opacity_threshold=0.5, diffuse_color=(1, 0, 0))
    faint = Material(path="/b", opacity=0.1, diffuse_color=(0, 1, 0))
    t = target(POINTS, FACES, materials=(holed, faint), face_material=[1, 0], primvars={"o": opacity})
    assert np.array_equal(material_values(t, "diffuse_color", FACE, WEIGHTS), [[0, 1, 0], [1, 0, 0], [1, 0, 0]])
    assert np.array_equal(is_there(t, FACE, WEIGHTS), [True, True, True])
    assert np.array_equal(is_there(t, FACE, np.eye(3)), [True, True, True])
    assert np.array_equal(is_there(t, np.full(3, 1, np.int32), np.eye(3)), [False, True, True])
