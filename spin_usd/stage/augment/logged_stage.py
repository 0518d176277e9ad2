"""A stage that grows by a picture at a time: the requests to a running simulator, to render again.

It is in a folder of its own, over a copy of the simulated stage: time code i is picture i. Each picture is read from it
as for a later render. The shutter is an instant: the next picture is not known yet.
"""

import time
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdLux

from spin_usd import __version__
from spin_usd.errors import InputError
from spin_usd.files.sha256 import sha256_of
from spin_usd.scene.scene import FrameId, Scene, augmentation_and_camera
from spin_usd.stage.augment.attribute_change import BaseStage, ChangedAttribute, attribute_of
from spin_usd.stage.augment.edited_stage import PART, Editor, Edits
from spin_usd.stage.augment.lights import find_sun, sun_directions
from spin_usd.stage.augment.replace_files import REPEATED, repeat
from spin_usd.stage.augment.sampled_values import SampledValue, SampledValues, write_values
from spin_usd.stage.composition.copy_stage import copy_stage
from spin_usd.stage.composition.files import files_of
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.read.lights import find_lights
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.layer_file import export, layer_at, writing
from spin_usd.stage.usd.time_variation import CachedIfConstant, stated_attributes
from spin_usd.stage.usd.transforms import EDITED
from spin_usd.stage.usd.values import read
from spin_usd.stage.usd.visibility import PROXIES

ROOT, REQUESTS, STAGE = "dataset.usda", "requests.usdc", "stage"
SAVE_S = 2.0
SUN = "sun.direction"
BEFORE = -1.0  # time code: a sample there makes readers treat an attribute as one that changes


def start_log(stage: Path, log: Path, *, variant: str, seed: int | None) -> Path:
    """Copy the stage into the folder `log`, and write an empty log of it in that variant there, unless there is one;
    return the copy's root layer. Raises InputError if the folder contains anything else, or a log of another stage,
    variant or seed; and StageError, OutputError."""
    copied = log / STAGE / stage.name
    if (log / ROOT).is_file():
        _refuse_other(stage, log, variant, seed)
        return copied
    root = layer_at(copy_stage(stage, log / STAGE))
    for name, below in ((REQUESTS, []), (ROOT, [f"./{REQUESTS}", f"./{STAGE}/{stage.name}"])):
        layer = Sdf.Layer.CreateAnonymous(Path(name).suffix)
        repeat(root, layer, [each for each in REPEATED if below or each != "renderSettingsPrimPath"])
        layer.documentation = "What was asked of a simulator: time code i is picture i."
        layer.startTimeCode = layer.endTimeCode = 0.0
        layer.customLayerData = {schema.PROVENANCE: {"version": __version__, schema.LOG: True, "variant": variant}}
        layer.subLayerPaths = below
        export(layer, log / name)
    return copied


def _refuse_other(stage: Path, log: Path, variant: str, seed: int | None) -> None:
    """Raise InputError unless the log in the folder is of that stage, variant and seed, if given."""
    said = layer_at(log / ROOT).customLayerData.get(schema.PROVENANCE, {})
    if not said.get(schema.LOG):
        raise InputError("contains a stage, and no log", where=log, do="give a new folder, or the one of a log")
    for file in files_of(stage).found:
        copy = log / STAGE / file.relative_to(stage.resolve().parent)
        if not copy.is_file() or sha256_of(copy) != sha256_of(file):
            raise InputError(f"is a log of another stage than {stage}", where=log, do="begin another log")
    if said.get("variant") != variant:
        raise InputError(f"is a log of the variant {said.get('variant')}", where=log, do="begin another log")
    if seed is not None and seed != (logged := logged_seed(log)):
        raise InputError(f"is a log of the seed {logged}", where=log, do="leave the seed out, or begin another log")


