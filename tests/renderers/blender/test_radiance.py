"""Radiance of surfaces whose light can be worked out by hand, and what must and must not change a picture."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.errors import UnsupportedError
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.geometry.region import Region
from spin_usd.renderers.blender.lamp import Sun, shining_along
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Primvar
from tests.cases.scenes import with_first

RADIOMETRY = 1e-4  # relative; float32 light transport
NOISE = 0.02  # relative, of a mean over some thousand pixels of 64 samples that choose lobes at random
FEW = 3  # hits more or less than the one expected: chance
FLAT_ON = (0.0, 0.0, 1.0)  # light along the camera's axis


def sun(direction=FLAT_ON, irradiance=(1361.0, 1361.0, 1361.0), angle=0.0):
    direction = np.asarray(direction, float) / np.linalg.norm(direction)
    return DistantLight(path="/Sun", direction_cam=tuple(direction), irradiance=irradiance, angle=angle)


@pytest.fixture
def noisy(make_scene, needles):
    """A scene whose radiance is noisy: a wide Sun, gloss, and parts that shade and light one another."""
    glossy = Material(path="/glossy", diffuse_color=(0.6, 0.5, 0.4), metallic=0.5, roughness=0.4)
    light = sun((0.5, 0.4, 0.8), angle=0.3)
    return make_scene(*needles, q=(0.5, -0.3, 0.7, 0.2), materials=[glossy], lights=[light])


def inner(picture):
    """The pixels (N, 3) well within a square that fills the middle of the picture."""
    rows, columns = picture.rgb.shape[:2]
    return picture.rgb[rows // 4 : -rows // 4, columns // 4 : -columns // 4].reshape(-1, 3)


def render(blender, scene, samples=1, seed=0):
    return blender.radiance(scene, Effort(samples=samples), seed=seed)


@pytest.mark.parametrize("irradiance", [1e-3, 1.0, 1361.0, 1e6])
@pytest.mark.parametrize("tilt", [0.0, 60.0, 85.0])
def test_white_lambertian_gives_irradiance_over_pi(blender, make_scene, square, irradiance, tilt) -> None:
    slope = np.radians(tilt)
    light = sun((np.sin(slope), 0, np.cos(slope)), (irradiance,) * 3)
    seen = inner(render(blender, make_scene(*square, lights=[light]), samples=4))
    assert seen == pytest.approx(irradiance * np.cos(slope) / np.pi, rel=RADIOMETRY)


def test_colours_of_light_and_surface_multiply(blender, make_scene, square, lambert) -> None:
    tinted = replace(lambert, diffuse_color=(0.2, 0.5, 0.8))
    scene = make_scene(*square, materials=[tinted], lights=[sun(irradiance=(10.0, 20.0, 5.0))])
    wanted = np.array([10 * 0.2, 20 * 0.5, 5 * 0.8]) / np.pi
    assert np.allclose(inner(render(blender, scene)), wanted, rtol=RADIOMETRY)


def test_lights_add_and_come_and_go(blender, make_scene, square) -> None:
    one, two = sun(irradiance=(100.0,) * 3), sun((0.6, 0, 0.8), (50.0, 0.0, 0.0))
    scene = make_scene(*square)
    dark = render(blender, scene)
    assert not dark.rgb.any()
    some = ((one,), (one, two), (two,), ())
    means = [inner(render(blender, replace(scene, lights=lights), samples=64)).mean(0) for lights in some]
    assert np.allclose(means[1], means[0] + means[2], rtol=NOISE)  # each ray asks one light, chosen at random
    assert means[2] == pytest.approx([50 * 0.8 / np.pi, 0, 0], rel=RADIOMETRY)
    assert not means[3].any()


def test_background_is_black_and_light_from_behind_lights_nothing(blender, make_scene, square) -> None:
    assert not render(blender, make_scene(*square, lights=[sun((0, 0, -1))])).rgb.any()


def test_emission_is_radiance(blender, make_scene, square, lambert) -> None:
    glow = replace(lambert, diffuse_color=(0, 0, 0), emissive_color=(3.0, 0.5, 40.0))
    seen = inner(render(blender, make_scene(*square, materials=[glow])))
    assert np.allclose(seen, (3.0, 0.5, 40.0), rtol=RADIOMETRY)


def test_shading_follows_the_corner_normals(blender, make_scene, square) -> None:
    normal = np.array([0, 0.6, -0.8])  # tilted by 37 degrees from the square's own
    normals = np.tile(normal, (2, 3, 1))
    seen = inner(render(blender, make_scene(*square, lights=[sun()], corner_normals=normals)))
    assert seen == pytest.approx(1361 * 0.8 / np.pi, rel=RADIOMETRY)


def test_each_face_has_its_own_material(blender, make_scene, square, lambert) -> None:
    grey = replace(lambert, diffuse_color=(0.25, 0.25, 0.25))
    scene = make_scene(*square, materials=[lambert, grey], lights=[sun()], face_material=[1, 0])
    face, rgb = blender.visibility(scene).face, render(blender, scene).rgb
    whole = (np.roll(face, 2, 1) == face) & (np.roll(face, -2, 1) == face)  # not on the edge between the two
    for index, reflects in ((0, 0.25), (1, 1.0)):
        seen = np.median(rgb[whole & (face == index)])
        assert seen == pytest.approx(1361 * reflects / np.pi, rel=RADIOMETRY)


def test_a_material_switched_between_frames_takes_effect(blender, make_scene, square, lambert) -> None:
    white = make_scene(*square, lights=[sun()])
    grey = with_first(white, target=replace(white.target, materials=(replace(lambert, diffuse_color=(0.5, 0.5, 0.5)),)))
    first, second, third = (render(blender, scene).rgb for scene in (white, grey, white))
    assert np.allclose(second, first / 2, rtol=RADIOMETRY)
    assert np.array_equal(third, first)


def test_clear_dielectric_keeps_its_reflection_and_passes_the_rest(blender, make_scene, square, lambert) -> None:
    """Behind a black pane of opacity 1/4 and index 1.5 a glowing square keeps 3/4 of 1 - 4 % (Fresnel, head-on)."""
    points, faces = square
    glow = replace(lambert, path="/glow", diffuse_color=(0, 0, 0), emissive_color=(10.0,) * 3)
    pane = Material(path="/pane", diffuse_color=(0, 0, 0), opacity=0.25, roughness=0.0)
    scene = make_scene(
        np.concatenate([points, points + np.array([0, 0, 0.5])]),
        np.concatenate([faces, faces + 4]),
        materials=[pane, glow],
        face_material=[0, 0, 1, 1],
        t=(0, 0, 6),
    )
    assert inner(render(blender, scene, samples=64)).mean() == pytest.approx(10 * 0.75 * 0.96, rel=NOISE)


def test_sample_count_takes_effect_by_itself(blender, noisy) -> None:
    """With its data kept, Blender has been seen to ignore a sample count that changed alone."""
    few, many = render(blender, noisy, samples=1).rgb, render(blender, noisy, samples=16).rgb
    again = render(blender, noisy, samples=1).rgb
    truth = render(blender, noisy, samples=64, seed=9).rgb
    assert np.array_equal(few, again)
    assert np.square(many - truth).mean() < np.square(few - truth).mean() / 4


def test_many_samples_leave_nothing_behind(blender, make_scene, square, speedplus) -> None:
    """A render of more than 256 samples is not felt by the next."""
    camera = replace(speedplus, width=16, height=10, fx=20.0, fy=20.0, cx=8.0, cy=5.0)
    scene = make_scene(*square, camera=camera, lights=[sun((0.5, 0, 1), angle=1.0)])
    first = render(blender, scene, samples=5).rgb.tobytes()
    render(blender, scene, samples=1000)
    assert render(blender, scene, samples=5).rgb.tobytes() == first


def test_seed_takes_effect_by_itself_and_only_as_noise(blender, noisy) -> None:
    one, two = (
        render(blender, noisy, samples=16, seed=1).rgb,
        render(blender, noisy, samples=16, seed=2).rgb,
    )
    assert not np.array_equal(one, two)
    assert one.mean() == pytest.approx(two.mean(), rel=NOISE)
    assert np.array_equal(one, render(blender, noisy, samples=16, seed=1).rgb)


def test_frames_do_not_depend_on_their_order(blender, noisy, make_scene, square) -> None:
    other = make_scene(*square, lights=[sun((0.6, 0, 0.8))])
    first = render(blender, noisy, samples=4).rgb.tobytes()
    render(blender, other, samples=2, seed=5)
    blender.visibility(other)
    assert render(blender, noisy, samples=4).rgb.tobytes() == first
    blender.visibility(noisy)
    assert render(blender, noisy, samples=4).rgb.tobytes() == first


def test_a_pixel_averages_its_own_square(blender, make_scene, square, speedplus) -> None:
    """A white square whose left edge leaves three quarters of a column of pixels to it."""
    camera = replace(speedplus, fx=100.0, fy=100.0, distortion=(0.0,) * 5)
    scene = make_scene(*square, camera=camera, t=(0.01, 0, 4), lights=[sun()])  # from column 96 - 25 + 0.25
    region, rgb = scene.region, render(blender, scene, samples=64).rgb
    column = rgb[20 - region.y0 + 20 : 80 - region.y0, 71 - region.x0]
    assert column.mean() == pytest.approx(0.75 * 1361 / np.pi, rel=NOISE)


def test_region_is_cut_from_the_same_picture(blender, noisy) -> None:
    vars(noisy)["picture_region"] = noisy.camera.frame
    whole = render(blender, noisy, samples=4).rgb
    vars(noisy)["picture_region"] = box = Region(x0=50, y0=20, x1=131, y1=97)
    assert np.array_equal(render(blender, noisy, samples=4).rgb, whole[box.slices])


def test_range_does_not_change_the_light(blender, noisy) -> None:
    """From 1,000 km through a lens as much longer, the picture is that of 1,000 m, up to its noise."""
    camera, pose = noisy.camera, noisy.T_cam_body
    pictures = []
    for range_m in (1e3, 1e6):
        k = range_m / 4
        lens = replace(camera, fx=camera.fx * k, fy=camera.fy * k, distortion=(0.0,) * 5)
        moved = replace(pose, translation=np.array([0, 0, range_m]))
        pictures.append(render(blender, with_first(replace(noisy, camera=lens), T_cam_body=moved), samples=16).rgb)
    assert pictures[0].shape == pictures[1].shape
    assert np.square(pictures[0] - pictures[1]).mean() < NOISE**2 * np.square(pictures[0]).mean()


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.3, -0.5, 0.2)])
def test_suns_shine_along_their_direction(direction) -> None:
    direction = np.asarray(direction) / np.linalg.norm(direction)
    rotation = shining_along(direction)
    assert np.allclose(rotation @ rotation.T, np.eye(3))
    assert np.linalg.det(rotation) == pytest.approx(1)
    assert np.allclose(rotation @ (0, 0, -1), direction)


@pytest.mark.parametrize("tilt", [0.0, 1e-6, 1e-5, 1e-3])
@pytest.mark.parametrize("axis", [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, 1)])
def test_blenders_suns_do_too_where_euler_angles_lock(blender, axis, tilt) -> None:
    """To float32's rounding: through Euler angles these were up to 5e-5 rad off."""
    import bpy

    direction = np.asarray(axis) + tilt * np.array([0.3, 0.5, -0.7])
    direction /= np.linalg.norm(direction)
    parent = bpy.data.objects.new("parent", None)
    sun = Sun(parent)
    bpy.context.scene.collection.objects.link(sun.object)
    sun.show(DistantLight(path="/sun", direction_cam=tuple(direction), irradiance=(1, 1, 1)))
    bpy.context.view_layer.update()
    shining = T_USDCAM_CAM.rotation.T @ -np.array(sun.object.matrix_world)[:3, 2]
    sun.remove()
    bpy.data.objects.remove(parent)
    np.testing.assert_allclose(shining, direction, atol=2e-7)


