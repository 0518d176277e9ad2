"""The target: transforms, instances, purposes, parts, materials by face, keypoints; USD's own answers as authority."""

import numpy as np
import pytest
import trimesh
from pxr import Usd, UsdGeom

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.stage_reader import StageReader

FLOAT32 = 1e-6
HALF_ORIENTATION = 1e-3  # rad: what a quaternion loses in half precision, whose numbers have 11 bits

NESTED = """
def Xform "A"
{
    double3 xformOp:translate = (1, 2, 3)
    quatd xformOp:orient = (0.8, 0.6, 0, 0)
    double3 xformOp:scale = (1, 2, -0.5)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient", "xformOp:scale"]

    def Cylinder "Can"
    {
        double height = 3
        double radius = 0.5
        token axis = "Y"
        float xformOp:rotateX = 30
        uniform token[] xformOpOrder = ["xformOp:rotateX"]
    }
}
"""
MESH = """
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]
    point3f[] points = [(0, 0, 0), (0, 0, 1), (0, 1, 0), (0, 1, 1), (1, 0, 0), (1, 0, 1), (1, 1, 0), (1, 1, 1)]
    uniform token subdivisionScheme = "none"
"""


def solid(mesh, faces=None):
    return trimesh.Trimesh(mesh.points, mesh.faces if faces is None else mesh.faces[faces], process=False)


def corner_means(mesh):
    """(F, 3) middles of the faces."""
    return mesh.points[mesh.faces].mean(1)


def test_nested_transforms_have_usds_bounds_and_stay_closed(make_stage) -> None:
    path = make_stage(NESTED)
    reader = StageReader(path)
    mesh = reader.scene(reader.frames[0]).bodies[0].target.mesh
    stage = Usd.Stage.Open(str(path))
    cache = UsdGeom.XformCache(Usd.TimeCode(0))
    target, can = (stage.GetPrimAtPath(p) for p in ("/World/Target", "/World/Target/A/Can"))
    matrix = np.array(cache.ComputeRelativeTransform(can, target)[0])
    local = (np.c_[mesh.points, np.ones(len(mesh.points))] @ np.linalg.inv(matrix))[:, :3]
    extent = np.array(UsdGeom.Boundable.ComputeExtentFromPlugins(UsdGeom.Boundable(can), Usd.TimeCode(0)))
    np.testing.assert_allclose([local.min(0), local.max(0)], extent, atol=FLOAT32)
    assert solid(mesh).is_watertight
    assert solid(mesh).volume > 0  # the mirror turned the winding
    facing = (mesh.corner_normals * solid(mesh).face_normals[:, None]).sum(-1)
    assert (facing > 0.99).all()  # normals by the inverse transpose


def test_normals_under_unequal_scale_stand_on_the_surface(read_scene) -> None:
    """A sphere scaled to an ellipsoid: its normal is the gradient of x^2/a^2 + y^2/b^2 + z^2/c^2."""
    mesh = (
        read_scene(
            """def Sphere "S"
        {
            double3 xformOp:scale = (1, 2, 0.5)
            uniform token[] xformOpOrder = ["xformOp:scale"]
        }"""
        )
        .bodies[0]
        .target.mesh
    )
    gradient = mesh.points[mesh.faces] / np.array([1, 2, 0.5]) ** 2
    gradient /= np.linalg.norm(gradient, axis=-1, keepdims=True)
    np.testing.assert_allclose(mesh.corner_normals, gradient, atol=FLOAT32)


@pytest.mark.parametrize(("metres", "up"), [(0.01, "Y"), (1, "Z"), (1000, "Y")])
def test_units_are_metres_whatever_the_stages_are(make_stage, metres, up) -> None:
    path = make_stage(metadata=f"metersPerUnit = {metres}")
    path.write_text(path.read_text().replace('upAxis = "Z"', f'upAxis = "{up}"'))
    reader = StageReader(path)
    scene = reader.scene(reader.frames[0])
    assert np.ptp(scene.bodies[0].target.mesh.points, axis=0) == pytest.approx([2 * metres] * 3)
    assert scene.bodies[0].T_cam_body.translation == pytest.approx([0, 0, 10 * metres])