def logged_seed(log: Path) -> int | None:
    """Return the seed of the log in the folder; None if it has no picture."""
    layer = layer_at(log / REQUESTS)
    path = Sdf.Path.absoluteRootPath.AppendChild(layer.defaultPrim).AppendProperty(schema.CAPTURE_SEED)
    found = layer.GetAttributeAtPath(path)
    return None if found is None else int(found.default)


class LoggedStage:
    """The log that `start_log` began in a folder; `base` reads the copied stage.

    `seed`: the dataset's; `parts`: names of parts of the first target that may move, besides parts that it moves.
    """

    def __init__(self, log: Path, base: StageReader, *, seed: int, parts: Sequence[str]) -> None:
        """Open it. Raises InputError for parts that the stage does not have."""
        self._log, self._base = log, base
        self._layer, self._editor = layer_at(log / REQUESTS), Editor(base, base.stage, base.frames[0])
        moved = {path.GetPrimPath() for path in _samples(self._layer) if path.name == f"{PART}{EDITED}"}
        self._parts = {name: np.eye(4) for name in (*parts, *self._editor.parts_at(moved))}
        self._reader: StageReader | None = None
        self._known = {str(attribute): attribute for attribute in (*_varying(base), *_logged(self._layer))}
        self._world = Sdf.CreatePrimInLayer(self._layer, base.stage.GetDefaultPrim().GetPath())
        times = self._world.path.AppendProperty(schema.CAPTURE_TIME)
        codes = self._layer.ListTimeSamplesForPath(times)
        self._last_time = max((self._layer.QueryTimeSample(times, code) for code in codes), default=-np.inf)
        frames = self._world.path.AppendProperty(schema.CAPTURE_FRAME)
        codes = self._layer.ListTimeSamplesForPath(frames)
        self._names = {self._layer.QueryTimeSample(frames, code).lower() for code in codes}
        self._last_save = time.monotonic()
        suns = [prim for prim in find_lights(base.stage) if prim.IsA(UsdLux.DistantLight)]
        self._sun = find_sun(self._editor.over) if suns else None
        with Sdf.ChangeBlock():
            self._author_start(seed)

    def _author_start(self, seed: int) -> None:
        """Author the values of all pictures."""
        for prim in self._editor.moved(Edits(poses=dict.fromkeys(self._editor.targets, np.eye(4)), parts=self._parts)):
            self._editor.hold(prim, self._layer)
        if self._sun:
            (change,) = self._editor.changes((SUN,))
            fixed = (SampledValue(attribute=attribute, value=value) for attribute, value in change.fixed)
            write_values(self._layer, SampledValues(attributes=tuple(fixed)))
        types, rolls = Sdf.ValueTypeNames, self._base.camera_prim.HasAPI(schema.SHUTTER_API)
        camera = Sdf.CreatePrimInLayer(self._layer, self._base.camera_prim.GetPath())
        for prim, name, of_type, value in (
            (self._world, schema.CAPTURE_SEED, types.Int64, seed),
            (self._world, schema.CAPTURE_SOURCE_FILE, types.String, Sdf.ValueBlock()),
            (self._world, schema.CAPTURE_TIME, types.Double, Sdf.ValueBlock()),
            (camera, UsdGeom.Tokens.shutterOpen, types.Double, 0.0),
            (camera, UsdGeom.Tokens.shutterClose, types.Double, 0.0),
            *([(camera, schema.SHUTTER_READOUT_TIME, types.Double, 0.0)] if rolls else []),
        ):
            attribute = prim.attributes.get(name) or Sdf.AttributeSpec(prim, name, of_type)
            attribute.default = value

    @property
    def count(self) -> int:
        """Number of pictures."""
        return len(self._layer.ListTimeSamplesForPath(self._world.path.AppendProperty(schema.CAPTURE_FRAME)))

    def scene(self, number: int, frame: FrameId, edits: Edits, *, views: Collection[str] = ()) -> Scene:
        """Write picture `number`, as `write` does, and read its scene. If it cannot be shown, it is removed."""
        before, names = self._last_time, set(self._names)
        try:
            self.write(number, frame, edits)
            return self.again(number, frame, views=views)
        except BaseException:
            self._erase(number)
            self._names, self._last_time = names, before
            raise

    def again(self, number: int, frame: FrameId, *, views: Collection[str] = ()) -> Scene:
        """Read the scene of picture `number`, which shows that frame."""
        if self._reader is None:
            self._reader = self._opened(number)
        CachedIfConstant.forget()
        return self._reader.scene(replace(frame, index=number, time_code=float(number)), views=views)

    def write(self, number: int, frame: FrameId, edits: Edits) -> None:
        """Write picture `number`, from 0, which shows the copied stage's `frame` with these edits under the frame's
        name. Raises InputError for edits that a log cannot contain; then it is not written."""
        timed = np.isfinite(self._last_time)
        if self._names and timed != (frame.time_s is not None):
            found = "it has no time, and the pictures before have" if timed else "the pictures before have no times"
            raise InputError(found, do="give `time` with each request, or with none")
        if frame.time_s is not None and frame.time_s <= self._last_time:
            found = f"its time, {frame.time_s:g} s, is not after {self._last_time:g} s, the time of the picture before"
            raise InputError(found, do="give it a later `time`; a frame has its own")
        if frame.name.lower() in self._names:
            do = "give each its own name; capitals do not count"
            raise InputError(f"a picture of the log is called {frame.name!r} already", do=do)
        values = dict(self._values(frame, edits))
        new = {path: attribute for path, (attribute, _) in values.items() if path not in self._known}
        owns = {path: self._stages(attribute, frame) for path, attribute in new.items()}
        for path, own in owns.items():
            if own is None and not new[path].name.startswith("xformOp:"):  # those are written for each picture
                found = f"{path} has no value in the stage, so it cannot be changed in a log"
                raise InputError(found, do="author the stage with one")
        for path, attribute in self._known.items():
            if path not in values:
                values[path] = attribute, self._stages(attribute, frame)
        codes = {0.0, number - 1.0} if number else set()  # a new attribute had the stage's value so far
        samples = [(new[path], ((code, own),)) for path, own in owns.items() for code in codes]
        samples += [(attribute, ((float(number), value),)) for attribute, value in values.values()]
        if new:
            self._known |= new
            self._reader = None
        of_world = ((schema.CAPTURE_FRAME, "string", frame.name), (schema.CAPTURE_TIME, "double", frame.time_s))
        for name, of_type, value in of_world:
            if value is not None:
                stated = ChangedAttribute(prim=str(self._world.path), name=name, type=of_type)
                samples.append((stated, ((float(number), value),)))
        with Sdf.ChangeBlock():
            each = (SampledValue(attribute=attribute, samples=sample) for attribute, sample in samples)
            write_values(self._layer, SampledValues(attributes=tuple(each)))
        self._last_time = self._last_time if frame.time_s is None else frame.time_s
        self._names.add(frame.name.lower())

    def _erase(self, number: int) -> None:
        stated = [self._world.path.AppendProperty(name) for name in (schema.CAPTURE_FRAME, schema.CAPTURE_TIME)]
        with Sdf.ChangeBlock():
            for path in (*stated, *map(_path, self._known.values())):
                self._layer.EraseTimeSample(path, float(number))

    def saved(self, *, now: bool = False) -> bool:
        """Write unsaved requests to disk if the last time is a while ago, or `now`; return whether all are saved.
        Raises OutputError."""
        if now or time.monotonic() - self._last_save > SAVE_S:
            root = layer_at(self._log / ROOT)
            root.endTimeCode = self._layer.endTimeCode = max(self.count - 1.0, 0.0)
            with writing(self._log / REQUESTS):
                self._layer.Save()
                root.Save()
            self._last_save = time.monotonic()
        return not self._layer.dirty

    def _values(self, frame: FrameId, edits: Edits) -> Iterator[tuple[str, tuple[ChangedAttribute, Any]]]:
        """Yield the picture's differences from the stage, by path: poses and the Sun's direction always."""
        poses = {name: body.pose_at(frame.time_code).matrix for name, body in self._editor.targets.items()}
        first = next(iter(poses))
        if unknown := [name for name in edits.parts if name not in self._parts]:
            do = "name all moving parts when the log is begun"
            raise InputError(f"the part {unknown[0]} does not move in this log", do=do)
        values = dict(edits.values)
        if self._sun and SUN not in values:
            here = BaseStage(stage=self._base.stage, times=(frame.time_code,), metres=self._base.metres)
            values[SUN] = tuple(sun_directions(here, self._sun)[0].tolist())
        for change in self._editor.changes(tuple(values)):
            cut = any(attribute.cut for attribute in change.attributes)
            if (change.fixed or change.apis or cut) and change.parameters != (SUN,):
                do = "author the stage with it, or leave it as it is"
                raise InputError("cannot be changed in a log", where=change.parameters[0], do=do)
        whole = replace(
            edits,
            poses=poses | {name or first: pose for name, pose in edits.poses.items()},
            parts={**self._parts, **edits.parts},
            values=values,
        )
        for attribute, value in self._editor.values(frame, whole):
            if attribute.uniform:
                raise InputError(f"{attribute} cannot change in time", do="author the stage with it")
            yield str(attribute), (attribute, value)

    def _stages(self, attribute: ChangedAttribute, frame: FrameId) -> Any:
        """Return the value that the attribute has in the copied stage."""
        own = self._base.stage.GetPrimAtPath(attribute.prim).GetAttribute(attribute.name)
        return read(own, Usd.TimeCode(frame.time_code))

    def _opened(self, number: int) -> StageReader:
        """Return a reader of the log that treats all its attributes as values that change in time."""
        paths = list(map(_path, self._known.values()))
        with Sdf.ChangeBlock():
            for path in paths:
                self._layer.SetTimeSample(path, BEFORE, self._layer.QueryTimeSample(path, float(number)))
        augmentation = augmentation_and_camera(self._base.variant)[0]
        reader = StageReader(
            self._log / ROOT,
            variant=self._base.variant,
            stage=open_stage(self._log / ROOT, variant=augmentation),
            after=self._base,
            numbering=self._base.numbering,
            check_images=False,
        )
        reader.scene(replace(self._base.frames[0], time_code=float(number)))  # bodies then list their changing values
        with Sdf.ChangeBlock():
            for path in paths:
                self._layer.EraseTimeSample(path, BEFORE)
        return reader


