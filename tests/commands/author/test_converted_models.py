"""FBX and .blend, made by Blender itself: size, axes, parts and textures of what it would render; no script runs."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import SpinError
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.png import png

POSES = [{"filename": "a.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 10]}]
MAKE = """
import bpy, sys
folder = sys.argv[1]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 1.5))
body = bpy.context.object
body.name, body.scale = "Body", (1, 2, 3)
bpy.ops.mesh.primitive_cube_add(size=1, location=(9, 0, 0))
hidden = bpy.context.object
hidden.name, hidden.hide_render = "Jig", True
bpy.ops.mesh.primitive_uv_sphere_add(radius=0.25, location=(2, 0, 0))
bpy.context.object.name = "Ball"
material = bpy.data.materials.new("foil")
material.use_nodes = True
nodes = material.node_tree.nodes
image = nodes.new("ShaderNodeTexImage")
image.image = bpy.data.images.load(folder + "/outside/secret.png")
material.node_tree.links.new(image.outputs[0], nodes["Principled BSDF"].inputs["Base Color"])
body.data.materials.append(material)
text = bpy.data.texts.new("run.py")
text.write("open(" + repr(folder + "/was_run") + ", 'w').write('x')")
text.use_module = True
bpy.ops.wm.save_as_mainfile(filepath=folder + "/model/in/craft.blend", relative_remap=True)
bpy.ops.object.select_all(action="SELECT")
hidden.select_set(False)
bpy.ops.preferences.addon_enable(module="io_scene_fbx")
bpy.ops.export_scene.fbx(filepath=folder + "/model/in/craft.fbx", use_selection=True)
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    for each in ("model/in", "outside"):
        (folder / each).mkdir(parents=True)
    (folder / "outside" / "secret.png").write_bytes(png(np.full((2, 2, 3), 77), color=2))
    (folder / "poses.json").write_text(json.dumps(POSES))
    subprocess.run([sys.executable, "-c", MAKE, str(folder)], check=True, stdout=subprocess.DEVNULL)
    (folder / "was_run").unlink(missing_ok=True)
    return folder


@pytest.mark.parametrize("name", ["craft.blend", "craft.fbx"])
def test_a_model_that_blender_reads_is_what_it_shows(made: Path, tmp_path: Path, name: str) -> None:
    model = made / "model" / "in" / name
    report = author_stage(poses=made / "poses.json", out=tmp_path / "stage", target=model, camera="speedplus")
    reader = StageReader(report.root)
    target = reader.scene(reader.frames[0]).bodies[0].target
    box = [[-0.5, -1, -0.25], [2.25, 1, 3]] if name == "craft.blend" else [[-0.5, -0.25, -1], [2.25, 3, 1]]  # y is up
    np.testing.assert_allclose(target.mesh.box, box, atol=1e-3)  # the ball's facets
    assert {part.name for part in target.parts} == {"Body", "Ball"}, "what is hidden in renders is none of it"
    assert any("'secret.png' lies outside the model's folder, and was left out" in note for note in report.notes)
    assert not (made / "was_run").exists()
    assert not list((tmp_path / "stage").rglob("*secret*"))


def test_a_damaged_model_is_refused_in_a_sentence(made: Path, tmp_path: Path) -> None:
    (tmp_path / "cut.blend").write_bytes((made / "model" / "in" / "craft.blend").read_bytes()[:3000])
    (tmp_path / "cut.fbx").write_bytes(b"Kaydara FBX Binary  \0")
    for name in ("cut.blend", "cut.fbx"):
        with pytest.raises(SpinError, match=r"cut\.\w+: cannot be read"):
            author_stage(poses=made / "poses.json", out=tmp_path / "s", target=tmp_path / name, camera="speedplus")
        assert not (tmp_path / "s").exists()


