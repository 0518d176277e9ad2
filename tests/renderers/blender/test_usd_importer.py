"""Materials against Blender's own USD importer: the same asset, camera, lights and Cycles settings.

What the importer gets wrong is listed in FAULTS, each with what proves it.
"""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.renderers.blender.light_links import EMISSION
from spin_usd.renderers.blender.textures import forget_render_data
from spin_usd.renderers.camera_shader import View
from spin_usd.scene.effort import Effort
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.image_files import write_image_file

LIKE_THE_IMPORTER = 0.01  # mean difference relative to the mean
SAMPLES = 16
SIZE = 12  # quads per side of the surface

STAGE = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "World"
{
    def Camera "Camera" ( prepend apiSchemas = ["SpinLensAPI"] )
    {
        int2 spin:lens:imageSize = (64, 64)
        double spin:lens:fx = 130
        double spin:lens:fy = 130
        double spin:lens:cx = 32
        double spin:lens:cy = 32
    }
    def Xform "Target" ( prepend apiSchemas = ["SpinTargetAPI"]
        prepend references = @asset.usda@ )
    {
        double3 xformOp:translate = (0, 0, -5)
        quatd xformOp:orient = (0.96, 0.2, 0.16, 0.11313708498984767)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]
    }
    def DistantLight "Key"
    {
        float inputs:intensity = 3
        bool inputs:normalize = 1
        float inputs:angle = 20
        float3 xformOp:rotateXYZ = (25, -30, 0)
        uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
    }
    def DistantLight "Fill"
    {
        float inputs:intensity = 1
        bool inputs:normalize = 1
        float inputs:angle = 40
        float3 xformOp:rotateXYZ = (-35, 35, 0)
        uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
    }
}
"""
ASSET = """#usda 1.0
(
    defaultPrim = "Asset"
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "Asset"
{{
    def Mesh "Bump" ( prepend apiSchemas = ["MaterialBindingAPI"] )
    {{
        uniform token subdivisionScheme = "none"
        {mesh}
        {binding}
    }}
    {materials}
}}
"""
MATERIAL = """
    def Material "{name}"
    {{
        token outputs:surface.connect = </Asset/{name}/Surface.outputs:surface>
        def Shader "Surface"
        {{
            uniform token info:id = "UsdPreviewSurface"
            {inputs}
            token outputs:surface
        }}
        def Shader "Reader"
        {{
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }}
        {nodes}
    }}
"""
TRANSFORM = """
        def Shader "Placed"
        {
            uniform token info:id = "UsdTransform2d"
            float2 inputs:in.connect = </Asset/Paint/Reader.outputs:result>
            float2 inputs:scale = (1.5, 0.8)
            float inputs:rotation = 30
            float2 inputs:translation = (0.2, -0.1)
            float2 outputs:result
        }
"""


def texture(name, file, *, output="rgb", space="raw", wrap="repeat", st="Reader", more="") -> str:
    """A UsdUVTexture node."""
    wraps = (wrap, wrap) if isinstance(wrap, str) else wrap
    kind = "float3" if output == "rgb" else "float"
    return f"""
        def Shader "{name}"
        {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @{file}@
            token inputs:sourceColorSpace = "{space}"
            token inputs:wrapS = "{wraps[0]}"
            token inputs:wrapT = "{wraps[1]}"
            float2 inputs:st.connect = </Asset/Paint/{st}.outputs:result>
            {more}
            {kind} outputs:{output}
        }}