def _logged(layer: Sdf.Layer) -> Iterator[ChangedAttribute]:
    """Yield the attributes with samples in the layer of a log."""
    for path in _samples(layer):
        if not path.name.startswith("spin:capture:"):
            of_type = str(layer.GetAttributeAtPath(path).typeName)
            yield ChangedAttribute(prim=str(path.GetPrimPath()), name=path.name, type=of_type)


def _samples(layer: Sdf.Layer) -> list[Sdf.Path]:
    """Return the paths of the layer's attributes that have samples."""
    found: list[Sdf.Path] = []
    layer.Traverse(Sdf.Path.absoluteRootPath, found.append)
    return [path for path in found if path.IsPropertyPath() and layer.ListTimeSamplesForPath(path)]


def _path(attribute: ChangedAttribute) -> Sdf.Path:
    return Sdf.Path(attribute.prim).AppendProperty(attribute.name)


def _varying(base: StageReader) -> Iterator[ChangedAttribute]:
    """Yield the attributes of the stage that change in time, except for the places of targets."""
    targets = {body.prim.GetPath() for body in base.bodies}
    for prim in Usd.PrimRange.Stage(base.stage, PROXIES):
        for attribute in stated_attributes(prim):
            posed = prim.GetPath() in targets and attribute.GetName().startswith(("xformOp", "spin:motion:"))
            stated = attribute.GetName().startswith("spin:capture:")
            if not posed and not stated and attribute.ValueMightBeTimeVarying():
                yield attribute_of(attribute)