@pytest.mark.parametrize(
    "values",
    [
        {"roughness": 1.5},
        {"diffuse_color": (0.5, np.nan, 0.5)},
        {"diffuse_color": (2.0, 0.5, 0.5)},
        {"emissive_color": (-1.0, 0.0, 0.0)},
        {"ior": 0.5},
        {"use_specular_workflow": True, "specular_color": (1.5, 1.0, 1.0)},
        {"opacity": Primvar(name="nowhere")},
        {"normal": (0.6, 0.0, 0.8)},
    ],
)
def test_what_cannot_be_drawn_is_named(blender, make_scene, square, lambert, values) -> None:
    scene = make_scene(*square, materials=[Material(path="/World/Looks/Odd", **values)])
    with pytest.raises(UnsupportedError, match="/World/Looks/Odd"):
        render(blender, scene)
    assert (blender.visibility(scene).face >= 0).any()  # labels need no material
    plain = replace(with_first(scene, target=replace(scene.target, materials=(lambert,))), lights=(sun(),))
    assert inner(render(blender, plain)) == pytest.approx(1361 / np.pi, rel=RADIOMETRY)


@pytest.mark.parametrize(
    "values",
    [{"irradiance": (-1.0, 1, 1)}, {"irradiance": (np.nan, 1, 1)}, {"angle": 4.0}, {"direction_cam": (0, 0, 2.0)}],
)
def test_lights_that_are_no_sun_are_named(blender, make_scene, square, values) -> None:
    with pytest.raises(UnsupportedError, match="/Sun"):
        render(blender, make_scene(*square, lights=[replace(sun(), **values)]))


