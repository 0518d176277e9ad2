"""A craft of another's making: a shape that is no mesh, an instance, subsets, a flat colour, an image."""

from pathlib import Path

from PIL import Image

CRAFT = """#usda 1.0
(
    defaultPrim = "Craft"
    metersPerUnit = 0.01
    upAxis = "Y"
)
def Xform "Craft"
{
    def Cube "Bus" {
        double size = 100
    }
    def Xform "Wings" (instanceable = true
        references = </Wing>) {
        double3 xformOp:translate = (150, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Mesh "Deck"
    {
        point3f[] points = [(-50, 60, -50), (50, 60, -50), (50, 60, 50), (-50, 60, 50), (0, 60, 90)]
        int[] faceVertexCounts = [4, 3]
        int[] faceVertexIndices = [0, 3, 2, 1, 3, 4, 2]
        uniform token subdivisionScheme = "none"
        texCoord2f[] primvars:st = [(0, 0), (0, 3), (3, 3), (3, 0), (0.5, 0.5)] (interpolation = "vertex")
        def GeomSubset "radiator" (apiSchemas = ["MaterialBindingAPI"]) {
            int[] indices = [0]
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            rel material:binding = </Craft/Red>
        }
        def GeomSubset "flag" (apiSchemas = ["MaterialBindingAPI"]) {
            int[] indices = [1]
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            rel material:binding = </Craft/Flag>
        }
    }
    def Material "Red" {
        token outputs:surface.connect = </Craft/Red/S.outputs:surface>
        def Shader "S" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.7, 0.05, 0.05)
            token outputs:surface
        }
    }
    def Material "Flag" {
        token outputs:surface.connect = </Craft/Flag/S.outputs:surface>
        def Shader "S" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </Craft/Flag/T.outputs:rgb>
            token outputs:surface
        }
        def Shader "T" {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @./flag.png@
            float2 inputs:st.connect = </Craft/Flag/R.outputs:result>
            float3 outputs:rgb
        }
        def Shader "R" {
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }
    }
}
def Xform "Wing" {
    def Mesh "solar_panel"
    {
        point3f[] points = [(-100, 0, -40), (100, 0, -40), (100, 0, 40), (-100, 0, 40)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        uniform token subdivisionScheme = "none"
        uniform bool doubleSided = true
    }
}
"""
PLAIN = CRAFT[: CRAFT.index('def Mesh "Deck"')] + "}\n" + CRAFT[CRAFT.index('def Xform "Wing"') :]
"""The same of parts without a material."""


def craft_in(folder: Path) -> Path:
    """Write it into the folder, with its image; return its file."""
    Image.new("RGB", (4, 4), (10, 200, 30)).save(folder / "flag.png")
    (folder / "craft.usda").write_text(CRAFT)
    return folder / "craft.usda"
