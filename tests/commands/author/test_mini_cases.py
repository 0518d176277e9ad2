"""The small cases of real files, each as what its format says it is: by sizes that stand in the files themselves."""

import json
from pathlib import Path

import numpy as np
import pytest

from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import SpinError
from spin_usd.stage.read.stage_reader import StageReader

POSES = [{"filename": "a.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 30]}]
SIZES = {  # metres, along the file's own axes
    "animation_without_blend_shapes.usda": (1, 1, 1),
    "lamp_of_its_own.usda": (1, 1, 1),
    "roughness_below_zero.glb": (1, 1, 1),
    "skin_is_3_m_not_2.glb": (3, 3, 3),
    "sparse_accessor.glb": (2, 2, 2),
    "d_zero.obj": (2, 2, 0),
}
SUFFIXES = (".usda", ".obj", ".glb")


def authored(model: Path, folder: Path) -> StageReader:
    (folder / "poses.json").write_text(json.dumps(POSES))
    options = {"any_size": True} | ({} if model.suffix == ".usda" else {"units_per_metre": 1})
    report = author_stage(
        poses=folder / "poses.json", out=folder / "stage", target=model, camera="speedplus", **options
    )
    return StageReader(report.root)


@pytest.mark.parametrize("name", SIZES)
def test_a_case_has_its_own_size(shared, tmp_path: Path, name: str) -> None:
    reader = authored(shared / "data" / "mini" / name, tmp_path)
    target = reader.scene(reader.frames[0]).bodies[0].target
    np.testing.assert_allclose(np.ptp(target.mesh.box, axis=0), SIZES[name], atol=1e-5)


def test_what_is_authored_can_be_rendered_and_the_rest_leaves_nothing(shared, tmp_path: Path) -> None:
    cases = sorted(each for each in (shared / "data" / "mini").rglob("*") if each.suffix in SUFFIXES)
    assert len(cases) > 20
    for number, case in enumerate(cases):
        folder = tmp_path / str(number)
        folder.mkdir()
        try:
            reader = authored(case, folder)
        except SpinError:
            assert not (folder / "stage").exists()
        else:
            assert reader.scene(reader.frames[0]).bodies[0].target.parts, case
