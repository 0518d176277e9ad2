"""Instances cost their shape once, and neither label nor picture shows it: both renderers draw them as they draw the
same triangles made out one by one."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.renderers.crop import label_bands
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.derived.faces import corners_of, groups_of, materials_of, normals_of, parts_of, primvar_of
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Primvar
from tests.cases import scenes
from tests.cases.instanced import expanded, made_out, placed
from tests.cases.scenes import with_first

CAMERA = Camera(width=160, height=120, fx=150, fy=150, cx=80, cy=60)
WHITE = Material(path="/white", diffuse_color=(1, 1, 1), use_specular_workflow=True)
RED = Material(path="/red", diffuse_color=(0.6, 0.1, 0.1), use_specular_workflow=True)
SUN = DistantLight(path="/sun", direction_cam=(0.0, 0.6, 0.8), irradiance=(3, 3, 3), lights=frozenset({0}))
FLOAT32 = 1e-6
ROUNDING = 1e-12
SAME_LIGHT = 2e-3  # of the mean radiance: few of a picture's rays fall on the other side of an edge


@pytest.fixture
def scene():
    pose = scenes.pose(q=(0.95, 0.2, -0.1, 0.2), t=(0.1, 0, 3))
    return scenes.scene(placed(materials=(WHITE, RED)), camera=CAMERA, T_cam_body=pose)


def surface(label_pass, scene):
    return visible_surface(scene, label_pass.visibility(scene))


def assert_same_labels(scene, label_pass) -> None:
    mine, theirs = surface(label_pass, scene), surface(label_pass, expanded(scene))
    assert len(mine.rows) > 2000
    assert len(np.unique(mine.part)) == 11
    for name in ("rows", "columns", "part", "z", "body", "face"):
        np.testing.assert_array_equal(getattr(mine, name), getattr(theirs, name))


def test_faces_are_those_of_the_mesh_made_out(scene) -> None:
    mesh = scene.target.mesh
    other = made_out(mesh)
    face = np.random.default_rng(0).permutation(mesh.count)
    np.testing.assert_array_equal(corners_of(mesh, face), other.points[other.faces[face]])
    np.testing.assert_array_equal(parts_of(mesh, face), other.face_part[face])
    np.testing.assert_array_equal(materials_of(mesh, face), other.face_material[face])
    np.testing.assert_array_equal(groups_of(mesh, face), other.face_group[face])
    np.testing.assert_array_equal(primvar_of(mesh, "shade", face), other.primvars["shade"][face])
    np.testing.assert_allclose(normals_of(mesh, face), other.corner_normals[face], atol=FLOAT32)


def test_extent_is_that_of_the_mesh_made_out(scene) -> None:
    mesh = scene.target.mesh
    other = made_out(mesh)
    np.testing.assert_array_equal(mesh.centre, other.centre)
    assert mesh.radius == other.radius
    assert mesh.groups == other.groups == {0, 1}
    for along in np.random.default_rng(0).normal(size=(50, 3)):
        assert (mesh.hull @ along).max() == pytest.approx((other.points @ along).max(), rel=ROUNDING)


def test_keys_tell_places_apart(scene) -> None:
    mesh = scene.target.mesh
    each = mesh.instances[0]
    moved = each.matrices.copy()
    moved[2, 0, 3] = np.nextafter(moved[2, 0, 3], np.inf)
    key = {mesh.key}
    for change in ({"matrices": moved}, {"parts": each.parts[::-1]}, {"matrices": each.matrices[::-1]}):
        key.add(replace(mesh, instances=(replace(each, **change),)).key)
    assert len(key) == 4
    regrouped = replace(mesh, instances=(replace(each, groups=each.groups[::-1] * 0),))
    assert regrouped.key == mesh.key
    assert regrouped.shading_key != mesh.shading_key


def test_labels_and_preview_are_those_of_the_mesh_made_out(scene) -> None:
    assert_same_labels(scene, EmbreeCaster())
    lit = replace(scene, lights=(SUN,))
    mine, theirs = (RaycastRenderer().radiance(s, Effort(samples=2), seed=3) for s in (lit, expanded(lit)))
    np.testing.assert_array_equal(mine.coverage, theirs.coverage)
    np.testing.assert_allclose(mine.rgba, theirs.rgba, atol=FLOAT32)


def test_bands_hold_all_that_is_seen(scene) -> None:
    there = EmbreeCaster().visibility(scene)
    inside = np.zeros(there.face.shape, bool)
    for band in label_bands(scene):
        rows, columns = band.y0 - there.region.y0, band.x0 - there.region.x0
        inside[rows : rows + band.height, columns : columns + band.width] = True
    assert not (there.face[~inside] >= 0).any()


@pytest.mark.parametrize("holes", [False, True])
def test_blender_holds_one_mesh_and_draws_the_same(scene, blender, holes) -> None:
    import bpy

    if holes:
        cut = replace(RED, opacity=Primvar(name="shade"), opacity_threshold=0.5)
        scene = with_first(scene, target=replace(scene.target, materials=(WHITE, cut)))
    assert_same_labels(scene, blender)
    lit, effort = replace(scene, lights=(SUN,)), Effort(samples=8)
    theirs = blender.radiance(expanded(lit), effort, seed=3).rgba
    mine = blender.radiance(lit, effort, seed=3).rgba
    shown = [each for each in bpy.data.objects if each.type == "MESH" and each.visible_camera]
    assert len(shown) == 6
    assert len({each.data for each in shown}) == 2  # the plate's and the ball's
    assert np.abs(mine - theirs).mean() < SAME_LIGHT * theirs.mean()
