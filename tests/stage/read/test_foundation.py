"""Every stage of the USD working group's `foundation` tests, read as its own name and contents say, or refused.

They hold neither a target nor (but for the animated cube) a camera. The composition stages are referenced below a
target of ours, as `spin-usd author` does; the configuration stages, whose point is the root layer's metadata, are root
layers themselves, in a copy that is given a target and a camera.

Run `python -m tests.stage.read.test_foundation FOLDER` for the table as markdown.
"""

import os
import re
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdRender

from spin_usd.errors import SpinError
from spin_usd.stage.read.stage_reader import StageReader

BOUNDS_TOLERANCE = 1e-6  # of the largest coordinate: the stages' own numbers are float32


@dataclass(frozen=True, kw_only=True)
class Read:
    """What is drawn: part name -> centre in metres in body axes; diffuse colour by part where the stage gives one."""

    parts: dict[str, tuple[float, float, float]]
    colors: dict[str, tuple[float, float, float]] | None = None
    size: float = 2.0  # edge of the part named `sized`, metres
    sized: str = ""
    frames: int = 1
    at: float | None = None  # the time code that `parts` is of; the first frame's otherwise
    why: str


@dataclass(frozen=True, kw_only=True)
class Refused:
    saying: str
    why: str


AXIS = {"X": (0.011, 0.0, 0.0), "Y": (0.0, 0.011, 0.0), "Z": (0.0, 0.0, 0.011)}
GREY = (0.18, 0.18, 0.18)
RED, GREEN, BLUE, YELLOW = (0.8, 0, 0), (0, 0.8, 0), (0, 0, 0.8), (0.8, 0.8, 0)
FALLBACK = "the fallback of 18 % grey"


def animated(x_metres, frames, at, why):
    """The cube moves 1 unit of 1 cm for each time code of its own layer, 0 to 100, which has 24 of them a second."""
    return Read(
        parts={**AXIS, "animatedCube": (x_metres, 0, 0)}, frames=frames, at=at, size=0.01, sized="animatedCube", why=why
    )


def axis(metres, why, **cubes):
    parts = {name: tuple(100 * metres * v for v in centre) for name, centre in AXIS.items()}
    return Read(parts={**parts, **cubes}, size=2 * metres, sized=next(iter(cubes), ""), why=why)


