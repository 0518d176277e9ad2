"""Displacement moves the mesh itself: closed, along smooth normals, as fine as its image."""

import numpy as np
import pytest
import trimesh
from PIL import Image as PillowImage

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.derived.lookup import values_at
from spin_usd.scene.texture import Coordinates, Image, Texture
from spin_usd.stage.read.shapes import displacement
from spin_usd.stage.read.shapes.displacement import displaced, tessellated, welded
from spin_usd.stage.read.shapes.primitives import revolve
from spin_usd.stage.read.shapes.triangles import Triangles, face_normals
from tests.cases.png import png

FLOAT32 = 1e-6
CHORD = 1e-4  # a sphere of 224 corners, relative to its radius (see gprims)
GEOMETRY = """
    def {shape} "Body" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {{
        rel material:binding = </World/Target/Paint>
        {body}
    }}
    def Material "Paint"
    {{
        token outputs:surface.connect = </World/Target/Paint/Surface.outputs:surface>
        def Shader "Surface"
        {{
            uniform token info:id = "UsdPreviewSurface"
            {inputs}
            token outputs:surface
        }}
        def Shader "Texture"
        {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @./a.png@
            token inputs:sourceColorSpace = "raw"
            token inputs:wrapS = "clamp"
            token inputs:wrapT = "clamp"
            float4 inputs:scale = (0.5, 1, 1, 1)
            float2 inputs:st.connect = </World/Target/Paint/Reader.outputs:result>
            float outputs:r
        }}
        def Shader "Reader"
        {{
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }}
    }}"""
SQUARE = """int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (
            interpolation = "vertex"
        )
        uniform token subdivisionScheme = "none"
        """
TEXTURED = "float inputs:displacement.connect = </World/Target/Paint/Texture.outputs:r>"


def solid(mesh):
    return trimesh.Trimesh(mesh.points, mesh.faces, process=False)


def test_a_constant_grows_a_sphere(read_scene) -> None:
    text = GEOMETRY.format(shape="Sphere", body="", inputs="float inputs:displacement = 0.25")
    mesh = read_scene(text).bodies[0].target.mesh
    radius = np.linalg.norm(mesh.points[np.unique(mesh.faces)], axis=1)
    np.testing.assert_allclose(radius, 1.25, rtol=CHORD)
    assert solid(mesh).is_watertight
    outward = mesh.points[mesh.faces] / np.linalg.norm(mesh.points[mesh.faces], axis=-1, keepdims=True)
    np.testing.assert_allclose(mesh.corner_normals, outward, atol=0.01)


def test_a_cube_stays_closed_and_keeps_its_hard_edges(read_scene) -> None:
    """Each corner moves along the mean of its three faces."""
    text = GEOMETRY.format(shape="Cube", body="double size = 2", inputs="float inputs:displacement = 0.5")
    mesh = read_scene(text).bodies[0].target.mesh
    assert solid(mesh).is_watertight
    np.testing.assert_allclose(np.abs(mesh.points[mesh.faces]), 1 + 0.5 / np.sqrt(3), atol=FLOAT32)
    flat = face_normals(mesh.points, mesh.faces)
    np.testing.assert_allclose(mesh.corner_normals, np.repeat(flat[:, None], 3, 1), atol=FLOAT32)


def test_a_seam_that_is_closed_but_for_rounding_stays_closed(read_scene) -> None:
    """A tube whose last points are its first, but for the sine of a full turn in float32."""
    angle = np.float32(2 * np.pi) * np.arange(13, dtype=np.float32) / 12
    ring = [(float(np.cos(a)), float(np.sin(a))) for a in angle]
    assert ring[0] != ring[12]
    points = ", ".join(f"({x!r}, {y!r}, {z})" for z in (0, 1) for x, y in ring)
    faces = ", ".join(f"{i}, {i + 1}, {i + 14}, {i + 13}" for i in range(12))
    body = f"""point3f[] points = [{points}]
        int[] faceVertexCounts = [{", ".join(["4"] * 12)}]
        int[] faceVertexIndices = [{faces}]
        uniform token subdivisionScheme = "none"
        """
    mesh = (
        read_scene(GEOMETRY.format(shape="Mesh", body=body, inputs="float inputs:displacement = 0.25"))
        .bodies[0]
        .target.mesh
    )
    assert len(np.unique(mesh.points[np.unique(mesh.faces)], axis=0)) == 24
    np.testing.assert_allclose(np.linalg.norm(mesh.points[mesh.faces][..., :2], axis=-1), 1.25, atol=1e-5)


def ramp(path, texels=16):
    """A PNG whose red grows from left to right; returns it as numbers, 0 to 1."""
    red = np.linspace(0, 255, texels).round().astype(int)
    pixels = np.zeros((texels, texels, 3), int)
    pixels[..., 0] = red
    path.write_bytes(png(pixels, color=2))
    return red / 255


