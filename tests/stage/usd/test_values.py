"""Attributes whose values are not what their readers expect: one sentence that names the attribute."""

import ast
from pathlib import Path

import pytest

import spin_usd
from spin_usd.errors import StageError
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader

STAGE = Path(spin_usd.__file__).parent / "stage"
READS = {"usd/values.py", "composition/differences.py"}  # diff compares any value

BOX = """def Mesh "Box"
{{
    {of_box}
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
}}"""
MOVED = 'uniform token[] xformOpOrder = ["xformOp:translate"]'
WRONG = {  # a declaration, of the camera or of the mesh, and the attribute that the sentence names
    "dkuble spin:lens:fx = 100": "Camera.spin:lens:fx",
    'string spin:lens:fx = "x"': "Camera.spin:lens:fx",
    "double spin:lens:k1 = inf": "Camera.spin:lens:k1",
    "double spin:lens:k1.timeSamples = { 0: nan, }": "Camera.spin:lens:k1",
    "int9 spin:lens:imageSize = 7": "Camera.spin:lens:imageSize",
    "double3 spin:lens:imageSize = (1, 2, 3)": "Camera.spin:lens:imageSize",
    'poken[] semantics:labels:class = ["a"]': "Box.semantics:labels:class",
    "float semantics:labels:class = 1": "Box.semantics:labels:class",
    f"doubleX xformOp:translate = (1, 2, 3)\n{MOVED}": "Box.xformOp:translate",
    f'string xformOp:translate = "x"\n{MOVED}': "Box.xformOp:translate",
    f"float xformOp:translate = 1\n{MOVED}": "Box.xformOp:translate",
    f"asset xformOp:translate = @x@\n{MOVED}": "Box.xformOp:translate",
    f"double3[] xformOp:translate = [(1, 2, 3)]\n{MOVED}": "Box.xformOp:translate",
    "float xformOpOrder = 1": "Box.xformOpOrder",
    'string holeIndices = "x"': "Box.holeIndices",
    "intX[] holeIndices = [1]": "Box.holeIndices",
    "double visibility = 1": "Box.visibility",
    "int subdivisionScheme = 1": "Box.subdivisionScheme",
    "color3f[] primvars:displayColor = [(nan, 0, 0)]": "primvars:displayColor",
}


@pytest.mark.parametrize("declaration", WRONG)
def test_a_value_of_the_wrong_type_is_one_sentence(make_stage, declaration) -> None:
    saying = WRONG[declaration]
    of_camera = saying.startswith("Camera.")
    name = declaration.split()[1]
    path = make_stage(
        geometry=BOX.format(of_box="" if of_camera else declaration), camera=declaration if of_camera else ""
    )
    lines = path.read_text().splitlines()
    first = next(i for i, line in enumerate(lines) if f" {name} =" in line)
    if of_camera and lines[first].strip() != declaration:  # the stage's own line for it
        del lines[first]
    path.write_text("\n".join(lines))
    with pytest.raises(StageError, match=saying):
        scene_of(path)
    assert any(saying in f"{finding.where} {finding.message}" for finding in check_stage(path))


def scene_of(path):
    reader = StageReader(path)
    return reader.scene(reader.frames[0])


def test_values_are_read_in_one_place() -> None:
    """No file calls USD's own Get, which returns whatever a layer authors."""
    for file in STAGE.rglob("*.py"):
        calls = [node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Attribute)]
        if file.relative_to(STAGE).as_posix() not in READS:
            assert not [f"{file}:{node.lineno}" for node in calls if node.attr == "Get"]
