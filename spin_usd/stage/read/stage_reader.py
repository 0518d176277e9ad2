"""A composed stage at a time code, as a Scene."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from types import MappingProxyType

from pxr import Usd, UsdGeom

from spin_usd.arrays import digest
from spin_usd.errors import StageError, UnknownPictureError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.body import OCCLUDER, Body
from spin_usd.scene.derived.eclipse import eclipsed
from spin_usd.scene.finding import Finding
from spin_usd.scene.model import NOMINAL, FrameId, Scene, Shutter, augmentation_and_camera, variant_of
from spin_usd.scene.target import Target
from spin_usd.stage.composition.images import Decoded, Images
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.composition.stage_hash import hash_and_files
from spin_usd.stage.read.bodies.target import TargetReader
from spin_usd.stage.read.body_reader import BodyReader
from spin_usd.stage.read.camera import find_cameras, picture_variants, read_camera
from spin_usd.stage.read.environment import EnvironmentReader
from spin_usd.stage.read.frames import read_frames, read_seed
from spin_usd.stage.read.lights import LightReader
from spin_usd.stage.read.numbering import Numbering
from spin_usd.stage.read.optics import read_optics, read_thin_lens
from spin_usd.stage.read.planet import refuse_hidden_target
from spin_usd.stage.read.rig import lidar_in_time, range_finder_in_time, rig_in_time
from spin_usd.stage.read.sensor import read_sensor
from spin_usd.stage.read.shared_poses import SharedPoses
from spin_usd.stage.read.shutter import Opening, read_opening, read_poses
from spin_usd.stage.usd.camera_space import CameraSpace
from spin_usd.stage.usd.root_metadata import METRES_PER_UNIT, UNITS, Notes, root_number
from spin_usd.stage.usd.time_variation import CachedIfConstant, moves, varying
from spin_usd.stage.usd.transforms import Placement, check_chain, placement
from spin_usd.stage.usd.visibility import PROXIES

# Prefixes of the camera's attributes on which only the sensor, the optics, the shutter or the focus depends.
SENSOR = ("exposure", "spin:sensor:")
OPTICS = ("spin:optics:",)
SHUTTER = ("shutter:", "spin:shutter:")
FOCUS = ("fStop", "focusDistance")
NO_IMAGES: Mapping[tuple[str, str], Decoded] = MappingProxyType({})


class StageReader:
    """Turns an opened stage into one Scene per frame; whatever does not change is read once and shared.

    frames: the stage's frames · seed: the dataset's · variants: all of its pictures' · variant: the selected one ·
    camera_prim: the camera that takes its pictures · bodies: the targets in order of their ids, then the occluders ·
    numbering: the ids of both, of all variants.
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
        """Open the stage at `path`. `stage`: the same stage in that augmentation if it is open already, perhaps with
        other sets' selections. `after`: a reader of another variant of the same files, whose decoded images are used
        again. `images`: decoded ones of another reader, of files that have not changed since. `check_images`: refuse
        damaged ones, which takes all their bytes to be decoded once; labels need none. `keep_poses`: keep the poses of
        all pictures for readers after this one, which take them where their variants do not change them. `numbering`:
        that of another reader of the same files; that of `after` unless given."""
        augmentation, self._camera_name = augmentation_and_camera(variant)
        self.stage: Usd.Stage = stage or open_stage(path, variant=augmentation)
        self.variant = variant
        self.variants = picture_variants(self.stage)
        self.metres = metres_per_unit(self.stage)
        self._cameras = find_cameras(self.stage)
        self.camera_prim: Usd.Prim = self._chosen_camera()
        self._notes = Notes()
        self._images: Images = Images(before=after._images.decoded if after else images, check=check_images)
        self._lights = LightReader(self.stage, self._images)
        self._environment = EnvironmentReader(self.stage, self._images)
        check_chain(self.camera_prim)
        known = numbering or (after.numbering if after else None)
        self.numbering: Numbering = known or Numbering.of(self.stage, augmentation)
        self.bodies: tuple[BodyReader, ...] = self._find_bodies(after.bodies if after else (), keep_poses)
        self.frames: tuple[FrameId, ...] = read_frames(self.stage, variant)
        self.seed = read_seed(self.stage)
        self._read_camera_parts()
        self._lidar = lidar_in_time(self.stage, self.camera_prim, self.metres)
        self._range_finder = range_finder_in_time(self.stage, self.camera_prim, self.metres)

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
        """Warnings about what was read so far and is rendered differently from what the stage authors."""
        return self._notes.findings

    @property
    def decoded_images(self) -> dict[tuple[str, str], Decoded]:
        """The images that were decoded so far, by file and colour space."""
        return self._images.decoded

    @property
    def camera_path(self) -> str:
        """The path of the camera's prim."""
        return str(self.camera_prim.GetPath())

    @property
    def light_is_still(self) -> bool:
        """Return whether lights, and planets that could hide them, are the same in camera axes in all pictures."""
        return self._lights.still and self._environment.still and not self._T_world_usdcam.varies

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

    def scene(self, frame: FrameId, *, views: Collection[str] = ()) -> Scene:
        """Read everything that a picture of `frame` needs, at the middle of its exposure, and of the other `views` that
        some labels need those named, "next_frame" and "paired". The target is the same object as long as it does not
        change."""
        opening = self._opening_at(frame.time_code)
        time = Usd.TimeCode(opening.middle)
        world = UsdGeom.XformCache(time)
        T_world_usdcam = self._T_world_usdcam.at(time)
        bodies = self._bodies_at(opening, world)
        target, T_cam_body = bodies[0].target, bodies[0].T_cam_body
        space = CameraSpace(time=time, world=world, T_world_usdcam=T_world_usdcam, metres=self.metres)
        lights, environment = self._lights.read(space), self._environment.read(space)
        if environment.planets:
            centre = T_cam_body.points(target.mesh.centre)
            refuse_hidden_target(environment.planets, centre, target.mesh.radius)
            lights = eclipsed(lights, environment.planets, centre)
        scene = Scene(
            frame=frame,
            camera=self._camera.at(time),
            bodies=bodies,
            lights=lights,
            environment=environment,
            sensor=self._sensor.at(time),
            optics=self._optics.at(time),
            thin_lens=self._thin_lens.at(time),
            shutter=Shutter(readout=opening.readout) if bodies[0].poses else None,
            next_frame=self._next_frame(frame) if "next_frame" in views else None,
            rig=self._rig.at(time),
            lidar=self._lidar.at(time),
            range_finder=self._range_finder.at(time),
            classes=self.numbering.classes,
        )
        return replace(scene, paired=self._paired_view(scene, time)) if "paired" in views and scene.rig else scene

    def _next_frame(self, frame: FrameId) -> Scene | None:
        """Read the frame after `frame`; None of the last."""
        after = self.frames[frame.index + 1 : frame.index + 2]
        return self.scene(after[0]) if after else None

    def _paired_view(self, scene: Scene, time: Usd.TimeCode) -> Scene:
        """Return `scene`, which is of one of several cameras, as the camera that is paired with it sees it."""
        camera, T_pair_cam = self._pair.at(time)
        bodies = (replace(body.still, T_cam_body=T_pair_cam @ body.T_cam_body) for body in scene.bodies)
        augmentation, _ = augmentation_and_camera(self.variant)
        other = "" if self._camera_name else list(self._cameras)[1]
        frame = replace(scene.frame, variant=variant_of(augmentation, other))
        return replace(scene, frame=frame, camera=camera, bodies=tuple(bodies), shutter=None)

    def target_at(self, time_code: float) -> Target:
        """Read the first target alone at a time code, metres."""
        time = Usd.TimeCode(time_code)
        first = self.bodies[0]
        target = first.target_at(time, first.placed(time, UsdGeom.XformCache(time))[1])
        assert target  # else it was refused
        return target

    def whole_target_at(self, time_code: float) -> Target:
        """Read the first target alone at a time code, metres, with the surfaces that cannot be seen."""
        time, prim = Usd.TimeCode(time_code), self.bodies[0].prim
        scale = self.bodies[0].placed(time, UsdGeom.XformCache(time))[1]
        reader = TargetReader(
            prim=prim,
            parts=self.numbering.parts_of(prim),
            time=time,
            group_of=self._lights.links.group_of,
            images=self._images,
            notes=Notes(),
            whole=True,
        )
        return reader.read(scale * self.metres)

    def targets_at(self, time_code: float) -> dict[int, Target]:
        """Read all targets at a time code, metres, by their ids."""
        time = Usd.TimeCode(time_code)
        world = UsdGeom.XformCache(time)
        targets = (body for body in self.bodies if body.id != OCCLUDER)
        found = {body.id: body.target_at(time, body.placed(time, world)[1]) for body in targets}
        return {number: target for number, target in found.items() if target}

    def _find_bodies(self, before: Sequence[BodyReader], keep_poses: bool) -> tuple[BodyReader, ...]:
        """Find the targets and the occluders. `before`: those of a variant before, whose poses may be the same; with
        `keep_poses` they are kept for variants after this one. Raises as Numbering.in_order."""
        camera, numbering = self.camera_prim, self.numbering
        links, images, notes = self._lights.links, self._images, self._notes

        def open_reader(prim: Usd.Prim, time: Usd.TimeCode) -> TargetReader:
            parts = numbering.parts_of(prim)
            return TargetReader(prim=prim, parts=parts, time=time, group_of=links.group_of, images=images, notes=notes)

        make = partial(BodyReader, camera=camera, metres=self.metres, open_reader=open_reader, numbering=numbering)
        found = numbering.in_order(self.stage)
        if not keep_poses:
            return tuple(make(body) for body in found)
        known = [body.shared or SharedPoses() for body in before[: len(found)]]
        known += [SharedPoses() for _ in found[len(known) :]]
        return tuple(make(body, shared=poses) for body, poses in zip(found, known, strict=True))

    def _bodies_at(self, opening: Opening, world: UsdGeom.XformCache) -> tuple[Body, ...]:
        """Read the bodies that are visible in the middle of an exposure."""
        time = Usd.TimeCode(opening.middle)
        placed = [(reader, *reader.placed(time, world)) for reader in self.bodies]
        shapes = [(reader, pose, reader.target_at(time, scale)) for reader, pose, scale in placed]
        shown = [(reader, pose, target) for reader, pose, target in shapes if target]
        poses = read_poses(opening, [reader.pose_at for reader, _, _ in shown], self.camera_prim.GetPath())
        return tuple(
            Body(id=reader.id, target=target, T_cam_body=pose, poses=own, part_offset=reader.part_offset)
            for (reader, pose, target), own in zip(shown, poses, strict=True)
        )

    def _chosen_camera(self) -> Usd.Prim:
        """Find the camera that the variant names, else the first. Raises UnknownPictureError."""
        names = list(self._cameras)
        name = self._camera_name or names[0]
        if name not in names or self._camera_name == names[0]:
            do = f"choose among the variants {', '.join(self.variants)}"
            where = self.stage.GetRootLayer().realPath
            raise UnknownPictureError(f"has no variant '{self.variant}'", where=where, do=do)
        return self._cameras[name]

    def _read_camera_parts(self) -> None:
        """Set up how each part of the camera is read, and which of them can change in time.

        The readers refer to the prim, not to this object: a reference cycle would keep the stage open for a while.
        """
        prim, metres, names = self.camera_prim, self.metres, varying(self.camera_prim)
        lens = any(not name.startswith((*SENSOR, *OPTICS, *SHUTTER, *FOCUS)) for name in names)

        def varies(*prefixes: str) -> bool:
            return lens or any(name.startswith(prefixes) for name in names)

        def T_world_usdcam(time: Usd.TimeCode) -> Transform:
            return _placement(prim, UsdGeom.XformCache(time), "usdcam", metres).transform

        camera = CachedIfConstant(lens, partial(read_camera, prim))
        self._shutter_varies = varies(*SHUTTER)
        self._T_world_usdcam = CachedIfConstant(moves(prim), T_world_usdcam)
        self._camera = camera
        self._sensor = CachedIfConstant(varies(*SENSOR), partial(read_sensor, prim))
        self._optics = CachedIfConstant(varies(*OPTICS), lambda time: read_optics(prim, camera.at(time), time))
        self._thin_lens = CachedIfConstant(varies(*FOCUS), lambda time: read_thin_lens(prim, time, metres))
        self._opening: Opening | None = None
        self._rig, self._pair = rig_in_time(self._cameras, prim, metres)

    def _opening_at(self, time_code: float) -> Opening:
        """Return the exposure of the frame at `time_code`."""
        rows = self._camera.at(Usd.TimeCode(time_code)).height
        if self._shutter_varies:
            return read_opening(self.camera_prim, time_code, rows=rows)
        if self._opening is None:
            self._opening = read_opening(self.camera_prim, 0.0, rows=rows)
        return replace(self._opening, middle=time_code + self._opening.middle)


def _placement(prim: Usd.Prim, world: UsdGeom.XformCache, frame: str, metres: float) -> Placement:
    """Compute the placement of `prim` at the time of `world`, its frame named `frame`."""
    return placement(world.GetLocalToWorldTransform(prim), frame=frame, metres=metres, where=prim.GetPath())


def metres_per_unit(stage: Usd.Stage) -> float:
    """Return the length of a stage unit. Raises StageError for units or an up axis that are not valid."""
    where = stage.GetRootLayer().realPath
    metres = root_number(stage, METRES_PER_UNIT)
    if not UNITS[0] <= metres <= UNITS[1]:
        do = f"make it positive, {UNITS[0]:g} to {UNITS[1]:g}"
        raise StageError(f"metersPerUnit is {metres:g}", where=where, do=do)
    up = str(UsdGeom.GetStageUpAxis(stage))
    if up not in ("Y", "Z"):
        raise StageError(f"upAxis is '{up}'", where=where, do="set it to Y or Z")
    return metres
