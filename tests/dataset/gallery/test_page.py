"""Tests of the page in a real browser, with real clicks and keys."""

import re

import numpy as np
import pytest

import spin_usd
from spin_usd.dataset.gallery.in_child.body_points import STEP_M

RAY_M = 1e-6  # what a point is off where the page's ray and ours differ by rounding, with float32's 6e-8 of 10 m


@pytest.fixture(scope="module")
def shown(pictured, tmp_path_factory):
    """The folder of the page."""
    out = tmp_path_factory.mktemp("shown") / "page"
    spin_usd.show(pictured, out=out, workers=1)
    return out


def under_the_pointer(page) -> dict[str, str]:
    """What the page says is under the pointer."""
    rows = page.locator(".pointer tr").all()
    return {row.locator("th").inner_text(): row.locator("td").inner_text() for row in rows}


def move_to(page, column, row) -> None:
    """Move the pointer to the centre of a pixel of the picture."""
    box = page.locator(".paper").bounding_box()
    width = page.evaluate("globalThis.page.picture.stage.width")
    zoom = box["width"] / width
    page.mouse.move(box["x"] + (column + 0.5) * zoom, box["y"] + (row + 0.5) * zoom)


def test_the_values_under_the_pointer_are_those_of_the_dataset(pictured, shown, opened) -> None:
    page = opened(shown)
    page.get_by_role("button", name=re.compile("img000002, nominal")).click()
    page.wait_for_selector("#picture img[src]")
    page.wait_for_function("globalThis.page.picture.labels")
    picture = spin_usd.Dataset(pictured).picture("img000002")
    rows, columns = np.nonzero(picture.depth)
    for place in np.linspace(0, len(rows) - 1, 7).astype(int):
        row, column = int(rows[place]), int(columns[place])
        move_to(page, column, row)
        found = under_the_pointer(page)
        assert found["Pixel"] == f"column {column}, row {row}"
        assert np.float32(found["Depth"].removesuffix(" m")) == picture.depth[row, column]
        assert found["Parts"].startswith(picture.parts[int(picture.segmentation[row, column])].name)
        point = np.array(found["Dense pose"].removesuffix(" m").split(", "), float)
        assert np.abs(point - picture.dense_pose[row, column]).max() <= STEP_M + RAY_M
        normal = np.array(found["Normals (camera)"].split(", "), np.float32)
        assert (normal == picture.label("normals_cam")[row, column]).all()
    move_to(page, 0, 0)
    assert under_the_pointer(page)["Depth"] == "–"
