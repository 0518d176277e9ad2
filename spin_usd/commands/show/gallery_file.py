"""The names of the files in a gallery's folder."""

import re

PAGE = "index.html"
INDEX = "index.js"
SELF = "gallery.json"
PROGRAM = "page"
THUMBNAILS, IMAGES, DATA = "thumbnails", "images", "data"
BY_KEY = (THUMBNAILS, IMAGES, DATA)
OWN_NAME = re.compile(rf"(?:{'|'.join(BY_KEY)})/[0-9a-f]{{2}}/[0-9a-f]{{16}}\.(?:jpg|png|js)")


def file_of(folder: str, key: str, suffix: str) -> str:
    """Return the name of the file with that key in one of the folders BY_KEY."""
    return f"{folder}/{key[:2]}/{key}{suffix}"