"""


def connect(name, node, output="rgb") -> str:
    kind = {"diffuseColor": "color3f", "emissiveColor": "color3f", "normal": "normal3f"}.get(name, "float")
    return f"{kind} inputs:{name}.connect = </Asset/Paint/{node}.outputs:{output}>\n"


DIFFUSE = "color3f inputs:diffuseColor = (0.7, 0.4, 0.2)\n"
ROUGH = "float inputs:roughness = 0.35\n"
SCALED = "float4 inputs:scale = (0.5, 0.4, 0.3, 1)\nfloat4 inputs:bias = (0.2, 0, 0.1, 0)"
NORMALS = "float4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = (-1, -1, -1, 0)"
# Name: (inputs, nodes).
CASES = {
    "dielectric": (DIFFUSE + ROUGH, ""),
    "index of refraction": (DIFFUSE + ROUGH + "float inputs:ior = 2.2\n", ""),
    "metal": (DIFFUSE + ROUGH + "float inputs:metallic = 1\n", ""),
    "half a metal": (DIFFUSE + ROUGH + "float inputs:metallic = 0.5\n", ""),
    "clearcoat": (DIFFUSE + ROUGH + "float inputs:clearcoat = 1\nfloat inputs:clearcoatRoughness = 0.1\n", ""),
    "emission": (DIFFUSE + ROUGH + "color3f inputs:emissiveColor = (0.5, 0.2, 0.9)\n", ""),
    "diffuse, sRGB": (ROUGH + connect("diffuseColor", "Map"), texture("Map", "smooth.png", space="sRGB")),
    "diffuse, raw": (ROUGH + connect("diffuseColor", "Map"), texture("Map", "color.png")),
    "diffuse, auto": (ROUGH + connect("diffuseColor", "Map"), texture("Map", "smooth.png", space="auto")),
    "clamped": (ROUGH + connect("diffuseColor", "Map"), texture("Map", "color.png", wrap="clamp")),
    "mirrored": (ROUGH + connect("diffuseColor", "Map"), texture("Map", "color.png", wrap="mirror")),
    "black border": (ROUGH + connect("diffuseColor", "Map"), texture("Map", "color.png", wrap="black")),
    "transformed": (
        ROUGH + connect("diffuseColor", "Map"),
        TRANSFORM + texture("Map", "color.png", st="Placed"),
    ),
    "scaled and biased": (
        ROUGH + connect("diffuseColor", "Map"),
        texture("Map", "color.png", more=SCALED),
    ),
    "roughness and metallic of one map": (
        DIFFUSE + connect("roughness", "Map", "g") + connect("metallic", "Other", "b"),
        texture("Map", "color.png", output="g") + texture("Other", "color.png", output="b"),
    ),
    "emission map": (DIFFUSE + ROUGH + connect("emissiveColor", "Map"), texture("Map", "smooth.png", space="sRGB")),
    "cut-out": (
        DIFFUSE + ROUGH + "float inputs:opacityThreshold = 0.5\n" + connect("opacity", "Map", "r"),
        texture("Map", "color.png", output="r"),
    ),
    "normal map": (DIFFUSE + ROUGH + connect("normal", "Map"), texture("Map", "normal.png", more=NORMALS)),
}  # fmt: skip
PRESENCE = DIFFUSE + ROUGH + 'token inputs:opacityMode = "presence"\n'
# What the importer gets wrong, with the reason and who else says so. Name: (inputs, nodes).
FAULTS = {
    # It has no absence: opacity always becomes refracting glass. test_materials.test_what_is_not_reflected_passes.
    "presence": (PRESENCE + "float inputs:opacity = 0.4\n", ""),
    "presence map": (PRESENCE + connect("opacity", "Map", "r"), texture("Map", "color.png", output="r")),
    # It reads specularColor as a tint of the reflection that ior gives, and useSpecularWorkflow not at all. Fresnel:
    # test_materials.test_the_specular_workflow_reflects_its_colour_head_on.
    "specular workflow": (
        DIFFUSE + ROUGH + "int inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (0.9, 0.5, 0.2)\n", ""),
    # It leaves what is not authored at Blender's own default, a diffuse colour of 0.8; USD's node registry says 0.18.
    "no diffuse colour": (ROUGH, ""),
    # It lets wrapS decide for both axes. OpenCV: tests/scene/derived/test_lookup.py.
    "wraps by axis": (ROUGH + connect("diffuseColor", "Map"), texture("Map", "color.png", wrap=("clamp", "repeat"))),
    # Blender interpolates sRGB's code values, where USD and graphics cards interpolate light: 6 % between texels of
    # great contrast, nothing on them. IEC 61966-2-1 and OpenCV: tests/stage/composition/test_images.py,
    # tests/scene/derived/test_lookup.py.
    "sRGB of great contrast": (ROUGH + connect("diffuseColor", "Map"), texture("Map", "color.png", space="sRGB")),
}  # fmt: skip


def write_images(folder) -> None:
    rng = np.random.default_rng(1)
    write_image_file(folder / "color.png", rng.integers(20, 255, (8, 8, 3), np.uint8))
    across, down = np.meshgrid(np.arange(32), np.arange(32))
    waves = [np.cos(2 * np.pi * (across + i * down) / 32) for i in range(3)]
    write_image_file(folder / "smooth.png", np.rint(140 + 100 * np.stack(waves, -1)).astype(np.uint8))
    tilt = np.stack([0.3 * np.sin(across / 3), 0.3 * np.cos(down / 4), np.ones((32, 32))], -1)
    tilt /= np.linalg.norm(tilt, axis=-1, keepdims=True)
    write_image_file(folder / "normal.png", np.rint((tilt * 0.5 + 0.5) * 255).astype(np.uint8))


def bump() -> str:
    """Attributes of a smooth hill of triangles, seen from +z, with texture coordinates beyond the image."""
    x, y = np.meshgrid(np.linspace(-1, 1, SIZE + 1), np.linspace(-1, 1, SIZE + 1))
    z = 0.4 * np.exp(-2 * (x**2 + y**2))
    points = np.stack([x, y, z], -1).reshape(-1, 3)
    normals = np.stack([4 * x * z, 4 * y * z, np.ones_like(z)], -1).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    i, j = np.mgrid[:SIZE, :SIZE].reshape(2, -1)
    a, b = i * (SIZE + 1) + j, i * (SIZE + 1) + j + 1
    c, d = a + SIZE + 1, b + SIZE + 1
    faces = np.stack([np.stack([a, b, d], -1), np.stack([a, d, c], -1)], 1).reshape(-1, 3)
    st = points[:, :2] * 1.2 + 0.5

    def listed(rows):
        return "[" + ", ".join("(" + ", ".join(f"{v:.9g}" for v in row) + ")" for row in rows) + "]"

    return f"""int[] faceVertexCounts = {[3] * len(faces)}
        int[] faceVertexIndices = {faces.ravel().tolist()}
        point3f[] points = {listed(points)}
        normal3f[] normals = {listed(normals)} (
            interpolation = "vertex"
        )
        texCoord2f[] primvars:st = {listed(st)} (
            interpolation = "vertex"
        )"""


BUMP = bump()
BOUND = "rel material:binding = </Asset/Paint>"


def render_ours(blender, folder, materials, binding=BOUND, mesh=BUMP):
    (folder / "stage.usda").write_text(STAGE)
    (folder / "asset.usda").write_text(ASSET.format(mesh=mesh, binding=binding, materials=materials))
    reader = StageReader(folder / "stage.usda")
    scene = reader.scene(reader.frames[0])
    return scene, blender.radiance(scene, Effort(samples=SAMPLES), seed=1).rgba


def render_theirs(blender, folder, scene):
    """The importer's objects in place of ours; everything else as it is."""
    ours = list(blender._bodies._objects[0].objects)
    before = {kind: set(getattr(bpy.data, kind)) for kind in ("objects", "meshes", "materials", "images")}
    for shown in ours:
        shown.hide_render = True
    try:
        bpy.ops.wm.usd_import(
            filepath=str(folder / "asset.usda"), import_cameras=False, import_lights=False, merge_parent_xform=False,
            set_frame_range=False, import_subdivision=False, create_world_material=False,
        )  # fmt: skip
        place, view = np.eye(4), View.blurred(scene)
        place[:3, :3] = T_USDCAM_CAM.rotation @ scene.bodies[0].T_cam_body.rotation
        place[:3, 3] = view.location(view.centre) - place[:3, :3] @ scene.bodies[0].target.mesh.centre
        for shown in set(bpy.data.objects) - before["objects"]:
            if shown.type == "MESH":
                shown.parent = None
                shown.matrix_world = Matrix(place)
                shown.lightgroup = EMISSION  # as ours is where it shines
        return blender.radiance(scene, Effort(samples=SAMPLES), seed=1).rgba
    finally:
        for kind in before:
            for item in set(getattr(bpy.data, kind)) - before[kind]:
                getattr(bpy.data, kind).remove(item)
        forget_render_data()
        for shown in ours:
            shown.hide_render = False


