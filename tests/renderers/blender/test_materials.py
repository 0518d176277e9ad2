"""What Cycles makes of a material: textures against scene.derived.lookup, light against what can be
worked out by hand."""

import itertools
from dataclasses import replace

import bpy
import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.renderers.blender import material as materials
from spin_usd.renderers.blender import textures
from spin_usd.renderers.blender.nodes import Nodes
from spin_usd.renderers.blender.textures import node_value
from spin_usd.scene.derived.lookup import values_at
from spin_usd.scene.derived.surface import visible_surface, weights_at
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import PRESENCE, Material
from spin_usd.scene.texture import IDENTITY, OUTPUTS, WRAPS, Coordinates, Image, Primvar, Texture, Tiles
from tests.cases.scenes import with_first

TEXEL = 1e-4  # of the image's range: float32 coordinates of a ray that misses its pixel's centre by 1e-4 px
RADIOMETRY = 1e-4  # relative; float32 light transport
NOISE = 0.02  # relative, of a mean over some thousand pixels of 64 samples that choose lobes at random
MIRROR = 2e-3  # relative: a mirror's Fresnel reflection up to 3 degrees from head-on
ROUNDED = 1e-5  # relative, of pictures whose inputs differ by float32's rounding
SAME_ON_AVERAGE = 2e-3  # relative: noise of 4,000 pixels of 16 samples
# The lens distorts a little, so that the first ray goes through the pixel's exact centre (render.rays).
CAMERA = Camera(width=64, height=64, fx=120, fy=120, cx=32, cy=32, distortion=(1e-3, 0, 0, 0, 0))
RNG = np.random.default_rng(3)
IMAGE = Image(name="noise", pixels=RNG.random((5, 7, 4), np.float32))
MATRIX = (1.3, 0.4, -0.7, -0.2, 0.9, 0.35)
SUN = DistantLight(path="/Sun", direction_cam=(0.0, 0.0, 1.0), irradiance=(1000.0, 1000.0, 1000.0))
BLACK = Material(path="/black", diffuse_color=(0, 0, 0), use_specular_workflow=True)


def textured(square, scale=1.3, shift=0.4):
    """(F, 3, 2) texture coordinates of the square."""
    points, faces = square
    return (points[:, :2] * scale + shift)[faces]


def uniform(value, output="rgb"):
    """A texture of one value, but for a texel's last bit: or it would be drawn as a constant."""
    rgba = np.ones(4, np.float32)
    rgba[: np.size(value)] = value
    pixels = np.tile(rgba, (2, 3, 1))
    pixels[0, 0] = np.nextafter(pixels[0, 0], np.float32(0.5))
    return Texture(path="/t", image=Image(name="u", pixels=pixels), output=output)