ONE_CUBE = {"Cube": (0.0, 0.0, 0.0)}
C, S = "stage_composition", "stage_configuration"
EXPECTED = {
    f"{C}/_parent_stage.usda": Read(parts=ONE_CUBE, colors={"Cube": GREY}, why="one Cube of size 2"),
    f"{C}/active.usda": Read(
        parts={"CubeActive": (3, 0, 0)}, colors={"CubeActive": GREEN}, why="the inactive cube is not there"
    ),
    f"{C}/class_inherit.usda": Read(
        parts={"cubeWithoutSetColor": (0, 0, 0), "cubeWithSetColor": (3, 0, 0)},
        colors={"cubeWithoutSetColor": GREEN, "cubeWithSetColor": RED},
        why="green from the class; a local colour beats it; the class itself is not rendered",
    ),
    f"{C}/inherit_and_specialize.usda": Read(
        parts={
            "cubeScene/inherits": (6, 0, 0),
            "cubeScene/source": (0, 0, 0),
            "cubeScene/specializes": (3, 0, 0),
            "cubeSceneReferenced/inherits": (6, 3, 0),
            "cubeSceneReferenced/source": (0, 3, 0),
            "cubeSceneReferenced/specializes": (3, 3, 0),
        },
        colors={
            "cubeScene/inherits": YELLOW,
            "cubeScene/source": RED,
            "cubeScene/specializes": YELLOW,
            "cubeSceneReferenced/inherits": GREEN,
            "cubeSceneReferenced/source": GREEN,
            "cubeSceneReferenced/specializes": YELLOW,
        },
        why="a colour set over the reference's source reaches what inherits it, not what specializes it",
    ),
    f"{C}/over.usda": Read(
        parts={"Cube": (0, 0, 0), "definedCube": (3, 0, 0)},
        colors={"Cube": BLUE, "definedCube": GREY},
        why="an over colours the sublayer's cube; an over alone (undefinedCube) defines nothing",
    ),
    f"{C}/purpose.usda": Read(
        parts={"CubeIsRender": (3, 0, 0)},
        colors={"CubeIsRender": GREEN},
        why="purpose render is drawn; guide, proxy and 'other', which USD does not know, are not",
    ),
    f"{C}/payload/_stage.usda": Read(parts=ONE_CUBE, why="one Cube"),
    f"{C}/payload/_children/_child_stage.usda": Read(parts=ONE_CUBE, why="one Cube"),
    f"{C}/payload/payload_same_folder.usda": Read(parts=ONE_CUBE, why="the payload's cube"),
    f"{C}/payload/payload_child_folder.usda": Read(parts=ONE_CUBE, why="the payload's cube"),
    f"{C}/payload/payload_parent_folder.usda": Read(parts=ONE_CUBE, why="the payload's cube, `..` staying in the tree"),
    f"{C}/payload/payload_invalid.usda": Refused(saying="file_does_not_exist.usda", why="its payload does not exist"),
    f"{C}/references/_stage.usda": Read(parts=ONE_CUBE, why="one Cube"),
    f"{C}/references/_children/_child_stage.usda": Read(parts=ONE_CUBE, why="one Cube"),
    f"{C}/references/reference_same_folder.usda": Read(parts=ONE_CUBE, why="the reference's cube"),
    f"{C}/references/reference_child_folder.usda": Read(parts=ONE_CUBE, why="the reference's cube"),
    f"{C}/references/reference_parent_folder.usda": Read(
        parts=ONE_CUBE, why="the reference's cube, `..` staying in the tree"
    ),
    f"{C}/references/reference_invalid.usda": Refused(
        saying="file_does_not_exist.usda", why="its reference does not exist"
    ),
    f"{C}/references_prim/_stage.usda": Read(parts=ONE_CUBE, why="one Cube"),
    f"{C}/references_prim/reference_prim_in_same_file.usda": Refused(
        saying="/World/cube", why="it references /World/cube and /World/cube_does_not_exist; only /World/Cube exists"
    ),
    f"{C}/references_prim/reference_prim_in_other_file.usda": Refused(
        saying="does_not_exist", why="two of its three references name a prim or a file that does not exist"
    ),
    f"{C}/subLayer/_stage.usda": Read(parts=ONE_CUBE, why="one Cube"),
    f"{C}/subLayer/_children/_child_stage.usda": Read(parts=ONE_CUBE, why="one Cube"),
    f"{C}/subLayer/sublayer_same_folder.usda": Read(parts=ONE_CUBE, why="the sublayer's cube"),
    f"{C}/subLayer/sublayer_child_folder.usda": Read(parts=ONE_CUBE, why="the sublayer's cube"),
    f"{C}/subLayer/sublayer_parent_folder.usda": Read(
        parts=ONE_CUBE, why="the sublayer's cube, `..` staying in the tree"
    ),
    f"{C}/subLayer/sublayer_invalid.usda": Refused(
        saying="file_does_not_exist.usda", why="its sublayer does not exist"
    ),
    f"{S}/framesPerSecond/framesPerSecond_-1.usda": Refused(
        saying="framesPerSecond = -1", why="no rate; USD's parser says so"
    ),
    f"{S}/framesPerSecond/framesPerSecond_0.usda": Refused(
        saying="framesPerSecond = 0", why="no rate; USD's parser says so"
    ),
    **{
        f"{S}/framesPerSecond/framesPerSecond_{fps}.usda": animated(
            0.04 * 24 / fps,
            101,
            4,
            f"without timeCodesPerSecond the rate {fps} stands for it, so USD rescales the sublayer of 24",
        )
        for fps in (1, 24, 48, 100, 101, 128)
    },
    **{
        f"{S}/framesPerSecond_timeCodesPerSecond_mixed/{fps}_{tcps}.usda": animated(
            0.04 * 24 / tcps, 101, 4, f"time codes are {tcps} a second, whatever the frames; the sublayer's are 24"
        )
        for fps in (24, 48)
        for tcps in (24, 48)
    },
    f"{S}/invalid_defaultPrim/invalid_defaultPrim.usda": Refused(
        saying="</invalidDefaultPrim>",
        why="its default prim does not exist, so a reference to it finds nothing",
    ),
    f"{S}/metersPerUnit/metersPerUnit_1.usda": axis(1, "cube_1 is 2 m", cube_1=(0, 0, 0)),
    f"{S}/metersPerUnit/metersPerUnit_10.usda": axis(10, "cube_10 is 20 m", cube_10=(0, 0, 0)),
    f"{S}/metersPerUnit/metersPerUnit_mix.usda": axis(
        100,
        "all cubes are 200 m, 300 m apart: USD takes the root layer's unit and does not convert its sublayers",
        cube_100=(0, 0, 0),
        cube_1=(300, 0, 0),
        cube_10=(600, 0, 0),
    ),
    f"{S}/multiple_root_prims/multiple_root_prims_no_defaultPrim.usda": Refused(
        saying="defaultPrim", why="nothing says which of its root prims is meant"
    ),
    f"{S}/multiple_root_prims/multiple_root_prims_with_defaultPrim.usda": Read(
        parts={"Model": (2, 0, 0)}, why="the default prim, Sphere, and not the Cube beside it"
    ),
    f"{S}/start_end_timeCode/large_start_end_timeCodes.usda": Refused(
        saying="20000001 frames", why="20 million frames without names are a slip"
    ),
    f"{S}/start_end_timeCode/missing_endTimeCode.usda": animated(0, 1, None, "no range: one frame at its start, 0"),
    f"{S}/start_end_timeCode/missing_startTimeCode.usda": animated(0, 1, None, "no range: one frame at time code 0"),
    f"{S}/start_end_timeCode/missing_start_end_timeCodes.usda": animated(
        0, 1, None, "no range: one frame at time code 0"
    ),
    f"{S}/start_end_timeCode/negative_start_end_timeCodes.usda": animated(
        0, 91, -10, "-100 to -10, before the first sample"
    ),
    f"{S}/start_end_timeCode/start_end_timeCodes_subset.usda": animated(0.7, 31, 70, "40 to 70 of the samples"),
    f"{S}/start_end_timeCode/start_end_timeCodes_superset.usda": animated(
        1, 121, 110, "-10 to 110; held after the samples"
    ),
    f"{S}/start_end_timeCode/start_end_timeCodes_swapped.usda": Refused(
        saying="endTimeCode 0 lies before startTimeCode 100", why="the range is reversed"
    ),
    f"{S}/timeCodesPerSecond/timeCodesPerSecond_-1.usda": Refused(
        saying="timeCodesPerSecond is -1", why="time would run backwards"
    ),
    f"{S}/timeCodesPerSecond/timeCodesPerSecond_0.usda": Refused(
        saying="timeCodesPerSecond is 0", why="time would stand still (USD lists the samples of such a stage for ever)"
    ),
    **{
        f"{S}/timeCodesPerSecond/timeCodesPerSecond_{tcps}.usda": animated(
            0.04 * 24 / tcps, 101, 4, f"the sublayer's samples, at 24 a second, are rescaled to {tcps}"
        )
        for tcps in (1, 24, 48, 100, 101, 128)
    },
    f"{S}/upAxis/upAxis_X.usda": Refused(saying="upAxis is 'X'", why="USD knows Y and Z only"),
    f"{S}/upAxis/upAxis_invalid.usda": Refused(saying="upAxis is 'invalid'", why="USD knows Y and Z only"),
    f"{S}/upAxis/upAxis_Y.usda": axis(0.01, "the axes as authored: a pose relative to the camera needs no up axis"),
    f"{S}/upAxis/upAxis_Z.usda": axis(0.01, "the axes as authored: a pose relative to the camera needs no up axis"),
}
REFERENCED = (f"{C}/", f"{S}/multiple_root_prims/", f"{S}/invalid_defaultPrim/")
"""Stages whose point is composition: referenced below a target of ours in metres."""


