"""`spin-usd debug`: the .blend, rendered by a Blender that has none of our code, is the picture before the detector."""

import json
import subprocess
import sys

import numpy as np
import pytest

from spin_usd.files.folder import FileIn, Folder
from spin_usd.files.user_file import read_bytes
from spin_usd.formats.array_file import read_array
from spin_usd.renderers.background.sky import sky
from spin_usd.scene.derived.content_keys import KEYS
from spin_usd.stage.read.stage_reader import StageReader
from tests.conftest import REPOSITORY, speedplus_camera

pytestmark = pytest.mark.children


POSES = REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json"
EFFORT = "samples=2"
ROUNDING = 1e-5  # of the root mean square: gains are applied after the render here, before it there
PLAIN = """
import json, os, sys
import bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
bpy.context.scene.render.filepath = sys.argv[2]
bpy.ops.render.render(write_still=True)
kinds = ("objects", "lights", "cameras", "materials", "texts")
found = {kind: [each.name for each in getattr(bpy.data, kind)] for kind in kinds}
found["groups"] = [group.name for group in bpy.data.objects["/World/Target"].vertex_groups]
found["readme"] = bpy.data.texts["README"].as_string()
found["packed"] = all(image.packed_file for image in bpy.data.images if image.type == "IMAGE")
print("FOUND", json.dumps(found), flush=True)
os._exit(0)
"""


@pytest.fixture(scope="module")
def two_bodies(tmp_path_factory, spin_usd):
    """A stage of two bodies before the stars, through a lens that distorts: the folder."""
    folder = tmp_path_factory.mktemp("debug")
    poses = json.loads(POSES.read_text())
    for pose in poses:
        pose["r_Vo2To_vbs_true"] = np.add(pose["r_Vo2To_vbs_true"], (0.8, -0.3, 0.5)).tolist()
    (folder / "also.json").write_text(json.dumps(poses))
    (folder / "camera.json").write_text(json.dumps(speedplus_camera(divide=8)))
    of = ["--poses", POSES, "--target", "tango", "--also", "cubesat:also.json", "--frames", "0:2"]
    look = ["--camera", folder / "camera.json", "--lights", "sun", "--environment", "stars"]
    spin_usd("author", *of, *look, "--out", folder / "stage", cwd=folder)
    return folder / "stage"


@pytest.fixture(scope="module")
def opened(two_bodies, tmp_path_factory, spin_usd):
    """What a plain Blender finds in the .blend of the second frame, and the frame that it renders (H, W, 3)."""
    folder = tmp_path_factory.mktemp("opened")
    blend, image = folder / "surprise.blend", folder / "surprise.exr"
    written = spin_usd("debug", two_bodies, "--frame", "1", "--effort", EFFORT, "--out", blend)
    assert "debug: step 3 of 3" in written.stderr
    done = subprocess.run([sys.executable, "-c", PLAIN, blend, image], capture_output=True, text=True, check=True)
    line = next(line for line in done.stdout.splitlines() if line.startswith("FOUND"))
    return json.loads(line.removeprefix("FOUND")), read_array(FileIn(Folder(folder), image.name))[..., :3]


@pytest.fixture(scope="module")
def rendered(two_bodies, tmp_path_factory, spin_usd):
    """The radiance that `render` makes of that frame (H, W, 4), and the keys in its record."""
    out = tmp_path_factory.mktemp("rendered") / "dataset"
    wanted = ["--frames", "1:2", "--effort", EFFORT, "--radiance", "--labels", "none"]
    spin_usd("render", two_bodies, "--out", out, *wanted)
    record = json.loads(read_bytes(out / "records" / "nominal" / "img000002.json", 1 << 20))
    return read_array(FileIn(Folder(out), record["files"]["radiance"]["path"])), record["provenance"]


@pytest.mark.slow
def test_what_blender_renders_is_our_radiance(opened, rendered):
    ours, theirs = rendered[0], opened[1]
    covered = ours[..., 3] >= 1
    assert covered.sum() > 1000
    truth = ours[covered, :3]
    error = np.sqrt(((theirs[covered] - truth) ** 2).mean() / (truth**2).mean())
    assert error < ROUNDING


def test_what_lies_behind_is_our_sky(two_bodies, opened, rendered):
    reader = StageReader(two_bodies / "dataset.usda")
    behind = sky(reader.scene(reader.frames[1]), seed=0)
    free = rendered[0][..., 3] == 0
    assert behind[free].any()
    np.testing.assert_array_equal(opened[1][free], behind[free])


def test_everything_has_the_name_of_its_prim(opened):
    found = opened[0]
    assert {"/World/Camera", "/World/Lights/Sun", "/World/Target"} <= set(found["objects"])
    assert found["cameras"] == ["/World/Camera"]
    assert found["lights"] == ["/World/Lights/Sun"]
    assert all(name.startswith("/World/") for name in found["materials"])
    assert "/World/Target/Model/Harness" in found["groups"]
    assert found["packed"]
    assert "camera shader" in found["texts"]


def test_the_readme_has_the_keys_of_the_record(opened, rendered):
    readme, provenance = opened[0]["readme"], rendered[1]
    assert provenance["stage"]["hash"] in readme
    for name in KEYS:
        assert f"{name} key: {provenance['keys'][name]}" in readme


def test_a_file_that_is_there_is_kept(two_bodies, spin_usd, tmp_path):
    (tmp_path / "mine.blend").write_text("mine")
    done = spin_usd("debug", two_bodies, "--frame", "0", "--out", tmp_path / "mine.blend", code=2)
    assert "exists already" in done.stderr
    assert (tmp_path / "mine.blend").read_text() == "mine"


def test_an_unknown_frame_is_refused_and_leaves_nothing(two_bodies, spin_usd, tmp_path):
    done = spin_usd("debug", two_bodies, "--frame", "img000009", "--out", tmp_path / "a.blend", code=2)
    assert "dataset.usda: has no frame 'img000009'" in done.stderr
    assert "0 to 1" in done.stderr
    assert not list(tmp_path.iterdir())
