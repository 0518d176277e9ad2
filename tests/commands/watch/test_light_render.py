"""`spin-usd watch` with Blender, and its page in a real browser."""

import shutil

import pytest

from tests.cases.root_layers import over_stage
from tests.cases.watching import save, watching

pytestmark = pytest.mark.slow
FRAMES = 8
SUN = """
over "Lights"
{
    over "Sun"
    {
        float inputs:intensity = %d
    }
}
"""


def lit(intensity):
    return over_stage(frames=FRAMES, body=SUN % intensity)


@pytest.fixture(scope="module")
def stage(small_stage, tmp_path_factory):
    folder = tmp_path_factory.mktemp("lit") / "stage"
    shutil.copytree(small_stage.parent, folder)
    (folder / "edited.usda").write_text(lit(1000))
    return folder / "edited.usda"


@pytest.fixture(scope="module")
def page(stage):
    with watching(stage, "--quality", "reference") as page:
        yield page
        assert page.stop() == 0


def test_blender_s_picture_follows_the_preview(page):
    assert page.shown("raycast")["rendering"]
    preview, depth = page.picture("image"), page.picture("depth")
    assert not page.shown("blender")["rendering"]
    assert page.picture("image") != preview
    assert page.picture("depth") == depth


def test_a_further_edit_cancels_the_older_render(page, stage):
    save(stage, lit(400))
    page.shown("raycast")
    save(stage, lit(700))
    assert page.state(lambda state: state["status"] == "shown")["light"] == "raycast"
    page.shown("blender")
    latest = page.picture("image")
    save(stage, lit(700) + "\n")
    page.shown("raycast")
    page.shown("blender")
    assert page.picture("image") == latest


def test_the_page_shows_pictures_and_slips(browser, page, stage):
    from playwright.sync_api import expect

    with browser.new_page(viewport={"width": 1366, "height": 768}) as tab:
        faults = []
        tab.on("pageerror", lambda error: faults.append(str(error)))
        tab.goto(page.address)
        expect(tab.locator("#name")).to_have_text("img000001 of nominal")
        for kind in ("image", "depth", "segmentation", "dense_pose"):
            expect(tab.locator(f"#{kind}")).to_have_js_property("naturalWidth", 240)
        tab.keyboard.press("ArrowRight")
        expect(tab.locator("#name")).to_have_text("img000002 of nominal", timeout=30_000)
        save(stage, lit(700).replace("over", "ovr", 1))
        expect(tab.locator("#fault")).to_contain_text("line ", timeout=30_000)
        save(stage, lit(700))
        expect(tab.locator("#fault")).to_be_hidden(timeout=30_000)
    assert not faults
