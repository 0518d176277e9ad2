"""The call of the child that makes a picture again, and its result."""

from collections.abc import Mapping
from typing import Any

from msgspec import Struct, to_builtins

from spin_usd.processes.call import Call


class Reproduce(Struct, frozen=True, kw_only=True):
    """The request to make a recorded picture again."""

    dataset: str
    record: str
    """Name of the record."""
    folder: str
    """Folder for the new files."""
    device: str
    """Device that renders the light."""


class Comparison(Struct, frozen=True, kw_only=True):
    """One file of the picture: its digest in the record, in the dataset (None: missing), and as made again."""

    kind: str
    path: str
    recorded: str
    found: str | None
    again: str

    @property
    def same(self) -> bool:
        return self.recorded == self.found == self.again


class Reproduction(Struct, frozen=True, kw_only=True):
    """A picture made again."""

    files: tuple[Comparison, ...]
    """Comparison of each file."""
    versions: Mapping[str, tuple[str, str]]
    """Libraries whose version has changed, by name, with the recorded version and today's, "" if there is none."""
    devices: tuple[str, str]
    """Devices that rendered the light: the recorded one and today's."""

    @property
    def same(self) -> bool:
        """Return whether every file came out with the same bytes."""
        return all(file.same for file in self.files)

    def as_json(self) -> dict[str, Any]:
        files = [{**to_builtins(file), "same": file.same} for file in self.files]
        return {"files": files, "versions": self.versions, "devices": self.devices}


REPRODUCE = Call("spin_usd.commands.reproduce.in_child:make_again", Reproduce, Reproduction)