def test_an_image_lifts_a_square_to_its_texels(read_scene, tmp_path) -> None:
    red = ramp(tmp_path / "a.png")
    target = read_scene(GEOMETRY.format(shape="Mesh", body=SQUARE, inputs=TEXTURED)).bodies[0].target
    points = target.mesh.points[np.unique(target.mesh.faces)]
    expected = 0.5 * np.interp(points[:, 0], (np.arange(16) + 0.5) / 16, red)
    np.testing.assert_allclose(points[:, 2], expected, atol=FLOAT32)
    edges = np.linalg.norm(np.diff(target.mesh.points[target.mesh.edges][..., :2], axis=1), axis=-1)
    assert edges.max() <= 1.5 / 16 + FLOAT32
    slope = 0.5 * (red[9] - red[7]) * 8
    middle = np.abs(target.mesh.points[target.mesh.faces][..., 0] - 0.5) < 0.01
    np.testing.assert_allclose(
        target.mesh.corner_normals[middle],
        np.broadcast_to(np.array([-slope, 0, 1]) / np.hypot(1, slope), (middle.sum(), 3)),
        atol=0.02,  # the ramp's steps are whole numbers of 255
    )


def test_scaled_gprims_displace_in_their_own_axes(read_scene, tmp_path) -> None:
    """Lengths are of the gprim's own axes: twice as large after a scale of two."""
    ramp(tmp_path / "a.png")
    scale = 'double3 xformOp:scale = (2, 2, 2)\nuniform token[] xformOpOrder = ["xformOp:scale"]'
    one = read_scene(GEOMETRY.format(shape="Mesh", body=SQUARE, inputs=TEXTURED)).bodies[0].target.mesh
    two = (
        read_scene(GEOMETRY.format(shape="Mesh", body=SQUARE + scale, inputs=TEXTURED), name="b.usda")
        .bodies[0]
        .target.mesh
    )
    np.testing.assert_allclose(two.points, 2 * one.points, atol=FLOAT32)


def test_only_the_faces_of_its_material_move_and_all_stay_joined(read_scene, tmp_path) -> None:
    ramp(tmp_path / "a.png")
    body = """int[] faceVertexCounts = [4, 4]
        int[] faceVertexIndices = [0, 1, 2, 3, 1, 4, 5, 2]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)]
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1), (1, 0), (1, 1)] (
            interpolation = "vertex"
        )
        uniform token subdivisionScheme = "none"
        def GeomSubset "Flat" (
            prepend apiSchemas = ["MaterialBindingAPI"]
        )
        {
            int[] indices = [1]
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            rel material:binding = </World/Target/Still>
        }
        """
    text = GEOMETRY.format(shape="Mesh", body=body, inputs=TEXTURED)
    still = text[text.index("def Material") :].replace(TEXTURED, "float inputs:roughness = 1").replace("Paint", "Still")
    target = read_scene(f"{text}\n{still}").bodies[0].target
    mesh = target.mesh
    names = [target.materials[i].path.rsplit("/", 1)[1] for i in mesh.face_material]
    middle = mesh.points[mesh.faces].mean(1)
    assert {n for n, x in zip(names, middle[:, 0], strict=True) if x < 1} == {"Paint"}
    assert {n for n, x in zip(names, middle[:, 0], strict=True) if x > 1} == {"Still"}
    beyond = mesh.points[:, 0] > 1 + 1e-9
    np.testing.assert_array_equal(mesh.points[beyond][:, 2], 0)
    border = trimesh.grouping.group_rows(np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1), 1)
    ends = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)[border]
    x, y = mesh.points[ends][..., 0], mesh.points[ends][..., 1]
    on_outline = (np.ptp(x, axis=1) < 1e-9) & np.isin(x[:, 0], (0, 2)) | (np.ptp(y, axis=1) < 1e-9)
    assert on_outline.all()  # no crack between the two faces
    assert set(target.mesh.face_part) == {1}


def noisy(seed=0, size=32):
    pixels = np.random.default_rng(seed).random((size, size, 4)).astype(np.float32)
    return Texture(
        path="/T", image=Image(name="noise", pixels=pixels), output="r", coordinates=Coordinates(primvar="st")
    )