SHADERS = """
import bpy, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
for place, (name, shader) in enumerate((("paint", "Diffuse"), ("foil", "Anisotropic"), ("panel", "Principled"))):
    bpy.ops.mesh.primitive_cube_add(size=0.5, location=(place, 0, 0))
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    node, output = tree.nodes.new(f"ShaderNodeBsdf{shader}"), tree.nodes.new("ShaderNodeOutputMaterial")
    node.inputs[0].default_value = (0.75, 0.25, 0.125, 1)
    tree.links.new(node.outputs[0], output.inputs[0])
    if shader == "Principled":
        node.inputs["IOR"].default_value, node.inputs["Specular IOR Level"].default_value = 1.4, 0.25
    bpy.context.object.data.materials.append(material)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
"""


@pytest.mark.filterwarnings("ignore:'Material.use_nodes':DeprecationWarning")  # until spin_usd stops to set it
def test_materials_that_no_exporter_knows_are_not_white_metal(made: Path, tmp_path: Path) -> None:
    """Blender's exporter writes only the Principled BSDF, and without it what glTF has for a default: white metal."""
    model = tmp_path / "model" / "craft.blend"
    model.parent.mkdir()
    subprocess.run([sys.executable, "-c", SHADERS, str(model)], check=True, stdout=subprocess.DEVNULL)
    report = author_stage(poses=made / "poses.json", out=tmp_path / "stage", target=model, camera="speedplus")
    reader = StageReader(report.root)
    materials = {Path(each.path).name: each for each in reader.scene(reader.frames[0]).bodies[0].target.materials}
    assert {name: each.metallic for name, each in materials.items()} == {"paint": 0, "foil": 1, "panel": 0}
    for each in materials.values():
        np.testing.assert_allclose(each.diffuse_color, (0.75, 0.25, 0.125), atol=1e-6)
    slowed = (0.5 * (0.4 / 2.4) ** 2) ** 0.5  # half of what 1.4 reflects
    assert materials["panel"].ior == pytest.approx((1 + slowed) / (1 - slowed), rel=1e-5)
    assert not any("KHR_materials" in note for note in report.notes)
    told = sorted(note for note in report.notes if "no Principled BSDF" in note)
    assert ["foil" in told[0], "paint" in told[1], len(told)] == [True, True, 2]


AS_RENDERED = """
import bpy, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
def cube(name, place):
    bpy.ops.mesh.primitive_cube_add(size=1, location=(place, 0, 0))
    bpy.context.object.name = name
    return bpy.context.object
smooth = cube("Smooth", 0).modifiers.new("S", "SUBSURF")
smooth.levels, smooth.render_levels = 0, 2
unused = cube("Plain", 3).modifiers.new("S", "SUBSURF")
unused.show_render = False
moving = cube("Moving", 6)
moving.keyframe_insert("location", frame=1)
moving.location = (9, 0, 0)
moving.keyframe_insert("location", frame=10)
left_out = bpy.data.collections.new("Left out")
scene.collection.children.link(left_out)
away = cube("Away", 50)
scene.collection.objects.unlink(away)
left_out.objects.link(away)
bpy.context.view_layer.layer_collection.children["Left out"].exclude = True
bpy.ops.object.armature_add()
bones = bpy.context.object
hung = cube("Hung", 0)
hung.parent, hung.parent_type, hung.parent_bone = bones, "BONE", "Bone"  # its tail is at 0, 0, 1
bones.pose.bones["Bone"].location = (0, 4, 0)  # along itself
scene.frame_set(10)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
"""


def test_a_model_is_what_blender_renders_and_not_what_its_viewport_shows(made: Path, tmp_path: Path) -> None:
    """Modifiers at their levels of a render, the frame that the file was saved at, no collection that is excluded."""
    model = tmp_path / "model" / "craft.blend"
    model.parent.mkdir()
    subprocess.run([sys.executable, "-c", AS_RENDERED, str(model)], check=True, stdout=subprocess.DEVNULL)
    report = author_stage(poses=made / "poses.json", out=tmp_path / "stage", target=model, camera="speedplus")
    reader = StageReader(report.root)
    target = reader.scene(reader.frames[0]).bodies[0].target
    faces = {part.name: int((target.mesh.face_part == part.id).sum()) for part in target.parts}
    assert faces == {"Smooth": 12 * 16, "Plain": 12, "Moving": 12, "Hung": 12}
    np.testing.assert_allclose(target.mesh.box[1], (9.5, 0.5, 5.5), atol=1e-6)


