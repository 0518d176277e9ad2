"""A session: a real model, clicks as rays, and the layer that is saved and that author reads."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from spin_usd.commands.author.additions import read_additions
from spin_usd.commands.author.options import AuthorOptions
from spin_usd.commands.keypoints.calls import SaveTarget
from spin_usd.commands.keypoints.in_child import save_target
from spin_usd.commands.keypoints.options import KeypointsOptions
from spin_usd.commands.keypoints.run import open_session, pick_keypoints
from spin_usd.commands.keypoints.suggestions import SuggestionMethod
from spin_usd.errors import InputError, MissingPackageError, OutputError
from spin_usd.geometry.snapping import Snap
from spin_usd.processes.executor import Executor
from tests.conftest import REPOSITORY

SIZE = np.array([1.0, 0.6, 0.4])
AT = np.array([0.25, 0, 1.5])  # the box's middle in the body's axes
CORNER = AT + SIZE / 2
EXACT = 1e-7  # metres: the model's file has single precision
ABOVE = AT + np.array([0.4, 0.2, 30])
DOWN = np.array([0, 0, -1.0])


@pytest.fixture(scope="module")
def request_of_box(tmp_path_factory):
    folder = tmp_path_factory.mktemp("box")
    trimesh.creation.box(SIZE, trimesh.transformations.translation_matrix(AT)).export(folder / "craft.ply")
    return KeypointsOptions(target=str(folder / "craft.ply"), out=folder / "points.usda", units_per_metre=1)


@pytest.fixture(scope="module")
def child():
    with Executor[None]() as child:
        yield child


@pytest.fixture(scope="module")
def session(request_of_box, child):
    return open_session(request_of_box, child, lambda line: None)


@pytest.fixture(autouse=True)
def empty(session):
    session.do(session.delete_all)
    session.pick, session.snap = None, Snap.VERTEX


def click(session, origin=ABOVE, direction=DOWN):
    session.do(lambda: session.click(origin, direction))


def saved(request):
    return read_additions(AuthorOptions(out="stage", keypoints=request.out)).keypoints


@pytest.mark.parametrize(
    ("snap", "place"),
    [
        (Snap.SURFACE, AT + np.array([0.4, 0.2, 0.2])),
        (Snap.VERTEX, CORNER),
        (Snap.EDGE, AT + np.array([0.5, 0, 0.2])),
        (Snap.FACE, AT + np.array([0, 0, 0.2])),
    ],
)
def test_a_click_snaps_and_author_reads_what_was_added(session, request_of_box, snap, place) -> None:
    session.snap = snap
    click(session)
    assert session.preview == pytest.approx(place, abs=EXACT)
    session.do(lambda: session.add("tip"))
    assert saved(request_of_box).names == ("tip",)
    assert (saved(request_of_box).points == session.keypoints.points).all()
    assert session.pick is None


def test_a_click_on_a_marker_selects_it_and_one_behind_the_target_does_not(session) -> None:
    click(session)
    session.do(lambda: session.add("front"))
    session.do(lambda: session.copy_selected("mirror x (plane y z)"))
    assert session.selected == "front_1"
    click(session, CORNER + np.array([0, 0, 5]))
    assert (session.selected, session.pick) == ("front", None)
    click(session, CORNER * [1, 1, -1] + np.array([-0.01, -0.01, -5]), -DOWN)
    assert session.pick is not None


def test_refusals_are_one_sentence_and_change_nothing(session) -> None:
    session.do(lambda: session.add("tip"))
    assert session.status.refused
    assert "click on the target first" in session.status.text
    click(session, ABOVE + np.array([9, 0, 0]))
    assert "met nothing" in session.status.text
    click(session)
    session.do(lambda: session.add("tip"))
    click(session, ABOVE - [0.8, 0, 0])
    session.do(lambda: session.add("tip"))
    assert session.status.refused
    assert session.keypoints.names == ("tip",)
    assert session.pick is not None


def test_all_changes_are_undone_and_done_again(session, request_of_box) -> None:
    click(session)
    session.do(lambda: session.add("a"))
    session.do(lambda: session.change_selected("b", np.array([1.0, 2, 3])))
    session.do(lambda: session.copy_selected("half turn about z"))
    assert saved(request_of_box).points.tolist() == [[1, 2, 3], [-1, -2, 3]]
    session.do(session.undo)
    session.do(session.undo)
    assert saved(request_of_box).names == ("a",)
    session.do(session.redo)
    assert saved(request_of_box).names == ("b",)
    session.do(session.delete_selected)
    assert session.selected is None


@pytest.mark.parametrize("method", SuggestionMethod)
def test_suggestions_are_corners_of_the_box_and_a_seed_decides_them(session, method) -> None:
    session.do(lambda: session.suggest(method, 5, 7))
    first = session.suggested
    assert np.abs(first - AT) == pytest.approx(np.broadcast_to(SIZE / 2, (5, 3)), abs=EXACT)
    session.do(lambda: session.suggest(method, 5, 7))
    assert (session.suggested == first).all()
    session.do(lambda: session.suggest(method, 100, 7))
    assert len(session.suggested) == 8
    session.do(session.add_suggestions)
    assert session.keypoints.names == tuple(f"point_{number}" for number in range(1, 9))
    session.do(session.undo)
    assert session.keypoints.names == ()


def test_a_click_on_a_suggestion_picks_it(session) -> None:
    session.do(lambda: session.suggest(SuggestionMethod.HULL, 8, 0))
    click(session, CORNER + np.array([0.01, 0.01, 5]))
    assert session.preview == pytest.approx(CORNER, abs=EXACT)
    session.do(session.forget_suggestions)
    click(session, CORNER + np.array([0.01, 0.01, 5]))
    assert session.pick is None


def test_it_goes_on_with_what_was_saved(session, request_of_box, child) -> None:
    click(session)
    session.do(lambda: session.add("kept"))
    told: list[str] = []
    again = open_session(request_of_box, child, told.append)
    assert again.keypoints.names == ("kept",)
    assert (again.keypoints.points == session.keypoints.points).all()
    assert "continues with 1 keypoint of" in told[-1]


def test_a_failed_save_is_said_and_made_good_by_the_next(session, request_of_box) -> None:
    click(session)
    request_of_box.out.unlink()
    request_of_box.out.mkdir()
    session.do(lambda: session.add("a"))
    assert session.unsaved
    assert session.keypoints.names == ("a",)
    request_of_box.out.rmdir()
    session.do(lambda: session.copy_selected("half turn about z"))
    assert session.unsaved is None
    assert saved(request_of_box).names == ("a", "a_1")


def test_two_tools_do_not_replace_one_anothers_keypoints(session, request_of_box, child) -> None:
    other = open_session(request_of_box, child, lambda line: None)
    click(session)
    session.do(lambda: session.add("first"))
    click(other)
    other.do(lambda: other.add("second"))
    assert "was changed by another program" in (other.unsaved or "")
    assert saved(request_of_box).names == ("first",)
    request_of_box.out.unlink()
    other.do(lambda: other.copy_selected("half turn about z"))
    assert other.unsaved is None
    session.do(session.delete_all)
    assert saved(request_of_box).names == ("second", "second_1")
    request_of_box.out.unlink()


def test_an_error_of_ours_is_shown_as_a_change_that_is_not_saved(session, monkeypatch) -> None:
    def fail(keypoints):
        raise RuntimeError("no such luck")

    shown: list[tuple[str, str | None]] = []
    monkeypatch.setattr(session, "_save", fail)
    monkeypatch.setattr(session, "on_change", lambda: shown.append((session.status.text, session.unsaved)))
    click(session)
    with pytest.raises(RuntimeError):
        session.do(lambda: session.add("a"))
    assert shown[-1] == ("an internal error: no such luck", "the last change was not saved")


def test_what_cannot_be_begun_is_refused(request_of_box, child, tmp_path) -> None:
    missing = tmp_path / "no" / "points.usda"
    (tmp_path / "other.usda").write_text("#usda 1.0\n")
    model = REPOSITORY / "stages" / "targets" / "cubesat" / "cubesat.usda"
    (tmp_path / "model.usda").write_bytes(model.read_bytes())
    for changes, error, said in (
        ({"target": "nothing"}, InputError, "there is no target named 'nothing'"),
        ({"target": "missing.obj"}, InputError, "is not there"),
        ({"out": tmp_path / "points.csv"}, InputError, "ends in .usda"),
        ({"out": tmp_path / "other.usda"}, InputError, "has 0 Points prims"),
        ({"out": tmp_path / "model.usda"}, InputError, "holds more than keypoints, and would be replaced"),
        ({"out": missing}, OutputError, "cannot be written"),
        ({"units_per_metre": 0.001}, InputError, "did you mean --units-per-metre 1 .* --any-size insists"),
    ):
        with pytest.raises(error, match=said):
            open_session(replace(request_of_box, **changes), child, lambda line: None)
    with pytest.raises(InputError, match="holds no keypoint"):
        saved(request_of_box)
    assert (tmp_path / "model.usda").read_bytes() == model.read_bytes()


def test_without_viser_the_tool_says_how_to_install_it(tmp_path, monkeypatch) -> None:
    """Viser is an extra: it brings a web stack that nothing else needs."""
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(
        MissingPackageError, match=r"needs viser, which is not installed; run .*pip install 'viser>=1\.1'"
    ):
        pick_keypoints(KeypointsOptions("tango"), tell=print)


def test_a_target_with_textures_has_its_colours(tmp_path) -> None:
    """They are read from images, which are there only as long as the model's copy is."""
    read = save_target(SaveTarget(target="tango", folder=str(tmp_path)))
    assert read.name == "tango"
    with np.load(tmp_path / "target.npz") as found:
        assert len(np.unique(found["colors"], axis=0)) > 2


def test_the_axes_of_an_own_model_are_said(shared, tmp_path) -> None:
    decal = str(shared / "data" / "strangers" / "decal.obj")
    read = save_target(SaveTarget(target=decal, folder=str(tmp_path), units_per_metre=1.0))
    own = "body axes are the file's own x, y and z, and it does not state an up axis: keypoints are meant in these"
    assert own in read.notes