def reader_of(name, data, folder):
    """A reader of the stage `name`, in a copy of the corpus in `folder` that has a camera and a target."""
    corpus = folder / "usd-wg-assets"
    for part in ("foundation", "_common"):
        shutil.copytree(data / part, corpus / part, dirs_exist_ok=True)
    file = corpus / "foundation" / name
    path = referenced(file, corpus) if name.startswith(REFERENCED) else as_root(file, corpus)
    return StageReader(path)


def referenced(file, corpus):
    root = Sdf.Layer.CreateNew(str(corpus / f"wrapper_{file.stem}.usda"))
    stage = Usd.Stage.Open(root)
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdGeom.Xform.Define(stage, "/Target").GetPrim().ApplyAPI("SpinTargetAPI")
    model = stage.DefinePrim("/Target/Model")
    with_camera(stage)
    stage.SetDefaultPrim(model.GetParent())
    model.GetReferences().AddReference(f"./{file.relative_to(corpus).as_posix()}")
    root.Save()
    return Path(root.realPath)


def as_root(file, corpus):
    """The file itself, with its default prim for a target and a camera, both added as text that USD composes.

    It moves to the corpus's top, for a stage may only name what lies in its own folder.
    """
    body = """
def Camera "SpinCamera" (
    prepend apiSchemas = ["SpinLensAPI"]
)
{
    int2 spin:lens:imageSize = (192, 120)
    double spin:lens:fx = 300
    double spin:lens:fy = 300
    double spin:lens:cx = 96
    double spin:lens:cy = 60
}

def Scope "SpinRender"
{
    def RenderSettings "Settings"
    {
        rel camera = </SpinCamera>
    }
}
"""
    text = file.read_text()
    head, rest = text.split("(", 1)
    text = f'{head}(\n    renderSettingsPrimPath = "/SpinRender/Settings"\n{rest}'
    target = 'prepend apiSchemas = ["SpinTargetAPI"]'
    if 'def "World"' in text:
        text = text.replace('def "World"', f'def "World" ({target})'.replace("(", "(\n    ").replace("])", "]\n)"), 1)
    else:
        body += f'\nover "World" (\n    {target}\n)\n{{\n}}\n'
    text = re.sub("@(.+?)@", lambda named: f"@./{os.path.relpath(file.parent / named[1], corpus)}@", text)
    root = corpus / f"root_{file.name}"
    root.write_text(text + body)
    return root


