"""Keys change exactly when what they decide can change."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.basics.arrays import digest
from spin_usd.scene.derived import content_keys
from spin_usd.scene.derived.content_keys import (
    VISIBILITY,
    KeyMaker,
    RenderSettings,
    geometry_key,
    picture_seed,
    render_seed,
)
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import Material
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.scene import FrameId
from spin_usd.scene.target import Part
from tests.cases.bodies import moved, three_bodies
from tests.cases.scenes import pose, scene, soup, target, with_first

SETTINGS = RenderSettings(renderer="raycast", effort=Effort(samples=4), seed=7)
METAL = Material(path="/m", metallic=0.1)
LIGHT = DistantLight(path="/sun", direction_cam=(0, 0, 1), irradiance=(1, 1, 1))


def base():
    points, faces, parts = soup(0, count=4)
    return scene(target(points, faces, parts=parts), lights=(LIGHT,))


def with_mesh(s, **changes):
    mesh = s.target.mesh
    names = ("points", "faces", "face_part", "face_material", "corner_normals")
    fields = {name: np.array(getattr(mesh, name)) for name in names} | changes
    return with_first(s, target=replace(s.target, mesh=Mesh(**fields)))


def nudged(array, by):
    array = np.array(array)
    array.flat[0] += by
    return array


# What each change must and must not reach: (geometry, radiance, exposure).
NOTHING, IMAGE, PICTURE, ALL = (False,) * 3, (False, False, True), (False, True, True), (True,) * 3
CHANGES = {
    "nothing, made again": (lambda s: with_mesh(s), NOTHING),
    "a path": (lambda s: with_first(s, target=replace(s.target, path="/U", name="U")), NOTHING),
    "a part's name": (lambda s: with_first(s, target=replace(s.target, parts=tuple(
        Part(id=p.id, path=p.path, name="other", class_name="other") for p in s.target.parts))), NOTHING),
    "a material's path": (lambda s: with_first(s, target=replace(s.target, materials=(Material(path="/n"),))), NOTHING),
    "a light's path": (lambda s: replace(s, lights=(replace(LIGHT, path="/other"),)), NOTHING),
    "time": (lambda s: replace(s, frame=replace(s.frame, time_code=3.0)), NOTHING),
    "index": (lambda s: replace(s, frame=replace(s.frame, index=5)), NOTHING),
    "exposure": (lambda s: replace(s, sensor=replace(s.sensor, exposure=2.0)), IMAGE),
    "channels": (lambda s: replace(s, sensor=replace(s.sensor, channels="rgb")), IMAGE),
    "bits": (lambda s: replace(s, sensor=replace(s.sensor, bit_depth=16)), IMAGE),
    "encoding": (lambda s: replace(s, sensor=replace(s.sensor, encoding="linear")), IMAGE),
    "variant (its noise)": (lambda s: replace(s, frame=replace(s.frame, variant="dim")), IMAGE),
    "frame name (its seed)": (lambda s: replace(s, frame=FrameId(index=0, name="g", time_code=0.0)), PICTURE),
    "a colour": (lambda s: with_first(s, target=replace(s.target, materials=(METAL,))), PICTURE),
    "a normal": (lambda s: with_mesh(s, corner_normals=nudged(s.target.mesh.corner_normals, 1e-3)), PICTURE),
    "irradiance": (lambda s: replace(s, lights=(replace(LIGHT, irradiance=(1, 1, 1.001)),)), IMAGE),
    "light direction": (lambda s: replace(s, lights=(replace(LIGHT, direction_cam=(0, 1, 0)),)), PICTURE),
    "an eclipse": (lambda s: replace(s, lights=(replace(LIGHT, obscuration=0.001),)), IMAGE),
    "a total eclipse": (lambda s: replace(s, lights=(replace(LIGHT, obscuration=1.0),)), PICTURE),
    "light angle": (lambda s: replace(s, lights=(replace(LIGHT, angle=0.01),)), PICTURE),
    "a second light": (lambda s: replace(s, lights=(LIGHT, LIGHT)), PICTURE),
    "a point, by one rounding": (lambda s: with_mesh(s, points=nudged(s.target.mesh.points, 1e-15)), ALL),
    "a face's order": (lambda s: with_mesh(s, faces=np.roll(s.target.mesh.faces, 1, axis=1)), ALL),
    "a part": (lambda s: with_mesh(s, face_part=s.target.mesh.face_part[::-1]), ALL),
    "position": (lambda s: with_first(s, T_cam_body=pose(t=(0, 0, np.nextafter(4, 5)))), ALL),
    "attitude": (lambda s: with_first(s, T_cam_body=pose(q=(1, 0, 0, 1e-9))), ALL),
    "focal length": (lambda s: replace(s, camera=replace(s.camera, fx=s.camera.fx + 1e-9)), ALL),
    "distortion": (lambda s: replace(s, camera=replace(s.camera, distortion=(0.0,) * 5)), ALL),
    "resolution": (lambda s: replace(s, camera=replace(s.camera, width=s.camera.width + 1)), ALL),
}  # fmt: skip


def keys(s, settings=SETTINGS):
    made = KeyMaker(settings).keys(s)
    assert made.geometry == geometry_key(s)
    return made.geometry, made.radiance, made.exposure


@pytest.mark.parametrize("change", CHANGES)
def test_a_maker_that_keeps_poses_makes_the_same_keys(change) -> None:
    """Also where the pose is the same object, and something else is not."""
    first, maker = base(), KeyMaker(SETTINGS, keep_poses=True)
    for each in (first, CHANGES[change][0](first), first):
        assert maker.keys(each) == KeyMaker(SETTINGS).keys(each)


@pytest.mark.parametrize("change", CHANGES)
def test_scene(change) -> None:
    make, expected = CHANGES[change]
    before, after = keys(base()), keys(make(base()))
    assert tuple(a != b for a, b in zip(after, before, strict=True)) == expected


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, NOTHING),
        ({"device": "cpu"}, NOTHING),
        ({"device": "optix"}, PICTURE),
        ({"effort": Effort(samples=5)}, PICTURE),
        ({"seed": 8}, PICTURE),
        ({"renderer": "blender"}, PICTURE),  # whose labels are the same
    ],
)
def test_settings(change, expected) -> None:
    before, after = keys(base()), keys(base(), replace(SETTINGS, **change))
    assert tuple(a != b for a, b in zip(after, before, strict=True)) == expected


def test_what_renders_otherwise_than_before_has_other_keys(monkeypatch) -> None:
    settings = replace(SETTINGS, renderer="blender")
    before = keys(base(), settings)
    monkeypatch.setattr(content_keys, "LIGHT", {"blender": "blender of another number"})
    assert tuple(a != b for a, b in zip(keys(base(), settings), before, strict=True)) == PICTURE


def test_seeds_differ_by_name_and_dataset_and_fit_blender() -> None:
    frames = [FrameId(index=0, name=f"img{i:06}", time_code=0.0) for i in range(40)]
    seeds = {render_seed(replace(base(), frame=frame), replace(SETTINGS, seed=j)) for frame in frames for j in range(5)}
    assert len(seeds) == 200
    assert all(0 <= seed < 2**31 for seed in seeds)


def test_variants_share_the_rays_but_not_the_noise() -> None:
    nominal, dim = base(), replace(base(), frame=replace(base().frame, variant="dim"))
    assert render_seed(nominal, SETTINGS) == render_seed(dim, SETTINGS)
    assert picture_seed(nominal, SETTINGS) != picture_seed(dim, SETTINGS)


class TestSeveralBodies:
    """Of several bodies a key holds all that its work depends on, and no more."""

    scene = three_bodies()
    outside = pose(t=(60, 0, 4))

    def test_one_target_alone_has_the_keys_that_it_always_had(self) -> None:
        alone = with_first(self.scene, others=())
        target, T = alone.target, alone.T_cam_body
        parts = (target.mesh.key, target.cut_out_key, T.rotation, T.translation, alone.camera.key)
        assert geometry_key(alone) == digest(VISIBILITY, *parts)

    @pytest.mark.parametrize("place", [1, 2])
    def test_a_body_that_moves_in_the_frame_changes_labels_and_light(self, place) -> None:
        before, after = (
            KeyMaker(SETTINGS).keys(self.scene),
            KeyMaker(SETTINGS).keys(moved(self.scene, place, pose(t=(0, 0, 3.5)))),
        )
        assert before.geometry != after.geometry
        assert before.radiance != after.radiance
        assert (before.targets != after.targets) == (place == 1)  # an occluder has no pose in the record

    def test_a_body_that_moves_where_nobody_sees_it_changes_no_label(self) -> None:
        out, farther = moved(self.scene, 1, self.outside), moved(self.scene, 1, pose(t=(70, 0, 4)))
        assert out.one_body_scenes[1].region.empty
        before, after = KeyMaker(SETTINGS).keys(out), KeyMaker(SETTINGS).keys(farther)
        assert before.geometry == after.geometry
        assert before.radiance != after.radiance  # it may cast a shadow
        assert before.targets != after.targets  # its pose is in the record

    def test_targets_that_change_places_change_labels(self) -> None:
        """A part is of another target then, though the pictures are the same."""
        first, second = self.scene.bodies[:2]
        swapped = replace(self.scene, bodies=(replace(second, id=1), replace(first, id=2), self.scene.bodies[2]))
        assert KeyMaker(SETTINGS).keys(swapped).geometry != KeyMaker(SETTINGS).keys(self.scene).geometry