def test_bands_are_cut_from_the_same_picture(blender, make_scene, needles, speedplus, monkeypatch) -> None:
    """However the region is cut into renders, every pixel is the same, bit for bit; partly out of the frame too."""
    for t in ((0.0, 0.0, 3.0), (0.5, 0.3, 2.5)):
        scene = make_scene(*needles, camera=speedplus, q=(0.5, -0.3, 0.7, 0.2), t=t, lights=[sun()])
        pictures = []
        for cost in (1e18, 0.0):  # one band; as many as there are
            monkeypatch.setattr("spin_usd.renderers.crop.BAND_COST_SAMPLES", cost)
            pictures.append((blender.visibility(scene).face, blender.radiance(scene, Effort(samples=3), seed=5).rgb))
        assert (pictures[0][0] >= 0).any()
        assert np.array_equal(pictures[0][0], pictures[1][0])
        assert np.array_equal(pictures[0][1], pictures[1][1])


def test_a_speck_at_a_pixels_centre_is_hit_as_often_as_its_area_says(blender, make_scene, square, speedplus) -> None:
    """But for Cycles' first ray, which always goes there: it is one ray more."""
    samples, side_px, z = 1 << 16, 0.004, 1000.0
    camera = replace(speedplus, cx=95.5, cy=59.5)
    half = side_px / 2 / camera.fx * z
    hits = (
        samples * render(blender, make_scene(half * square[0], square[1], camera=camera, t=(0, 0, z)), samples).coverage
    )
    assert hits.sum() == pytest.approx(1 + samples * side_px**2, abs=FEW)
