"""`spin-usd watch`: edits of a real stage, seen as its page sees them."""

import shutil
import time

import psutil
import pytest

from spin_usd.commands.watch.options import WatchOptions
from spin_usd.commands.watch.request import WatchedPicture, WatchRequest
from spin_usd.commands.watch.run import LightRender
from spin_usd.commands.watch.state import SharedState
from spin_usd.scene.effort import Effort
from tests.cases.root_layers import over_stage
from tests.cases.watching import save, watching

pytestmark = pytest.mark.children


FRAMES = 8
KINDS = {"image", "depth", "segmentation", "dense_pose"}


@pytest.fixture(scope="module")
def stage(small_stage, tmp_path_factory):
    """A root layer of our own over a copy of the small stage."""
    folder = tmp_path_factory.mktemp("watched") / "stage"
    shutil.copytree(small_stage.parent, folder)
    (folder / "edited.usda").write_text(over_stage(frames=FRAMES))
    return folder / "edited.usda"


@pytest.fixture(scope="module")
def page(stage):
    with watching(stage, "--renderer", "raycast") as page:
        page.shown()
        yield page
        assert page.stop() == 0


def pictures(page):
    return {kind: page.picture(kind) for kind in KINDS}


def over(*prims, text):
    """Opinions on a prim below /World."""
    for prim in reversed(prims):
        text = f'over "{prim}"\n{{\n{text}\n}}\n'
    return text


def test_an_edit_of_a_light_changes_the_image_alone(page, stage):
    before = pictures(page)
    save(stage, over_stage(frames=FRAMES, body=over("Lights", "Sun", text="float inputs:intensity = 300")))
    assert set(page.shown()["pictures"]) == KINDS
    after = pictures(page)
    assert {kind for kind in KINDS if before[kind] != after[kind]} == {"image"}


def test_an_edit_of_the_lens_written_in_place_changes_the_labels(page, stage):
    before = pictures(page)
    stage.write_text(over_stage(frames=FRAMES, body=over("Camera", text="double spin:lens:fx = 300")))
    page.shown()
    after = pictures(page)
    assert all(before[kind] != after[kind] for kind in KINDS)


def test_a_layer_below_the_root_is_watched_too(page, stage):
    poses = stage.parent / "layers" / "poses.usdc"
    before, text = page.picture("depth"), poses.read_bytes()
    poses.unlink()
    assert "poses.usdc" in page.faulty()["message"]
    assert page.picture("depth") == before
    poses.write_bytes(text)
    page.shown()
    assert page.picture("depth") == before


def test_a_slip_is_said_with_its_line_and_the_pictures_stay(page, stage):
    before, good = pictures(page), stage.read_text()
    save(stage, good.replace("spin:lens:fx = 300", "spin:lens:fx = = 300"))
    said = page.faulty()["message"]
    assert "edited.usda" in said
    assert "line " in said
    assert pictures(page) == before
    save(stage, good)
    page.shown()
    assert pictures(page) == before


def test_a_stage_that_was_deleted_comes_back(page, stage):
    text = stage.read_text()
    stage.unlink()
    assert "does not exist" in page.faulty()["message"]
    save(stage, text)
    page.shown()


def test_the_page_chooses_the_frame(page):
    before = page.picture("depth")
    assert page.choose("3") == 200
    state = page.state(lambda state: state["status"] == "shown" and state["place"] == 3)
    assert (state["frame"], state["frames"]) == ("img000004", FRAMES)
    assert page.picture("depth") != before
    page.choose("99")
    assert "0 to 7" in page.faulty()["message"]
    page.choose("0")
    page.shown()


def test_a_child_that_was_killed_is_replaced(page, stage):
    (child,) = psutil.Process(page.process.pid).children()
    child.kill()
    save(stage, stage.read_text() + "\n")
    page.shown()


def test_strangers_are_refused(page):
    own = page.address.rstrip("/")
    assert page.ask() == 200
    assert page.ask(Host="stranger.example") == 403
    assert page.ask(Origin="http://stranger.example") == 403
    choice = {"frame": "1", "variant": "nominal"}
    assert page.ask("choice", choice) == 403
    assert page.ask("choice", choice, Origin="null") == 403
    assert page.ask("choice", {"frame": 1}, Origin=own) == 403
    assert page.ask("picture/../../etc/passwd") == 404


def test_what_ends_the_render_s_thread_ends_the_command(stage):
    """As a terminal does that is gone when the image is to be shown."""

    def refuse(png):
        raise BrokenPipeError("gone")

    choice = WatchedPicture(frame="0", variant="nominal")
    options = WatchOptions(stage, frame="0", max_width=60)
    request = WatchRequest(stage=stage, options=options, renderer="raycast", effort=Effort(samples=1))
    shared = SharedState(choice, refuse)
    with LightRender(request, shared, lambda line: None) as light:
        light.raise_defect()
        light.render(choice, time.monotonic())
        shared.state_after(1, within_s=60)  # the image's is the first state
        with pytest.raises(BrokenPipeError):
            light.raise_defect()
    assert shared.state_after(0, 0)[1]["rendering"] is False


@pytest.mark.parametrize(
    ("frame", "variant", "said"), [("typo", "nominal", "0 to 7"), ("0", "typo", "choose one of nominal")]
)
def test_a_picture_that_the_stage_does_not_have_is_refused(stage, spin_usd, frame, variant, said):
    options = ["--frame", frame, "--variant", variant, "--port", "0", "--renderer", "raycast"]
    done = spin_usd("watch", stage, *options, code=2)
    assert said in done.stderr


def test_a_port_that_is_taken_is_one_sentence(page, stage, spin_usd):
    port = page.address.rstrip("/").rpartition(":")[2]
    done = spin_usd("watch", stage, "--frame", "0", "--port", port, code=2)
    assert "give another --port" in done.stderr
