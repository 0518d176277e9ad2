"""The Blender renderer: Cycles, held open from frame to frame."""

import ctypes
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spin_usd.geometry.region import Region
from spin_usd.renderers.background.surroundings import Surroundings
from spin_usd.renderers.blender.bodies import BodySetup
from spin_usd.renderers.blender.camera import CameraSetup
from spin_usd.renderers.blender.cycles_settings import (
    LABEL,
    LABEL_LAYERS,
    ON_CPU,
    LightDevice,
    cycles_effort,
    cycles_scene,
)
from spin_usd.renderers.blender.denoiser import GUIDES, Denoiser
from spin_usd.renderers.blender.lamp import LightSetup
from spin_usd.renderers.blender.light_links import group_names, keep_apart, needs_groups, pass_name
from spin_usd.renderers.blender.material import label_material
from spin_usd.renderers.blender.nodes import assign
from spin_usd.renderers.blender.passes import Readback, face_indices, scratch_folder
from spin_usd.renderers.blender.world import WorldSetup
from spin_usd.renderers.camera_shader import View
from spin_usd.renderers.crop import label_bands, picture_bands
from spin_usd.renderers.device import DEVICES, shader_refusal
from spin_usd.renderers.skipped import Requirements, check_rule_names
from spin_usd.scene.derived.light_groups import LightGroups, emits
from spin_usd.scene.derived.nearest import nearest
from spin_usd.scene.effort import CPU, Effort
from spin_usd.scene.passes import Radiance, Visibility
from spin_usd.scene.scene import OneBody, Scene

Float32 = NDArray[np.float32]


