"""One law for the axes, the unit and the time of a model, whatever its format: one craft, written by the usual exporter
of each."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import SpinError
from spin_usd.stage.read.stage_reader import StageReader
from tests.commands.author.test_step_models import METRE, step_box

POSES = [{"filename": "a.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 20]}]
MAKE = """
import bpy, sys
from pathlib import Path
folder = Path(sys.argv[1])
bpy.ops.wm.read_factory_settings(use_empty=True)
def box(name, corner, size):
    bpy.ops.mesh.primitive_cube_add(size=1, location=[c + s / 2 for c, s in zip(corner, size)])
    made = bpy.context.object
    made.name = made.data.name = name
    made.scale = size
    return made
box("Bus", (0, 0, 0), (1, 2, 3))
mast = box("Mast", (0.25, 0.5, 3), (0.5, 0.25, 1.5))
bpy.ops.object.select_all(action="SELECT")
bpy.ops.object.transform_apply()
for module in ("io_scene_fbx", "io_scene_gltf2"):
    bpy.ops.preferences.addon_enable(module=module)
path = lambda name: str(folder / name)
def write(stem):
    bpy.ops.wm.save_as_mainfile(filepath=path(f"{stem}.blend"), copy=True)
    bpy.ops.export_scene.fbx(filepath=path(f"{stem}.fbx"))
    bpy.ops.export_scene.gltf(filepath=path(f"{stem}.glb"), export_current_frame=True)
write("craft")
bpy.ops.export_scene.fbx(filepath=path("z_up.fbx"), axis_forward="Y", axis_up="Z")
bpy.ops.wm.obj_export(filepath=path("craft.obj"))
bpy.ops.wm.obj_export(filepath=path("z_up.obj"), forward_axis="Y", up_axis="Z")
bpy.ops.wm.stl_export(filepath=path("craft.stl"))
bpy.ops.wm.ply_export(filepath=path("craft.ply"))
bpy.ops.wm.usd_export(filepath=path("craft.usdc"), export_materials=False)
mast.keyframe_insert("location", frame=1)
mast.location = (0, 0, 4)
mast.keyframe_insert("location", frame=25)
bpy.context.scene.frame_set(25)
write("moving")
"""
BOX = np.array([[0, 0, 0], [1, 2, 4.5]])
Y_UP = np.array([[0, 0, -2], [1, 4.5, 0]])
NAMES = ["Bus", "Mast"]
FILES = {
    "craft.blend": (BOX, "z", NAMES),
    "craft.fbx": (Y_UP, "y", NAMES),
    "z_up.fbx": (BOX, "z", NAMES),
    "craft.glb": (Y_UP, "y", NAMES),
    "craft.obj": (Y_UP, "", NAMES),
    "z_up.obj": (BOX, "", NAMES),
    "craft.stl": (BOX, "", []),
    "craft.ply": (BOX, "", []),
    "craft.usdc": (BOX, "z", NAMES),
    "craft.dae": (BOX, "z", NAMES),
    "craft.step": (np.array([[0, 0, 0], [1, 2, 3]]), "", ["hull"]),
}
"""By file the box in its own axes, the axis that it calls up, and its parts' names."""
DAE = """<COLLADA version="1.4.1"><asset>{unit}<up_axis>Z_UP</up_axis></asset>
<library_geometries>{geometries}</library_geometries>
<library_visual_scenes><visual_scene id="S">{nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#S"/></scene></COLLADA>"""
GEOMETRY = """<geometry id="{name}" name="{name}"><mesh><source id="{name}P">
<float_array count="24" id="{name}A">{points}</float_array>
<technique_common><accessor count="8" source="#{name}A" stride="3"/></technique_common></source>
<vertices id="{name}V"><input semantic="POSITION" source="#{name}P"/></vertices><polylist count="6">
<input semantic="VERTEX" source="#{name}V" offset="0"/><vcount>4 4 4 4 4 4</vcount>
<p>0 1 3 2 4 6 7 5 0 4 5 1 2 3 7 6 0 2 6 4 1 5 7 3</p></polylist></mesh></geometry>"""


def dae(unit: str) -> str:
    boxes = {"Bus": ((0, 0, 0), (1, 2, 3)), "Mast": ((0.25, 0.5, 3), (0.75, 0.75, 4.5))}
    made = {name: [(a[i & 1][0], a[i >> 1 & 1][1], a[i >> 2][2]) for i in range(8)] for name, a in boxes.items()}
    text = {name: " ".join(str(x) for point in points for x in point) for name, points in made.items()}
    geometries = "".join(GEOMETRY.format(name=name, points=points) for name, points in text.items())
    nodes = "".join(f'<node name="{name}"><instance_geometry url="#{name}"/></node>' for name in boxes)
    return DAE.format(unit=unit, geometries=geometries, nodes=nodes)