PATHS = """
import bpy, os, sys
from pathlib import Path
folder = Path(sys.argv[1])
inside, outside = folder / "model" / "in", folder / "outside"
def saved(name, act):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_plane_add(size=2)
    act(bpy.context.object)
    bpy.ops.wm.save_as_mainfile(filepath=str(inside / f"{name}.blend"), relative_remap=False)
def image(path, source="FILE"):
    def act(plane):
        found = bpy.data.images.new("I", 4, 4)
        found.source, found.filepath = source, str(path)
        material = bpy.data.materials.new("M")
        material.use_nodes = True
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = found
        material.node_tree.links.new(node.outputs[0], material.node_tree.nodes["Principled BSDF"].inputs[0])
        plane.data.materials.append(material)
    return act
def cache(path):
    def act(plane):
        plane.modifiers.new("C", "MESH_CACHE").filepath = str(path)
    return act
def library(path):
    def act(plane):
        with bpy.data.libraries.load(str(path), link=True) as (there, here):
            here.objects = there.objects
        bpy.context.scene.collection.objects.link(here.objects[0])
    return act
def appended(path):
    def act(plane):
        options = {"do_reuse_local_id": True, "link": False}
        bpy.ops.wm.append(directory=f"{path}/Material/", filename="foil", **options)
        plane.data.materials.append(bpy.data.materials["foil"])
        assert str(path) in bpy.utils.blend_paths(absolute=True)
    return act
def importing(plane):
    tree = bpy.data.node_groups.new("G", "GeometryNodeTree")
    tree.nodes.new("GeometryNodeImportOBJ")
    plane.modifiers.new("G", "NODES").node_group = tree
for place in (inside, outside):
    saved("library", lambda plane: None)
    os.rename(inside / "library.blend", place / "other.blend")
    (place / "t.1001.png").write_bytes((outside / "secret.png").read_bytes())
    (place / "c.mdd").write_bytes(bytes(8))
    (place / "notes.txt").write_text("from whom, and when")
(inside / "late.blend").write_bytes((inside / "other.blend").read_bytes())
(inside / "link.png").symlink_to(outside / "secret.png")
for name, act in {
    "tiled inside": image(inside / "t.<UDIM>.png", "TILED"),
    "tiled outside": image(outside / "t.<UDIM>.png", "TILED"),
    "image link": image(inside / "link.png"),
    "image pipe": image(inside / "pipe.png"),
    "image device": image("/dev/zero"),
    "cache outside": cache(outside / "c.mdd"),
    "library inside": library(inside / "other.blend"),
    "library outside": library(outside / "other.blend"),
    "appended outside": appended(outside / "craft.blend"),
    "text outside": lambda plane: bpy.data.texts.load(str(outside / "notes.txt")),
    "library pipe": library(inside / "late.blend"),
    "import": importing,
}.items():
    saved(name, act)
os.mkfifo(inside / "pipe.png")
(inside / "late.blend").unlink()
os.mkfifo(inside / "late.blend")
"""
LEFT_OUT = {
    "tiled inside": "",
    "tiled outside": "'t.<UDIM>.png' lies outside the model's folder, and was left out",
    "image link": "'link.png' lies outside the model's folder, and was left out",
    "image pipe": "'pipe.png' is not a plain file, and was left out",
    "image device": "'zero' lies outside the model's folder, and was left out",
    "library inside": "",
    "appended outside": "",
    "text outside": "",
}
REFUSED = {
    "cache outside": "takes .*/outside/c.mdd, which lies outside the model's folder",
    "library outside": "takes .*/outside/other.blend, which lies outside the model's folder",
    "library pipe": "takes .*/in/late.blend, which is not a plain file",
    "import": "imports files by geometry nodes",
}


