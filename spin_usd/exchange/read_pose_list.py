"""A file of poses, or a folder of such files, in any of the formats of the table, to a PoseList."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from math import isfinite
from pathlib import Path

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.unique_names import UniqueNames
from spin_usd.basics.utc import utc_text
from spin_usd.errors import GeometryError, InputError
from spin_usd.exchange.events import RECORDING, recording
from spin_usd.exchange.pose_format import PoseEntry, PoseFormat
from spin_usd.exchange.table import POSE_FORMATS, POSE_HEAD, recognised, refuse_of_other_option
from spin_usd.geometry.rotation import QUATERNION_NORM_ROUNDED, QUATERNION_NORM_TOLERANCE
from spin_usd.scene.poses import FRAME_NAME, FRAME_NAME_RULE, PoseList, repeated_name

IMAGE_SUFFIXES = {".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".exr"}
SHORT_S, LONG_S = 1e-7, 1e6  # between two pictures, beyond which the unit of time is in doubt
FAR_M = 1e5  # from the camera, where a spacecraft is less than a pixel
REACH = "look for a unit or a scale that is off by many powers of ten"
NOT_IN_NAMES = re.compile("[^A-Za-z0-9._-]+")


def read_pose_list(path: str | Path) -> PoseList:
    """Read the poses of the file at `path`, in its order, or of the lists in the folder of a data set.

    Raises InputError that names the file and the entry.
    """
    path = Path(path)
    lists = _lists_in(path) if path.is_dir() else ((path, _format_of(path)),)
    notes: list[str] = []
    with np.errstate(over="ignore", invalid="ignore"):  # values that are not finite are refused
        entries = [entry for file, of in lists for entry in _entries(file, of, notes)]
    entries, renamed = _renamed(entries)
    if len(lists) > 1 and repeated_name([entry.name for entry in entries]):
        entries = [replace(entry, name=f"{_place(entry.list, path)}_{entry.name}") for entry in entries]
    names = [entry.name for entry in entries]
    if pair := repeated_name(names):
        first, second = (entries[place] for place in pair)
        found, do = f"names the same picture as {first.place}", "give every pose its own name"
        if second.pose.time is not None and second.pose.time == first.pose.time:
            found, do = f"has the time of {first.place} again", "keep one of the two"
        raise InputError(found, where=second.where, do=do)
    q = np.array([entry.pose.q_cam_body for entry in entries], np.float64)
    t = np.array([entry.pose.t_cam_body for entry in entries], np.float64)
    q, rounded = _normalised(q, entries, lists[0][1])
    times, epoch = _times(entries, notes)
    if (near := float(np.linalg.norm(t, axis=1).min())) > FAR_M:
        do = "if its world's origin is elsewhere, such as the Earth's centre, subtract the target's position"
        notes.append(f"the target is {near / 1e3:.6g} km or more from the camera in all poses: {do}")
    return PoseList(
        names=tuple(names),
        q_cam_body=q,
        t_cam_body=t,
        files=tuple(entry.pose.filename.rpartition("\0" if renamed else "/")[2] for entry in entries),
        times=times,
        epoch=epoch,
        source=str(path),
        lists=_said(lists) if path.is_dir() else "",
        notes=(*notes, *renamed, *rounded, *_off_rotations(entries)),
    )


def _times(entries: "Sequence[NamedPose]", notes: list[str]) -> tuple[Float | None, str]:
    """Return the seconds (N,) of the entries and the UTC of second 0; None and "", with a note, where not all have a
    time, or where they go back."""
    said = [entry.pose.time for entry in entries]
    if all(time is None for time in said):
        return None, ""
    moments = [time for time in said if isinstance(time, datetime)]
    times = [time for time in said if isinstance(time, float)]
    if len(moments) == len(entries):
        times = [(time - moments[0]).total_seconds() for time in moments]
    if len(times) != len(entries):
        notes.append("its times are left out: not all poses have one, or some are UTC and others seconds")
        return None, ""
    for before, time, entry in zip(times, times[1:], entries[1:], strict=False):
        if time <= before:
            found, do = "has the same time as the entry above it", "keep one of the two"
            if time < before:
                found, do = f"is {before - time:g} s before the entry above it", "sort the poses by time"
            notes.append(f"its times are left out: {entry.where} {found}; {do}")
            return None, ""
    if len(times) > 1 and not SHORT_S <= (step := times[1] - times[0]) <= LONG_S:
        notes.append(f"its first two times are {step:.3g} s apart: check their unit")
    epochs = {entry.pose.epoch for entry in entries}
    if len(epochs) == 1 and (epoch := epochs.pop()):
        notes.append(f"its times count from 1970: second 0 is {utc_text(epoch)}")
        moments = [epoch]
    return np.array(times, np.float64), utc_text(moments[0]) if moments else ""


@dataclass(frozen=True, kw_only=True)
class NamedPose:
    """An entry of a list, the name of its picture, and its place in the list, for messages."""

    name: str
    pose: PoseEntry
    list: Path
    place: str

    @property
    def where(self) -> str:
        return f"{self.list}, {self.place} ({self.name!r})"


def _entries(file: Path, of: PoseFormat, notes: list[str]) -> Iterator[NamedPose]:
    """Yield the entries of the list, and add its notes. Raises InputError."""
    count = 0
    for pose in _read(file, of):
        if isinstance(pose, str):
            notes.append(f"{file}: {pose}")
            continue
        place = f"line {pose.line}" if pose.line else f"entry {count}"
        count += 1
        if not all(map(isfinite, pose.t_cam_body)):
            raise InputError("has a position that overflows", where=f"{file}, {place}", do=REACH)
        yield NamedPose(name=_picture_name(pose.filename, f"{file}, {place}"), pose=pose, list=file, place=place)
    if not count:
        raise InputError("holds no poses: its list is empty", where=file)


def _read(file: Path, of: PoseFormat) -> Iterator[PoseEntry | str]:
    """Yield the format's entries. Raises InputError if the numbers of one do not form a pose."""
    try:
        yield from of.read(file)
    except GeometryError as error:
        raise InputError(error.found, where=error.where or file, do=error.do or REACH) from None
    except InputError:
        refuse_of_other_option(file, of)
        raise


