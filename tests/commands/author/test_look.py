"""author reports targets that no picture shows, and light that vanishes beside the Sun's."""

import json
import re
from math import pi
from pathlib import Path

import pytest

from spin_usd.commands.author.in_child import author_stage
from spin_usd.commands.check.calls import CheckStage
from spin_usd.commands.check.in_child.stage import stage_findings
from spin_usd.errors import StageError
from spin_usd.scene.finding import Finding
from spin_usd.stage.read.stage_reader import StageReader

POSES = [{"filename": "a.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 10]}]

TOO_BRIGHT = """#usda 1.0
(
    defaultPrim = "Box"
    metersPerUnit = 1
)
def Cube "Box"
{
    float[] primvars:displayOpacity = [2]
}
"""


def notes_of(folder: Path, material: str, **additions: bool) -> tuple[str, ...]:
    """Of authoring a triangle of a material in an MTL file."""
    (folder / "poses.json").write_text(json.dumps(POSES))
    (folder / "a.mtl").write_text(f"newmtl lamp\n{material}\n")
    target = folder / "model.obj"
    target.write_text("mtllib a.mtl\nusemtl lamp\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    poses, out = folder / "poses.json", folder / "stage"
    given = {"target": target, "camera": "speedplus", "units_per_metre": 1, **additions}
    notes = author_stage(poses=poses, out=out, **given).notes
    return tuple(note for note in notes if not note.startswith("body axes are"))


def test_a_target_that_nothing_shows_is_refused_unless_it_is_kept(tmp_path: Path) -> None:
    with pytest.raises(StageError, match=r"/World/Target: .*no geometry that is rendered.*--keep-transparent"):
        notes_of(tmp_path, "d 0")
    assert notes_of(tmp_path, "d 0", keep_transparent=True) == (
        "every material of the target has opacity 0: pictures show at most its reflections, labels all of it",
    )


def test_what_a_render_would_refuse_is_refused_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "poses.json").write_text(json.dumps(POSES))
    craft = tmp_path / "craft.usda"
    craft.write_text(TOO_BRIGHT)
    with pytest.raises(StageError, match=r"^/World/Target/Model\S*: .*displayOpacity.* is 2"):
        author_stage(poses=tmp_path / "poses.json", out=tmp_path / "stage", target=craft, camera="speedplus")
    assert {each.name for each in tmp_path.iterdir()} == {"craft.usda", "poses.json"}


def test_an_emission_that_vanishes_is_told_beside_the_suns_white(tmp_path: Path) -> None:
    (note,) = notes_of(tmp_path, "Kd 0.5 0.5 0.5\nKe 1 0.5 0")
    reader = StageReader(tmp_path / "stage" / "dataset.usda")
    (sun,) = reader.scene(reader.frames[0]).lights
    said = re.match(r"/World/Target/Model/mtl/lamp emits at most 1 W/m2/sr, (\S+) of the (\d+) of a white", note)
    assert said
    assert float(said[2]) == pytest.approx(max(sun.irradiance) / pi, rel=1e-2)  # type: ignore[union-attr]
    assert float(said[1]) == pytest.approx(pi / max(sun.irradiance), rel=0.05)  # type: ignore[union-attr]


@pytest.mark.parametrize("material", ["Ke 0 0 0", "Ke 100 100 100", "d 0.5"])
def test_what_shows_is_not_told(tmp_path: Path, material: str) -> None:
    assert notes_of(tmp_path, material) == ()


def test_overlapping_faces_are_said_once_of_each_shape(tmp_path: Path, shared: Path) -> None:
    """As `check` says them: a decal in a wall, whose corners are those of no face of the wall."""
    (tmp_path / "poses.json").write_text(json.dumps(POSES))
    target = shared / "data" / "strangers" / "decal.obj"
    given = {"target": target, "camera": "speedplus", "units_per_metre": 1, "also": [str(target)]}
    report = author_stage(poses=tmp_path / "poses.json", out=tmp_path / "stage", **given)
    said = [note for note in report.notes if "overlap others" in note]
    assert said == [f"{each.where}: {each.message}" for each in coincident(report.root)]
    assert "/World/Target/Model/Body with /World/Target/Model/Cell" in said[0]


def coincident(root: str) -> list[Finding]:
    found = stage_findings(CheckStage(stage=root), lambda *_: None).findings
    return [each for each in found if each.code == "faces-coincident"]


LEVELS = """o craft_LOD0
v 0 0 0
v 1 0 0
v 0 1 0
f 1 2 3
o craft_LOD1
v 0 0 -0.01
v 1.01 0 -0.01
v 0 1.01 -0.01
f 4 5 6
"""


@pytest.mark.parametrize(("leaves", "size"), [((), 1), (("*LOD0",), 1.01)])
def test_one_level_of_detail_is_the_target(tmp_path: Path, leaves: tuple[str, ...], size: float) -> None:
    """Its size is not that of the whole file, and nothing says that it was not kept."""
    (tmp_path / "poses.json").write_text(json.dumps(POSES))
    (tmp_path / "craft.obj").write_text(LEVELS)
    given = {"poses": tmp_path / "poses.json", "target": tmp_path / "craft.obj", "camera": "speedplus"}
    report = author_stage(**given, units_per_metre=1, out=tmp_path / "stage", leave_out=leaves)
    assert len([note for note in report.notes if "left out" in note]) == 1
    reader = StageReader(tmp_path / "stage/dataset.usda")
    target = reader.scene(reader.frames[0]).bodies[0].target
    assert target.mesh.box[1].tolist() == pytest.approx([size, size, -0.01 if leaves else 0])
    assert len(target.parts) == 1
