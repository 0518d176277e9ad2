"""A small stage around the geometry that a test is about, written as text so that a reader sees all of it."""

import pytest
from pxr import Usd

from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.read.camera import find_camera
from spin_usd.stage.read.stage_reader import StageReader

STAGE = """#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Z"
    {metadata}
)

def Xform "World"
{{
    def Camera "Camera" (
        {apis}
    )
    {{
        int2 spin:lens:imageSize = (200, 120)
        double spin:lens:fx = 250
        double spin:lens:fy = 240
        double spin:lens:cx = 100
        double spin:lens:cy = 60
        {camera}
    }}

    def Xform "Target" (
        prepend apiSchemas = ["SpinTargetAPI"]
    )
    {{
        {pose}
        {geometry}
    }}

    {world}
}}
"""


@pytest.fixture
def make_stage(tmp_path):
    """Write a stage; the target, 10 m before the camera, holds `geometry`; the camera has `apis` and the attributes
    `camera`. Returns the path of its root layer."""

    def make(
        geometry='def Cube "Box" {}',
        *,
        metadata="metersPerUnit = 1",
        camera="",
        apis=("SpinLensAPI",),
        pose='double3 xformOp:translate = (0, 0, -10)\nuniform token[] xformOpOrder = ["xformOp:translate"]',
        world="",
        name="stage.usda",
    ):
        path = tmp_path / name
        names = ", ".join(f'"{api}"' for api in apis)
        applied = f"prepend apiSchemas = [{names}]" if apis else ""  # USD refuses an empty list to prepend
        text = STAGE.format(metadata=metadata, camera=camera, apis=applied, pose=pose, geometry=geometry, world=world)
        path.write_text(text.replace(" {}", "\n{\n}"))
        return path

    return make


@pytest.fixture
def read_scene(make_stage):
    """The first scene of a stage made by `make_stage`."""

    def read(*arguments, **options):
        reader = StageReader(make_stage(*arguments, **options))
        return reader.scene(reader.frames[0])

    return read


@pytest.fixture
def open_camera(make_stage):
    """The camera prim of a stage whose camera has these attributes and, unless told otherwise, the API `api`."""
    open_stages: list[Usd.Stage] = []  # a prim dies with its stage

    def camera(text, api, *, applied=True):
        apis = ("SpinLensAPI", api) if applied else ("SpinLensAPI",)
        path = make_stage(camera=text, apis=apis, name=f"{len(open_stages)}.usda")  # USD caches layers by name
        open_stages.append(open_stage(path))
        return find_camera(open_stages[-1])

    return camera