def test_the_targets_own_scale_is_in_its_points(read_scene) -> None:
    pose = """
        double3 xformOp:translate = (0, 0, -10)
        float3 xformOp:scale = (0.5, 0.5, 0.5)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]"""
    scene = read_scene(pose=pose)
    assert np.ptp(scene.bodies[0].target.mesh.points, axis=0) == pytest.approx([1, 1, 1])
    np.testing.assert_allclose(
        scene.bodies[0].T_cam_body.rotation @ scene.bodies[0].T_cam_body.rotation.T, np.eye(3), atol=1e-15
    )


def test_native_instances_are_read_as_separate_copies(read_scene) -> None:
    """Two instances of a class, which is not rendered itself."""
    copies = """
        class Xform "_Box"
        {
            def Cube "Cube" {}
        }
        def Xform "One" (
            instanceable = true
            inherits = </World/Target/_Box>
        )
        {
            double3 xformOp:translate = (5, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
        def Xform "Two" (
            instanceable = true
            inherits = </World/Target/_Box>
        )
        {
        }"""
    target = read_scene(copies).bodies[0].target
    assert [p.path for p in target.parts] == ["/World/Target/One/Cube", "/World/Target/Two/Cube"]
    plain = read_scene(copies.replace("instanceable = true", ""), name="plain.usda").bodies[0].target
    assert target.mesh.key == plain.mesh.key


INSTANCER = """def PointInstancer "Many"
{{
    point3f[] positions = [(0, 0, 0), (3, 0, 0), (0, 5, 0), (0, 0, 7)]
    int[] protoIndices = [0, 1, 0, 1]
    {orientations}
    float3[] scales = [(1, 1, 1), (1, 2, 1), (-1, 1, 1), (1, 1, 1)]
    int64[] ids = [10, 11, 12, 13]
    int64[] invisibleIds = [{invisible}]
    rel prototypes = [</World/Target/Many/Box>, </World/Target/Many/Rod>]

    def Cube "Box"
    {{
        double size = 0.5
        double3 xformOp:translate = (0.25, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}

    def Xform "Rod"
    {{
        def Cone "Tip" {{
        }}
    }}
}}"""
ORIENTATIONS = "[(1, 0, 0, 0), (0.8, 0.6, 0, 0), (0.6, 0, 0.8, 0), (0, 0, 0, 1)]"


@pytest.mark.parametrize(
    ("kind", "tolerance"), [("quath[] orientations", HALF_ORIENTATION * 3), ("quatf[] orientationsf", FLOAT32)]
)
def test_point_instances_stand_where_explicit_copies_stand(read_scene, kind, tolerance) -> None:
    scene = read_scene(INSTANCER.format(orientations=f"{kind} = {ORIENTATIONS}", invisible=""))
    copies = ""
    places: list[tuple[tuple[float, ...], ...]]
    places = [((0, 0, 0), (1, 0, 0, 0), (1, 1, 1)), ((3, 0, 0), (0.8, 0.6, 0, 0), (1, 2, 1))]
    places += [((0, 5, 0), (0.6, 0, 0.8, 0), (-1, 1, 1)), ((0, 0, 7), (0, 0, 0, 1), (1, 1, 1))]
    for i, (position, orient, scale) in enumerate(places):
        shape = (
            'def Cone "Tip" {}'
            if i % 2
            else """def Cube "Box"
            {
                double size = 0.5
                double3 xformOp:translate = (0.25, 0, 0)
                uniform token[] xformOpOrder = ["xformOp:translate"]
            }"""
        )
        copies += f"""
        def Xform "Copy{i}"
        {{
            double3 xformOp:translate = {position}
            quatd xformOp:orient = {orient}
            double3 xformOp:scale = {scale}
            uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient", "xformOp:scale"]
            {shape}
        }}"""
    expected = read_scene(copies, name="copies.usda").bodies[0].target.mesh
    mesh = scene.bodies[0].target.mesh
    assert len(mesh.faces) == len(expected.faces)
    mine, theirs = (np.array(sorted(np.round(corner_means(m), 2).tolist())) for m in (mesh, expected))
    np.testing.assert_allclose(mine, theirs, atol=0.011)  # so that rounding may fall either way
    for bound in (np.min, np.max):
        np.testing.assert_allclose(bound(mesh.points, axis=0), bound(expected.points, axis=0), atol=tolerance)
    assert solid(mesh).volume == pytest.approx(solid(expected).volume, rel=1e-3)
    assert {p.name for p in scene.bodies[0].target.parts} == {"Box", "Tip"}