class BlenderRenderer:
    """Cycles: light on the `device`, one of renderers.device.DEVICES, the rest on the CPU. Blender's state is the
    process's: a second renderer ends the one before it.

    Without `crop` it renders the whole frame for each picture instead of the bodies' bands, to the same result.
    `keep`: names in renderers.skipped.RULES of work that it does even where the scene does not need it, to
    measure that.
    """

    name = "blender"

    def __init__(self, *, device: str = CPU, crop: bool = True, keep: Collection[str] = ()) -> None:
        self._crop, self._keep = crop, check_rule_names(keep)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self._device = LightDevice(device)
        self._scratch = scratch_folder()
        folder = Path(self._scratch.name)
        # One Blender scene for both passes: alternating between two cost 30 ms of CPU more per frame.
        self._scene = cycles_scene()
        self._label_material = label_material()
        self._camera = CameraSetup(self._scene, folder)
        self._bodies = BodySetup(self._scene)
        self._lights = LightSetup(self._scene)
        self._world = WorldSetup(self._scene)
        self._readback = Readback(folder)
        self._denoiser = Denoiser(folder)
        self._kept: Any = None
        self._built: Any = None

    def visibility(self, scene: Scene) -> Visibility:
        """Return the face behind every pixel centre of `scene.region`: an independent check of the labels, which are
        not made of it. Raises RenderError, UnsupportedError."""
        return nearest(scene, [self._visibility(place, one) for place, one in enumerate(scene.one_body_scenes)])

    def _visibility(self, place: int, scene: OneBody) -> Visibility:
        """Return the face of the body at `place`, which `scene` has alone. Rays start at each body itself, so that its
        range costs no precision."""
        region = scene.region
        if region.empty:
            return Visibility(region=region, face=np.full(region.shape, -1, np.int32))
        view = View.sharp(scene)
        self._bodies.show_alone(place, scene, view, split=needs_groups(scene.lights))
        self._camera.aim(view, plain=view.plain)
        holes = bool(scene.target.cut_out_key)
        assign(self._scene.cycles, {**LABEL, "transparent_max_bounces": LABEL_LAYERS if holes else 0})
        self._scene.view_layers[0].material_override = None if holes else self._label_material
        self._split_light([], guided=False)
        if holes:
            self._bodies.show_face_ids(place, scene.target.materials)
        numbers = self._numbers(label_bands(scene), region)
        return Visibility(region=region, face=face_indices(numbers, scene.target.mesh.count))

    def radiance(self, scene: Scene, effort: Effort, *, seed: int) -> Radiance:
        """Linear radiance of `scene.picture_region`, W/m2/sr. Raises RenderError, UnsupportedError."""
        region, names = scene.picture_region, group_names(LightGroups.of(scene))
        if region.empty:
            return Radiance.dark(region, groups=len(names))
        required = Requirements.of(scene, effort, self._keep)
        if not self._device.proven:
            self._prove_device(scene, required)
        self._prepare(scene, required, effort, self._device.cycles)
        self._scene.cycles.seed = seed
        guided = bool(names) and effort.denoiser != "none"
        self._split_light(names, guided=guided)
        self._build_trees(scene)
        planes, coverage = self._planes(scene, effort, [*map(pass_name, names), *(GUIDES if guided else ())])
        groups, guides = planes[: len(names)], planes[len(names) :]
        noisy = Radiance(region=region, groups=groups, coverage=coverage)
        if not guided:
            return noisy
        return self._denoiser.denoised(noisy, guides, effort.denoiser, samples=effort.samples)

    def prepare(self, scene: Scene, effort: Effort, *, seed: int) -> tuple[Any, Sequence[Any]]:
        """Make Blender's scene that of `radiance`, with all light in one pass and the camera shader's text; return it,
        and the objects that hold the axes of each of Scene.bodies. Raises RenderError, UnsupportedError."""
        self._prepare(scene, Requirements.of(scene, effort, self._keep), effort, self._device.cycles)
        self._split_light([], guided=False)
        self._scene.cycles.seed = seed
        self._camera.keep_source()
        return self._scene, self._bodies.axes

    def versions(self) -> dict[str, str]:
        """Return names and versions of the software that decides the result."""
        return {"blender": f"{bpy.app.version_string} {bpy.app.build_hash.decode()}", **self._device.versions}

    def close(self) -> None:
        """Free the scene and the temporary folder."""
        self._scratch.cleanup()
        bpy.ops.wm.read_factory_settings(use_empty=True)

    def _prove_device(self, scene: Scene, required: Requirements) -> None:
        """Render the picture's coverage by one ray a pixel, on the CPU and on the device, which has to agree."""
        effort, seen = Effort(samples=1), []
        for device in (ON_CPU, self._device.cycles):
            self._prepare(scene, required, effort, device)
            self._split_light([], guided=False)
            seen.append(self._planes(scene, effort, [])[1])
        self._device.prove(*seen)

    def _prepare(self, scene: Scene, required: Requirements, effort: Effort, device: Mapping[str, Any]) -> None:
        """Set up Blender's scene as required, except the seed and the passes."""
        bodies, settings = self._bodies, {**cycles_effort(effort), **_settings(required), **device}
        view = View.blurred(scene)
        bodies.show(scene, view, split=needs_groups(scene.lights))
        shaded = self._camera.aim(view, plain=view.plain and not required.camera_shader)
        if shaded and not DEVICES[self._device.name].shaders:
            raise shader_refusal(self._device.name, scene)
        bodies.set_materials(scene)
        self._lights.set_light(scene.lights, required.lights, view, bodies.groups)
        self._world.set_light(Surroundings.of(scene) if LightGroups.of(scene).surroundings else None)
        self._forget((effort, settings, self._world.image, self._lights.made, bodies.count))
        assign(self._scene.cycles, settings)
        self._scene.view_layers[0].material_override = None

    def _numbers(self, bands: list[Region], region: Region) -> Float32:
        """Return (rows, columns) of `region`, rendered only in the `bands`, where the target can be; 0 elsewhere."""
        numbers = np.zeros(region.shape, np.float32)
        for band in bands:
            self._camera.crop(band)
            numbers[_inside(band, region)] = self._readback.picture(self._scene, band)[..., 0]
        return numbers

    def _split_light(self, names: Sequence[str], *, guided: bool) -> None:
        """Have Cycles render these light groups apart, and the denoiser's guides."""
        layer = self._scene.view_layers[0]
        keep_apart(layer, names)
        assign(layer.cycles, {"denoising_store_passes": guided})

    def _planes(self, scene: Scene, effort: Effort, passes: Sequence[str]) -> tuple[Float32, Float32]:
        """Return the `passes` (N, rows, columns, 3) of `scene.picture_region`, and its coverage; black and transparent
        where the target cannot be, which is not rendered."""
        region = scene.picture_region
        box = region if self._crop else scene.camera.frame
        planes, coverage = np.zeros((len(passes), *box.shape, 3), np.float32), np.zeros(box.shape, np.float32)
        for band in self._bands(scene, effort):
            self._camera.crop(band)
            inside = _inside(band, box)
            planes[:, *inside], coverage[inside] = self._readback.planes(self._scene, band, passes)
        cut = _inside(region, box)
        return planes[:, *cut], coverage[cut]

    def _bands(self, scene: Scene, effort: Effort) -> list[Region]:
        if not self._crop:
            return [scene.camera.frame]
        if effort.adaptive:
            return [scene.picture_region]  # a pixel's neighbours decide with it how many samples it takes
        return picture_bands(scene, samples=effort.samples)

    def _build_trees(self, scene: Scene) -> None:
        """Have Cycles build the trees of meshes that it has not kept, by one thread: a pixel is rendered for it. Where
        faces glow it builds them for each picture."""
        bodies = scene.one_body_scenes
        glow = any(emits(one.target) for one in bodies)
        built = (self._kept, needs_groups(scene.lights), [one.target.mesh for one in bodies])
        if glow or built != self._built:
            region = scene.picture_region
            pixel = Region(x0=region.x0, y0=region.y0, x1=region.x0 + 1, y1=region.y0 + 1)
            self._camera.crop(pixel)
            with one_thread():
                self._readback.picture(self._scene, pixel)
            self._built = built

    def _forget(self, kept: Any) -> None:
        """Make Cycles prepare all anew where effort, settings, the world's image, how often lights were made or how
        many bodies there are is not what was `kept`.

        Among the data that it keeps is a table of samples, which grew with a render of more than 256 and stayed so:
        renders of fewer then had other noise than without that one. And an image that comes after another, or after
        none, gave other noise than in a renderer just opened. So did lights that came after others, which it keeps in
        another order.
        """
        if self._kept not in (None, kept):
            assign(self._scene.render, {"use_persistent_data": False})
            assign(self._scene.render, {"use_persistent_data": True})
        self._kept = kept


