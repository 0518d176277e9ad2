"""Lights by UsdLux's own rules: how bright, how large, where in camera axes, linked to what; and what is refused.

What their radiometry means for a surface, tests/renderers/blender/test_lights.py shows.
"""

import numpy as np
import OpenImageIO
import pytest
from pxr import Gf, UsdLux

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.light import CylinderLight, DiskLight, DistantLight, PointLight, RectLight, SphereLight
from spin_usd.stage.read.stage_reader import StageReader

FLOAT32 = 1e-6


def sun(attributes="", kind="DistantLight", metadata="") -> str:
    return f"""def {kind} "Sun" {metadata}
    {{
        float inputs:intensity = 100
        {attributes}
    }}"""


def light(read_scene, *arguments, **options):
    (found,) = read_scene(world=sun(*arguments, **options)).lights
    return found


@pytest.mark.parametrize(
    ("attributes", "irradiance"),
    [
        ("bool inputs:normalize = 1", (100, 100, 100)),
        ("bool inputs:normalize = 1\nfloat inputs:angle = 5", (100, 100, 100)),
        ("bool inputs:normalize = 1\nfloat inputs:exposure = 3", (800, 800, 800)),
        ("bool inputs:normalize = 1\ncolor3f inputs:color = (1, 0.5, 0)", (100, 50, 0)),
        ("float inputs:angle = 10", (100 * np.pi * np.sin(np.radians(5)) ** 2,) * 3),
        ("float inputs:angle = 180", (100 * np.pi,) * 3),  # a whole hemisphere of radiance L: pi L
        ("float inputs:angle = 0", (100, 100, 100)),
    ],
)
def test_irradiance(read_scene, attributes, irradiance) -> None:
    np.testing.assert_allclose(light(read_scene, attributes).irradiance, irradiance, rtol=FLOAT32)


def test_color_temperature_counts_only_where_it_is_enabled(read_scene) -> None:
    off = "bool inputs:normalize = 1\nfloat inputs:colorTemperature = 3000\n"
    assert light(read_scene, off).irradiance == (100, 100, 100)
    on = read_scene(world=sun(off + "bool inputs:enableColorTemperature = 1"), name="on.usda").lights[0]
    np.testing.assert_allclose(on.irradiance, 100 * np.array(UsdLux.BlackbodyTemperatureAsRgb(3000)), rtol=FLOAT32)


def test_direction_is_in_camera_axes(read_scene) -> None:
    """A light shines along its own -z. This one, turned 90 degrees about y, shines along world -x; the camera, turned
    90 degrees about x, looks along world +y with +z up: -x is to its left, -x of an OpenCV camera."""
    turned = 'float xformOp:rotateY = 90\nuniform token[] xformOpOrder = ["xformOp:rotateY"]'
    camera = 'float xformOp:rotateX = 90\nuniform token[] xformOpOrder = ["xformOp:rotateX"]'
    found = read_scene(world=sun(turned), camera=camera).lights[0]
    np.testing.assert_allclose(found.direction_cam, (-1, 0, 0), atol=1e-15)
    assert found.angle == pytest.approx(np.radians(0.53))
    straight = read_scene(world=sun(), camera=camera, name="b.usda").lights[0]
    np.testing.assert_allclose(straight.direction_cam, (0, 1, 0), atol=1e-15)  # world -z is down, +y of the camera


def test_invisible_and_inactive_lights_are_off(read_scene) -> None:
    assert read_scene(world=sun('token visibility = "invisible"')).lights == ()
    assert read_scene(world=sun(metadata="(\nactive = false\n)"), name="b.usda").lights == ()
    assert read_scene(world=sun('token visibility = "invisible"', kind="DomeLight"), name="c.usda").lights == ()


LIGHT_API = '(prepend apiSchemas = ["MeshLightAPI"])'


@pytest.mark.parametrize(
    ("kind", "metadata"), [("PortalLight", ""), ("GeometryLight", ""), ("PluginLight", ""), ("Mesh", LIGHT_API)]
)
def test_other_lights_are_refused_by_name(read_scene, make_stage, kind, metadata) -> None:
    light = f'def {kind} "Sun" {metadata} {{}}'
    with pytest.raises(UnsupportedError, match=f"^/World/(Target/)?Sun: is a {kind}"):
        read_scene(
            'def Cube "Box" {}\n' + light if kind == "Mesh" else 'def Cube "Box" {}',
            world="" if kind == "Mesh" else light,
        )
    hidden = light.replace("{}", '{\ntoken visibility = "invisible"\n}')
    assert read_scene(world=hidden, name="hidden.usda").lights == ()


