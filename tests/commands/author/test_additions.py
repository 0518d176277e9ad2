"""What a user adds to an own model: keypoints, parts, colour, the Sun; from the files to the composed scene."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from pxr import Usd

from spin_usd import author
from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError, StageError
from spin_usd.formats.image_file import read_image
from spin_usd.scene.event_sensor import PRESETS
from spin_usd.scene.scene import Scene
from spin_usd.stage.augment.sampled_values import open_base
from spin_usd.stage.augment.sun_and_planet import read_sky
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader

BOXES = {"bus": "foil", "left": "cells", "right": "cells", "boom": "white"}
CAMERA = {"Nu": 64, "Nv": 48, "ppx": 1e-5, "ppy": 1e-5, "cameraMatrix": [[90, 0, 32], [0, 90, 24], [0, 0, 1]]}
KEYPOINTS = {"tip": [0, 0, 1.2], "third": [1 / 3, -0.6, 0.1234567890123]}
ROUNDED = 1e-8  # of a unit vector whose quaternion has nine decimals
POSES = [
    {"filename": f"p{i}.png", "q_vbs2tango_true": q, "r_Vo2To_vbs_true": [0, 0, 12 + i]}
    for i, q in enumerate([[1, 0, 0, 0], [0.6, 0, 0.8, 0], [0, 0, 0.6, -0.8]])
]


@pytest.fixture
def inputs(tmp_path: Path) -> dict[str, Any]:
    """A craft of four boxes of three materials, in glTF, beside its own pose list and camera."""
    craft = trimesh.Scene()
    for at, (name, material) in enumerate(BOXES.items()):
        box = trimesh.creation.box((0.8, 0.5, 0.5), trimesh.transformations.translation_matrix((at, 0, 0)))
        look = trimesh.visual.material.PBRMaterial(name=material, baseColorFactor=[40 * at, 90, 200, 255])
        box.visual = trimesh.visual.TextureVisuals(material=look)
        craft.add_geometry(box, node_name=name, geom_name=name)
    craft.export(tmp_path / "craft.glb")
    for name, content in (("poses", POSES), ("camera", CAMERA), ("keypoints", KEYPOINTS)):
        (tmp_path / f"{name}.json").write_text(json.dumps(content))
    named = {"poses": tmp_path / "poses.json", "camera": tmp_path / "camera.json", "target": tmp_path / "craft.glb"}
    return {**named, "out": tmp_path / "stage"}


def rules(folder: Path, *rows: tuple[str, ...]) -> Path:
    with (folder / "parts.csv").open("w", newline="") as file:
        csv.writer(file).writerows([("pattern", "part", "class"), *rows])
    return folder / "parts.csv"


def scenes(root: str) -> list[Scene]:
    reader = StageReader(root)
    return [reader.scene(frame) for frame in reader.frames]


def named(scene: Scene) -> dict[str, tuple[str, int]]:
    """Part name -> class and number of faces."""
    return {
        part.name: (part.class_name, int((scene.bodies[0].target.mesh.face_part == part.id).sum()))
        for part in scene.bodies[0].target.parts
    }


def test_all_of_them_reach_the_dataset(inputs: dict[str, Any], tmp_path: Path, spin_usd: Any) -> None:
    parts = rules(tmp_path, ("cells", "panel", "solar_panel"), ("foil", "bus", "body"))
    files = [f"--{name}={inputs[name]}" for name in ("poses", "camera", "target", "out")]
    own = [
        f"--keypoints={tmp_path / 'keypoints.json'}",
        f"--parts={parts}",
        "--channels=rgb",
        "--sun-direction=-1,0,-1",
    ]
    said = spin_usd("author", *files, *own).stderr
    assert "note: 2 keypoints are from keypoints.json, metres in the target's body axes" in said
    assert "parts made: bus (1 surface), panel (2 surfaces); 1 other surface stays unchanged" in said
    assert spin_usd("check", inputs["out"]).stdout.endswith("0 errors, 0 warnings\n")
    spin_usd(
        "render", inputs["out"], "--out", tmp_path / "made", "--renderer", "raycast", "--samples", 1, "--frames", ":1"
    )
    dataset = json.loads((tmp_path / "made" / "dataset.json").read_text())
    assert dataset["targets"][0]["keypoints"] == KEYPOINTS  # to the last bit
    assert {(part["name"], part["class"]) for part in dataset["parts"].values()} == {
        ("bus", "body"), ("panel", "solar_panel"), ("boom", "spacecraft"),
    }  # fmt: skip
    image, _ = read_image(tmp_path / "made" / "image" / "nominal" / "p0.png")
    assert image.shape == (48, 64, 3)
    stage = Usd.Stage.Open(str(inputs["out"] / "dataset.usda"))
    sources = stage.GetRootLayer().customLayerData["spin"]["inputs"]
    assert {role: sources[role]["name"] for role in ("keypoints", "parts")} == {
        "keypoints": "keypoints.json", "parts": "parts.csv",
    }  # fmt: skip


def test_surfaces_of_one_part_are_one_part_and_all_others_keep_their_own(
    inputs: dict[str, Any], tmp_path: Path
) -> None:
    plain = author_stage(**inputs | {"out": tmp_path / "plain"})
    before = named(scenes(plain.root)[0])
    assert set(before) == set(BOXES)
    parts = rules(tmp_path, ("right", "tail"), ("cells", "panel", "solar"), ("f?il", "panel"))
    made = author_stage(**inputs, parts=parts)
    assert named(scenes(made.root)[0]) == {
        "panel": ("solar", 24), "tail": ("spacecraft", 12), "boom": ("spacecraft", 12),
    }  # fmt: skip
    assert check_stage(made.root) == ()


def test_a_pattern_matches_all_that_lies_below_a_node_of_its_name(inputs: dict[str, Any], tmp_path: Path) -> None:
    craft = trimesh.load_scene(inputs["target"])
    craft.graph.update(frame_from="world", frame_to="Array")
    for name in list(BOXES)[:2]:
        matrix, _ = craft.graph[name]
        craft.graph.transforms.remove_node(name)
        craft.graph.update(frame_from="Array", frame_to=name, matrix=matrix, geometry=name)
    craft.export(inputs["target"])
    made = author_stage(**inputs, parts=rules(tmp_path, ("array", "wing")))
    assert {name: faces for name, (_, faces) in named(scenes(made.root)[0]).items()} == {
        "wing": 24, **dict.fromkeys(list(BOXES)[2:], 12),
    }  # fmt: skip
    assert check_stage(made.root) == ()


@pytest.mark.parametrize("preset", ["v2e_noisy", "evk4"])
def test_an_event_sensor_is_authored_on_the_camera(inputs: dict[str, Any], preset: str) -> None:
    root = author_stage(**inputs, event_sensor=preset).root
    reader = StageReader(root)
    assert reader.event_sensor(reader.frames[0]) == PRESETS[preset]
    (layer,) = (Path(root).parent / "layers").glob("camera*")
    assert "SpinEventSensorAPI" in layer.read_text()
    assert check_stage(root) == ()


@pytest.mark.parametrize(("scale", "count"), [(1, 0), (1000, 1)])
def test_keypoints_of_another_unit_are_reported(
    inputs: dict[str, Any], tmp_path: Path, scale: float, count: int
) -> None:
    given = {name: [scale * x for x in point] for name, point in KEYPOINTS.items()}
    (tmp_path / "keypoints.json").write_text(json.dumps(given))
    notes = author_stage(**inputs, keypoints=tmp_path / "keypoints.json").notes
    assert sum("keypoints far off the target: 2 of 2" in note for note in notes) == count


def test_a_link_where_the_stage_shall_be_is_told(inputs: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    inputs["out"].symlink_to("empty")
    with pytest.raises(InputError, match="is a link; give the folder that it leads to"):
        author_stage(**inputs)


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        (
            [("wing*", "panel")],
            r"parts.csv: the pattern 'wing\*' matches nothing; the materials are foil, cells, white; ",
        ),
        ([("*", "all"), ("cells", "panel")], "the pattern 'cells' matches only surfaces that rows before it match"),
    ],
)
def test_a_rule_that_names_nothing_is_refused_with_what_there_is(
    inputs: dict[str, Any], tmp_path: Path, rows: list[tuple[str, ...]], sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        author_stage(**inputs, parts=rules(tmp_path, *rows))
    assert not inputs["out"].exists()


USD = """#usda 1.0
(
    defaultPrim = "Craft"
    metersPerUnit = 0.01
    upAxis = "Z"
)
def Xform "Craft"
{
    def Scope "Looks"
    {
        def Material "cells"
        {
            token outputs:surface.connect = </Craft/Looks/cells/Surface.outputs:surface>
            def Shader "Surface"
            {
                uniform token info:id = "UsdPreviewSurface"
                token outputs:surface
            }
        }
    }
    def Xform "Wing_1" (
        instanceable = true
        references = </Craft/Prototype>
    )
    {
    }
    def Xform "Wing_2" (
        instanceable = true
        references = </Craft/Prototype>
    )
    {
    }
    def Xform "Prototype"
    {
        def Cube "Plate" {
            double size = 50
        }
    }
    def Mesh "Body" (
        apiSchemas = ["SemanticsLabelsAPI:class"]
    )
    {
        token[] semantics:labels:class = ["body"]
        int[] faceVertexCounts = [3, 3]
        int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
        point3f[] points = [(0, 0, 0), (100, 0, 0), (100, 50, 0), (0, 50, 0)]
        uniform token subdivisionScheme = "none"
        def GeomSubset "front" (
            apiSchemas = ["MaterialBindingAPI"]
        )
        {
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            int[] indices = [1]
            rel material:binding = </Craft/Looks/cells>
        }
    }
}
"""


def test_usd_targets_are_named_by_material_group_and_path_through_instances(
    inputs: dict[str, Any], tmp_path: Path
) -> None:
    (tmp_path / "craft.usda").write_text(USD)
    parts = rules(tmp_path, ("cells", "panel", "solar"), ("Wing_1", "wing", "solar"), ("Wing_2/*", "wing"))
    made = author_stage(**inputs | {"target": tmp_path / "craft.usda"}, parts=parts)
    assert named(scenes(made.root)[0]) == {
        "panel": ("solar", 1), "Body": ("body", 1), "wing": ("solar", 24), "Plate": ("unknown", 12),
    }  # fmt: skip


def test_one_part_of_two_classes_is_refused(inputs: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "craft.usda").write_text(USD)
    parts = rules(tmp_path, ("Body", "all"), ("Plate", "all"))
    with pytest.raises(InputError, match="the part 'all' would be of the classes"):
        author_stage(**inputs | {"target": tmp_path / "craft.usda"}, parts=parts)
    made = author_stage(**inputs | {"target": tmp_path / "craft.usda"})
    stage = Usd.Stage.Open(made.root)
    stage.GetPrimAtPath("/World/Target").GetAttribute("spin:target:mergedParts").Set(["all"])
    for name, label in (("Body", "body"), ("Prototype/Plate", "plate")):
        prim = stage.GetPrimAtPath(f"/World/Target/Model/{name}")
        for taxonomy, value in (("part", "all"), ("class", label)):
            prim.AddAppliedSchema(f"SemanticsLabelsAPI:{taxonomy}")
            prim.GetAttribute(f"semantics:labels:{taxonomy}").Set([value])
    stage.Save()
    with pytest.raises(StageError, match="belongs to the merged part 'all' and has the class"):
        scenes(made.root)


def test_keypoints_that_were_edited_without_their_points_are_refused(inputs: dict[str, Any], tmp_path: Path) -> None:
    made = author_stage(**inputs, keypoints=tmp_path / "keypoints.json")
    assert np.array_equal(scenes(made.root)[0].bodies[0].target.keypoints, list(KEYPOINTS.values()))
    stage = Usd.Stage.Open(made.root)
    stage.GetPrimAtPath("/World/Target/Keypoints").GetAttribute("points").Set([(0, 0, 1.2), (0.3, -0.6, 0.12345679)])
    stage.Save()
    with pytest.raises(StageError, match="has points that are not its spin:keypoints:positions"):
        scenes(made.root)


def test_given_keypoints_stand_in_place_of_the_targets(inputs: dict[str, Any], tmp_path: Path) -> None:
    made = author_stage(**inputs | {"target": "cubesat"}, keypoints=tmp_path / "keypoints.json")
    assert scenes(made.root)[0].bodies[0].target.keypoint_names == tuple(KEYPOINTS)
    assert {finding.code for finding in check_stage(made.root)} <= {"target-small"}


def test_the_sun_stands_where_it_is_asked_to_in_camera_axes(inputs: dict[str, Any]) -> None:
    made = author_stage(**inputs, sun_direction=(2, -1, -2))
    for scene in scenes(made.root):
        np.testing.assert_allclose(scene.lights[0].direction_cam, -np.array([2, -1, -2]) / 3, atol=ROUNDED)
    sky = read_sky(open_base(Usd.Stage.Open(made.root))[0])  # what constraints on draws are held against
    np.testing.assert_allclose(sky.sun, np.array([[2, -1, -2]]) / 3, atol=ROUNDED)


@pytest.mark.parametrize("source", ["poses", "example"])
def test_a_sun_that_is_given_from_the_target_turns_with_it(
    inputs: dict[str, Any], tmp_path: Path, spin_usd: Any, source: str
) -> None:
    files = [f"--{name}={inputs[name]}" for name in ("camera", "target", "out")]
    pictures = [f"--poses={inputs['poses']}"] if source == "poses" else ["--sample=speedplus", "--count=3"]
    spin_usd("author", *files, *pictures, "--sun-from-target=0,3,4")
    made = scenes(str(inputs["out"] / "dataset.usda"))
    directions = [-np.array(scene.lights[0].direction_cam) for scene in made]
    expected = [scene.bodies[0].T_cam_body.directions(np.array([0, 0.6, 0.8])) for scene in made]
    np.testing.assert_allclose(directions, expected, atol=ROUNDED)
    assert len(np.unique(np.round(directions, 3), axis=0)) == 3


@pytest.mark.parametrize("given", [{"sun_direction": (2, -1, -2)}, {"sun_from_target": (0, 3, 4)}, {}])
@pytest.mark.parametrize("source", ["poses", "example"])
def test_all_that_stands_in_the_layers_of_light_is_read(
    inputs: dict[str, Any], source: str, given: dict[str, Any]
) -> None:
    """Whoever edits a number there sees another picture: no stronger layer beats it, no order leaves it out."""
    files = {name: inputs[name] for name in ("camera", "target", "out")}
    shown = {"poses": inputs["poses"], "environment": "earth"} if source == "poses" else {"sample": "speedplus"}
    stage = Usd.Stage.Open(author(**files, **shown, **({} if source == "poses" else {"count": 3}), **given).root)
    seen = 0
    for prim in stage.Traverse():
        order = prim.GetAttribute("xformOpOrder").Get() or ()
        for each in prim.GetAuthoredAttributes():
            layers = [spec.layer.GetDisplayName() for spec in each.GetPropertyStack()]
            if {"lights.usda", "environment.usda"} & set(layers):
                assert len(layers) == 1, each.GetPath()
                assert not each.GetName().startswith("xformOp:") or each.GetName() in order, each.GetPath()
                seen += 1
    assert seen > 8


@pytest.mark.parametrize(
    ("additions", "sentence"),
    [
        ({"channels": "grey"}, "no channels 'grey'; choose mono or rgb"),
        ({"event_sensor": "evk5"}, "no event sensor 'evk5'; choose among ideal, v2e_clean, v2e_noisy, evk4, davis346"),
        ({"sun_direction": (0, 0, 0)}, "0, 0, 0 is not a direction to the Sun"),
        ({"sun_direction": (1, 2)}, "three numbers X,Y,Z"),
        ({"sun_direction": (1, 0, 0), "sun_from_target": (1, 0, 0)}, "given together"),
    ],
)
def test_what_cannot_be_is_refused(inputs: dict[str, Any], additions: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        author_stage(**inputs, **additions)
    assert not inputs["out"].exists()
