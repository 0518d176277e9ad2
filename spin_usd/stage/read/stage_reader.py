"""A composed stage at a time code, as a Scene."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType

from pxr import Usd, UsdGeom

from spin_usd.basics.arrays import digest
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.geometry.transform import Transform
from spin_usd.records.record import StageProvenance
from spin_usd.scene.derived.eclipse import eclipsed
from spin_usd.scene.event_sensor import EventSensor
from spin_usd.scene.finding import Finding
from spin_usd.scene.scene import NOMINAL, FrameId, OneBody, Scene, Shutter, augmentation_and_camera, variant_of
from spin_usd.stage.composition.images import Decoded, Images
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.composition.stage_hash import hash_and_files
from spin_usd.stage.read.body_readers import BodyReaders
from spin_usd.stage.read.camera import find_cameras, picture_variants
from spin_usd.stage.read.camera_reader import CameraReader, chosen_camera
from spin_usd.stage.read.clock import Clock
from spin_usd.stage.read.environment import EnvironmentReader
from spin_usd.stage.read.event_sensor import read_event_sensor
from spin_usd.stage.read.frames import read_frames, read_seed
from spin_usd.stage.read.lights import LightReader
from spin_usd.stage.read.numbering import Numbering
from spin_usd.stage.read.planet import refuse_hidden_target
from spin_usd.stage.read.shutter import Opening
from spin_usd.stage.usd.camera_space import CameraSpace
from spin_usd.stage.usd.root_metadata import Notes, metres_per_unit
from spin_usd.stage.usd.transforms import check_chain
from spin_usd.stage.usd.visibility import PROXIES

NO_IMAGES: Mapping[tuple[str, str], Decoded] = MappingProxyType({})


class StageReader:
    """Turns an opened stage into one Scene per frame; constant parts are read once and shared.

    frames: the stage's frames · clock: its seconds · seed: the dataset's · variants: all of its pictures' · variant:
    the selected one · camera_prim: the camera that takes its pictures · bodies: the targets in order of their ids, then
    the occluders · numbering: the ids of both, of all variants.
    Raises StageError for a stage that lacks what a picture needs, UnsupportedError for features not supported yet.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        variant: str = NOMINAL,
        stage: Usd.Stage | None = None,
        after: "StageReader | None" = None,
        images: Mapping[tuple[str, str], Decoded] = NO_IMAGES,
        check_images: bool = True,
        keep_poses: bool = False,
        numbering: Numbering | None = None,
    ):
        """Open the stage at `path`. `stage`: the same stage in that augmentation if it is open already, possibly with
        other sets' selections. `after`: a reader of another variant of the same files, whose decoded images are used
        again. `images`: decoded images of another reader of the same, unchanged files. `check_images`: refuse damaged
        images, which decodes all their bytes once; labels need none. `keep_poses`: keep the poses of all pictures for
        later readers, which use them if their variants do not change them. `numbering`: numbering of another reader of
        the same files, by default of `after`."""
        augmentation, self._camera_name = augmentation_and_camera(variant)
        self.stage: Usd.Stage = stage or open_stage(path, variant=augmentation)
        self.variant = variant
        self.variants = picture_variants(self.stage)
        self.metres = metres_per_unit(self.stage)
        self._cameras = find_cameras(self.stage)
        self.camera_prim: Usd.Prim = chosen_camera(
            self.stage, self._cameras, self._camera_name, variant=variant, variants=self.variants
        )
        self._notes = Notes()
        self.clock = Clock(self.stage)
        self._images: Images = Images(before=after._images.decoded if after else images, check=check_images)
        self._lights = LightReader(self.stage, self._images)
        self._environment = EnvironmentReader(self.stage, self._images)
        check_chain(self.camera_prim)
        known = numbering or (after.numbering if after else None)
        self.numbering: Numbering = known or Numbering.of(self.stage, augmentation)
        self.bodies: BodyReaders = BodyReaders(
            self.stage,
            self.camera_prim,
            metres=self.metres,
            clock=self.clock,
            numbering=self.numbering,
            group_of=self._lights.links.group_of,
            images=self._images,
            notes=self._notes,
            before=after.bodies if after else (),
            keep_poses=keep_poses,
        )
        self.frames: tuple[FrameId, ...] = read_frames(self.stage, variant)
        self.seed = read_seed(self.stage)
        self._camera = CameraReader(self.stage, self._cameras, self.camera_prim, self.metres, self.clock)

    def provenance(self, root: str) -> StageProvenance:
        """Return the provenance of a picture of this stage, whose root layer the record calls `root`."""
        return StageProvenance(root=root, hash=self.stage_hash, files=self.used_files, variants=self.variant_selections)

    @property
    def stage_hash(self) -> str:
        """Digest of the composed content with its variant, its camera's name included, wherever the stage lies."""
        return self._hash_and_files[0]

    @property
    def used_files(self) -> dict[str, str]:
        """Path relative to the root layer's folder -> sha256 (hex) of every layer and asset of this composition."""
        return self._hash_and_files[1]

    @cached_property
    def _hash_and_files(self) -> tuple[str, dict[str, str]]:
        found, files = hash_and_files(self.stage, Path(self.stage.GetRootLayer().realPath).parent)
        return digest([found, self._camera_name]) if self._camera_name else found, files

    @property
    def notes(self) -> tuple[Finding, ...]:
        """Warnings about features read so far that are rendered differently from the stage's opinions."""
        return self._notes.findings

    @property
    def decoded_images(self) -> dict[tuple[str, str], Decoded]:
        """The images decoded so far, by file and colour space."""
        return self._images.decoded

    @property
    def camera_path(self) -> str:
        """The path of the camera's prim."""
        return str(self.camera_prim.GetPath())

    @property
    def light_is_still(self) -> bool:
        """Return whether lights, and planets that could hide them, are the same in camera axes in all pictures."""
        return self._lights.still and self._environment.still and not self._camera.T_world_usdcam.varies

    def event_sensor(self, frame: FrameId) -> EventSensor | None:
        """Read the event camera's pixels; None if it is not an event camera."""
        return read_event_sensor(self.camera_prim, Usd.TimeCode(frame.time_code))

    def T_world_cam(self, frame: FrameId) -> Transform:
        """Return where the camera is in the middle of the frame's exposure, metres."""
        middle = Usd.TimeCode(self._camera.opening_at(frame.time_code).middle)
        return self._camera.T_world_usdcam.at(middle) @ T_USDCAM_CAM

    @cached_property
    def variant_selections(self) -> dict[str, str]:
        """The selection of each variant set: by its name for the default prim's, by "PATH{NAME}" for others."""
        default = self.stage.GetDefaultPrim()
        selections: dict[str, str] = {}
        for prim in Usd.PrimRange.Stage(self.stage, PROXIES):
            for name, variant in prim.GetVariantSets().GetAllVariantSelections().items():
                if variant:
                    selections[name if prim == default else f"{prim.GetPath()}{{{name}}}"] = variant
        return selections

    def scene(self, frame: FrameId, *, views: Collection[str] = (), instant: bool = False) -> Scene:
        """Read everything that a picture of `frame` needs, at the middle of its exposure, or at its own `instant`, and
        of the other `views` that some labels need those named, "next_frame" and "paired". The target is the same object
        as long as it does not change."""
        opening = Opening(middle=frame.time_code) if instant else self._camera.opening_at(frame.time_code)
        time = Usd.TimeCode(opening.middle)
        world = UsdGeom.XformCache(time)
        T_world_usdcam = self._camera.T_world_usdcam.at(time)
        camera = self._camera.camera.at(time)
        bodies = self.bodies.at(opening, world, focal=max(camera.fx, camera.fy))
        target, T_cam_body = bodies[0].target, bodies[0].T_cam_body
        space = CameraSpace(time=time, world=world, T_world_usdcam=T_world_usdcam, metres=self.metres)
        lights, environment = self._lights.read(space), self._environment.read(space)
        if environment.planets:
            centre = T_cam_body.points(target.mesh.centre)
            refuse_hidden_target(environment.planets, centre, target.mesh.radius)
            lights = eclipsed(lights, environment.planets, centre)
        scene = (Scene if len(bodies) > 1 else OneBody)(
            frame=frame,
            camera=camera,
            bodies=bodies,
            lights=lights,
            environment=environment,
            sensor=self._camera.sensor.at(time),
            optics=self._camera.optics.at(time),
            thin_lens=self._camera.thin_lens.at(time),
            shutter=Shutter(readout=opening.readout) if bodies[0].poses else None,
            next_frame=self._next_frame(frame) if "next_frame" in views else None,
            rig=self._camera.rig.at(time),
            lidar=self._camera.lidar.at(time),
            range_finder=self._camera.range_finder.at(time),
            classes=self.numbering.classes,
        )
        return replace(scene, paired=self._paired_view(scene, time)) if "paired" in views and scene.rig else scene

    def _next_frame(self, frame: FrameId) -> Scene | None:
        """Read the frame after `frame`; None of the last."""
        after = self.frames[frame.index + 1 : frame.index + 2]
        return self.scene(after[0]) if after else None

    def _paired_view(self, scene: Scene, time: Usd.TimeCode) -> Scene:
        """Return `scene`, which is of one of several cameras, as the camera that is paired with it sees it."""
        camera, T_pair_cam = self._camera.pair.at(time)
        bodies = (replace(body.still, T_cam_body=T_pair_cam @ body.T_cam_body) for body in scene.bodies)
        augmentation, _ = augmentation_and_camera(self.variant)
        other = "" if self._camera_name else list(self._cameras)[1]
        frame = replace(scene.frame, variant=variant_of(augmentation, other))
        return replace(scene, frame=frame, camera=camera, bodies=tuple(bodies), shutter=None)
