"""What lies below a folder, itself: a link is a link wherever it leads."""

import os
import stat
from enum import StrEnum
from typing import NamedTuple


class NodeType(StrEnum):
    """The type of a node."""

    FILE = "file"
    FOLDER = "folder"
    LINK = "link"
    OTHER = "pipe, socket or device"


STRANGE = (NodeType.LINK, NodeType.OTHER)
_TYPES = {stat.S_IFREG: NodeType.FILE, stat.S_IFDIR: NodeType.FOLDER, stat.S_IFLNK: NodeType.LINK}


class Node(NamedTuple):
    """Something below a folder: its name relative to that, with slashes, and what it is."""

    name: str
    type: NodeType


def type_of_mode(mode: int) -> NodeType:
    """Return the type that a status's mode says."""
    return _TYPES.get(stat.S_IFMT(mode), NodeType.OTHER)


def type_of_entry(entry: os.DirEntry[str]) -> NodeType:
    """Return the type of what a listing has found, without asking the file system once more where it said so."""
    if entry.is_file(follow_symlinks=False):  # asked first: most are
        return NodeType.FILE
    if entry.is_dir(follow_symlinks=False):
        return NodeType.FOLDER
    return NodeType.LINK if entry.is_symlink() else NodeType.OTHER
