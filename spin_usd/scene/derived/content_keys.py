"""Three keys per picture: content digests of at least all inputs of labels, render and image.

Equal keys mean equal results, so the work is done once. Equal results may have different keys: the radiance key also
contains unused inputs of a render: materials on no face, and inputs without effect.
"""

from collections import defaultdict
from dataclasses import dataclass
from functools import partial
from typing import Any

from spin_usd.basics.arrays import digest
from spin_usd.basics.identity_memo import IdentityMemo
from spin_usd.geometry.transform import Transform
from spin_usd.scene.body import Body
from spin_usd.scene.content import content, key_of
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.derived.magnification import magnification
from spin_usd.scene.effort import CPU, Effort
from spin_usd.scene.light import AreaLight
from spin_usd.scene.scene import Scene, augmentation_and_camera
from spin_usd.scene.target import Target

VISIBILITY = "embree 3"  # determines the face of a pixel; the number grows when results may change
LIGHT = {"blender": "blender 2"}
"""Versions of renderers that once made other numbers of the same content; a version grows when that may happen
again."""
PLANETS = "planets 2"
"""Version of planets, likewise; it counts in pictures that have any."""
KEYS = ("geometry", "radiance", "exposure")
"""The names of the three keys: each decides all that those before it decide, and more."""


@dataclass(frozen=True, kw_only=True)
class RenderSettings:
    """The user's choices for a render; `seed` is the dataset's, `device` renders the light."""

    renderer: str
    effort: Effort
    seed: int
    device: str = CPU


@dataclass(frozen=True, kw_only=True)
class Keys:
    """The three keys of a picture, and the key of its record's data on the targets."""

    geometry: str
    """As `geometry_key`."""
    radiance: str
    """Inputs of the target's radiance in unit light: geometry, renderer, shading, materials, directions of light, depth
    of field, shutter, effort, seed and device; not strengths and colours of lights."""
    exposure: str
    """Inputs of the image's numbers: radiance, actual lights, background, optics, sensor and seed."""
    targets: str
    """Poses, motions, meshes and keypoints of all targets, also where no picture shows them."""


class KeyMaker:
    """Makes the keys of picture after picture: an object that is identical to the previous picture's is digested once.

    With `keep_poses` this includes poses identical to any earlier picture's, such as another variant's. Later pictures
    may have another seed: set `seed`.
    """

    def __init__(self, settings: RenderSettings, *, keep_poses: bool = False) -> None:
        self._settings, self._keep_poses = settings, keep_poses
        self.seed = settings.seed
        self._posed: dict[tuple[object, ...], tuple[str, str]] = {}
        self._effort = key_of(settings.effort)
        self._last: defaultdict[str, IdentityMemo[str]] = defaultdict(IdentityMemo)

    def keys(self, scene: Scene) -> Keys:
        """Return the keys of `scene`; they do not depend on the scenes before."""
        settings, frame, first = self._settings, scene.frame, scene.bodies[0]
        geometry, targets = self._of_pose(scene)
        motion = scene.shutter and [scene.shutter, first.poses]
        blur = content([scene.thin_lens, motion]) if scene.blurred else None
        shading = [first.target.mesh.shading_key, self._materials(first.target), self._unit_light(scene), blur]
        if scene.several:  # invisible ones are seen in reflections, and cast shadows
            shading += [[placed(body), self._shading(body)] for body in scene.bodies]
        elsewhere = [settings.device] if settings.device != CPU else []  # which rounds, and adds up, in other ways
        fine = [f"magnified {by}"] if (by := magnification(scene)) > 1 else []
        how = [LIGHT.get(settings.renderer, settings.renderer), self._effort, self.seed, *elsewhere, *fine]
        radiance = digest([geometry, shading, how, frame.name])
        parts = (scene.lights, scene.environment, scene.optics, scene.sensor)
        taking = [self._last[str(i)].of((part,), partial(key_of, part)) for i, part in enumerate(parts)]
        behind = [PLANETS] if scene.environment.planets else []
        exposure = digest([radiance, taking, frame.variant, *behind])
        return Keys(geometry=geometry, radiance=radiance, exposure=exposure, targets=targets)

    def _of_pose(self, scene: Scene) -> tuple[str, str]:
        """Return the keys that poses, shapes and camera decide: of the geometry, and of the targets."""
        if scene.several or not self._keep_poses:
            return geometry_key(scene), self._targets(scene)
        (body,) = scene.bodies
        own = body.target.mesh.key, body.target.cut_out_key, self._keypoints(body.target)
        moves = body.motion.key if body.motion else ""
        numbers = tuple(_numbers(scene))
        of = (body.T_cam_body, moves, *own, scene.camera.key, scene.rig, scene.range_finder, numbers)
        if of not in self._posed:
            self._posed[of] = geometry_key(scene), self._targets(scene)
        return self._posed[of]

    def _shading(self, body: Body) -> list[Any]:
        """Return the inputs of light from a body, and its motion."""
        return [body.target.mesh.shading_key, self._materials(body.target), content(body.poses)]

    def _materials(self, target: Target) -> str:
        last = self._last[f"materials of {target.path}"]
        return last.of((target,), lambda: digest([material.key for material in target.materials]))

    def _keypoints(self, target: Target) -> str:
        return self._last[f"keypoints of {target.path}"].of((target,), lambda: _keypoints_key(target))

    def _targets(self, scene: Scene) -> str:
        """Return the key of the record's data on the targets, except their names and data from pixels."""
        shown = [
            [body.id, *_pose(body.T_cam_body), body.target.mesh.key, self._keypoints(body.target)]
            for body in scene.targets
        ]
        more = [content(scene.rig)] if scene.rig else []
        more += [[body.id, body.motion.key] for body in scene.targets if body.motion]
        if scene.range_finder:
            more += [content(scene.range_finder), [placed(body) for body in scene.bodies]]
        return digest(scene.camera.key, shown, *more)

    def _unit_light(self, scene: Scene) -> str:
        """Return the key of the lights as rendered, and of the planets, which light the target too."""
        planets = scene.environment.planets
        shining = scene.environment.illuminating
        of: tuple[object, ...] = (scene.lights, planets, *(body.target for body in scene.bodies))
        if any(isinstance(light, AreaLight) for light in scene.lights):  # their share depends on how far they are
            of = (*of, scene.bodies[0].T_cam_body)
        return self._last["unit light"].of(
            of, lambda: key_of([in_unit_light(scene).scene.lights, shining, *([PLANETS] if shining else [])])
        )


