"""What stands in several places of a stage is read once, and its pictures are those of the same stage made out."""

import numpy as np
import pytest

from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.scene.shape import MIN_SHARED_FACES

ONCE_BALL = """
def Xform "Library"
{
    def Xform "Ball"
    {
        def Sphere "Body" (
            prepend apiSchemas = ["SemanticsLabelsAPI:class"]
        )
        {
            token[] semantics:labels:class = ["ball"]
            double radius = 0.5
        }
        def Cube "Foot"
        {
            double size = 0.2
            double3 xformOp:translate = (0, 0, -0.8)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
    token visibility = "invisible"
}
"""
PLACES = {"A": ((-1.2, 0, 0), (1, 1, 1)), "B": ((0, 0.2, 0), (0.7, 1.1, 0.5)), "C": ((1.2, 0, 0.3), (-1, 0.8, 1))}
POSITIONS = [at for at, _ in PLACES.values()]
SCALES = [scale for _, scale in PLACES.values()]
INSTANCER = f"""
def PointInstancer "Many"
{{
    rel prototypes = </World/Target/Many/Ball>
    int[] protoIndices = [0, 0, 0]
    point3f[] positions = {POSITIONS}
    float3[] scales = {SCALES}
    def "Ball" (references = </Library/Ball>)
    {{
    }}
}}
"""


def placed(*, instanceable):
    return "\n".join(
        f"""
        def "{name}" (
            instanceable = {str(instanceable).lower()}
            references = </Library/Ball>
        )
        {{
            double3 xformOp:translate = {at}
            double3 xformOp:scale = {scale}
            uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
        }}"""
        for name, (at, scale) in PLACES.items()
    )


@pytest.fixture
def read(make_stage):
    from spin_usd.stage.read.stage_reader import StageReader

    def first(geometry, name):
        path = make_stage(geometry, name=name)
        path.write_text(path.read_text() + ONCE_BALL)
        reader = StageReader(path)
        return reader.scene(reader.frames[0])

    return first


def labels(scene):
    surface = visible_surface(scene, EmbreeCaster().visibility(scene))
    return surface.rows, surface.columns, surface.z.astype(np.float32), surface.body.astype(np.float32), surface.part


def test_scenegraph_instances_are_one_shape_and_label_as_without(read) -> None:
    scene, flat = read(placed(instanceable=True), "a.usda"), read(placed(instanceable=False), "b.usda")
    (shared,) = scene.bodies[0].target.mesh.instances
    assert len(shared.matrices) == 3
    assert len(shared.shape.faces) > MIN_SHARED_FACES
    assert len(scene.bodies[0].target.mesh.faces) == 3 * 12  # the cubes are cheaper made out
    assert not flat.bodies[0].target.mesh.instances
    assert scene.bodies[0].target.mesh.count == flat.bodies[0].target.mesh.count
    assert [(p.name, p.class_name) for p in scene.bodies[0].target.parts] == [
        (p.name, p.class_name) for p in flat.bodies[0].target.parts
    ]
    for mine, theirs in zip(labels(scene), labels(flat), strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_point_instances_are_one_shape_where_scenegraph_instances_stand(read) -> None:
    scene, other = read(INSTANCER, "a.usda"), read(placed(instanceable=True), "b.usda")
    (mine,), (theirs,) = scene.bodies[0].target.mesh.instances, other.bodies[0].target.mesh.instances
    np.testing.assert_allclose(mine.matrices, theirs.matrices, atol=1e-6)  # single precision arrays
    np.testing.assert_array_equal(mine.shape.points, theirs.shape.points)
    assert scene.bodies[0].target.mesh.centre == pytest.approx(other.bodies[0].target.mesh.centre, abs=1e-6)
    assert {part.name for part in scene.bodies[0].target.parts} == {"Body", "Foot"}


def test_instances_of_different_materials_are_different_shapes(read) -> None:
    colour = "color3f[] primvars:displayColor = [(1, 0, 0)]\n        }"
    text = placed(instanceable=True).rsplit("}", 1)
    scene = read(colour.join(text), "a.usda")
    shared = scene.bodies[0].target.mesh.instances
    assert [len(each.matrices) for each in shared] == [2]
    assert len(scene.bodies[0].target.materials) == 2
