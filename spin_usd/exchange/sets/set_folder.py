"""The folder of a data set of somebody else: its file names, listed once, and its lists, read with what is wrong."""

import csv
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.audit.annotated_set import Fault
from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.exchange.pose_numbers import csv_rows
from spin_usd.files.size_limits import MAX_POSE_LIST, UNBOUNDED
from spin_usd.files.user_file import open_file
from spin_usd.formats.json_file import read_json_file

MAX_FILES = 4_000_000
LARGEST = 9e18  # as whole numbers of 64 bits; in metres, pixels or nanoseconds no label is larger
LABELS = re.compile(r"(^|/)[^/]*(mask|depth|seg|disp)[^/]*/", re.IGNORECASE)
"""Folders of images that no camera took."""
IMAGES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp")


class SetFolder:
    """A data set's folder. Raises InputError for one of more than MAX_FILES files."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.faults: list[Fault] = []
        """Faults that readers have met."""
        self.files = frozenset(self._walk())
        self._sorted = sorted(self.files)
        self.renamed: dict[str, str] = {}
        """Images that lie elsewhere than lists say, or are spelled otherwise: their paths by their names there."""

    def _walk(self) -> Iterator[str]:
        """Yield the regular files; links that lead out of the folder are faults, and none to folders is followed."""
        count, folders, root = 0, [""], os.path.realpath(self.root)
        outside: list[str] = []
        while folders:
            at = folders.pop()
            for entry in self._entries_of(at):
                name = f"{at}{entry.name}"
                if entry.is_dir(follow_symlinks=False):
                    folders += [] if entry.name.startswith(".") else [f"{name}/"]
                elif entry.is_symlink() and not os.path.realpath(entry.path).startswith(f"{root}{os.sep}"):
                    outside.append(name)
                elif is_regular(entry):
                    count += 1
                    yield name
            if count > MAX_FILES:
                raise InputError(f"holds more than {MAX_FILES} files", where=self.root, do="give a part of it")
        if outside:
            message = f"{len(outside)} links lead out of the set's folder, and are not read"
            self.fault("files", min(outside), message)

    def _entries_of(self, at: str) -> list[os.DirEntry[str]]:
        try:
            with os.scandir(self.root / at) as entries:
                return list(entries)
        except OSError as error:
            self.fault("unreadable", at or str(self.root), f"cannot be listed ({error.strerror})")
            return []

    @cached_property
    def _by_name(self) -> dict[str, list[str]]:
        """Images by their names without folders, in lower case."""
        found: dict[str, list[str]] = {}
        for file in self._sorted:
            if file.lower().endswith(IMAGES) and not LABELS.search(file):
                found.setdefault(file.rpartition("/")[2].lower(), []).append(file)
        return found

    def matching(self, pattern: str) -> list[re.Match[str]]:
        """Return matches of the whole names with the pattern, in alphabetic order."""
        compiled = re.compile(pattern)
        return [match for file in self._sorted if (match := compiled.fullmatch(file))]

    def first(self, *names: str) -> str:
        """Return the first of the names that is a file; "" if none is."""
        return next((name for name in names if name in self.files), "")

    def image(self, name: str, *folders: str) -> str:
        """Return the image that a list calls `name`, with or without an ending, in one of the folders, or the only one
        of that name anywhere, in any case; "" if there is none."""
        name = name.replace("\\", "/").removeprefix("./")
        endings = ("", *IMAGES)
        found = self.first(*(f"{folder}{name}{ending}" for folder in (*folders, "") for ending in endings))
        if found:
            return found
        alike = self._by_name.get(name.rpartition("/")[2].lower(), [])
        if len(alike) != 1:
            return ""
        self.renamed[name] = alike[0]
        return alike[0]

    def head(self, name: str, size: int = 4096) -> str:
        """Return the first `size` bytes of a file as text; "" if it cannot be read."""
        try:
            with open_file(self.root / name, UNBOUNDED) as file:
                return file.read(size).decode("utf-8-sig", "replace")
        except (InputError, OSError):
            return ""

    def size(self, name: str) -> tuple[int, int] | None:
        """Return width and height of an image by its head, None if it has none."""
        from spin_usd.formats.image_file import image_size  # not above: OpenImageIO is slow to load

        return image_size(self.root / name)

    def json(self, name: str) -> Any:
        """Return the JSON of the file; None, and a fault, if it cannot be read."""
        try:
            return read_json_file(self.root / name, MAX_POSE_LIST)
        except InputError as error:
            self.fault("unreadable", name, error.found)
            return None

    def entries(self, name: str) -> list[dict[str, Any]]:
        """Return the objects of a JSON list, or of the list under "poses"; others are faults."""
        document = self.json(name)
        document = document.get("poses") if isinstance(document, dict) else document
        if not isinstance(document, list):
            self.fault("unreadable", name, "holds no list")
            return []
        if wrong := [place for place, each in enumerate(document) if not isinstance(each, dict)]:
            self.fault("unreadable", name, f"{len(wrong)} entries, such as entry {wrong[0]}, are not objects")
        return [each if isinstance(each, dict) else {} for each in document]

    def rows(self, name: str) -> Iterator[tuple[str, Mapping[str, str]]]:
        """Yield the place and the cells of each row of a CSV file with headings; a row that breaks it is a fault."""
        try:
            for line, _, row in csv_rows(self.root / name):
                yield f"{name}, line {line}", {key.strip(): cell for key, cell in row.items()}
        except InputError as error:
            self.fault("unreadable", str(error.where or name), error.found)
        except csv.Error:
            self.fault("unreadable", name, "is not CSV")

    def fault(self, rule: str, where: str, message: str) -> None:
        """Note a fault."""
        self.faults.append(Fault(rule=rule, where=where, message=message))


def is_regular(entry: os.DirEntry[str]) -> bool:
    """Return whether an entry of a folder is a regular file, or a link to one."""
    try:
        return entry.is_file()
    except OSError:  # of links in a circle
        return False


def numbers(values: Any, count: int) -> Float:
    """Return (count,) numbers of a list, NaN for all that is none."""
    found = np.full(count, nan)
    if isinstance(values, Sequence) and not isinstance(values, str):
        for place, value in enumerate(values[:count]):
            found[place] = number(value)
    return found


def number(value: Any) -> float:
    """Return the number that a value, or its text, is; NaN if it is none, infinite, or beyond LARGEST."""
    try:
        found = nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        return nan
    return found if abs(found) < LARGEST else nan


def cells_or_nan(row: Mapping[str, str], columns: Sequence[str]) -> Float:
    """Return the numbers (N,) in these columns of a row, NaN for missing ones."""
    return np.array([number(row.get(column)) for column in columns])