@pytest.fixture(scope="module")
def crafts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("crafts")
    subprocess.run([sys.executable, "-c", MAKE, str(folder)], check=True, stdout=subprocess.DEVNULL)
    (folder / "poses.json").write_text(json.dumps(POSES))
    (folder / "craft.dae").write_text(dae('<unit name="meter" meter="1"/>'))
    (folder / "craft.step").write_text(step_box((1, 2, 3), METRE))
    return folder


def authored(folder: Path, name: str, out: Path, **options):
    """Return the target and the notes of the stage of a file."""
    if name.endswith((".obj", ".stl", ".ply")):
        options["units_per_metre"] = 1.0
    report = author_stage(
        poses=folder / "poses.json", out=out, target=folder / name, camera="speedplus", any_size=True, **options
    )
    reader = StageReader(report.root)
    return reader.scene(reader.frames[0]).bodies[0].target, report.notes


@pytest.mark.parametrize("name", FILES)
def test_body_axes_are_the_files_own_whatever_its_format(crafts: Path, tmp_path: Path, name: str) -> None:
    if name.endswith(".step"):
        pytest.importorskip("cascadio")
    target, notes = authored(crafts, name, tmp_path / "stage")
    box, up, parts = FILES[name]
    np.testing.assert_allclose(target.mesh.box, box, atol=1e-5)
    assert not parts or sorted(part.name for part in target.parts) == parts
    said = f", of which it calls {up} up" if up else ", and it does not state an up axis"
    assert f"body axes are the file's own x, y and z{said}: poses are meant in these" in notes


@pytest.mark.parametrize("ending", ["blend", "fbx", "glb"])
def test_a_model_stands_as_it_is_stored_or_at_the_time_that_is_chosen(crafts, tmp_path, ending) -> None:
    """All three are stored at the last key, 4 m above the first, which is a second earlier."""
    tall = {}
    for time in (None, 0.0, 0.5, 1.0):
        target, notes = authored(crafts, f"moving.{ending}", tmp_path / str(time), model_time=time)
        tall[time] = float(np.ptp(target.mesh.box, axis=0).max())
        assert (time is None) == any("it has animations, and is shown" in note for note in notes)
    assert [tall[time] for time in (None, 0.0, 1.0)] == pytest.approx([8.5, 4.5, 8.5], abs=1e-4)
    assert 4.6 < tall[0.5] < 8.4


@pytest.mark.parametrize(("name", "saying"), [("craft.obj", "only .fbx, .blend"), ("craft.glb", "has no animations")])
def test_a_time_of_what_does_not_move_is_refused(crafts, tmp_path, name, saying) -> None:
    with pytest.raises(SpinError, match=saying):
        authored(crafts, name, tmp_path / "stage", model_time=0.0)


def test_a_unit_that_no_file_says_is_asked_for(crafts: Path, tmp_path: Path) -> None:
    (crafts / "none.dae").write_text(dae(""))
    (crafts / "none.fbx").write_bytes(
        (crafts / "craft.fbx").read_bytes().replace(b"UnitScaleFactor", b"UnitScaleFacto_")
    )
    for name, units in (("none.dae", 1.0), ("none.fbx", 100.0)):
        with pytest.raises(SpinError, match=rf"{name}: does not state its unit of length; give --units-per-metre"):
            authored(crafts, name, tmp_path / "s")
        target, _ = authored(crafts, name, tmp_path / name, units_per_metre=units)
        np.testing.assert_allclose(np.ptp(target.mesh.box, axis=0).max(), 4.5, atol=1e-5)


def test_a_unit_whose_name_says_another_length_is_told(crafts: Path, tmp_path: Path) -> None:
    (crafts / "inch.dae").write_text(dae('<unit name="inch" meter="0.01"/>'))
    _, notes = authored(crafts, "inch.dae", tmp_path / "stage")
    assert any(re.search(r"<unit> is called 'inch' but has 0\.01 metres, which was taken", note) for note in notes)


@pytest.mark.parametrize("seconds", [float("nan"), float("inf"), -1.0, 1e30])
def test_a_time_that_is_none_is_refused(crafts: Path, tmp_path: Path, seconds: float) -> None:
    with pytest.raises(SpinError, match=r"model_time is .*make it 0 to 1e\+06 seconds"):
        authored(crafts, "moving.glb", tmp_path / "stage", model_time=seconds)


def test_a_gltf_takes_no_buffer_from_elsewhere_at_a_time_either(crafts: Path, tmp_path: Path) -> None:
    """Blender makes no list of buffers; points of bytes would hold any file that can be read."""
    (tmp_path / "secret").write_bytes(bytes(range(36)))
    position = {"bufferView": 0, "componentType": 5121, "count": 9, "type": "VEC3", "min": [0] * 3, "max": [255] * 3}
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "../secret", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36, "byteStride": 4}],
        "accessors": [position],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    }
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "leak.gltf").write_text(json.dumps(document))
    with pytest.raises(SpinError, match="lies outside the model's folder"):
        authored(crafts, str(tmp_path / "own" / "leak.gltf"), tmp_path / "stage", model_time=0.0, root=tmp_path / "own")