@pytest.fixture(scope="module")
def naming(tmp_path_factory, made):
    folder = tmp_path_factory.mktemp("naming")
    (folder / "model" / "in").mkdir(parents=True)
    shutil.copytree(made / "outside", folder / "outside")
    shutil.copy(made / "model" / "in" / "craft.blend", folder / "outside")
    subprocess.run([sys.executable, "-c", PATHS, str(folder)], check=True, stdout=subprocess.DEVNULL)
    return folder


@pytest.mark.children
@pytest.mark.slow
@pytest.mark.parametrize("name", [*LEFT_OUT, *REFUSED])
def test_a_model_takes_plain_files_of_its_own_folder_alone(made, naming, tmp_path, spin_usd, name) -> None:
    """Whatever kind of file it names; a pipe is not waited for."""
    options = ("--poses", made / "poses.json", "--camera", "speedplus", "--out", tmp_path / "stage", "--any-size")
    model, root = naming / "model" / "in" / f"{name}.blend", naming / "model"
    code = 0 if name in LEFT_OUT else 2
    done = spin_usd("author", *options, "--target", model, "--root", root, code=code)
    assert re.search(re.escape(LEFT_OUT[name]) if name in LEFT_OUT else REFUSED[name], done.stdout + done.stderr)
    copied = [file for file in (tmp_path / "stage").rglob("*.png") if "_looks" not in str(file)]
    assert len(copied) == (name == "tiled inside")


def test_what_a_foreign_exporter_raises_is_told_of_the_users_file(made, tmp_path, monkeypatch) -> None:
    def fails(filepath: str, **_: object) -> None:
        raise RuntimeError(f"Error: Python: Traceback (most recent call last):\nValueError: {filepath}\nLocation: x")

    monkeypatch.setattr("spin_usd.renderers.blender.model_conversion._export", fails)
    model = made / "model" / "in" / "craft.blend"
    with pytest.raises(SpinError, match=rf"^{model}: cannot be read by Blender \(ValueError: craft.blend\); copy"):
        author_stage(poses=made / "poses.json", out=tmp_path / "s", target=model, camera="speedplus")


INSTANCES = """
import bpy, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_cube_add(size=1)
bpy.context.object.name = "Bus"
tree = bpy.data.node_groups.new("G", "GeometryNodeTree")
tree.interface.new_socket(name="Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
tree.interface.new_socket(name="Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
kinds = ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeMeshLine", "GeometryNodeMeshCube",
         "GeometryNodeInstanceOnPoints", "GeometryNodeJoinGeometry")
given, wanted, line, cube, instances, join = (tree.nodes.new(kind) for kind in kinds)
line.inputs["Offset"].default_value = (3, 0, 0)
tree.links.new(line.outputs[0], instances.inputs["Points"])
tree.links.new(cube.outputs[0], instances.inputs["Instance"])
tree.links.new(given.outputs[0], join.inputs[0])
tree.links.new(instances.outputs[0], join.inputs[0])
tree.links.new(join.outputs[0], wanted.inputs[0])
bpy.context.object.modifiers.new("G", "NODES").node_group = tree
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
import numpy as np
corners = [each.matrix_world @ __import__("mathutils").Vector(corner)
           for each in bpy.context.evaluated_depsgraph_get().object_instances for corner in each.object.bound_box]
print("BOX", *np.min(corners, 0), *np.max(corners, 0))
"""


