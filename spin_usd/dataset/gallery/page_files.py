"""The page itself: HTML, a style sheet and scripts, which travel with the package and are the same for all datasets."""

from spin_usd.files.folder import Folder
from spin_usd.files.size_limits import MAX_DOCUMENT
from spin_usd.resources import PACKAGE

PAGE_FOLDER = PACKAGE / "dataset" / "gallery" / "page"


def page_files() -> dict[str, bytes]:
    """Return the files of the page by their names; index.html, which loads the others, is the last."""
    folder = Folder(PAGE_FOLDER)
    names = sorted(folder.files(), key=lambda name: (name.endswith(".html"), name))
    return {name: folder.read(name, MAX_DOCUMENT) for name in names}
