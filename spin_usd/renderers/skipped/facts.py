"""Facts of a scene that decide how it must be rendered."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from spin_usd.arrays import Float
from spin_usd.geometry.blur import arc_height, circle_of_confusion, magnification, offset_blur_radius
from spin_usd.renderers.background.surroundings import Surroundings
from spin_usd.renderers.skipped.material_needs import SceneSurfaces, scene_surfaces
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import AreaLight, CylinderLight, DistantLight, DomeLight, Light
from spin_usd.scene.model import Scene


@dataclass(frozen=True, kw_only=True, eq=False)
class Facts:
    """Facts of a scene, each computed when it is asked for; those of a body's surfaces, once for all its pictures."""

    scene: Scene
    effort: Effort

    @cached_property
    def groups(self) -> LightGroups:
        return LightGroups.of(self.scene)

    @cached_property
    def surfaces(self) -> SceneSurfaces:
        return scene_surfaces(self.scene)

    @cached_property
    def surroundings(self) -> Surroundings | None:
        return Surroundings.of(self.scene)

    @cached_property
    def lights(self) -> tuple[int, ...]:
        """Indices of the lights with a place or a direction that shine on some of the bodies."""
        there, found = {group for body in self.scene.bodies for group in body.target.mesh.groups}, []
        for index in self.groups.placed:
            light = self.scene.lights[index]
            if not isinstance(light, DomeLight) and (light.lights is None or light.lights & there):
                found.append(index)
        return tuple(found)

    @cached_property
    def lamps(self) -> tuple[AreaLight, ...]:
        """The lights that rays can meet on their way."""
        lights = (self.scene.lights[index] for index in self.lights)
        return tuple(light for light in lights if isinstance(light, AreaLight))

    @cached_property
    def light_angle(self) -> float:
        """The angular diameter of the smallest light with a place or a direction, as a body sees it, radians."""
        return min((_angle(self.scene.lights[i], self.scene) for i in self.lights), default=np.inf)

    @property
    def tubes(self) -> bool:
        return any(isinstance(lamp, CylinderLight) for lamp in self.lamps)

    @property
    def dark(self) -> bool:
        """True where there is no light at all."""
        return not (self.lights or self.groups.surroundings or self.surfaces.emissive)

    @cached_property
    def alone(self) -> bool:
        """True where light that leaves the visible surface never meets a body again: there is but one, and it is
        convex."""
        if self.scene.several:
            return False
        scene, mesh = self.scene, self.scene.target.mesh
        nearest = min(float(np.linalg.norm(pose.points(mesh.centre))) for pose in scene.poses) - mesh.radius
        outside = nearest > (scene.thin_lens.radius if scene.thin_lens else 0.0)
        return outside and not self.surfaces.transparent and mesh.convex

    @cached_property
    def defocus_px(self) -> float:
        """The largest blur radius by the thin lens, pixels."""
        lens, places = self.scene.thin_lens, self._places
        if lens is None or places[..., 2].min() <= 0:
            return np.inf if lens else 0.0
        blur_radius = circle_of_confusion(places[..., 2], radius=lens.radius, focus=lens.focus)
        return float(blur_radius.max()) * magnification(self.scene.camera)

    @cached_property
    def motion_px(self) -> float:
        """The most by which a body is off its place in the middle of the shutter's time, pixels."""
        places = self._places
        if self.scene.shutter is None or places[..., 2].min() <= 0:
            return np.inf if self.scene.shutter else 0.0
        xy = places[..., :2] / places[..., 2:]
        way = np.linalg.norm(xy - xy[len(xy) // 2], axis=-1).max()
        aside = max(arc_height(one.target.mesh.radius, one.poses) for one in self.scene.one_body_scenes)
        return float(way + offset_blur_radius(places.reshape(-1, 3), aside).max()) * magnification(self.scene.camera)

    @cached_property
    def _places(self) -> Float:
        """(poses, N, 3) of points that span each body, camera frame, metres."""
        each = [[pose.points(one.target.mesh.hull) for pose in one.poses] for one in self.scene.one_body_scenes]
        return np.concatenate([np.stack(places) for places in each], axis=1)


def _angle(light: Light, scene: Scene) -> float:
    """Return the angular diameter of a light, as the body farthest from it sees it, radians; 0 for a point."""
    if isinstance(light, DistantLight):
        return light.angle
    if not isinstance(light, AreaLight) or not light.area:
        return 0.0
    centres = [body.T_cam_body.points(body.target.mesh.centre) for body in scene.bodies]
    far = max(float(np.linalg.norm(light.T_cam_light.translation - centre)) for centre in centres)
    return 2 * math.sqrt(light.facing_area / math.pi) / far
