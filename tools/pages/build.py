"""The site, built from the documents and from what the code says of itself."""

import os
import shutil
import tempfile
import time
from pathlib import Path

from pages import commands, contents, mirror, python_interface, schemas, tables, troubleshooting
from sphinx.cmd.build import build_main

ROOT = Path(__file__).resolve().parents[2]
MADE = {
    "commands": commands.page,
    "python": python_interface.page,
    "labels": tables.labels,
    "parameters": tables.parameters,
    "troubleshooting": troubleshooting.page,
    "formats": tables.formats,
    "bundled": tables.bundled,
    "schemas": schemas.page,
}
"""Pages of docs/reference that are made of the code."""
TO_FIRST = '<!doctype html><meta http-equiv="refresh" content="0; url=docs/index.html">\n'


def build_site(out: Path) -> bool:
    """Build the site, and put it in the place of the folder `out`; returns whether Sphinx had nothing to warn of. Where
    it had, the folder stays as it is."""
    began = time.monotonic()
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{out.name}-", dir=out.parent) as folder:
        source, site = Path(folder) / "source", Path(folder) / "site"
        write_source(source)
        options = ["--quiet", "--fail-on-warning", "-c", str(ROOT / "docs"), "-d", f"{folder}/doctrees"]
        if build_main([*options, str(source), str(site)]):
            return False
        (site / "index.html").write_text(TO_FIRST)
        shutil.rmtree(out, ignore_errors=True)
        os.replace(site, out)
    print(f"{out / 'index.html'}: built in {time.monotonic() - began:.0f} s")
    return True


def write_source(source: Path) -> None:
    """Write all pages, and what they show and link, into the folder that Sphinx reads."""
    mirror.copy_documents(ROOT, source)
    for name, page in MADE.items():
        (source / "docs" / "reference" / f"{name}.md").write_text(page())
    contents.add_contents(source / "docs" / "index.md", [f"reference/{name}.md" for name in MADE])