@pytest.mark.parametrize(
    ("attributes", "error", "saying"),
    [
        ("float inputs:diffuse = 0.5", UnsupportedError, "its inputs:diffuse is not 1"),
        ("float inputs:specular.timeSamples = {0: 1, 1: 2}", UnsupportedError, "its inputs:specular is not 1"),
        ("float inputs:angle = 200", StageError, "inputs:angle: is 200.0; choose numbers from 0 to 180"),
        ("rel light:filters = </World/Target>", UnsupportedError, "has light filters"),
        (
            "float inputs:intensity.connect = </World/Target.outputs:a>",
            UnsupportedError,
            "its inputs:intensity is conn",
        ),
        ("color3f inputs:shadow:color = (0, 0, 1)", UnsupportedError, "its shadows have a colour"),
        ("float inputs:shadow:distance = 3", UnsupportedError, "its shadows end at a distance"),
        ("asset inputs:shaping:ies:file = @./a.ies@", UnsupportedError, "has an IES profile"),
        ("float inputs:shaping:cone:angle = 0.2", UnsupportedError, "is a DistantLight with a cone or a focus"),
        (
            "float inputs:shaping:cone:angle = 90\nfloat inputs:shaping:cone:softness = 1",
            UnsupportedError,
            "is a DistantLight with a cone or a focus",
        ),
        ("float inputs:shaping:focus = 1", UnsupportedError, "is a DistantLight with a cone or a focus"),
        ("float inputs:exposure = nan", StageError, "inputs:exposure: is nan"),
        ("float inputs:exposure = 1e6", StageError, r"its emission is \(inf, inf, inf\); choose an intensity"),
        ("float inputs:intensity = 1e30", StageError, r"its emission is .* numbers from 0 to 1e\+15"),
        (
            "bool inputs:enableColorTemperature = 1\nfloat inputs:colorTemperature = -5",
            StageError,
            "inputs:colorTemperature: is -5.0; choose numbers from 1000 to 10000",
        ),
        ("color3f inputs:color = (-1, 0, 0)", StageError, "its emission is"),
        (
            'color3f inputs:color = (1, 1, 1) (\ncolorSpace = "lin_ap1_scene"\n)',
            UnsupportedError,
            "inputs:color: is given in colour space 'lin_ap1_scene'",
        ),
    ],
)
def test_what_a_sun_does_not_do_is_refused(read_scene, attributes, error, saying) -> None:
    with pytest.raises(error, match=f"^/World/Sun(: |[.]){saying}"):
        read_scene(world=sun(attributes))


@pytest.mark.parametrize(
    "attributes",
    [
        "float inputs:shaping:cone:angle = 180",
        "float inputs:shaping:cone:angle = 0.3",  # the Sun's rays are at most 0.265 degrees off its axis
        "float inputs:shaping:cone:angle = 20\nfloat inputs:shaping:cone:softness = 0.9",
        "float inputs:shaping:focus = -1",
    ],
)
def test_a_cone_around_all_rays_of_a_sun_has_no_effect(read_scene, attributes) -> None:
    (shaped,) = read_scene(world=sun(attributes), name="shaped.usda").lights
    assert vars(shaped) == vars(light(read_scene))


def placed(*attributes, scale=(1, 1, 1), turn=(0, 0, 0), at=(0, 0, 0)):
    """The text of attributes and a transform."""
    ops = (
        f"double3 xformOp:translate = {at}\nfloat3 xformOp:rotateXYZ = {turn}\nfloat3 xformOp:scale = {scale}\n"
        'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"]'
    )
    return "\n".join([*attributes, ops])


NORMALIZED = "bool inputs:normalize = 1"