def test_instances_of_geometry_nodes_stand_where_blender_renders_them(made: Path, tmp_path: Path) -> None:
    model = tmp_path / "model" / "craft.blend"
    model.parent.mkdir()
    done = subprocess.run([sys.executable, "-c", INSTANCES, str(model)], check=True, capture_output=True, text=True)
    box = np.array(next(line for line in done.stdout.splitlines() if line.startswith("BOX")).split()[1:], float)
    report = author_stage(poses=made / "poses.json", out=tmp_path / "stage", target=model, camera="speedplus")
    reader = StageReader(report.root)
    np.testing.assert_allclose(reader.scene(reader.frames[0]).bodies[0].target.mesh.box.ravel(), box, atol=1e-5)


BETWEEN = """
import bpy, sys
for name, kinds in {
    "plain": ("ShaderNodeUVMap", "ShaderNodeMapping"), "invert": ("ShaderNodeInvert",), "ramp": ("ShaderNodeValToRGB",),
    "bump": ("ShaderNodeBump",), "object": ("ShaderNodeTexCoord",), "box": (), "group": (),
}.items():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_plane_add(size=2)
    material = bpy.data.materials.new("M")
    material.use_nodes = True
    bpy.context.object.data.materials.append(material)
    tree, new, link = material.node_tree, material.node_tree.nodes.new, material.node_tree.links.new
    shader, texture = tree.nodes["Principled BSDF"], new("ShaderNodeTexImage")
    texture.image = bpy.data.images.new("I", 4, 4)
    texture.image.pack()
    texture.projection = "BOX" if name == "box" else "FLAT"
    made = [new(kind) for kind in kinds]
    if name in ("plain", "object"):
        output = made[0].outputs["Object" if name == "object" else "UV"]
        link(output, made[-1].inputs[0] if name == "plain" else texture.inputs[0])
        if name == "plain":
            link(made[-1].outputs[0], texture.inputs[0])
        made = []
    at = texture.outputs[0]
    if made:
        link(at, next(each for each in made[0].inputs if each.name in ("Color", "Factor", "Fac", "Height")))
        at = made[0].outputs[0]
    link(at, shader.inputs["Normal" if name == "bump" else "Base Color"])
    if name == "group":
        group = bpy.data.node_groups.new("G", "ShaderNodeTree")
        group.interface.new_socket(name="Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
        within, end = group.nodes.new("ShaderNodeBsdfPrincipled"), group.nodes.new("NodeGroupOutput")
        within.inputs["Base Color"].default_value = (0.25, 0.5, 0.75, 1)
        group.links.new(within.outputs[0], end.inputs[0])
        use = new("ShaderNodeGroup")
        use.node_tree = group
        link(use.outputs[0], tree.nodes["Material Output"].inputs[0])
    bpy.ops.wm.save_as_mainfile(filepath=f"{sys.argv[1]}/{name}.blend")
"""
TOLD = {
    "plain": "",
    "invert": "has Invert Color between an image and Base Color",
    "ramp": "has Color Ramp between an image and Base Color",
    "bump": "has a height map behind Normal",
    "object": "has Object coordinates between an image and Base Color",
    "box": "has box projection between an image and Base Color",
    "group": "",
}


def test_what_stands_between_an_image_and_its_shader_is_told(made: Path, tmp_path: Path) -> None:
    folder = tmp_path / "model"
    folder.mkdir()
    subprocess.run([sys.executable, "-c", BETWEEN, str(folder)], check=True, stdout=subprocess.DEVNULL)
    for name, told in TOLD.items():
        report = author_stage(
            poses=made / "poses.json", out=tmp_path / name, target=folder / f"{name}.blend", camera="speedplus"
        )
        notes = [note for note in report.notes if "the material 'M'" in note]
        assert len(notes) == bool(told), notes
        assert all(told in note for note in notes)
    reader = StageReader(tmp_path / "group" / "dataset.usda")
    (material,) = reader.scene(reader.frames[0]).bodies[0].target.materials
    np.testing.assert_allclose(material.diffuse_color, (0.25, 0.5, 0.75), atol=1e-6)
