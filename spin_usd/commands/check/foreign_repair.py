"""A copy of a data set of somebody else in which what is known to be wrong with its lists is mended."""

import csv
import json
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.audit.readings import Reading
from spin_usd.audit.set_finding import Repair
from spin_usd.basics.arrays import Float
from spin_usd.basics.progress import Progress
from spin_usd.errors import InputError, OutputError
from spin_usd.exchange.sets.set_folder import SetFolder, number, numbers
from spin_usd.exchange.sets.set_format import PoseFields
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.json_file import read_json_file
from spin_usd.geometry.rotation import matrix_from_quaternion

TABLE = "repaired.csv"


def repaired_copy(
    root: Path, out: Path, fields: PoseFields, repairs: Sequence[Repair], progress: Progress
) -> list[str]:
    """Copy the set in `root` to the new folder `out`, and return what was mended, a sentence for each list.

    Every changed entry is in repaired.csv. Raises OutputError if it cannot be written; then there is no copy.
    """
    folder = SetFolder(root)
    lists = [match.group() for match in folder.matching(fields.files) if _holds(fields, folder.head(match.group()))]
    try:
        out.mkdir(parents=True)
    except OSError as error:
        raise OutputError(f"cannot be made ({error.strerror})", where=out, do="give another folder") from None
    try:
        for done, name in enumerate(sorted(folder.files)):
            progress("copying: file", done, len(folder.files))
            (out / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(root / name, out / name)
        mending = _Mending(fields=fields, repairs=repairs, changes=[])
        told = [each for name in lists for each in mending.file(out / name, name)]
        with open(out / TABLE, "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([("list", "entry", "key", "before", "after"), *mending.changes])
    except BaseException as error:
        shutil.rmtree(out, ignore_errors=True)
        if isinstance(error, OSError):
            raise OutputError(f"cannot be written ({error.strerror})", where=out, do="free some space") from None
        raise
    return told


def _holds(fields: PoseFields, head: str) -> bool:
    """Return whether a list that begins so holds poses."""
    return all(any(key in head for key in keys) for keys in (fields.rotation, fields.position))


def _listed(bodies: Any) -> list[dict[str, Any]]:
    return [body for body in bodies if isinstance(body, dict)] if isinstance(bodies, list) else []


@dataclass(frozen=True, kw_only=True)
class _Mending:
    """The changes to lists."""

    fields: PoseFields
    repairs: Sequence[Repair]
    changes: list[tuple[str, str, str, str, str]]

    def file(self, path: Path, name: str) -> Iterator[str]:
        """Mend the list at `path`, and yield a sentence if it changed."""
        before = len(self.changes)
        try:
            if path.suffix == ".csv":
                self._table(path, name)
            else:
                self._document(path, name)
        except (InputError, UnicodeDecodeError, csv.Error):
            yield f"{name}: left as it is, as it cannot be read"
        if count := len(self.changes) - before:
            yield f"{name}: {count} values; {TABLE} lists them"

    def _document(self, path: Path, name: str) -> None:
        document, before = read_json_file(path, MAX_POSE_LIST), len(self.changes)
        for place, entry in self._entries(document):
            self._entry(entry, name, place)
        if len(self.changes) > before:
            path.write_text(json.dumps(document), encoding="utf-8")

    def _entries(self, document: Any) -> Iterator[tuple[str, dict[str, Any]]]:
        """Yield the objects with poses of a JSON document, and their places."""
        if isinstance(document, dict) and "poses" not in document:
            for key, bodies in document.items():
                yield from ((f"image {key}", body) for body in _listed(bodies))
        else:
            entries = document["poses"] if isinstance(document, dict) else document
            listed = enumerate(entries) if isinstance(entries, list) else ()
            yield from ((f"entry {place}", each) for place, each in listed if isinstance(each, dict))

    def _entry(self, entry: dict[str, Any], name: str, place: str) -> None:
        rotation, position = (
            next((key for key in keys if key in entry), "") for keys in (self.fields.rotation, self.fields.position)
        )
        said = entry.get(rotation)
        q = numbers(said, len(said)) if isinstance(said, list) and len(said) in (4, 9) else np.full(4, np.nan)
        t = numbers(entry.get(position), 3)
        if np.isfinite(q).all() and np.isfinite(t).all() and q.any():
            for key, values in zip((rotation, position), self._pose(q, t, name), strict=True):
                self._set(entry, key, values.tolist(), name, place)
        image = entry.get(self.fields.name)
        if isinstance(image, str) and (right := self._named(image)):
            self._set(entry, self.fields.name, right, name, place)

    def _table(self, path: Path, name: str) -> None:
        with open(path, newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
            rows, columns = list(reader), list(reader.fieldnames or ())
        if any(None in row for row in rows):
            raise InputError("has a row with more cells than headings", where=name)
        plain = {column.strip(): column for column in columns}
        keys = [plain.get(key, key) for key in (*self.fields.rotation, *self.fields.position)]
        before = len(self.changes)
        for place, row in enumerate(rows):
            if all(key in row for key in keys):
                said = np.array([number(row[key]) for key in keys])
                usable = np.isfinite(said).all() and said[:4].any()
                made = np.concatenate(self._pose(said[:4], said[4:], name)) if usable else ()
                for key, value in zip(keys, made, strict=bool(usable)):
                    self._set(row, key, repr(float(value)), name, f"line {place + 2}")
            if (said_name := row.get(self.fields.name)) and (right := self._named(said_name)):
                self._set(row, self.fields.name, right, name, f"line {place + 2}")
        if len(self.changes) > before:
            with open(path, "w", newline="", encoding="utf-8") as file:
                writer = csv.DictWriter(file, columns)
                writer.writeheader()
                writer.writerows(rows)

    def _named(self, said: str) -> str:
        found = next((each.names[said] for each in self.repairs if said in each.names), "")
        return found.rpartition("/")[2] if found and "/" not in said else found

    def _set(self, entry: dict[str, Any], key: str, value: Any, name: str, place: str) -> None:
        if value != entry[key] and not (isinstance(value, str) and number(value) == number(entry[key])):
            self.changes.append((name, place, key, json.dumps(entry[key]), json.dumps(value)))
            entry[key] = value

    def _pose(self, rotation: Float, position: Float, name: str) -> tuple[Float, Float]:
        """Return the numbers of a pose in the list of that `name` with all repairs."""
        for repair in self.repairs:
            if repair.lists and name not in repair.lists:
                continue
            if repair.reading is not None:
                rotation, position = self._reread(repair.reading, rotation, position)
            position = position * repair.length
        return rotation, position

    def _reread(self, reading: Reading, rotation: Float, position: Float) -> tuple[Float, Float]:
        """Return a pose that was written as the reading has it as the layout has it."""
        if len(rotation) == 9:
            found = rotation.reshape(3, 3).T.ravel() if reading.inverse else rotation
            R = found.reshape(3, 3)
        else:
            last = self.fields.scalar_last
            found = np.roll(rotation, (-1 if last else 1) * reading.other_order)
            if reading.inverse:
                found = found * ([-1, -1, -1, 1] if last else [1, -1, -1, -1])
            first = np.roll(found, 1) if last else found
            R = matrix_from_quaternion(first / np.linalg.norm(first))
        return found, -R @ position if reading.of_camera else position