@pytest.mark.parametrize(
    ("kind", "attributes", "metres", "shape", "size", "area"),
    [  # the size in metres, and the area that normalising divides by, in the stage's own units
        ("SphereLight", ["float inputs:radius = 2"], 1, SphereLight, (2,), 16 * np.pi),
        ("SphereLight", ["float inputs:radius = 200"], 0.01, SphereLight, (2,), 160000 * np.pi),
        ("DiskLight", ["float inputs:radius = 2"], 1, DiskLight, (2, 2), 4 * np.pi),
        ("RectLight", ["float inputs:width = 2", "float inputs:height = 3"], 1, RectLight, (2, 3), 6),
        ("RectLight", ["float inputs:width = 2", "float inputs:height = 3"], 1000, RectLight, (2000, 3000), 6),
        ("CylinderLight", ["float inputs:length = 2", "float inputs:radius = 3"], 1, CylinderLight, (2, 3), 12 * np.pi),
    ],
)
def test_sizes_and_areas(read_scene, kind, attributes, metres, shape, size, area) -> None:
    metadata = f"metersPerUnit = {metres}"
    found = light(read_scene, "\n".join(attributes), kind=kind) if metres == 1 else None
    for name, extra, emission in (("a.usda", [], 100), ("b.usda", [NORMALIZED], 100 / area)):
        world = sun("\n".join([*attributes, *extra]), kind=kind)
        (found,) = read_scene(world=world, metadata=metadata, name=name).lights
        assert (type(found), found.size) == (shape, pytest.approx(size, rel=FLOAT32))
        np.testing.assert_allclose(found.emission, (emission,) * 3, rtol=FLOAT32)


@pytest.mark.parametrize(
    ("kind", "scale", "size"),
    [
        ("SphereLight", (3, 3, 3), (1.5,)),
        ("DiskLight", (3, 2, 7), (1.5, 1.0)),
        ("RectLight", (3, 2, 7), (3, 2)),
        ("CylinderLight", (3, 2, 2), (3, 1)),
    ],
)
def test_transforms_scale_sizes(read_scene, kind, scale, size) -> None:
    assert light(read_scene, placed(scale=scale), kind=kind).size == pytest.approx(size, rel=FLOAT32)


@pytest.mark.parametrize(
    ("kind", "attributes", "error", "saying"),
    [
        ("SphereLight", placed(scale=(1, 2, 1)), UnsupportedError, "is a SphereLight scaled unequally"),
        ("CylinderLight", placed(scale=(1, 2, 1)), UnsupportedError, "is a CylinderLight scaled unequally"),
        ("RectLight", placed(scale=(-1, 1, 1)), StageError, "its transform is mirrored"),
        ("RectLight", placed(scale=(1, 0, 1)), StageError, "its transform is mirrored, flat"),
        ("RectLight", "float inputs:width = 0", StageError, "has no surface that could emit"),
        ("SphereLight", "float inputs:radius = 0", StageError, "has no surface that could emit"),
        ("SphereLight", "float inputs:radius = -1", StageError, "inputs:radius: is -1.0; choose"),
        ("DiskLight", "float inputs:radius = inf", StageError, "inputs:radius: is inf; choose"),
        ("DiskLight", "float inputs:shaping:cone:softness = -1", StageError, "inputs:shaping:cone:softness: is -1"),
        ("DiskLight", "float inputs:shaping:focus = nan", StageError, "inputs:shaping:focus: is nan; choose"),
        ("DiskLight", "float inputs:shaping:focus = 1e30", StageError, "inputs:shaping:focus: is 1.*e[+]30; choose"),
        (
            "SphereLight",
            placed(at=(0, 1e17, 0)),
            UnsupportedError,
            r"its distance from the camera is 1e\+17 m.*Distant",
        ),
        ("SphereLight", "float inputs:radius = 1e17", UnsupportedError, r"its size is 1e\+17 m.* use a DistantLight"),
        ("SphereLight", "float inputs:radius = 1e-20", UnsupportedError, "its size is 1e-20 m, less than"),
        ("DomeLight", "float inputs:intensity = 1e30", StageError, "its emission is"),
        ("DomeLight", "float inputs:shaping:focus = 1", UnsupportedError, "is a DomeLight with a cone or a focus"),
        ("DomeLight", "bool inputs:shadow:enable = 0", UnsupportedError, "is a dome without shadows"),
        ("DomeLight", "rel collection:lightLink:excludes = </World/Target>", UnsupportedError, "is a DomeLight linked"),
        (
            "DomeLight",
            'asset inputs:texture:file = @./sky.exr@\ntoken inputs:texture:format = "angular"',
            UnsupportedError,
            "its texture is a angular",
        ),
        ("RectLight", "asset inputs:texture:file = @./none.png@", StageError, "its image @./none.png@ does not exist"),
    ],
)
def test_what_a_light_with_a_place_does_not_do_is_refused(read_scene, kind, attributes, error, saying) -> None:
    with pytest.raises(error, match=f"^/World/Sun(: |[.]){saying}"):
        read_scene(world=sun(attributes, kind=kind))


