"""A mesh's unseen twin: the same picture but for rounding, no new tree for another pose, and no more light."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import Material
from tests.cases.scenes import SMALL, boxes, pose, with_first

SAMPLES = 16
RAYS = 4  # of a picture's 25,000 that pass an edge, or graze a face, within the rounding of float32
ROUNDING = 1e-5  # of each pixel, of those that hit the same: sums of float32 numbers that are rounded some 20 times
TURNS = ((1, 0, 0, 0), (0.36, 0.48, -0.64, 0.48), (0.9, -0.1, 0.3, 0.3))
RANGES = {"near": (4.0, 1.0), "centimetres": (0.05, 0.01), "10,000 km": (1e7, 1.0)}  # away, size, metres
MATT = Material(path="/matt", diffuse_color=(0.8, 0.8, 0.8), use_specular_workflow=True)
GLOWING = replace(MATT, emissive_color=(3.0, 2.0, 1.0))
SUN = DistantLight(path="/sun", direction_cam=(0.6, 0.0, 0.8), irradiance=(np.pi,) * 3)
LINKED = replace(SUN, lights=frozenset({0}), shadowed_by=frozenset({1}))


@pytest.fixture(scope="module")
def made(make_scene, needles):
    """A scene of needles, a ball and a plate in two face groups, of one material."""

    def make(away, size, *, light=SUN, mesh=None):
        points, faces = mesh or needles
        focal = 35.0 * away / size
        camera = replace(SMALL, width=64, height=48, fx=focal, fy=focal, cx=32, cy=24, distortion=(0.0,) * 5)
        groups = (np.arange(len(faces)) % 2).astype(np.uint16)
        fixed = {"camera": camera, "materials": [MATT], "lights": [light], "face_group": groups}
        return make_scene(size * points, faces, q=TURNS[1], t=(0.02 * size, -0.03 * size, away), **fixed)

    return make


@pytest.fixture(scope="module")
def scenes(made):
    """Far and near, turned about, of split meshes and of few faces."""
    found = {name: made(*of) for name, of in RANGES.items()}
    for turn in TURNS:
        found[f"turned {turn}"] = with_first(found["near"], T_cam_body=pose(turn))
    return found | {"linked": made(4.0, 1.0, light=LINKED), "few faces": made(4.0, 1.0, mesh=boxes())}


@pytest.fixture(scope="module")
def drawn(scenes, blender):
    """The radiance of each scene, without twins, as if all of it glowed, and with them."""
    paired = {name: blender.radiance(scene, Effort(samples=SAMPLES), seed=1) for name, scene in scenes.items()}
    with pytest.MonkeyPatch.context() as patch:
        for where in ("renderer", "bodies"):
            patch.setattr(f"spin_usd.renderers.blender.{where}.emits", lambda target: True)
        return {
            name: (blender.radiance(scene, Effort(samples=SAMPLES), seed=1), paired[name])
            for name, scene in scenes.items()
        }


@pytest.mark.parametrize("name", [*RANGES, *(f"turned {turn}" for turn in TURNS), "linked", "few faces"])
def test_the_picture_is_that_without_twins(drawn, name) -> None:
    alone, paired = drawn[name]
    assert not np.array_equal(paired.rgb, alone.rgb)
    assert (alone.coverage > 0).sum() > 300
    assert np.abs(paired.coverage - alone.coverage).sum() <= RAYS / SAMPLES
    apart = np.abs(paired.rgb - alone.rgb)[..., 1]
    assert apart[apart > ROUNDING * alone.rgb.max()].sum() <= RAYS / SAMPLES * alone.rgb.max()


def test_another_pose_takes_no_tree_anew(blender, made) -> None:
    import bpy

    told: list[str] = []
    scene = made(4.0, 1.0)
    bpy.app.handlers.render_stats.append(lambda line, _: told.append(line))
    blender.radiance(scene, Effort(samples=1), seed=0)
    first = [line for line in told if "Geometry BVH" in line]
    told.clear()
    blender.radiance(with_first(scene, T_cam_body=pose(TURNS[2])), Effort(samples=1), seed=0)
    bpy.app.handlers.render_stats.pop()
    assert first
    assert any("Scene BVH" in line for line in told)
    assert not any("Geometry BVH" in line for line in told)


def test_what_glows_has_no_twin_and_leaves_no_trace(blender, made) -> None:
    """A mesh whose material glows in every other picture is drawn as by a renderer that knows no other."""
    import bpy

    matt = made(4.0, 1.0)
    glowing = with_first(matt, target=replace(matt.target, materials=(GLOWING,)))
    found = []
    for scene in (matt, glowing, matt, glowing):
        found.append(blender.radiance(scene, Effort(samples=SAMPLES), seed=1).groups)
        meshes = [each for each in bpy.data.objects if each.type == "MESH" and not each.hide_render]
        assert len(meshes) == (1 if scene is glowing else 2)
        assert len({each.data for each in meshes}) == 1
    np.testing.assert_array_equal(found[2], found[0])
    np.testing.assert_array_equal(found[3], found[1])
