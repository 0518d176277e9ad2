"""Names of targets and classes, where a format calls files or folders after them."""

from spin_usd.errors import UnsupportedError
from spin_usd.scene.source.poses import FRAME_NAME, FRAME_NAME_RULE


def folder_name(name: str) -> str:
    """Return the name of a target as a folder's. Raises UnsupportedError for one that cannot be that, such as a
    path."""
    if not FRAME_NAME.fullmatch(name):
        do = f"rename it in the stage: {FRAME_NAME_RULE}"
        raise UnsupportedError("cannot name a folder, which the format calls after it", where=f"target {name!r}", do=do)
    return name