def inner(picture):
    rows, columns = picture.rgb.shape[:2]
    return picture.rgb[rows // 4 : -rows // 4, columns // 4 : -columns // 4].reshape(-1, 3)


@pytest.fixture
def shows(blender, monkeypatch):
    """Render any input as emission, and compare it with `values_at` on every pixel's own surface point."""

    def glow(value):
        def surface(material, images, **_):
            nodes = Nodes("glow")
            return nodes.surface(nodes.add("ShaderNodeEmission", [node_value(nodes, images, value)]).outputs[0])

        return surface

    def compare(scene, value) -> None:
        monkeypatch.setattr(materials, "surface_material", glow(value))
        unique = Material(path="/m", emissive_color=(1.0,) * 3, ior=1 + RNG.random())  # not built by the library yet
        scene = with_first(scene, target=replace(scene.target, materials=(unique,)))
        visibility = blender.visibility(scene)
        seen = visible_surface(scene, visibility)
        wanted = values_at(value, scene.target.mesh, seen.face, weights_at(scene.target.mesh, seen.face, seen.body))
        found = blender.radiance(scene, Effort(samples=1), seed=0).rgb[visibility.face >= 0]
        assert len(found) > 2000
        assert np.ptp(wanted) > 0
        assert np.abs(found - wanted).max() < TEXEL

    return compare


@pytest.mark.parametrize("wrap", list(itertools.product(WRAPS, WRAPS)))
def test_textures_are_what_lookup_says(shows, make_scene, square, wrap) -> None:
    scene = make_scene(*square, camera=CAMERA, primvars={"st": textured(square)})
    for output, matrix in (("rgb", IDENTITY), ("rgb", MATRIX), ("a", MATRIX)):
        shows(scene, Texture(path="/t", image=IMAGE, output=output, wrap=wrap, coordinates=Coordinates(matrix=matrix)))


@pytest.mark.parametrize("output", ["rgb", "g", "a"])
def test_tiles_are_what_lookup_says(shows, make_scene, square, output) -> None:
    """Three tiles of two sizes, and nothing where there is a gap."""
    scene = make_scene(*square, camera=CAMERA, primvars={"st": textured(square)})
    other = Image(name="other", pixels=RNG.random((4, 3, 4), np.float32))
    tiles = Tiles(name="t", images=(((0, 0), IMAGE), ((1, 0), other), ((1, 1), IMAGE)))
    shows(scene, Texture(path="/t", image=tiles, output=output, scale=(0.5, 0.6, 0.7, 0.8), bias=(0.1, 0.2, 0.1, 0.2)))


@pytest.mark.parametrize("output", OUTPUTS)
def test_outputs_are_scaled_and_biased(shows, make_scene, square, output) -> None:
    scene = make_scene(*square, camera=CAMERA, primvars={"uv": textured(square)})
    scale, bias = (0.5, 0.7, 0.9, 0.8), (0.1, 0.0, 0.05, 0.2)
    where = Coordinates(primvar="uv")
    shows(scene, Texture(path="/t", image=IMAGE, output=output, coordinates=where, scale=scale, bias=bias))


@pytest.mark.parametrize("size", [1, 3])
def test_primvars_are_what_lookup_says(shows, make_scene, square, size) -> None:
    values = RNG.random((2, 3, size), np.float32)
    name = "a name that is longer than what Blender would keep of it, by far: it has room for sixty-seven bytes"
    scene = make_scene(*square, camera=CAMERA, primvars={name: values, name + "!": values / 2})
    shows(scene, Primvar(name=name))


INPUTS = {
    "diffuse_color": (0.7, 0.5, 0.3), "emissive_color": (20.0, 30.0, 10.0), "metallic": 0.6, "roughness": 0.3,
    "clearcoat": 0.8, "clearcoat_roughness": 0.2, "opacity": 0.4, "ior": 1.8, "normal": (0.28, 0.0, 0.96),
}  # fmt: skip


@pytest.mark.parametrize("workflow", [False, True])
@pytest.mark.parametrize("mode", ["transparent", PRESENCE])
@pytest.mark.parametrize("kind", ["texture", "primvar"])
def test_a_constant_is_the_same_as_texture_or_primvar(blender, make_scene, square, workflow, mode, kind) -> None:
    """One input after the other. A varying emission or opacity makes Cycles choose other paths: the same on average."""
    inputs = INPUTS | {"specular_color": (0.9, 0.5, 0.1)}
    size = {name: np.size(value) for name, value in inputs.items()}
    primvars = {name: np.broadcast_to(np.float32(value), (2, 3, size[name])) for name, value in inputs.items()}
    common = {"path": "/m", "use_specular_workflow": workflow, "opacity_mode": mode}

    def picture(**values):
        scene = make_scene(*square, q=(1, 0.2, 0.1, 0), camera=CAMERA, lights=[replace(SUN, angle=0.5)],
                           materials=[Material(**common, **inputs | values)],
                           primvars={"st": textured(square), **primvars})  # fmt: skip
        return blender.radiance(scene, Effort(samples=16), seed=1).rgba

    constant = picture()
    assert constant.any()
    for name, value in inputs.items():
        varying = Primvar(name=name) if kind == "primvar" else uniform(value, "rgb" if size[name] == 3 else "r")
        found = picture(**{name: varying})
        if name in ("emissive_color", "opacity"):
            assert found.mean() == pytest.approx(constant.mean(), rel=SAME_ON_AVERAGE)
        else:
            assert np.abs(found - constant).mean() < ROUNDED * constant.mean()


@pytest.mark.parametrize("limit", [0, 1 << 30])
def test_each_surface_shows_its_own_picture_and_the_unused_are_freed(
    blender, make_scene, square, monkeypatch, limit
) -> None:
    """Cycles has been seen to show the pixels of a picture that was freed, where the next got its address."""
    monkeypatch.setattr(textures, "UNUSED_BYTES", limit)
    for value in np.linspace(0.05, 0.95, 25):
        glow = replace(BLACK, emissive_color=uniform((value, 0.5, 0.2)))
        scene = make_scene(*square, camera=CAMERA, materials=[glow], primvars={"st": textured(square)})
        assert inner(blender.radiance(scene, Effort(samples=1), seed=0))[:, 0] == pytest.approx(value, rel=RADIOMETRY)
    green_and_blue = [np.round(image.pixels[5:7], 3).tolist() for image in bpy.data.images]
    assert green_and_blue.count([0.5, 0.2]) == (1 if limit == 0 else 25)  # other tests leave theirs


def before_a_glow(make_scene, square, material, *, behind=False, **fields):
    """A square 4 m before the camera that sees the glow of 100 W/m2/sr behind the camera, or one behind itself."""
    points, faces = square
    glow = replace(BLACK, path="/glow", emissive_color=(100.0,) * 3)
    far = 20 * points + (np.array([0, 0, 2]) if behind else np.array([0, 0, -6]))
    return make_scene(
        np.concatenate([points, far]), np.concatenate([faces, (faces if behind else faces[:, ::-1]) + 4]),
        materials=[material, glow], face_material=[0, 0, 1, 1],
        camera=replace(CAMERA, fx=600, fy=600), **fields,
    )  # fmt: skip


F0 = [(0.04, 0.04, 0.04), (0.9, 0.6, 0.2), (0.0, 0.1, 0.0), (1.0, 1.0, 1.0), (1.0, 0.7, 0.3), (0.0, 0.0, 0.0)]


@pytest.mark.parametrize("f0", F0)
@pytest.mark.parametrize("as_texture", [False, True])
def test_the_specular_workflow_reflects_its_colour_head_on(blender, make_scene, square, f0, as_texture) -> None:
    color = uniform(f0) if as_texture else f0
    mirror = replace(BLACK, path="/mirror", specular_color=color, roughness=0.0)
    st = np.concatenate([textured(square)] * 2)
    scene = before_a_glow(make_scene, square, mirror, primvars={"st": st})
    seen = inner(blender.radiance(scene, Effort(samples=16), seed=0)).mean(0)
    assert seen == pytest.approx(100 * np.array(f0), rel=MIRROR, abs=MIRROR)


@pytest.mark.parametrize("opacity", [0.0, 0.25, 1.0])
@pytest.mark.parametrize(
    ("values", "share"),
    [
        ({}, (0.04,) * 3),
        ({"metallic": 1.0, "diffuse_color": (0.9, 0.6, 0.2)}, (0.9, 0.6, 0.2)),
        ({"use_specular_workflow": True, "specular_color": (0.3, 0.2, 0.1)}, (0.3, 0.2, 0.1)),
        ({"ior": 1.0, "clearcoat": 1.0, "clearcoat_roughness": 0.0}, (0.04,) * 3),
    ],
)
@pytest.mark.parametrize("mode", ["transparent", PRESENCE])
def test_what_is_not_reflected_passes(blender, make_scene, square, values, share, opacity, mode) -> None:
    """Transparent: reflection stays, the rest passes. Presence: all of it is there by that share."""
    material = Material(path="/m", roughness=0.0, opacity=opacity, opacity_mode=mode,
                        **{"diffuse_color": (0, 0, 0), **values})  # fmt: skip
    share = np.array(share)
    reflected, passed = share, (1 - share) * (1 - opacity)
    if mode == PRESENCE:
        reflected, passed = share * opacity, np.ones(3) * (1 - opacity)
    for behind, wanted in ((False, reflected), (True, passed)):
        scene = before_a_glow(make_scene, square, material, behind=behind)
        found = inner(blender.radiance(scene, Effort(samples=64), seed=0)).mean(0)
        assert found == pytest.approx(100 * wanted, rel=NOISE, abs=0.1)


@pytest.mark.parametrize(("mode", "left"), [("transparent", 1.0), (PRESENCE, 0.25)])
def test_a_clear_surface_still_glows_and_one_that_fades_does_not(blender, make_scene, square, mode, left) -> None:
    glow = replace(BLACK, emissive_color=(8.0, 4.0, 2.0), opacity=0.25, opacity_mode=mode)
    found = inner(blender.radiance(make_scene(*square, materials=[glow]), Effort(samples=64), seed=0)).mean(0)
    assert found == pytest.approx(left * np.array([8, 4, 2]), rel=NOISE)


@pytest.mark.parametrize("opacity", [0.3, 0.5, 0.7])
def test_a_cut_out_is_there_or_not(blender, make_scene, square, lambert, opacity) -> None:
    holed = replace(lambert, opacity=opacity, opacity_threshold=0.5)
    picture = blender.radiance(make_scene(*square, materials=[holed], lights=[SUN]), Effort(samples=4), seed=0)
    there = float(opacity >= 0.5)
    assert inner(picture) == pytest.approx(there * 1000 / np.pi, rel=RADIOMETRY)
    assert picture.rgba[..., 3].max() == there


TILT = np.array([0.36, 0.48, 0.8])


def as_constant(tilt):
    return tuple(tilt)


def as_primvar(_tilt):
    return Primvar(name="tilt")


def as_texture(tilt):
    """As a normal map holds it: 0 to 1, decoded by scale and bias."""
    return replace(uniform(0.5 * tilt + 0.5), scale=(2.0, 2, 2, 1), bias=(-1.0, -1, -1, 0))


@pytest.fixture
def uncorrected(monkeypatch) -> None:
    """Without Cycles' darkening of what a tilted normal lights at a slant (Conty Estevez and others, 2019)."""
    make = materials.surface_material

    def made(*args, **options):
        material = make(*args, **options)
        material.cycles.use_bump_map_correction = False
        return material

    monkeypatch.setattr(materials, "surface_material", made)


AXES = {
    "along x and y": [[1, 0], [0, 1]],
    "mirrored": [[-1, 0], [0, 1]],
    "turned": [[0, 1], [-1, 0]],
    "mirrored and turned": [[0, 1], [1, 0]],
    "stretched": [[3, 0], [0, 0.5]],
}


@pytest.mark.parametrize("axes", AXES.values(), ids=AXES)
@pytest.mark.parametrize("normal", [as_constant, as_primvar, as_texture])
@pytest.mark.parametrize("smooth", [False, True])
def test_normal_maps_tilt_along_their_texture(
    blender, make_scene, square, lambert, uncorrected, axes, normal, smooth
) -> None:
    """Lambert's law of the normal x T + y B + z N, T along s and B along t on the surface."""
    points, faces = square
    st = (points[:, :2] @ np.array(axes, float).T)[faces]
    inverse = np.linalg.inv(np.array(axes, float))  # columns: where a step along s, or t, leads on the surface
    tangent, bitangent = (np.append(step / np.linalg.norm(step), 0) for step in inverse.T)
    tilted = TILT @ np.array([tangent, bitangent, (0, 0, -1)])
    light = np.array([0.5, -0.3, 0.8]) / np.linalg.norm([0.5, -0.3, 0.8])
    white = (1.0, 1.0, 1 - 0.1 * RADIOMETRY * RNG.random())  # not one that was built with correction
    material = replace(lambert, normal=normal(TILT), diffuse_color=white)
    corner_normals = np.tile([0, 0, -1.0], (2, 3, 1))
    if smooth:  # that shading normals count, not the face's own
        corner_normals = np.tile([0, 0.6, -0.8], (2, 3, 1))
        across = corner_normals[0, 0]
        tangent, bitangent = (axis - across * (axis @ across) for axis in (tangent, bitangent))
        tangent /= np.linalg.norm(tangent)
        handed = np.sign(np.cross((0, 0, -1), np.append(inverse[:, 0], 0)) @ np.append(inverse[:, 1], 0))
        tilted = TILT @ np.array([tangent, handed * np.cross(across, tangent), across])
    scene = make_scene(*square, camera=CAMERA, materials=[material], corner_normals=corner_normals,
                       lights=[replace(SUN, direction_cam=tuple(light))],
                       primvars={"st": st, "tilt": np.tile(TILT, (2, 3, 1))})  # fmt: skip
    wanted = 1000 / np.pi * max(-light @ tilted, 0)
    assert wanted > 20
    assert inner(blender.radiance(scene, Effort(samples=4), seed=0)) == pytest.approx(wanted, rel=RADIOMETRY)


def test_a_normal_map_tilts_along_the_primvar_of_its_own_texture(blender, make_scene, square, lambert) -> None:
    turned = textured(square)[..., ::-1] * (1, -1)
    normal = replace(as_texture(TILT), coordinates=Coordinates(primvar="other"))
    light = replace(SUN, direction_cam=(0.6, 0.0, 0.8))
    pictures = [
        blender.radiance(
            make_scene(*square, camera=CAMERA, materials=[replace(lambert, normal=map_)], lights=[light],
                       primvars={"st": textured(square), "other": turned}), Effort(samples=1), seed=0).rgb
        for map_ in (normal, as_texture(TILT))
    ]  # fmt: skip
    assert not np.allclose(pictures[0], pictures[1], rtol=0.1)