def _renamed(entries: list[NamedPose]) -> tuple[list[NamedPose], tuple[str, ...]]:
    """Return the entries with valid picture names, and a note if names were changed: folders are prefixed if several
    end alike, "_" replaces invalid characters, and a number makes equal names unique."""
    names = [entry.name for entry in entries]
    folders = [entry.pose.filename.replace("\\", "/").split("/")[:-1] for entry in entries]
    if any(folders) and repeated_name(names):
        alike = [len({*each}) == 1 for each in zip(*folders, strict=False)]
        common = (*alike, False).index(False)
        names = ["_".join([*folder[common:], name]) for folder, name in zip(folders, names, strict=True)]
    clean = [NOT_IN_NAMES.sub("_", name).lstrip("._-") or "_" for name in names]
    unique = UniqueNames()
    clean = [each if each == name else unique.give(each) for each, name in zip(clean, names, strict=True)]
    changed = [i for i, entry in enumerate(entries) if clean[i] != entry.name]
    if not changed:
        return entries, ()
    first, was = clean[changed[0]], entries[changed[0]].pose.filename
    note = f"{len(changed)} of {len(entries)} pictures have other names than in the list, such as {first} for {was!r}"
    return [replace(entry, name=name) for entry, name in zip(entries, clean, strict=True)], (note,)


def _off_rotations(entries: Sequence[NamedPose]) -> tuple[str, ...]:
    """Return a note where matrices were made rotations."""
    off = [entry.pose.off_rotation for entry in entries]
    if not any(off):
        return ()
    worst = entries[int(np.argmax(off))]
    count = sum(each > 0 for each in off)
    told = f"are off one by up to {max(off):.2g} ({worst.where}), as few decimals leave them"
    return (f"{count} of {len(off)} matrices were made rotations: they {told}",)