def difference(ours, theirs):
    return float(np.abs(ours - theirs).mean() / ours.mean())


def both(blender, folder, case):
    """Our picture and theirs."""
    inputs, nodes = case
    write_images(folder)
    scene, ours = render_ours(blender, folder, MATERIAL.format(name="Paint", inputs=inputs, nodes=nodes))
    return ours, render_theirs(blender, folder, scene)


@pytest.mark.parametrize("name", list(CASES))
def test_looks_as_blenders_importer_makes_it(blender, tmp_path, name) -> None:
    assert difference(*both(blender, tmp_path, CASES[name])) < LIKE_THE_IMPORTER


@pytest.mark.parametrize("name", list(FAULTS))
def test_the_importers_faults_are_still_there(blender, tmp_path, name) -> None:
    """So that the list grows no older than the importer."""
    assert difference(*both(blender, tmp_path, FAULTS[name])) > LIKE_THE_IMPORTER


def test_a_clear_surface_reflects_as_the_importers_does(blender, tmp_path) -> None:
    """Reflection and body alone: the importer refracts what passes, so it never shows the background (alpha 1)."""
    ours, theirs = both(blender, tmp_path, (DIFFUSE + ROUGH + "float inputs:opacity = 0.4\n", ""))
    assert difference(ours[..., :3], theirs[..., :3]) < LIKE_THE_IMPORTER
    assert theirs[..., 3].max() == 1
    assert ours[..., 3].max() < 0.5