def test_invisible_ids_are_left_out(read_scene) -> None:
    whole = read_scene(INSTANCER.format(orientations="", invisible=""), name="a.usda").bodies[0].target
    some = read_scene(INSTANCER.format(orientations="", invisible="11, 13"), name="b.usda").bodies[0].target
    assert {p.name for p in some.parts if p.id in some.mesh.face_part} == {"Box"}
    assert some.parts == whole.parts, "what is hidden keeps its number"
    assert len(some.mesh.faces) == 24 < len(whole.mesh.faces)


@pytest.mark.parametrize(
    ("old", "new", "saying"),
    [
        ("[0, 1, 0, 1]", "[0, 1, 2, 1]", r"protoIndices\[2\] is 2, but there are 2 prototypes"),
        ("[0, 1, 0, 1]", "[0, 1, 0]", "has 3 protoIndices but 4 positions"),
        ("[0, 1, 0, 1]", "[0, -1, 0, 1]", r"protoIndices\[1\] is -1"),
        ("</World/Target/Many/Rod>", "</World/Target/Many/None>", "prototype /World/Target/Many/None does not exist"),
        ("</World/Target/Many/Rod>", "</World/Target>", "holds the instancer"),
        ("(3, 0, 0)", "(nan, 0, 0)", r"positions\[1\] is \[nan"),
        ("[(1, 0, 0, 0), (0.8", "[(2, 0, 0, 0), (0.8", "norm is off 1 by 1"),
    ],
)
def test_instancers_that_disagree_with_themselves(read_scene, old, new, saying) -> None:
    text = INSTANCER.format(orientations=f"quatf[] orientationsf = {ORIENTATIONS}", invisible="")
    with pytest.raises(StageError, match=f"^/World/Target/Many: .*{saying}"):
        read_scene(text.replace(old, new))


def test_purpose_visibility_and_activation(read_scene) -> None:
    def cube(name, extra) -> str:
        return f'def Cube "{name}" {extra}'

    geometry = "\n".join(
        [
            cube("Shown", "{}"),
            cube("Render", '{\ntoken purpose = "render"\n}'),
            cube("Guide", '{\ntoken purpose = "guide"\n}'),
            cube("Proxy", '{\ntoken purpose = "proxy"\n}'),
            cube("Hidden", '{\ntoken visibility = "invisible"\n}'),
            cube("Inactive", "(\nactive = false\n)\n{}"),
            'def Xform "GuideGroup"\n{\ntoken purpose = "guide"\ndef Cube "Below" {}\n'
            'def Cube "Own"\n{\ntoken purpose = "default"\n}\n}',
            'def Xform "HiddenGroup"\n{\ntoken visibility = "invisible"\ndef Cube "Below2" {}\n}',
            'over Cube "Undefined" {}',
        ]
    )
    assert [p.name for p in read_scene(geometry).bodies[0].target.parts] == ["Own", "Render", "Shown"]


