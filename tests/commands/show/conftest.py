"""A dataset of a few small pictures in two variants, and its page in a real browser."""

import json
import os

import pytest

import spin_usd

LABELS = "depth,segmentation,dense_pose,normals_cam,lit"


@pytest.fixture(scope="session")
def pictured(small_stage, tmp_path_factory):
    """The folder of a dataset of three frames at 240 x 150 in the variants nominal and other."""
    out = tmp_path_factory.mktemp("pictured") / "my dataset"
    spin_usd.render(small_stage, out=out, renderer="raycast", samples=1, frames="0:3", labels=LABELS, workers=1)
    for path in sorted((out / "records" / "nominal").iterdir()):
        add_variant(out, json.loads(path.read_text()))
    return out


def add_variant(dataset, record) -> None:
    """Add the picture of that record once more, as one of the variant other."""
    for file in record["files"].values():
        path = file["path"].replace("/nominal/", "/other/")
        (dataset / path).parent.mkdir(parents=True, exist_ok=True)
        os.link(dataset / file["path"], dataset / path)
        file["path"] = path
    record |= {"variant": "other", "tones": {"pixels": 5, "mean": 0.875, "dark": 0.0, "saturated": 0.0}}
    path = dataset / "records" / "other" / f"{record['frame']}.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(record))


@pytest.fixture(scope="session")
def shown(pictured, tmp_path_factory):
    """The folder of the page of that dataset, beside which it stands itself."""
    out = tmp_path_factory.mktemp("shown") / "page"
    spin_usd.show(pictured, out=out, beside=pictured, workers=1)
    return out


@pytest.fixture
def opened(browser):
    """Open the page in a folder in a window of a small laptop; whatever goes wrong in it fails the test; of one
    that is not complete, the browser may say which files are missing."""
    pages, faults = [], []

    def open_page(folder, fragment="", *, complete=True, size=(1366, 768), **options):
        page = browser.new_page(viewport={"width": size[0], "height": size[1]}, **options)
        pages.append(page)
        page.on("pageerror", lambda error: faults.append(str(error)))
        if complete:
            page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
        page.goto(f"{(folder / 'index.html').as_uri()}{fragment}")
        page.wait_for_selector("body[data-ready]")
        return page

    yield open_page
    for page in pages:
        page.close()
    assert not faults