def subset(name, faces) -> str:
    return f"""
        def GeomSubset "{name}Faces" ( prepend apiSchemas = ["MaterialBindingAPI"] )
        {{
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            int[] indices = {list(faces)}
            rel material:binding = </Asset/{name}>
        }}"""


FACES = 2 * SIZE**2
PAINTS = "".join(
    MATERIAL.format(name=name, inputs=inputs, nodes="")
    for name, inputs in (("Paint", DIFFUSE + ROUGH), ("Metal", DIFFUSE + ROUGH + "float inputs:metallic = 1\n"))
)


def test_subsets_that_cover_the_mesh_look_as_the_importer_makes_them(blender, tmp_path) -> None:
    subsets = subset("Paint", range(0, FACES, 3)) + subset("Metal", sorted(set(range(FACES)) - set(range(0, FACES, 3))))
    scene, ours = render_ours(blender, tmp_path, PAINTS, binding=subsets)
    assert difference(ours, render_theirs(blender, tmp_path, scene)) < LIKE_THE_IMPORTER


def test_the_importer_loses_the_mesh_binding_beside_subsets(blender, tmp_path) -> None:
    """USD: what no subset binds keeps the mesh's own material. Proved by the same with the rest as a subset."""
    rest = sorted(set(range(FACES)) - set(range(0, FACES, 3)))
    one = BOUND.replace("Paint", "Metal") + subset("Paint", range(0, FACES, 3))
    scene, ours = render_ours(blender, tmp_path, PAINTS, binding=one)
    assert difference(ours, render_theirs(blender, tmp_path, scene)) > LIKE_THE_IMPORTER
    _, covered = render_ours(
        blender, tmp_path, PAINTS, binding=subset("Paint", range(0, FACES, 3)) + subset("Metal", rest)
    )
    assert np.array_equal(ours, covered)
