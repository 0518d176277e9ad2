"""The scenes and pictures of pairs: an open stage and a studio, with the fits so far."""

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.commands.gap.calls import Fitted, Pair
from spin_usd.picture.make_picture import Stopwatch, make_labels
from spin_usd.realism.camera_fit import fitted_optics, fitted_sensor
from spin_usd.realism.panels import light_around, names_around, scaled
from spin_usd.realism.picture_view import FULL
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.light import Light
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.scene.sensor import LUMINANCE, Sensor
from spin_usd.sensor.tone import unrounded
from spin_usd.studio.open_stage import OpenStage
from spin_usd.studio.picture_request import PictureRequest
from spin_usd.studio.studio import Studio

SAME_POSE = 1e-5  # of a matrix, and of the distance: lists round their numbers


class PairStudio:
    """Makes our picture of each pair."""

    def __init__(self, stage: str, variant: str, settings: RenderSettings) -> None:
        self.stage, self.studio = OpenStage(stage, variant=variant), Studio(settings)
        self.studio.open_renderer()

    def scene(self, pair: Pair, fitted: Fitted) -> Scene:
        """Read the scene of a pair, with the fits so far."""
        request = PictureRequest(
            frame=pair.frame,
            poses={} if pair.pose is None else {"": pair.pose},
            name=pair.name if pair.pose else None,
            values=dict(fitted.values),
        )
        scene = self.stage.scene(request)
        if fitted.lights is not None:
            lights = tuple(
                scaled(light, fitted.lights[light.path])
                for light in candidates(scene, fitted.panels, tuple(fitted.lights))
            )
            scene = replace(scene, lights=lights, sensor=replace(scene.sensor, auto_exposure=None))
        if fitted.camera is not None:
            sensor = fitted_sensor(scene.sensor, fitted.camera, fitted.level)
            sensor = sensor if fitted.lights is not None else replace(sensor, auto_exposure=scene.sensor.auto_exposure)
            scene = replace(scene, sensor=sensor, optics=fitted_optics(scene.optics, fitted.camera))
        return scene

    def has_own_pose(self, pair: Pair, scene: Scene) -> bool:
        """Return whether the scene of a pair has the pose of the stage's frame of that name."""
        if pair.frame is None or pair.pose is None:
            return pair.frame is not None
        own = self.stage.scene(PictureRequest(frame=pair.frame)).bodies[0].T_cam_body
        change = own.matrix - scene.bodies[0].T_cam_body.matrix
        return float(np.abs(change).max()) <= SAME_POSE * max(float(np.abs(own.translation).max()), 1.0)

    def radiance(self, scene: Scene) -> Radiance:
        return self.studio.maker.radiance(scene, self.studio.settings, Stopwatch())

    def parts(self, scene: Scene) -> NDArray[Any]:
        """Return (H, W) the part ids of the labels."""
        caster = self.studio.caster
        _, parts, _ = next(make_labels(scene, caster, ("segmentation",), Stopwatch(), caster))
        return parts

    def part_names(self, scene: Scene) -> dict[int, str]:
        return {
            offset + number: part.name
            for body, offset in zip(scene.bodies, scene.part_offsets, strict=True)
            for number, part in enumerate(body.target.parts, 1)
        }


def candidates(scene: Scene, panels: int, names: Collection[str] | None) -> tuple[Light, ...]:
    """Return the lights of these names that may shine: panels and Suns around the first target, or the scene's own."""
    if not panels:
        return tuple(light for light in scene.lights if names is None or light.path in names)
    centre, radius = centre_of(scene), scene.bodies[0].target.mesh.radius
    chosen = names_around(panels) if names is None else names
    return tuple(light_around(name, centre, radius, panels) for name in chosen)


def centre_of(scene: Scene) -> Float:
    first = scene.bodies[0]
    return first.T_cam_body.points(first.target.mesh.centre)


def linear_signal(grey: NDArray[Any], sensor: Sensor) -> Float:
    """Return the linear signal, 0 to 1, of grey in steps of 8 bits, as a detector of one channel writes it."""
    signal = np.linspace(0, 1, 4096)
    mono = replace(sensor, channels="mono", bit_depth=8)
    found: Float = np.interp(grey, unrounded(signal[:, None], mono)[:, 0], signal)
    return found


def grey_of(image: NDArray[Any], sensor: Sensor) -> NDArray[np.float32]:
    """Return a written picture (H, W) or (H, W, 3) in steps of 8 bits."""
    grey = image if image.ndim == 2 else image @ np.array(LUMINANCE)
    return np.asarray(grey * (FULL / (2**sensor.bit_depth - 1)), np.float32)