def test_parts_and_classes_from_the_nearest_label(read_scene) -> None:
    geometry = """
    def Xform "Bus" (
        prepend apiSchemas = ["SemanticsLabelsAPI:part", "SemanticsLabelsAPI:class"]
    )
    {
        token[] semantics:labels:part = ["bus"]
        token[] semantics:labels:class = ["body"]
        def Cube "A" {}
        def Cube "B" {}
        def Mesh "C" (
            prepend apiSchemas = ["SemanticsLabelsAPI:part"]
        )
        {
            token[] semantics:labels:part = ["panel"]
            %s
            def GeomSubset "Lens" (
                prepend apiSchemas = ["SemanticsLabelsAPI:part", "SemanticsLabelsAPI:class"]
            )
            {
                uniform token elementType = "face"
                int[] indices = [1, 4]
                token[] semantics:labels:part = ["lens"]
                token[] semantics:labels:class = ["sensor"]
            }
        }
    }
    def Cube "Alone" {}
    """
    target = read_scene(geometry % MESH).bodies[0].target
    root = "/World/Target"
    assert [(p.id, p.path, p.name, p.class_name) for p in target.parts] == [
        (1, f"{root}/Alone", "Alone", "unknown"),
        (2, f"{root}/Bus", "bus", "body"),
        (3, f"{root}/Bus/C", "panel", "body"),
        (4, f"{root}/Bus/C/Lens", "lens", "sensor"),
    ]
    assert np.bincount(target.mesh.face_part).tolist() == [0, 12, 24, 8, 4]


TWO_MATERIALS = """
    def Mesh "M" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        rel material:binding = </World/Target/Red>
        MESH
        def GeomSubset "Top" (
            prepend apiSchemas = ["MaterialBindingAPI"]
        )
        {
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            int[] indices = [3]
            rel material:binding = </World/Target/Blue>
        }
    }
    """.replace("MESH", MESH)


def two_materials(**inputs):
    """A cube of Red, one of its faces Blue, with these inputs."""
    geometry = TWO_MATERIALS
    for name, color in {"Red": (1, 0, 0), "Blue": (0, 0, 1)}.items():
        geometry += f"""
    def Material "{name}"
    {{
        token outputs:surface.connect = </World/Target/{name}/S.outputs:surface>
        def Shader "S"
        {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = {color}
            {inputs.get(name, "")}
            token outputs:surface
        }}
    }}"""
    return geometry


def test_materials_by_face_and_leftover_faces(read_scene) -> None:
    target = read_scene(two_materials()).bodies[0].target
    colors = np.array([m.diffuse_color for m in target.materials])[target.mesh.face_material]
    assert (colors == [0, 0, 1]).all(1).sum() == 2
    assert (colors == [1, 0, 0]).all(1).sum() == 10


def test_materials_of_equal_values_keep_their_names(read_scene) -> None:
    equal = two_materials().replace("(0, 0, 1)", "(1, 0, 0)")
    assert read_scene(equal).bodies[0].target.part_materials == {1: ("Red", "Blue")}


KEYPOINTS = """
    def Cube "Box" {}
    def Xform "Marks"
    {
        double3 xformOp:translate = (1, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Points "Keypoints"
        {
            uniform token purpose = "guide"
            point3f[] points = [(1, 2, 3), (4, 5, 6)]
            string[] primvars:keypointName = ["a", "b"]
        }
    }"""


def test_keypoints_are_in_body_axes_and_metres(read_scene) -> None:
    target = read_scene(KEYPOINTS, metadata="metersPerUnit = 0.1").bodies[0].target
    assert target.keypoint_names == ("a", "b")
    np.testing.assert_allclose(target.keypoints, [[0.2, 0.2, 0.3], [0.5, 0.5, 0.6]])


@pytest.mark.parametrize(
    ("old", "new", "error", "saying"),
    [
        ('["a", "b"]', '["a"]', StageError, "2 keypoints and 1 names"),
        ('["a", "b"]', '["a", "a"]', StageError, "names one twice"),
        ("(1, 2, 3)", "(1, 2, nan)", StageError, r"points\[0\] is"),
    ],
)
def test_keypoints_that_are_none(read_scene, old, new, error, saying) -> None:
    with pytest.raises(error, match=saying):
        read_scene(KEYPOINTS.replace(old, new))


