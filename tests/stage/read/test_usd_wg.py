"""Every stage of the USD working group's assets but `foundation`, authored as a target: read as it says of itself.

What a stage says is in its prim names, in its texture's letters and colours, and in what its parts have in common: two
ways to write the same look must give the same numbers.
"""

import json
from dataclasses import dataclass, field

import numpy as np
import pytest

from spin_usd.commands.author.in_child import author_stage
from spin_usd.scene.derived.lookup import look_up, values_at
from spin_usd.scene.texture import Texture
from spin_usd.stage.read.stage_reader import StageReader

EIGHT_BITS = 0.02  # three files of one normal map, each rounded to 8 bits, scaled by 2
ROUGHNESS = 0.01  # the texture has 8 bits: 211 of 255 is 0.652
SAME_PICTURE = 0.02  # mean difference of one picture in several formats, JPEG among them
POSES = [{"filename": "a.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 100]}]


@dataclass(frozen=True, kw_only=True)
class Read:
    """parts: how many there are · images: file names of all textures."""

    parts: int
    images: set[str] = field(default_factory=set)


NORMALS = {"r_normal_map.png", "r_normal_map_reversed_x_0_bias_z.png", "r_normal_map_reversed_y.png"}
FORMATS = {
    "jpeg_cmyk_8-bit": "jpg",
    "jpeg_grayscale_8-bit": "jpg",
    "jpeg_rgb_8-bit": "jpg",
    "png_grayscale_16-bit": "png",
    "png_grayscale_8-bit": "png",
    "png_rgb_16-bit": "png",
    "png_rgb_32-bit": "png",
    "png_rgb_8-bit": "png",
}
EXPECTED = {
    "AlphaBlendSortTest/AlphaBlendSortTest.usda": Read(
        parts=3, images={"Texture_6_000000_0.298039228.png", "Texture_6_000000_0.509803951.png"}
    ),
    "AlphaBlendSortTest/geometries/Geometry_7.usd": Read(parts=1),
    "AlphaBlendSortTest/geometries/Geometry_8.usd": Read(parts=1),
    "NormalsTextureBiasAndScale/NormalsTextureBiasAndScale.usda": Read(parts=3, images=NORMALS),
    "NormalsTextureBiasAndScale/NormalsTextureBiasAndScale.usdz": Read(parts=3, images=NORMALS),
    "RoughnessTest/RoughnessTest.usdz": Read(parts=6, images={"roughness.tga", "roughness-spec.png"}),
    "TextureCoordinateTest/TextureCoordinateTest.usda": Read(parts=5, images={"TextureCoordinateTemplate.png"}),
    "TextureCoordinateTest/TextureCoordinateTestMaterialX.usda": Read(parts=5),
    "TextureTransformTest/TextureTransformTest.usd": Read(
        parts=12,
        images={
            "TextureTransformTest Arrow_3f19c4b30ba512b6ada648d0556dd5cb.png",
            "TextureTransformTest Correct_1707e3f51203d3718e177cac0feb30a8.png",
            "TextureTransformTest Error_3cb6f7004e7fc2a5bd84948bbfc8d2c5.png",
            "TextureTransformTest Not Supported_94a69d32159b22ca3b96ab8e43432351.png",
            "TextureTransformTest UV_244266e87c0f006acef7f70b1ae83a8f.png",
        },
    ),
    "TextureFileFormatTests/_scene.usda": Read(parts=3),
    "TextureFileFormatTests/all_files.usda": Read(parts=24, images={f"{n}.{kind}" for n, kind in FORMATS.items()}),
    **{f"TextureFileFormatTests/{n}.usda": Read(parts=3, images={f"{n}.{kind}"}) for n, kind in FORMATS.items()},
    "_common/animated_cube_translation.usda": Read(parts=1),
    "_common/axis.usda": Read(parts=3),
    "_common/teapot.usda": Read(parts=1),
}


@pytest.fixture(scope="module")
def assets(shared):
    return shared / "data" / "usd-wg-assets"


@pytest.fixture(scope="module")
def read_asset(assets, tmp_path_factory):
    """The target of an asset, authored into a stage of its own; each once."""
    known = {}

    def read(name):
        if name not in known:
            folder = tmp_path_factory.mktemp("asset")
            (folder / "poses.json").write_text(json.dumps(POSES))
            target = assets / name
            given = {"poses": folder / "poses.json", "target": target, "camera": "speedplus"}
            author_stage(**given, out=folder / "stage", any_size=True)  # what exercises renderers need be no craft
            reader = StageReader(folder / "stage" / "dataset.usda")
            known[name] = reader.scene(reader.frames[0]).bodies[0].target
        return known[name]

    return read


def textures(target):
    return [value for material in target.materials for value in vars(material).values() if isinstance(value, Texture)]


def on_part(target, end, name, *, points):
    """Values (N, C) of the material's field `name` on the part whose path ends in `end`, at random points."""
    part = next(part for part in target.parts if part.path.endswith(end))
    faces = np.flatnonzero(target.mesh.face_part == part.id)
    rng = np.random.default_rng(1)
    face = rng.choice(faces, points)
    weights = rng.dirichlet([1, 1, 1], points)
    material = target.materials[target.mesh.face_material[faces[0]]]
    return values_at(getattr(material, name), target.mesh, face.astype(np.int32), weights)


def test_every_stage_of_the_assets_is_listed(assets) -> None:
    found = {f.relative_to(assets).as_posix() for f in assets.rglob("*.usd*")}
    assert {name for name in found if not name.startswith("foundation/")} == set(EXPECTED)


@pytest.mark.parametrize("name", EXPECTED)
def test_read(read_asset, name) -> None:
    target = read_asset(name)
    assert len(target.parts) == EXPECTED[name].parts
    assert {texture.image.name for texture in textures(target)} == EXPECTED[name].images


@pytest.mark.parametrize(("part", "color"), [("U", [0, 1, 0]), ("V", [0, 0, 1]), ("UV", [0, 1, 1])])
def test_each_offset_shows_the_quarter_with_its_own_letters(read_asset, part, color) -> None:
    """In the image U is green, V blue, UV cyan, and what is not supported yellow."""
    target = read_asset("TextureTransformTest/TextureTransformTest.usd")
    shown = np.median(on_part(target, f"/Offset_{part}", "diffuse_color", points=2000), axis=0)
    assert ((shown > 0.1) == color).all()


@pytest.mark.parametrize("panel", ["Rotation", "Scale", "All"])
def test_the_arrow_points_at_the_mark_that_says_correct(read_asset, panel) -> None:
    """Its marks lie where they would with the panel's centre as origin: the exporter lost their parents' places."""
    target = read_asset("TextureTransformTest/TextureTransformTest.usd")
    face, weights = pixels(target, f"/{panel}", 400_000)
    material = target.materials[target.mesh.face_material[face[0]]]
    dark = values_at(material.diffuse_color, target.mesh, face, weights)[:, 0] < 0.1
    at = np.einsum("nk,nkc->nc", weights, target.mesh.points[target.mesh.faces[face]])[dark][:, :2]
    bounds = target.mesh.points[target.mesh.faces[face]].reshape(-1, 3)[:, :2]
    at -= (bounds.min(0) + bounds.max(0)) / 2
    axis = np.linalg.svd(at - at.mean(0), full_matrices=False)[2][0]
    along = (at - at.mean(0)) @ axis
    axis, along = (axis, along) if np.mean(along**3) < 0 else (-axis, -along)  # the head is heavy: towards it
    tip = at[np.argmax(along)]
    for mark, near in (("Correct", True), ("Error", False)):
        places = [p for p in target.parts if p.path.endswith(f"/{panel}___{mark}")]
        if places:
            corners = target.mesh.points[target.mesh.faces[target.mesh.face_part == places[0].id]].reshape(-1, 3)
            to = (corners.min(0) + corners.max(0))[:2] / 2 - tip
            assert (to @ axis / np.linalg.norm(to) > np.cos(np.radians(20))) == near


def pixels(target, end, count):
    """Random faces (N,) and weights (N, 3), even over the part."""
    part = next(part for part in target.parts if part.path.endswith(end))
    faces = np.flatnonzero(target.mesh.face_part == part.id)
    rng = np.random.default_rng(2)
    return rng.choice(faces, count).astype(np.int32), rng.dirichlet([1, 1, 1], count)


@pytest.mark.parametrize(
    ("level", "constant", "textured"), [("000", 0.0, 0.0), ("033", 0.33, 0.6), ("066", 0.66, 0.66)]
)
def test_roughness_by_texture_is_that_of_the_constant_beside_it(read_asset, level, constant, textured) -> None:
    """But for the middle one, whose texture the stage calls raw and the other two sRGB: 153 of 255 is then 0.6."""
    target = read_asset("RoughnessTest/RoughnessTest.usdz")
    numbers = {"000": ("", "_001"), "033": ("_002", "_003"), "066": ("_004", "_005")}[level]
    texture = on_part(target, f"/Tex{level}/Mesh{numbers[0]}", "roughness", points=500)
    beside = on_part(target, f"/Const{level}/Mesh{numbers[1]}", "roughness", points=1)
    assert beside[0, 0] == pytest.approx(constant, abs=1e-6)
    np.testing.assert_allclose(texture, textured, atol=ROUGHNESS)


@pytest.mark.parametrize("kind", ["usda", "usdz"])
def test_the_three_normal_maps_are_one_by_their_scale_and_bias(read_asset, kind) -> None:
    """Each has an axis turned or shifted in the file, and turned back by scale and bias."""
    target = read_asset(f"NormalsTextureBiasAndScale/NormalsTextureBiasAndScale.{kind}")
    plain, *others = (m.normal for m in target.materials)
    st = np.random.default_rng(1).random((2000, 2))
    expected = look_up(plain, st)
    np.testing.assert_allclose(np.median(np.linalg.norm(expected, axis=1)), 1, atol=EIGHT_BITS)
    for other in others:
        assert np.abs(look_up(other, st) - expected).mean() < EIGHT_BITS


def test_texture_coordinates_put_each_corner_in_its_color(read_asset) -> None:
    """The squares are named by their place, and tinted yellow, orange red, blue and green from the top left on."""
    target = read_asset("TextureCoordinateTest/TextureCoordinateTest.usda")
    tints = {
        "TopLeft": (0.8, 0.8, 0),
        "TopRight": (0.8, 0.08, 0),
        "BottomLeft": (0, 0.16, 0.8),
        "BottomRight": (0, 0.8, 0),
    }
    for place, tint in tints.items():
        color = np.median(on_part(target, f"/{place}Mesh/submesh", "diffuse_color", points=500), axis=0)
        np.testing.assert_allclose(color, tint, atol=1e-6)


@pytest.mark.parametrize("other", ["jpeg_rgb_8-bit", "png_rgb_16-bit"])
def test_one_picture_in_several_formats(read_asset, other) -> None:
    first, second = (
        next(t for t in textures(read_asset(f"TextureFileFormatTests/{n}.usda")) if t.output == "rgb").image.pixels
        for n in ("png_rgb_8-bit", other)
    )
    # The letters, which say the format, fill the left half's top and the word below right.
    top = slice(200, 230), slice(10, 150)
    assert np.abs(first[top][..., :3] - second[top][..., :3]).mean() < SAME_PICTURE
