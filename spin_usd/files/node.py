"""An entry of a folder: a link is a link, regardless of its target."""

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
    """An entry below a folder: its relative name, with slashes, and its type."""

    name: str
    type: NodeType


def type_of_mode(mode: int) -> NodeType:
    """Return the type from a status's mode."""
    return _TYPES.get(stat.S_IFMT(mode), NodeType.OTHER)


def type_of_entry(entry: os.DirEntry[str]) -> NodeType:
    """Return the type of a listing's entry, without another system call if the listing has it."""
    if entry.is_file(follow_symlinks=False):  # tested first: most are
        return NodeType.FILE
    if entry.is_dir(follow_symlinks=False):
        return NodeType.FOLDER
    return NodeType.LINK if entry.is_symlink() else NodeType.OTHER