def sphere_with_seam():
    """A sphere with texture coordinates that jump from 1 to 0 along one meridian, and differ at the poles."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 25)
    outline = np.stack([np.where(np.abs(angle) < 1.57, np.cos(angle), 0), np.sin(angle)], 1)
    t = revolve([(outline, outline)])
    p = t.points[t.corners]
    u = np.arctan2(p[..., 1], p[..., 0]) / (2 * np.pi) % 1
    u = np.where((np.ptp(u, axis=1) > 0.5)[:, None] & (u < 0.5), u + 1, u)
    st = np.stack([u, np.arcsin(np.clip(p[..., 2], -1, 1)) / np.pi + 0.5], -1)
    return Triangles(points=t.points, corners=t.corners, normals=t.normals, source=t.source, primvars={"st": st})


def test_texture_seams_do_not_open() -> None:
    """The image does not repeat: its two sides disagree along the seam, and the surface stays closed."""
    texture = Texture(**{**vars(noisy()), "scale": (0.2, 1, 1, 1), "wrap": ("clamp", "clamp")})
    t = sphere_with_seam()
    moved = displaced(t, np.zeros(len(t.corners), int), [texture], "/Mesh")
    closed = trimesh.Trimesh(moved.points, moved.corners, process=False)
    assert closed.is_watertight
    assert closed.volume > 4.0
    assert len(moved.corners) == len(moved.normals) == len(moved.source) == len(moved.primvars["st"])


@pytest.mark.parametrize("seed", range(3))
def test_splitting_leaves_no_crack_and_loses_no_area(seed) -> None:
    rng = np.random.default_rng(seed)
    box = trimesh.creation.box((1, 2, 3))
    points, corners = np.array(box.vertices), np.array(box.faces)
    t = Triangles(
        points=points,
        corners=corners,
        normals=np.repeat(face_normals(points, corners)[:, None], 3, 1),
        source=np.arange(len(corners)),
        primvars={"p": points[corners]},
    )
    measure = points[corners][..., :2] * rng.uniform(0.3, 3, 2) + rng.uniform(0, 0.5, (len(corners), 1, 2))
    fine, parent = tessellated(welded(t), measure, 0.4, "/Mesh")
    split = trimesh.Trimesh(fine.points, fine.corners, process=False)
    assert split.is_watertight
    assert split.area == pytest.approx(box.area)
    assert split.volume == pytest.approx(box.volume)
    np.testing.assert_array_equal(fine.source, parent)
    np.testing.assert_allclose(fine.primvars["p"], fine.points[fine.corners], atol=1e-12)
    np.testing.assert_allclose(fine.normals[:, 0], face_normals(fine.points, fine.corners), atol=1e-9)


def test_too_fine_an_image_is_refused(monkeypatch) -> None:
    monkeypatch.setattr(displacement, "MAX_TRIANGLES", 1000)
    t = sphere_with_seam()
    with pytest.raises(UnsupportedError, match=r"^/Mesh: needs more than 1000 triangles to follow the texels"):
        displaced(t, np.zeros(len(t.corners), int), [noisy()], "/Mesh")


@pytest.mark.parametrize("amount", [1e30, -150])
def test_a_displacement_out_of_sight_is_refused(read_scene, amount) -> None:
    text = GEOMETRY.format(shape="Mesh", body=SQUARE, inputs=f"float inputs:displacement = {amount}")
    with pytest.raises(
        StageError, match=r"^/World/Target/Body: is displaced by (1e\+30|150), more than 100 times its own"
    ):
        read_scene(text)


def test_sheets_back_to_back_are_refused(read_scene) -> None:
    body = SQUARE.replace("[4]", "[4, 4]").replace("[0, 1, 2, 3]", "[0, 1, 2, 3, 3, 2, 1, 0]")
    text = GEOMETRY.format(shape="Mesh", body=body, inputs="float inputs:displacement = 0.5")
    with pytest.raises(UnsupportedError, match=r"^/World/Target/Body: is displaced where two of its faces lie back to"):
        read_scene(text)


def test_nothing_changes_where_displacement_is_zero(read_scene) -> None:
    text = GEOMETRY.format(shape="Cube", body="", inputs="float inputs:displacement = 0")
    plain = GEOMETRY.format(shape="Cube", body="", inputs="")
    assert read_scene(text).bodies[0].target.mesh.key == read_scene(plain, name="b.usda").bodies[0].target.mesh.key


def test_a_texel_of_the_displacement_changes_the_geometry(read_scene, tmp_path) -> None:
    text = GEOMETRY.format(shape="Mesh", body=SQUARE, inputs=TEXTURED)
    ramp(tmp_path / "a.png")
    before = read_scene(text).bodies[0].target.mesh.key
    image = np.asarray(PillowImage.open(tmp_path / "a.png")).astype(int)
    image[3, 4, 0] += 9
    (tmp_path / "a.png").write_bytes(png(image, color=2))
    assert read_scene(text, name="b.usda").bodies[0].target.mesh.key != before


def test_the_image_is_still_looked_up_where_it_was(read_scene, tmp_path) -> None:
    """Texture coordinates follow their points: the height that a corner got is what its own st says."""
    ramp(tmp_path / "a.png")
    color = "color3f inputs:diffuseColor.connect = </World/Target/Paint/Texture.outputs:rgb>"
    text = GEOMETRY.format(shape="Mesh", body=SQUARE, inputs=f"{TEXTURED}\n{color}")
    target = read_scene(text.replace("float outputs:r", "float outputs:r\nfloat3 outputs:rgb")).bodies[0].target
    faces = np.arange(len(target.mesh.faces))
    for corner in np.eye(3):
        shown = values_at(target.materials[0].diffuse_color, target.mesh, faces, np.tile(corner, (len(faces), 1)))
        height = target.mesh.points[target.mesh.faces[:, int(np.argmax(corner))], 2]
        np.testing.assert_allclose(shown[:, 0], height, atol=FLOAT32)