def with_camera(stage) -> None:
    camera = UsdGeom.Camera.Define(stage, "/SpinCamera").GetPrim()
    camera.ApplyAPI("SpinLensAPI")
    camera.GetAttribute("spin:lens:imageSize").Set(Gf.Vec2i(192, 120))
    for name, value in {"fx": 300.0, "fy": 300.0, "cx": 96.0, "cy": 60.0}.items():
        camera.GetAttribute(f"spin:lens:{name}").Set(value)
    settings = UsdRender.Settings.Define(stage, "/SpinRender")
    settings.GetCameraRel().SetTargets([camera.GetPath()])
    stage.SetMetadata("renderSettingsPrimPath", "/SpinRender")


def boxes(target, names):
    """Part name -> (centre, largest edge), metres; names as in the expectation, with parents where it gives them."""
    found = {}
    for part in target.parts:
        name = next((n for n in names if part.path.endswith(f"/{n}")), part.path)
        points = target.mesh.points[np.unique(target.mesh.faces[target.mesh.face_part == part.id])]
        found[name] = ((points.min(0) + points.max(0)) / 2, float(np.ptp(points, axis=0).max()))
    return found


def diffuse_color(target, part):
    return target.materials[target.mesh.face_material[target.mesh.face_part == part][0]].diffuse_color