def pose_files(path: Path) -> tuple[Path, ...]:
    """Return the files that `read_pose_list` reads. Raises InputError."""
    return tuple(file for file, _ in _lists_in(path)) if path.is_dir() else (path,)


def _lists_in(folder: Path) -> tuple[tuple[Path, PoseFormat], ...]:
    """Return the lists in the folder, all of one format. Raises InputError if there is none, or a second format."""
    found = [(file, each) for each in POSE_FORMATS for file in each.lists(folder) if _format_of(file) == each]
    if not found:
        do = "give a pose list, or the folder of a data set that has one"
        raise InputError("holds no pose list of a known format", where=folder, do=do)
    firsts = {of.name: file.relative_to(folder) for file, of in reversed(found)}
    if len(firsts) > 1:
        named = " and ".join(f"{name} ({file})" for name, file in reversed(firsts.items()))
        raise InputError(f"holds pose lists of several formats: {named}", where=folder, do="give the file of one")
    return tuple(found)


def _said(lists: Sequence[tuple[Path, PoseFormat]]) -> str:
    """Return how many lists these are, and their format."""
    return f"{len(lists)} pose list{'s' * (len(lists) > 1)} in the format {lists[0][1].name}"


def _place(file: Path, folder: Path) -> str:
    """Return where a list is in the folder, as the beginning of a picture's name."""
    return "_".join(file.relative_to(folder).with_suffix("").parts)


def _format_of(path: Path) -> PoseFormat:
    """Return the first format that recognises the file; one that cannot be read is left to its reader to refuse. Raises
    InputError for text or data that is of none."""
    found, head = recognised(path, POSE_FORMATS, POSE_HEAD)
    if found is POSE_FORMATS[-1] and path.suffix.lower() != ".json" and head.lstrip()[:1] not in ("", "[", "{"):
        if RECORDING.match(head):
            raise recording(path)
        refuse_of_other_option(path, found)
        do = "docs/how-to/poses.md lists the formats; a table needs names over its columns"
        raise InputError("is in no known format of poses", where=path, do=do)
    return found


def _picture_name(filename: str, where: str) -> str:
    """Return the picture's name as the list has it: the file's without its folders and an image format's extension."""
    base = filename.replace("\\", "/").rpartition("/")[2]
    stem, dot, suffix = base.rpartition(".")  # no Path: lists have tens of thousands
    name = stem if dot + suffix.lower() in IMAGE_SUFFIXES else base
    if not name.isprintable() or not FRAME_NAME.fullmatch(NOT_IN_NAMES.sub("_", name).lstrip("._-")):
        raise InputError(
            f"has the filename {filename[:80]!r}, which cannot name a picture", where=where, do=FRAME_NAME_RULE
        )
    return name


def _normalised(q: Float, entries: Sequence[NamedPose], of: PoseFormat) -> tuple[Float, tuple[str, ...]]:
    """Return the quaternions (N, 4) with norm 1, and a note where rounding had left some of them visibly off. Raises
    InputError for one that is further off, or zero."""
    norm = np.linalg.norm(q, axis=1)
    off = np.abs(norm - 1)
    if (off > QUATERNION_NORM_ROUNDED).any():
        i = int(np.argmax(off > QUATERNION_NORM_ROUNDED))
        found = "is zero, which is not a rotation" if norm[i] == 0 else f"has norm {norm[i]:.9g}, expected 1"
        raise InputError(f"the quaternion {found}", where=entries[i].where, do=f"give {of.rotation}")
    rounded = np.flatnonzero(off > QUATERNION_NORM_TOLERANCE)
    if not len(rounded):
        return q, ()
    worst = entries[int(np.argmax(off))]
    note = (
        f"{len(rounded)} of {len(q)} quaternions were normalised: norms are off 1 by up to {off.max():.2g} "
        f"({worst.where}), as few decimals leave them"
    )
    return q / norm[:, None], (note,)