def test_sheared_lights_are_refused(read_scene) -> None:
    world = f"""def Xform "Slanted" {{
        {placed(scale=(1, 3, 1))}
        {sun(placed(turn=(0, 0, 45)), kind="RectLight")}
    }}"""
    with pytest.raises(StageError, match=r"^/World/Slanted/Sun: its transform shears it"):
        read_scene(world=world)


@pytest.mark.parametrize("far", [0.0, 1e11])
def test_places_are_exact_however_far_the_stage_lies_from_its_origin(make_stage, far) -> None:
    """USD's own matrices, in Gf's doubles, around the camera: its rounding is 1e11 / 2^53 m."""
    path = make_stage(world=sun(placed(at=(1, 2, -3), turn=(20, 30, 40)), kind="RectLight"))
    orbit = f'{{\ndouble3 xformOp:translate = ({far}, {far}, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    path.write_text(path.read_text().replace('def Xform "World"\n{', 'def Xform "World"\n' + orbit))
    reader = StageReader(path)
    (found,) = reader.scene(reader.frames[0]).lights
    np.testing.assert_allclose(found.T_cam_light.translation, (1, -2, 3), atol=4 * far / 2**53 + 1e-12)
    turn = Gf.Matrix3d(1)
    for axis, angle in (((1, 0, 0), 20), ((0, 1, 0), 30), ((0, 0, 1), 40)):
        turn *= Gf.Matrix3d(Gf.Rotation(axis, angle))
    np.testing.assert_allclose(found.T_cam_light.rotation, np.diag([1, -1, -1]) @ np.array(turn).T, atol=1e-9)


def test_spheres_that_are_points(read_scene) -> None:
    """From afar a sphere of radiance L is a point of intensity pi r2 L; normalised, a quarter of L."""
    for name, attributes, intensity in (
        ("a", ["bool treatAsPoint = 1", "float inputs:radius = 2"], 400 * np.pi),
        ("b", ["bool treatAsPoint = 1", "float inputs:radius = 2", NORMALIZED], 25),
        ("c", ["float inputs:radius = 0", NORMALIZED], 25),
    ):
        (found,) = read_scene(world=sun("\n".join(attributes), kind="SphereLight"), name=f"{name}.usda").lights
        assert type(found) is PointLight
        np.testing.assert_allclose(found.emission, (intensity,) * 3, rtol=FLOAT32)


def test_shaping(read_scene) -> None:
    assert light(read_scene, kind="DiskLight").shaping is None
    applied = '(\nprepend apiSchemas = ["ShapingAPI"]\n)'
    (bare,) = read_scene(world=sun(kind="DiskLight", metadata=applied), name="b.usda").lights
    assert (bare.shaping.cone_angle, bare.shaping.softness) == (pytest.approx(np.pi / 2), 0)  # the schema's own cone
    attributes = (
        "float inputs:shaping:cone:angle = 30\nfloat inputs:shaping:cone:softness = 0.25\n"
        "float inputs:shaping:focus = 2\ncolor3f inputs:shaping:focusTint = (1, 0, 0.5)"
    )
    (full,) = read_scene(world=sun(attributes, kind="DiskLight", metadata=applied), name="c.usda").lights
    assert full.shaping.cone_angle == pytest.approx(np.radians(30))
    assert (full.shaping.softness, full.shaping.focus, full.shaping.focus_tint) == (0.25, 2.0, (1.0, 0.0, 0.5))


def test_values_and_places_follow_time(make_stage) -> None:
    attributes = (
        "float inputs:intensity.timeSamples = {0: 1, 1: 3}\nfloat inputs:radius.timeSamples = {0: 1, 1: 2}\n"
        "double3 xformOp:translate.timeSamples = {0: (0, 0, 0), 1: (0, 0, -5)}\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n'
        'token visibility.timeSamples = {0: "inherited", 1: "inherited", 2: "invisible"}'
    )
    world = 'def DiskLight "Lamp"\n{\n' + attributes + "\n}"
    metadata = "metersPerUnit = 1\nstartTimeCode = 0\nendTimeCode = 2"
    reader = StageReader(make_stage(world=world, metadata=metadata))
    first, second, third = (reader.scene(frame).lights for frame in reader.frames)
    assert (first[0].emission, first[0].size, first[0].T_cam_light.translation[2]) == ((1, 1, 1), (1, 1), 0)
    assert (second[0].emission, second[0].size, second[0].T_cam_light.translation[2]) == ((3, 3, 3), (2, 2), 5)
    assert third == ()


@pytest.mark.parametrize(
    "attributes",
    [
        "",
        "float inputs:intensity.timeSamples = {0: 1, 2: 3}",
        "float inputs:angle.timeSamples = {0: 1, 2: 3}",
        'token visibility.timeSamples = {0: "inherited", 2: "invisible"}',
    ],
)
def test_a_sun_that_turns_is_read_as_if_each_picture_were_the_first(make_stage, attributes) -> None:
    turn = 'float xformOp:rotateY.timeSamples = {0: 0, 2: 90}\nuniform token[] xformOpOrder = ["xformOp:rotateY"]\n'
    path = make_stage(world=sun(turn + attributes), metadata="startTimeCode = 0\nendTimeCode = 2")
    reader = StageReader(path)
    found = [reader.scene(frame).lights for frame in reader.frames]
    assert found == [StageReader(path).scene(frame).lights for frame in reader.frames]
    assert len({light.direction_cam for lights in found for light in lights}) == sum(map(len, found)) > 1


def test_shadows_can_be_off(read_scene) -> None:
    for name, kind in (("a", "DistantLight"), ("b", "SphereLight")):
        (found,) = read_scene(world=sun("bool inputs:shadow:enable = 0", kind=kind), name=f"{name}.usda").lights
        assert not found.shadows


def write_image(path) -> None:
    """2 x 1 pixels: red, then blue."""
    pixels = np.array([[[1, 0, 0], [0, 0, 4]]], np.float32)
    assert OpenImageIO.ImageBuf(pixels).write(str(path))


def test_images_of_rectangles_and_domes(read_scene, tmp_path) -> None:
    write_image(tmp_path / "sky.exr")
    for kind in ("RectLight", "DomeLight"):
        attributes = "asset inputs:texture:file = @./sky.exr@"
        (found,) = read_scene(world=sun(attributes, kind=kind), name=f"{kind}.usda").lights
        np.testing.assert_array_equal(found.image.pixels[0, :, :3], [[1, 0, 0], [0, 0, 4]])


@pytest.mark.parametrize(
    ("kind", "pole", "up", "top", "middle", "left"),
    [  # where the image's top row, middle column and the column a quarter of the width left of it are, world axes
        ("DomeLight", None, "Z", (0, 1, 0), (0, 0, 1), (1, 0, 0)),
        ("DomeLight", None, "Y", (0, 1, 0), (0, 0, 1), (1, 0, 0)),
        ("DomeLight_1", None, "Y", (0, 1, 0), (0, 0, 1), (1, 0, 0)),
        ("DomeLight_1", None, "Z", (0, 0, 1), (0, -1, 0), (1, 0, 0)),
        ("DomeLight_1", "Y", "Z", (0, 1, 0), (0, 0, 1), (1, 0, 0)),
        ("DomeLight_1", "Z", "Y", (0, 0, 1), (0, -1, 0), (1, 0, 0)),
    ],
)
def test_domes_lie_as_openexr_says(make_stage, kind, pole, up, top, middle, left) -> None:
    """OpenEXR's latitude-longitude images: +y at the top, +z in the middle, longitude pi / 2 at +x, left of the middle.
    DomeLight_1 with its pole along z: +z at the top, -y in the middle."""
    attributes = "" if pole is None else f'uniform token poleAxis = "{pole}"'
    path = make_stage(world=sun(attributes, kind=kind))
    path.write_text(path.read_text().replace('upAxis = "Z"', f'upAxis = "{up}"'))
    reader = StageReader(path)
    (found,) = reader.scene(reader.frames[0]).lights
    to_world = (
        np.diag([1, -1, -1]) @ found.T_cam_dome.rotation
    )  # the camera's axes are the world's, half a turn about x
    for wanted, axis in ((top, (0, 1, 0)), (middle, (0, 0, -1)), (left, (-1, 0, 0))):
        np.testing.assert_allclose(to_world @ axis, wanted, atol=1e-12)
    assert found.radiance == (100, 100, 100)


TWO = 'def Cube "Box" {}\ndef Sphere "Ball" {}'


def linked(read_scene, **collections):
    """The scene of a cube and a ball under a Sun and a lamp, with the lamp's collections; relationships by name."""
    lines = [f"rel collection:{name.replace('__', ':')} = <{path}>" for name, path in collections.items() if path]
    lines += [f"uniform bool collection:{n.split('__')[0]}:includeRoot = 0" for n in collections if "includes" in n]
    world = sun() + "\n" + sun("\n".join(lines), kind="SphereLight").replace('"Sun"', '"Lamp"')
    scene = read_scene(TWO, world=world, name="-".join(["linked", *collections]) + ".usda")
    target = scene.bodies[0].target
    groups = {part.name: target.mesh.face_group[target.mesh.face_part == part.id] for part in target.parts}
    return scene, {name: set(map(int, of)) for name, of in groups.items()}


def test_without_links_all_is_one_group(read_scene) -> None:
    scene, groups = linked(read_scene)
    assert set.union(*groups.values()) == {0}
    assert {(light.lights, light.shadowed_by) for light in scene.lights} == {(None, None)}


@pytest.mark.parametrize("collection", ["lightLink", "shadowLink"])
@pytest.mark.parametrize(
    ("relationship", "path", "members"),
    [
        ("excludes", "/World/Target/Ball", {"Box"}),
        ("excludes", "/World/Target", set()),
        ("includes", "/World/Target/Ball", {"Ball"}),
        ("includes", "/World/Target", {"Box", "Ball"}),
    ],
)
def test_links_are_what_usd_says_they_are(read_scene, collection, relationship, path, members) -> None:
    scene, groups = linked(read_scene, **{f"{collection}__{relationship}": path})
    by_kind = {type(light): light for light in scene.lights}
    sunlight, lamp = by_kind[DistantLight], by_kind[SphereLight]
    assert (sunlight.lights, sunlight.shadowed_by) == (None, None)
    links, other = (lamp.lights, lamp.shadowed_by) if collection == "lightLink" else (lamp.shadowed_by, lamp.lights)
    assert other is None
    if members == {"Box", "Ball"}:
        assert links is None
    else:
        assert {name for name, of in groups.items() if of <= links} == members
    assert all(len(of) == 1 for of in groups.values())


def test_links_to_what_is_no_gprim_are_refused(read_scene) -> None:
    subset = """def Mesh "Box" {
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
        def GeomSubset "Half" {
            int[] indices = [0]
        }
    }"""
    rel = "rel collection:lightLink:excludes = </World/Target/Box/Half>"
    with pytest.raises(UnsupportedError, match=r"^/World/Sun: is linked by lightLink to the subset"):
        read_scene(subset, world=sun(rel))
    expression = 'uniform pathExpression collection:lightLink:membershipExpression = "/World//"'
    with pytest.raises(UnsupportedError, match=r"^/World/Sun: is linked by an expression in lightLink"):
        read_scene(world=sun(expression), name="b.usda")


def test_lights_in_point_instancers_are_refused(read_scene) -> None:
    world = """def PointInstancer "Many" {
        rel prototypes = </World/Many/Lamp>
        int[] protoIndices = [0]
        point3f[] positions = [(0, 0, 0)]
        def SphereLight "Lamp" {}
    }"""
    with pytest.raises(UnsupportedError, match=r"^/World/Many"):
        read_scene(world=world)