def first_scene(open_reader, *arguments):
    reader = open_reader(*arguments)
    return reader.scene(reader.frames[0])


@pytest.fixture
def data(shared):
    return shared / "data" / "usd-wg-assets"


def test_every_stage_of_the_corpus_is_listed(data) -> None:
    stages = {file.relative_to(data / "foundation").as_posix() for file in (data / "foundation").rglob("*.usda")}
    assert stages == set(EXPECTED)


@pytest.mark.parametrize("name", [name for name, e in EXPECTED.items() if isinstance(e, Refused)])
def test_refused(name, data, tmp_path) -> None:
    expected = EXPECTED[name]
    with pytest.raises(SpinError) as error:
        first_scene(reader_of, name, data, tmp_path)
    assert expected.saying in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", [name for name, e in EXPECTED.items() if isinstance(e, Read)])
def test_read(name, data, tmp_path) -> None:
    expected = EXPECTED[name]
    reader = reader_of(name, data, tmp_path)
    assert len(reader.frames) == expected.frames
    at = reader.frames[0] if expected.at is None else next(f for f in reader.frames if f.time_code == expected.at)
    target = reader.scene(at).bodies[0].target
    found = boxes(target, expected.parts)
    assert set(found) == set(expected.parts)
    for part, centre in expected.parts.items():
        np.testing.assert_allclose(found[part][0], centre, atol=BOUNDS_TOLERANCE * max(1, *np.abs(centre)))
    if expected.sized:
        assert found[expected.sized][1] == pytest.approx(expected.size, rel=BOUNDS_TOLERANCE)
    for part, color in (expected.colors or {}).items():
        number = next(p.id for p in target.parts if p.path.endswith(f"/{part}"))
        np.testing.assert_allclose(diffuse_color(target, number), color, atol=1e-7)  # float32


def table(data):
    """One markdown row for each stage: what really happens, and why that is right."""
    rows = ["| stage | outcome | because |", "| --- | --- | --- |"]
    for name in sorted(EXPECTED):
        expected = EXPECTED[name]
        with TemporaryDirectory() as folder:
            rows.append(f"| `{name}` | {outcome(name, expected, data, Path(folder))} | {expected.why} |")
    return "\n".join(rows)


def outcome(name, expected, data, folder) -> str:
    try:
        reader = reader_of(name, data, folder)
        at = next((f for f in reader.frames if f.time_code == getattr(expected, "at", None)), reader.frames[0])
        target = reader.scene(at).bodies[0].target
        found = boxes(target, expected.parts)
    except SpinError as error:
        saying = str(error).replace(str(folder.resolve()), "").replace("|", "/")
        return f"refused: {saying}"
    color = dict(zip(found, (diffuse_color(target, part.id) for part in target.parts), strict=True))
    shown = {
        p: f" in {tuple(round(c, 3) for c in color[p])}" if getattr(expected, "colors", None) else "" for p in found
    }
    parts = ", ".join(
        f"{p} {e:g} m at ({', '.join(f'{v + 0:.4g}' for v in c)}){shown[p]}" for p, (c, e) in found.items()
    )
    count = f"{len(reader.frames)} frame{'s' * (len(reader.frames) > 1)}"
    when = f"; at time code {at.time_code:g}" if len(reader.frames) > 1 else ""
    return f"read, {count}{when}: {parts}"


if __name__ == "__main__":
    print(table(Path(sys.argv[1]) / "usd-wg-assets"))
