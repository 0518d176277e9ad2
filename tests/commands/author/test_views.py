"""What author and check say of what the pictures show, and what author refuses as implausible."""

import json
from pathlib import Path
from typing import Any

import pytest
import trimesh
from msgspec import to_builtins

from spin_usd.commands.author.in_child import author_stage
from spin_usd.commands.author.reports import AuthorReport
from spin_usd.errors import InputError
from spin_usd.scene.derived.views import ViewKind
from spin_usd.scene.finding import ERROR, WARNING, Finding
from spin_usd.stage.check.check_stage import check_stage

BOX_CM = (110, 80, 30)
COLOURED = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 1
property list uchar int vertex_indices
end_header
0 0 0 255 0 0
0.3 0 0 255 0 0
0 0.3 0 0 255 0
3 0 1 2
"""


@pytest.fixture
def craft(tmp_path: Path) -> Path:
    trimesh.creation.box(BOX_CM).export(tmp_path / "craft.obj")
    return tmp_path / "craft.obj"


def poses(folder: Path, *places: tuple[float, float, float]) -> Path:
    rows = [
        {"filename": f"p{i}.png", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": place}
        for i, place in enumerate(places)
    ]
    (folder / "poses.json").write_text(json.dumps(rows))
    return folder / "poses.json"


def author(craft: Path, *places: tuple[float, float, float], units: float | None = 100, **more: Any) -> AuthorReport:
    folder = craft.parent
    listed = poses(folder, *places)
    choices = {"camera": "speedplus", "target": craft, "units_per_metre": units} | more
    return author_stage(poses=listed, out=folder / "stage", **choices)


def findings(report: AuthorReport) -> list[Finding]:
    return [finding for finding in check_stage(report.root) if finding.code.startswith(("target", "camera"))]


def test_size_and_distance_are_reported(craft: Path) -> None:
    report = author(craft, (0, 0, 5), (0, 0, 8))
    assert report.views is not None
    assert report.views.size == pytest.approx((1.1, 0.8, 0.3))
    assert report.views.distance == pytest.approx((5, 8))
    assert not [note for note in report.notes if "in " in note and "picture" in note]
    assert findings(report) == []


@pytest.mark.parametrize(
    ("place", "code", "said"),
    [
        ((0, 0, -8), "target-behind", "the target is behind the camera"),
        ((8, 0, 5), "target-outside", "the target is outside the frame"),
        ((8, 0, 0), "target-outside", "the target is outside the frame"),
        ((1.6, 0, 5), "target-cut-off", "the target is cut off by the frame"),
        ((0, 0, 8000), "target-small", "the target is less than 5 pixels across"),
        ((0.2, 0.1, 0.05), "camera-inside", "the camera is inside the target's bounding box"),
    ],
)
def test_pictures_that_a_user_may_not_have_meant_are_reported(
    craft: Path, place: tuple[float, float, float], code: str, said: str
) -> None:
    report = author(craft, (0, 0, 5), place, (0, 0, 6))
    assert [note for note in report.notes if note.startswith(f"in 1 of 3 pictures {said} (p1): ")]
    found = findings(report)
    assert [(finding.code, finding.severity) for finding in found] == [(code, WARNING)]
    assert f"in 1 of 3 pictures {said} (p1): " in found[0].message


def test_no_picture_of_the_target_is_an_error(craft: Path) -> None:
    found = findings(author(craft, (0, 0, -8), (9, 0, 5)))
    assert [(finding.code, finding.severity) for finding in found] == [
        ("target-behind", ERROR),
        ("target-outside", ERROR),
    ]


def test_pictures_of_the_dark_side_are_reported(craft: Path, tmp_path: Path) -> None:
    report = author(craft, (0, 0, 5), sun_direction=[0, 0, 1])
    assert [note for note in report.notes if "faces away from the Sun (p0)" in note]
    assert [finding.code for finding in findings(report)] == ["target-unlit"]


def test_a_unit_that_puts_the_camera_inside_is_refused_with_the_likely_one(craft: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        author(craft, (0, 0, 5), (0, 0, 8), units=1)
    assert str(refused.value) == (
        f"{craft}: with --units-per-metre 1 the target is 110 x 80 x 30 m, and the camera is inside its bounding box "
        "in 2 of 2 pictures; did you mean --units-per-metre 100 (1.1 x 0.8 x 0.3 m) or --units-per-metre 1000 "
        "(0.11 x 0.08 x 0.03 m)? --any-size insists"
    )
    assert not (tmp_path / "stage").exists()
    assert author(craft, (0, 0, 5), units=1, any_size=True).frames == 1


@pytest.mark.parametrize(("units", "size"), [(0.1, "1100 x 800 x 300"), (1e4, "0.011 x 0.008 x 0.003")])
def test_a_size_that_no_craft_has_is_refused_with_the_likely_unit(craft: Path, units: float, size: str) -> None:
    with pytest.raises(InputError, match=rf"the target is {size} m.*did you mean --units-per-metre 100 \(1.1 x 0.8"):
        author(craft, (0, 0, 5), (0, 0, 8), (2000, 0, 100), units=units)
    with pytest.raises(InputError, match=rf"the target is {size} m.*did you mean --units-per-metre"):
        author_stage(sample="urso", out=craft.parent / "s", count=2, target=craft, units_per_metre=units)


def test_insisting_names_the_likely_unit_too_where_nothing_is_inside(craft: Path) -> None:
    options = {"target": craft, "camera": "speedplus", "count": 2, "any_size": True}
    sample = "range=4..8 inside=1"
    with pytest.raises(InputError, match=r"none of .* is 1100 x 800 x 300 m; did you mean .* 100 \(1.1 x 0.8 x"):
        author_stage(sample=sample, out=craft.parent / "s", units_per_metre=0.1, **options)
    with pytest.raises(InputError, match=r"none of .* 11 m across, .*; put it farther away .* or check the unit"):
        author_stage(sample=sample, out=craft.parent / "s", units_per_metre=10, **options)


def test_gltf_and_usd_say_their_unit_in_their_own_words(tmp_path: Path) -> None:
    trimesh.creation.box(BOX_CM).export(tmp_path / "craft.glb")
    with pytest.raises(InputError, match=r"in the unit of its format or file, the target is 110 x 80 x 30 m.*did you mean --units-per-metre 100 "):  # noqa: E501  # fmt: skip
        author(tmp_path / "craft.glb", (0, 0, 5), units=None)
    usd = tmp_path / "craft.usda"
    usd.write_text('#usda 1.0\n(\n defaultPrim = "C"\n metersPerUnit = 1\n)\ndef Cube "C" {\n double size = 300\n}\n')
    with pytest.raises(InputError, match=r"with metersPerUnit = 1 in craft.usda the target is 300 x 300 x 300 m.*did you mean metersPerUnit = 0.01 in craft.usda \(3 x 3 x 3 m\) or metersPerUnit = 0.001 in craft.usda \(0.3 x 0.3 x 0.3 m\)\? --any-size"):  # noqa: E501  # fmt: skip
        author(usd, (0, 0, 20), units=None)


@pytest.mark.parametrize("environment", [None, "earth"])
def test_metal_under_the_sun_alone_is_noted(tmp_path: Path, environment: str | None) -> None:
    """glTF's metallic is 1 where none is given."""
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    box.visual = trimesh.visual.TextureVisuals(material=trimesh.visual.material.PBRMaterial(baseColorFactor=[1, 1, 1]))
    box.export(tmp_path / "craft.glb")
    notes = author(tmp_path / "craft.glb", (0, 0, 5), units=None, environment=environment).notes
    said = "100% of the target's surface is metal (inputs:metallic above 0.9)"
    assert any(note.startswith(said) for note in notes) == (environment is None)


