"""The good files that are written by hand: a small scene with something of everything that is read."""

from typing import Any

POSES: list[dict[str, Any]] = [
    {"filename": "img000001.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 5]},
]
STREAM_2 = "filename,sequence,Tx,Ty,Tz,Qx,Qy,Qz,Qw\na.png,1,0,0,5,0,0,0,1\nb.png,1,0,0,6,0.6,0,0,0.8\n"
URSO_POSES = "x,y,z,q1,q2,q3,q4\n5,0,0,0,0,0,1\n6,0.1,0,0.6,0,0,0.8\n"
CAMERA: dict[str, Any] = {
    "Nu": 64,
    "Nv": 48,
    "ppx": 5.86e-6,
    "ppy": 5.86e-6,
    "fx": 0.000586,
    "fy": 0.000586,
    "cameraMatrix": [[100, 0, 32], [0, 100, 24], [0, 0, 1]],
    "distCoeffs": [-0.1, 0.01, 0.001, 0.001, 0],
}
KEYPOINTS: dict[str, Any] = {"corner": [0, 0, 0], "tip": [1, 0, 0]}
PARTS: list[dict[str, Any]] = [{"pattern": "*wing*", "part": "wing", "class": "panel"}]
BOX_OBJ = """mtllib box.mtl
o body
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
vt 0 0
vt 1 0
vt 0 1
vn 0 0 1
usemtl red
f 1/1/1 2/2/1 3/3/1
f 1/1 2/2 4/3
o wing
usemtl blue
s 1
f 2/1 3/2 4/3
f -4/1 -2/2 -1/3
"""
BOX_MTL = """newmtl red
Kd 0.8 0.1 0.1
Ks 0.5 0.5 0.5
Ns 50
d 1
map_Kd -s 1 1 1 texture.png
newmtl blue
Kd 0.1 0.1 0.8
Pr 0.3
Pm 1
illum 2
map_Bump -bm 0.5 texture.png
"""
LIDAR = """schema = "lidar-1"
title = "small"
pattern = "raster"
rows = 4
columns = 4
azimuth = [-10, 10]
elevation = [-10, 10]
range = [0.5, 100]
drop_out = 0.01
max_incidence = 85
noise = { constant = 0.02, proportional = 0.0005 }
mounting = { position = [0.15, 0, 0], forward = [0, 0, 1] }
"""
SAMPLE = """schema = "sample-1"
title = "small"

[[part]]
name = "first"
names = "img{picture:06d}"
pictures = 2
[part.poses]
range = { distribution = "log_uniform", low = 3, high = 30, unit = "m" }
attitude = { distribution = "attitudes" }
inside = 1

[sample]
"sun.direction" = { distribution = "directions", per = "frame" }

[constraints]
sun_from_boresight_deg = 30
"""
SPEC = """schema = "augment-1"
seed = 3

[[augmentation]]
name = "noisy"
count = 1

[augmentation.sample]
"sun.direction" = { distribution = "directions", per = "frame" }
"material.*.roughness.factor" = { distribution = "uniform", low = 0.8, high = 1.0 }

[augmentation.constraints]
sun_from_boresight_deg = 30
"""
TARGET = """#usda 1.0
(
    defaultPrim = "Craft"
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "Craft" (
    prepend apiSchemas = ["SemanticsLabelsAPI:class"]
)
{
    token[] semantics:labels:class = ["bus"]
    double3 xformOp:translate = (0.1, 0, 0)
    float3 xformOp:rotateXYZ = (10, 20, 30)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]

    def Mesh "Body" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        int[] faceVertexCounts = [3, 3, 4]
        int[] faceVertexIndices = [0, 1, 2, 0, 1, 3, 0, 2, 4, 3]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 1, 1)]
        normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)] (
            interpolation = "vertex"
        )
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (0, 1), (1, 1), (0.5, 0.5)] (
            interpolation = "vertex"
        )
        color3f[] primvars:displayColor = [(0.8, 0.6, 0.2)]
        int[] holeIndices = []
        uniform token orientation = "rightHanded"
        uniform token subdivisionScheme = "none"
        rel material:binding = </Craft/Paint>

        def GeomSubset "Side" (
            prepend apiSchemas = ["MaterialBindingAPI"]
        )
        {
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            int[] indices = [2]
            rel material:binding = </Craft/Paint>
        }
    }

    def Cylinder "Antenna"
    {
        token axis = "Z"
        double height = 0.6
        double radius = 0.05
    }

    def PointInstancer "Bolts"
    {
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0, 0, 0), (0.5, 0.5, 0.5)]
        quath[] orientations = [(1, 0, 0, 0), (1, 0, 0, 0)]
        float3[] scales = [(1, 1, 1), (1, 1, 1)]
        rel prototypes = </Craft/Bolts/Bolt>

        def Sphere "Bolt"
        {
            double radius = 0.02
        }
    }

    def Material "Paint"
    {
        token outputs:surface.connect = </Craft/Paint/Surface.outputs:surface>

        def Shader "Surface"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.5, 0.5, 0.5)
            float inputs:roughness = 0.4
            float inputs:metallic = 0
            float inputs:opacity = 1
            float inputs:ior = 1.5
            token outputs:surface
        }
    }
}
"""
STAGE = """#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    upAxis = "Z"
    startTimeCode = 0
    endTimeCode = 1
    timeCodesPerSecond = 24
    renderSettingsPrimPath = "/Render/Settings"
)

def Xform "World" (
    prepend apiSchemas = ["SpinCaptureAPI"]
)
{
    string spin:capture:frame.timeSamples = {
        0: "near",
        1: "far",
    }

    def Camera "Camera" (
        prepend apiSchemas = ["SpinLensAPI", "SpinSensorAPI"]
    )
    {
        quatd xformOp:orient = (0.7071067811865476, 0.7071067811865476, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:orient"]
        int2 spin:lens:imageSize = (64, 48)
        double spin:lens:fx = 100
        double spin:lens:fy = 100
        double spin:lens:cx = 32
        double spin:lens:cy = 24
        double spin:lens:k1 = -0.1
        double spin:lens:k2 = 0.01
        uniform token spin:lens:model = "brownConrady"
        token spin:sensor:channels = "rgb"
        int spin:sensor:bitDepth = 8
        float focalLength = 0.00586
        float horizontalAperture = 0.0037504
        float verticalAperture = 0.0028128
        float fStop = 0
        float exposure:time = 0.01
        float exposure:iso = 100
        float exposure:fStop = 4
        float exposure:responsivity = 3.3239481
        double shutter:open = 0
        double shutter:close = 0
    }

    def Xform "Target" (
        prepend apiSchemas = ["SpinTargetAPI", "SemanticsLabelsAPI:class"]
        variants = {
            string look = "plain"
        }
        prepend variantSets = "look"
    )
    {
        string spin:target:name = "box"
        token[] semantics:labels:class = ["spacecraft"]
        double3 xformOp:translate.timeSamples = {
            0: (0, 5, 0),
            1: (0.5, 6, 0.2),
        }
        quatd xformOp:orient.timeSamples = {
            0: (1, 0, 0, 0),
            1: (0.9238795325112867, 0, 0, 0.3826834323650898),
        }
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient"]

        def Mesh "Body" (
            prepend apiSchemas = ["MaterialBindingAPI"]
        )
        {
            int[] faceVertexCounts = [3, 3]
            int[] faceVertexIndices = [0, 1, 2, 0, 1, 3]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
            texCoord2f[] primvars:st = [(0, 0), (1, 0), (0, 1), (1, 1)] (
                interpolation = "vertex"
            )
            uniform token subdivisionScheme = "none"
            uniform bool doubleSided = 1
            rel material:binding = </World/Target/Paint>
        }

        def Cube "Box"
        {
            double size = 0.5
            color3f[] primvars:displayColor = [(0.8, 0.6, 0.2)]
        }

        def Material "Paint"
        {
            token outputs:surface.connect = </World/Target/Paint/Surface.outputs:surface>

            def Shader "Surface"
            {
                uniform token info:id = "UsdPreviewSurface"
                color3f inputs:diffuseColor.connect = </World/Target/Paint/Image.outputs:rgb>
                float inputs:roughness = 0.4
                token outputs:surface
            }

            def Shader "Image"
            {
                uniform token info:id = "UsdUVTexture"
                asset inputs:file = @./texture.png@
                float2 inputs:st.connect = </World/Target/Paint/Place.outputs:result>
                token inputs:wrapS = "repeat"
                float4 inputs:scale = (1, 1, 1, 1)
                float3 outputs:rgb
            }

            def Shader "Place"
            {
                uniform token info:id = "UsdPrimvarReader_float2"
                string inputs:varname = "st"
                float2 outputs:result
            }
        }

        variantSet "look" = {
            "bright" {
                over "Box"
                {
                    color3f[] primvars:displayColor = [(1, 1, 1)]
                }
            }
            "plain" {
            }
        }
    }

    def DistantLight "Sun"
    {
        bool inputs:normalize = 1
        float inputs:intensity = 1361
        float inputs:angle = 0.53
        color3f inputs:color = (1, 1, 1)
        float3 xformOp:rotateXYZ = (60, 0, 30)
        uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
    }

    def SphereLight "Lamp"
    {
        float inputs:radius = 0.2
        float inputs:intensity = 10
        double3 xformOp:translate = (3, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}

def Scope "Render"
{
    def RenderSettings "Settings"
    {
        rel camera = </World/Camera>
        uniform int2 resolution = (64, 48)
    }
}
"""

BOX_DAE = """<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1" name="metre"/><up_axis>Z_UP</up_axis></asset>
<library_images><image id="picture"><init_from>texture.png</init_from></image></library_images>
<library_effects><effect id="effect"><profile_COMMON>
<newparam sid="surface"><surface type="2D"><init_from>picture</init_from></surface></newparam>
<newparam sid="sampler"><sampler2D><source>surface</source></sampler2D></newparam>
<technique sid="t"><phong><diffuse><texture texture="sampler" texcoord="UV"/></diffuse>
<shininess><float>20</float></shininess><transparency><float>0.5</float></transparency></phong></technique>
</profile_COMMON></effect></library_effects>
<library_materials><material id="foil" name="foil"><instance_effect url="#effect"/></material></library_materials>
<library_geometries><geometry id="panel" name="panel"><mesh>
<source id="points"><float_array id="points-a" count="12">0 0 0 1 0 0 1 1 0 0 1 1</float_array><technique_common>
<accessor source="#points-a" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<source id="st"><float_array id="st-a" count="4">0 0 1 1</float_array><technique_common>
<accessor source="#st-a" count="2" stride="2"><param name="S" type="float"/><param name="T" type="float"/></accessor>
</technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#points"/></vertices>
<polylist material="m" count="2"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#st" offset="1" set="0"/><vcount>3 3</vcount><p>0 0 1 1 2 0 0 0 2 1 3 1</p>
</polylist></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node name="wing"><translate>1 2 3</translate><rotate>0 0 1 45</rotate>
<instance_geometry url="#panel"><bind_material><technique_common><instance_material symbol="m" target="#foil">
<bind_vertex_input semantic="UV" input_semantic="TEXCOORD" input_set="0"/></instance_material></technique_common>
</bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene></COLLADA>
"""
