"""What `show` did."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class GalleryReport:
    """page: the file to open in a browser · pictures: how many it has · made, kept: how many of these had files to
    write, and how many had all already · damaged: what is wrong with pictures, by VARIANT/FRAME · bytes: of all that
    the folder holds · seconds: that it took."""

    page: str
    pictures: int
    made: int
    kept: int
    damaged: dict[str, str]
    bytes: int
    seconds: float