@pytest.mark.parametrize("kind", ["Volume", "TetMesh"])
def test_geometry_that_is_not_read_is_refused_by_name(read_scene, kind) -> None:
    with pytest.raises(UnsupportedError, match=f"^/World/Target/Thing: is a {kind}"):
        read_scene(f'def Cube "Box" {{}}\ndef {kind} "Thing" {{}}')
    assert read_scene(f'def Cube "Box" {{}}\ndef {kind} "Thing"\n{{\ntoken purpose = "guide"\n}}', name="b.usda")


@pytest.mark.parametrize(
    ("xform", "error", "saying"),
    [
        ('quatd xformOp:orient = (1, 1, 0, 0)\nORDER["xformOp:orient"]', StageError, "norm is off 1 by 0.414"),
        ('quatd xformOp:orient = (0, 0, 0, 0)\nORDER["xformOp:orient"]', StageError, "norm is off 1 by 1"),
        ('ORDER["xformOp:translate"]', StageError, "xformOpOrder lists xformOp:translate, which is not authored"),
        ('double3 xformOp:scale = (1, 0, 1)\nORDER["xformOp:scale"]', StageError, "is scaled to nothing"),
        ('double3 xformOp:translate = (nan, 0, 1)\nORDER["xformOp:translate"]', StageError, "NaN or infinity"),
        ('ORDER["!resetXformStack!"]', UnsupportedError, "resets its transform stack"),
    ],
)
def test_transforms_that_usd_misreads(read_scene, xform, error, saying) -> None:
    text = xform.replace("ORDER", "uniform token[] xformOpOrder = ")
    with pytest.raises(error, match=f"^/World/Target/Box.*{saying}"):
        read_scene(f'def Cube "Box"\n{{\n{text}\n}}')


def test_a_target_without_geometry(read_scene) -> None:
    with pytest.raises(StageError, match=r"^/World/Target: the target has no geometry that is rendered"):
        read_scene('def Xform "Empty" {}')


def test_levels_of_detail_are_refused_rather_than_all_drawn(read_scene) -> None:
    geometry = 'def Xform "Lod" (\nprepend apiSchemas = ["LODRootAPI"]\n)\n{\ndef Cube "Near" {}\ndef Cube "Far" {}\n}'
    with pytest.raises(UnsupportedError, match=r"^/World/Target/Lod: chooses among levels of detail"):
        read_scene(geometry)


@pytest.mark.parametrize(
    ("inputs", "kept"),
    [
        ('float inputs:opacity = 0\ntoken inputs:opacityMode = "presence"', False),
        ('float inputs:opacity = 0.001\ntoken inputs:opacityMode = "presence"', True),
        ("float inputs:opacity = 0\nfloat inputs:ior = 1", False),
        ("float inputs:opacity = 0", True),  # glass, which reflects
        ("float inputs:opacity = 0.3\nfloat inputs:opacityThreshold = 0.4", False),
        ("float inputs:opacity = 0\ncolor3f inputs:emissiveColor = (1, 0, 0)", True),
    ],
)
def test_faces_that_cannot_be_seen_are_left_out_and_told(make_stage, inputs, kept) -> None:
    reader = StageReader(make_stage(two_materials(Blue=inputs)))
    mesh = reader.scene(reader.frames[0]).bodies[0].target.mesh
    assert len(mesh.faces) == (12 if kept else 10)
    told = [] if kept else [("material-transparent", "/World/Target/Blue")]
    assert [(note.code, note.where) for note in reader.notes] == told
    assert len(reader.bodies.whole_target_at(0).mesh.faces) == 12


def test_a_gprim_that_cannot_be_seen_has_no_faces_and_keeps_its_number(read_scene) -> None:
    gone = 'float inputs:opacity = 0\ntoken inputs:opacityMode = "presence"'
    alone = two_materials(Blue=gone, Red=gone) + '\ndef Cube "Alone" {}'
    target, kept = (
        read_scene(alone).bodies[0].target,
        read_scene(f"uniform bool spin:target:keepTransparent = true\n{alone}").bodies[0].target,
    )
    assert [part.name for part in target.parts if part.id in target.mesh.face_part] == ["Alone"]
    assert set(kept.mesh.face_part) == {1, 2}
    assert kept.parts == target.parts