def test_where_no_unit_would_fit_the_poses_are_named(tmp_path: Path, craft: Path) -> None:
    with pytest.raises(InputError, match="check the units of the model and of the poses, which are in metres"):
        author(craft, (0, 0, 0.005))


def test_a_target_that_is_small_in_most_pictures_is_told(craft: Path) -> None:
    said = "in all 2 pictures the target is less than a tenth of the frame across"
    assert [note for note in author(craft, (0, 0, 6), (0, 0, 7), units=1000).notes if note.startswith(said)]


def test_the_real_tango_in_metres_is_refused(shared: Path, tmp_path: Path) -> None:
    tango, listed = shared / "data/tango/tango.obj", shared / "data/speedplus/sunlamp.json"
    choices = {"poses": listed, "target": tango, "camera": "speedplus", "frames": "0:40"}
    with pytest.raises(
        InputError, match=r"111 x 109 x 34 m.*did you mean --units-per-metre 100 \(1.11 x 1.09 x 0.34 m"
    ):
        author_stage(out=tmp_path / "s", units_per_metre=1, **choices)
    report = author_stage(out=tmp_path / "s", units_per_metre=100, **choices)
    assert report.views
    unusable = (ViewKind.BEHIND, ViewKind.OUTSIDE, ViewKind.CAMERA_INSIDE, ViewKind.FEW_PIXELS)
    assert report.views.count(*unusable) == 0


def test_plan_tells_the_same_of_all_variants(craft: Path, spin_usd: Any) -> None:
    spec = craft.parent / "spec.toml"
    spec.write_text(
        'schema = "augment-1"\n[[augmentation]]\nname = "bright"\n[augmentation.sample]\n'
        '"exposure.stops" = { distribution = "fixed", value = 1, unit = "stops" }\n'
    )
    report = author(craft, (0, 0, 5), (0, 0, -8), augment=str(spec))
    command = ["plan", craft.parent / "stage", "--renderer", "raycast", "--variants", "all"]
    done = spin_usd(*command)
    assert "target 1.1 x 0.8 x 0.3 m, 5 to 8 m from the camera" in done.stdout
    assert "in 2 of 4 pictures the target is behind the camera (nominal/p1, bright/p1)" in done.stderr
    views = json.loads(spin_usd(*command[:4], "--json").stdout)["views"]
    assert report.views
    assert views == json.loads(json.dumps(to_builtins(report.views)))


def test_what_a_camera_file_lacks_is_told(tmp_path: Path) -> None:
    (tmp_path / "craft.ply").write_text(COLOURED)
    matrix = [[3000, 0, 960], [0, 3000, 600], [0, 0, 1]]
    camera = {"Nu": 640, "Nv": 480, "ppx": 5.86e-6, "ppy": 5.86e-6, "cameraMatrix": matrix}
    (tmp_path / "camera.json").write_text(json.dumps(camera))
    report = author(tmp_path / "craft.ply", (-0.9, -0.6, 5), units=1, camera=tmp_path / "camera.json")
    for said in (
        "camera.json has no 'distCoeffs': its lens is taken for one without distortion",
        "camera.json has its principal point (960, 600) outside its picture of 640 x 480 pixels: check that this is "
        "the size of the calibration",
        "camera.json does not state colour: pictures are grey; --channels rgb makes them coloured",
    ):
        assert said in report.notes
    assert "lens-aside" in {finding.code for finding in check_stage(report.root)}
    more = {"camera": tmp_path / "camera.json", "channels": "rgb", "out": tmp_path / "rgb"}
    listed = poses(tmp_path, (0, 0, 5))
    coloured = author_stage(poses=listed, target=tmp_path / "craft.ply", units_per_metre=1, **more)
    assert not [note for note in coloured.notes if "state colour" in note]