def geometry_key(scene: Scene) -> str:
    """Digest the inputs of labels: mesh, parts, cut-outs, pose, camera, and the ray caster, which is the same for all
    renderers. Of several bodies only those in the frame count."""
    if not scene.several:
        target, pose = scene.bodies[0].target, scene.bodies[0].T_cam_body
        where = pose.rotation, pose.translation, scene.camera.key
        return digest(VISIBILITY, target.mesh.key, target.cut_out_key, *where, *_numbers(scene))
    each = zip(scene.bodies, scene.part_offsets, scene.one_body_scenes, strict=True)
    shown = [[*placed(body), before] for body, before, one in each if not one.region.empty]
    return digest(VISIBILITY, shown, scene.camera.key)


def _numbers(scene: Scene) -> list[int]:
    """Return the target's id in labels, and the offset of its parts' ids; none where these are the usual ones."""
    numbers = [scene.bodies[0].id, scene.part_offsets[0]]
    return [] if numbers == [1, 0] else numbers


def placed(body: Body) -> list[Any]:
    """Return the inputs of a body's place in the picture, and its target id."""
    target = body.target
    return [body.id, target.mesh.key, target.cut_out_key, *_pose(body.T_cam_body)]


def _pose(T_cam_body: Transform) -> tuple[str, str]:
    return digest(T_cam_body.rotation), digest(T_cam_body.translation)


def render_seed(scene: Scene, settings: RenderSettings) -> int:
    """Return a 31-bit seed of this frame's render, and of its LiDAR: from the dataset's seed and the frame's name,
    never from its neighbours. It is the same in all variants, which may share both."""
    return _seed(settings.seed, scene.frame.name)


def picture_seed(scene: Scene, settings: RenderSettings) -> int:
    """Return a 31-bit seed of all that is sampled for this picture alone: the detector's noise."""
    return _seed(settings.seed, scene.frame.name, scene.frame.variant)


def background_seed(scene: Scene, settings: RenderSettings) -> int:
    """Return a 31-bit seed of the samples for the background, such as the choice of a back plate: all cameras see the
    same."""
    return _seed(settings.seed, scene.frame.name, augmentation_and_camera(scene.frame.variant)[0])


def _seed(*of: int | str) -> int:
    return int(digest(list(of))[:8], 16) & 0x7FFFFFFF


def _keypoints_key(target: Target) -> str:
    """Return the key of the keypoints, and of the shape's record if it is not as the model has it."""
    return digest(target.keypoints, *([target.shape.key] if target.shape else []))