def _settings(required: Requirements) -> dict[str, Any]:
    """Cycles' own settings for the requirements of a picture."""
    return {
        "use_light_tree": required.light_tree,
        "blur_glossy": required.filter_glossy,
    }


def _inside(band: Region, region: Region) -> tuple[slice, slice]:
    """Index of the band in an array of the region."""
    rows, columns = band.y0 - region.y0, band.x0 - region.x0
    return slice(rows, rows + band.height), slice(columns, columns + band.width)


# What global_control's own constructor and destructor call.
CREATE, DESTROY = (f"_ZN3tbb6detail2r1{name}ERNS0_2d114global_controlE" for name in ("6create", "7destroy"))
MOST_THREADS = 0  # oneTBB's global_control::max_allowed_parallelism


class GlobalControl(ctypes.Structure):
    """oneTBB's class of that name: what it controls, and its value."""

    _fields_ = (("value", ctypes.c_size_t), ("reserved", ctypes.c_ssize_t), ("parameter", ctypes.c_int))


@contextmanager
def one_thread() -> Iterator[None]:
    """Let oneTBB, by which Blender, Cycles and Embree share out work, use the calling thread alone, until the end; on
    Linux, for elsewhere its functions have other names."""
    if sys.platform != "linux":
        yield
        return
    control = ctypes.byref(GlobalControl(value=1, parameter=MOST_THREADS))
    _library()[CREATE](control)
    try:
        yield
    finally:
        _library()[DESTROY](control)


@cache
def _library() -> ctypes.CDLL:
    """Return Blender's copy of oneTBB."""
    return ctypes.CDLL(str(Path(bpy.utils.resource_path("LOCAL")).parent / "lib" / "libtbb.so.12"))
