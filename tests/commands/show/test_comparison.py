"""Tests of two datasets side by side, picture by picture."""

import json
import shutil

import pytest

import spin_usd


@pytest.fixture
def compared(pictured, opened, tmp_path):
    """The page, at img000002 of nominal, beside a dataset in which that picture is brighter, and is a different image,
    and which lacks img000003."""
    beside = shutil.copytree(pictured, tmp_path / "brighter", copy_function=shutil.copy)
    for path in (beside / "records").glob("*/img000003.json"):
        path.unlink()
    record = json.loads((beside / "records" / "nominal" / "img000002.json").read_text())
    other = json.loads((beside / "records" / "nominal" / "img000001.json").read_text())
    record["tones"]["mean"] = 0.75
    record["files"]["image"] = other["files"]["image"]
    (beside / "records" / "nominal" / "img000002.json").write_text(json.dumps(record))
    spin_usd.show(pictured, out=tmp_path / "page", beside=beside, workers=1)
    page = opened(tmp_path / "page", "#picture/nominal/img000002")
    page.wait_for_selector("[data-shown='nominal/img000002']")
    return page


def visible(page) -> list[bool]:
    """Whether the sheet of this dataset is seen, and whether that of the other is."""
    return [bool(sheet.is_visible()) for sheet in page.locator(".sheet .paper").all()]


def test_both_are_shown_side_by_side_and_zoom_as_one(compared) -> None:
    page = compared
    page.keyboard.press("w")
    images = page.get_by_alt_text("img000002 of nominal")
    images.nth(1).wait_for()
    assert visible(page) == [True, True]
    assert images.nth(0).get_attribute("src") != images.nth(1).get_attribute("src")
    page.keyboard.press("d")
    page.locator("canvas[data-kind=depth]").nth(1).wait_for()
    page.keyboard.press("z")
    own, other = (sheet.bounding_box() for sheet in page.locator(".sheet .paper").all())
    assert own["width"] > page.locator(".sheet").first.bounding_box()["width"]
    assert (own["width"], own["y"]) == pytest.approx((other["width"], other["y"]))
    assert page.locator(".caption").all_inner_texts() == ["my dataset", "brighter"]


def test_the_other_takes_the_place_of_this_one_and_both_by_turns(compared) -> None:
    page = compared
    page.keyboard.press("e")
    page.get_by_alt_text("img000002 of nominal").nth(1).wait_for()
    assert visible(page) == [False, True]
    page.keyboard.press("e")
    assert visible(page) == [True, False]
    page.keyboard.press("r")
    for place in (1, 0):
        page.locator(".sheet").nth(place).wait_for(state="hidden")
    page.keyboard.press("r")
    assert visible(page) == [True, False]


def test_it_says_which_values_differ(compared, pictured) -> None:
    page = compared
    page.get_by_text("Values that differ (2)").click()
    rows = page.locator(".compared tbody tr").all()
    mean = spin_usd.Dataset(pictured).picture("img000002").record["tones"]["mean"]
    assert [row.locator("td, th").all_inner_texts() for row in rows] == [
        ["tones.mean", f"{mean:.6g}", "0.75"],
        ["files.image.path", "image/nominal/img000002.png", "image/nominal/img000001.png"],
    ]


def test_a_picture_that_the_other_lacks_is_said(compared) -> None:
    page = compared
    page.keyboard.press("w")
    page.get_by_label("Next picture").click()
    page.wait_for_selector("[data-shown='nominal/img000003']")
    page.get_by_text("It has no picture of this name.").wait_for()
    assert visible(page) == [True, False]
