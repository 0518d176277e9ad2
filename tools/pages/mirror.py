"""The documents as Sphinx reads them: copies under the same paths, so that links between them hold."""

import re
import shutil
from pathlib import Path

PATTERNS = ("*.md", "docs/**/*.md", "docs/**/*.ipynb", "stages/**/README.md", "tools/figures/*.md")
WITHOUT = ("README.md",)
"""What a code host shows first; docs/index.md stands in its place."""
LINK = re.compile(r"(?P<image>!?)\[(?P<text>[^\]]*)\]\((?P<path>[^)\s#:]+)(?P<heading>#[^)\s]*)?\)")


def copy_documents(root: Path, source: Path) -> None:
    """Copy the documents of the repository at `root`, and the files that they show or link, to `source`."""
    pages = {page for pattern in PATTERNS for page in root.glob(pattern)} - {root / name for name in WITHOUT}
    for page in sorted(pages):
        copy = source / page.relative_to(root)
        copy.parent.mkdir(parents=True, exist_ok=True)
        if page.suffix == ".md":
            copy.write_text(_with_files(page, pages, root, source))
        else:
            shutil.copyfile(page, copy)


def _with_files(page: Path, pages: set[Path], root: Path, source: Path) -> str:
    """Return the page's text, and copy each file that it shows or links. Folders, and the README, become plain text."""

    def linked(found: re.Match[str]) -> str:
        file = (page.parent / found["path"]).resolve()
        if file in pages:
            return found[0]
        if not file.is_file() or file.suffix == ".md":
            return found["text"]
        copy = source / file.relative_to(root)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)
        return found[0]

    return LINK.sub(linked, page.read_text())
