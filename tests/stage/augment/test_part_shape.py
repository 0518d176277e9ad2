"""Parts that are not as drawn: mesh and keypoints are where the parameters put them, and all else stays."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from spin_usd.commands.author.augment import augment_stage
from spin_usd.errors import InputError, StageError
from spin_usd.geometry.bend import SAGITTA
from spin_usd.geometry.part_axes import PartAxes, nearest
from spin_usd.scene.derived.content_keys import geometry_key
from spin_usd.scene.scene import FrameId
from spin_usd.stage.augment.edited_stage import EditedStage, Edits
from spin_usd.stage.augment.part_shape import part_shape
from spin_usd.stage.augment.sampled_values import open_base
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.shaped import BENT, BULGED, SCALE, SHIFT, TURN, WING, author_shaped, specification

NAMES = WING.split("+")
ROUNDED = 1e-9  # metres
ON_SURFACE = 1e-6  # metres: the model's points are of single precision


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    return author_shaped(tmp_path_factory.mktemp("shaped"))


@pytest.fixture(scope="module")
def scenes(stage):
    variants = ("nominal", *("as_drawn", "moved", "bent", "bulged", "gone", "every"))
    readers = {name: StageReader(stage, variant=name) for name in variants}
    return {name: reader.scene(reader.frames[0]) for name, reader in readers.items()}


def corners(target, names):
    ids = [part.id for part in target.parts if part.name in names]
    mesh = target.mesh
    assert not mesh.instances
    return mesh.points[mesh.faces[np.isin(mesh.face_part, ids)]]


def on_wing(target):
    return np.array([part.rpartition("/")[2] in NAMES for part in target.shape.keypoint_parts])


def test_none_is_as_drawn(scenes) -> None:
    nominal, same = scenes["nominal"], scenes["as_drawn"]
    assert same.target.shape is None
    assert geometry_key(same) == geometry_key(nominal)
    assert same.target.key == nominal.target.key


def test_every_shape_has_a_key_of_its_own(scenes) -> None:
    keys = {geometry_key(scene) for name, scene in scenes.items() if name != "as_drawn"}
    assert len(keys) == len(scenes) - 1


def test_the_rest_of_the_craft_stays(scenes) -> None:
    nominal = scenes["nominal"].target
    for name, changed in {"moved": NAMES, "bent": NAMES, "bulged": ["Body"], "gone": NAMES}.items():
        others = {part.name for part in nominal.parts} - set(changed)
        np.testing.assert_array_equal(corners(scenes[name].target, others), corners(nominal, others))


def test_a_moved_part_and_its_keypoints_are_T_times_the_drawn_ones(scenes) -> None:
    nominal, moved = scenes["nominal"].target, scenes["moved"].target
    wing, rest = corners(nominal, NAMES), corners(nominal, {part.name for part in nominal.parts} - set(NAMES))
    root, turn = PartAxes.of(wing, rest).root, np.radians(TURN)
    rotation = np.array([[1, 0, 0], [0, np.cos(turn), -np.sin(turn)], [0, np.sin(turn), np.cos(turn)]])

    def T(points):
        return (points - root) @ (SCALE * rotation).T + root + SHIFT

    np.testing.assert_allclose(corners(moved, NAMES), T(wing), atol=ROUNDED)
    own = on_wing(moved)
    assert own.any()
    assert not own.all()
    np.testing.assert_allclose(moved.keypoints[own], T(nominal.keypoints[own]), atol=ROUNDED)
    np.testing.assert_array_equal(moved.keypoints[~own], nominal.keypoints[~own])
    np.testing.assert_array_equal(moved.shape.drawn_keypoints, nominal.keypoints)
    for part in moved.shape.parts:
        recorded = nominal.keypoints @ part.T_body_drawn[:3, :3].T + part.T_body_drawn[:3, 3]
        np.testing.assert_allclose(recorded, T(nominal.keypoints), atol=ROUNDED)


def test_a_bent_panel_keeps_its_length_on_an_arc_of_constant_curvature(scenes) -> None:
    nominal, bent = scenes["nominal"].target, scenes["bent"].target
    drawn, both = corners(nominal, ["WingPlusX"]).reshape(-1, 3), corners(nominal, NAMES).reshape(-1, 3)
    after = corners(bent, ["WingPlusX"]).reshape(-1, 3)
    start, length, middle = both[:, 0].min(), np.ptp(both[:, 0]), (both[:, 1].min() + both[:, 1].max()) / 2
    radius = length / np.radians(BENT)
    from_centre = radius - np.hypot(after[:, 0] - start, after[:, 1] - (middle + radius))  # as far as from the middle
    heights = drawn[:, 1] - middle
    np.testing.assert_allclose([from_centre.min(), from_centre.max()], [heights.min(), heights.max()], atol=ROUNDED)
    along = np.arctan2(after[:, 0] - start, middle + radius - after[:, 1]) * radius
    ends = [along.min(), along.max()]
    np.testing.assert_allclose(ends, [drawn[:, 0].min() - start, drawn[:, 0].max() - start], atol=ROUNDED)
    own = on_wing(bent)
    distance, _ = nearest(bent.keypoints[own], corners(bent, NAMES))
    expected, _ = nearest(nominal.keypoints[own], corners(nominal, NAMES))
    np.testing.assert_allclose(distance, expected, atol=2 * SAGITTA * length)


def test_a_bulge_leaves_borders_and_takes_keypoints_with_it(scenes) -> None:
    nominal, bulged = scenes["nominal"].target, scenes["bulged"].target
    drawn = corners(nominal, ["Body"])
    away, _ = nearest(corners(bulged, ["Body"]).reshape(-1, 3)[::7], drawn)
    assert away.max() <= BULGED + ROUNDED
    tops = np.abs(corners(bulged, ["Body"]).reshape(-1, 3)).max(0) - np.abs(drawn.reshape(-1, 3)).max(0)
    assert tops.max() == pytest.approx(BULGED, rel=1e-6)
    np.testing.assert_allclose(nearest(drawn.reshape(-1, 3), corners(bulged, ["Body"]))[0], 0, atol=ON_SURFACE)
    own = [part.endswith("/Body") for part in bulged.shape.keypoint_parts]
    assert any(own)
    np.testing.assert_allclose(
        nearest(bulged.keypoints[own], corners(bulged, ["Body"]))[0],
        nearest(nominal.keypoints[own], drawn)[0],
        atol=1e-4,
    )


def test_a_missing_part_has_no_face_and_no_keypoint(scenes) -> None:
    nominal, gone = scenes["nominal"].target, scenes["gone"].target
    assert not len(corners(gone, NAMES))
    assert [part.id for part in gone.parts] == [part.id for part in nominal.parts]
    np.testing.assert_array_equal(gone.shape.keypoint_missing, on_wing(gone))


def test_parts_that_are_missing_are_named_where_nothing_is_left(stage) -> None:
    opened = open_stage(stage, variant="gone")
    reader = StageReader(stage, variant="gone", stage=opened)
    with Usd.EditContext(opened, opened.GetSessionLayer()):
        for part in reader.scene(reader.frames[0]).bodies[0].target.parts:
            UsdGeom.Imageable(opened.GetPrimAtPath(part.path)).GetVisibilityAttr().Set("invisible")
    reader = StageReader(stage, variant="gone", stage=opened, numbering=reader.numbering)
    with pytest.raises(StageError, match="no part that is rendered at time code 0: `missing` of the variant"):
        reader.scene(reader.frames[0])


def test_a_target_that_a_picture_does_not_show_may_lack_all_parts(stage) -> None:
    opened = open_stage(stage)
    base, _, _ = open_base(opened)
    change = part_shape(base, ("part.*.missing",))
    with pytest.raises(InputError, match="all parts of the target microsat are missing in picture img000002"):
        change.values({"part.*.missing": True}, base.times[1])
    UsdGeom.Imageable(opened.GetPrimAtPath("/World/Target")).GetVisibilityAttr().Set("invisible", base.times[1])
    assert change.values({"part.*.missing": True}, base.times[1])


def test_a_simulator_changes_shapes_too(stage, scenes) -> None:
    base = StageReader(stage)
    frame: FrameId = base.frames[0]
    edits = Edits(values={f"part.{WING}.bent": BENT})
    edited = EditedStage(stage, base, frame, edits)
    assert edited.scene(frame, edits).bodies[0].target.mesh.key == scenes["bent"].target.mesh.key
    less = Edits(values={f"part.{WING}.bent": 0.0})
    assert edited.scene(frame, less).bodies[0].target.mesh.key == scenes["nominal"].target.mesh.key


def test_a_simulator_places_a_part_that_is_changed_too(stage) -> None:
    base = StageReader(stage)
    frame, moved = base.frames[0], np.eye(4)
    moved[:3, 3] = (0, 0, 0.5)
    edits = Edits(parts={"WingPlusX": moved}, values={"part.WingPlusX.shift.x": 0.25})
    target = EditedStage(stage, base, frame, edits).scene(frame, edits).bodies[0].target
    drawn = corners(base.scene(frame).bodies[0].target, ["WingPlusX"])
    np.testing.assert_allclose(corners(target, ["WingPlusX"]), drawn + np.array([0.25, 0, 0.5]), atol=ROUNDED)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"part.Wing.turn": "3"}, "no target has a part 'Wing'"),
        ({"part.WingPlusX.turn": "3", f"part.{WING}.turn": "3"}, "twice"),
        ({"part.WingPlusX.bent": "181"}, "numbers from -180 to 180"),
        ({"part.WingPlusX.scale": "0"}, "numbers from 0.001"),
        ({"part.WingPlusX.shift.w": "1"}, "there is no"),
        (
            {"part.*.missing": "true"},
            r"augmentation wrong: part\.\*\.missing: all parts of the target microsat are missing in picture img000001",
        ),
    ],
)
def test_what_cannot_be_is_refused(stage, tmp_path, values, words) -> None:
    (tmp_path / "wrong.toml").write_text(specification({"wrong": values}))
    with pytest.raises(InputError, match=words):
        augment_stage(stage=stage, spec=str(tmp_path / "wrong.toml"))
