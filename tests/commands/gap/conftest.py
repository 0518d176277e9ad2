"""Sets that stand for real ones: pictures of a stage whose camera or light was changed by known amounts."""

import json
import shutil
from pathlib import Path

import pytest

import spin_usd
from tests.cases.root_layers import over_stage
from tests.conftest import EXAMPLE_POSES, speedplus_camera

FRAMES = 6
STEPS = 4095 / 255  # of the ADC per step of 8 bits
LEVEL, NOISE, PSF = 4.0, 0.6, 1.2
"""Planted black level and noise, in steps of 8 bits of the linear signal, and point spread function, pixels."""
PER_STEP = 7.9  # electrons
SHOT = 1 / (PER_STEP * STEPS)
CAMERA = f"""
over "Camera"
{{
    double spin:sensor:blackLevel = {LEVEL * STEPS}
    double spin:sensor:gain = {PER_STEP}
    double spin:sensor:readNoise = {NOISE * STEPS * PER_STEP}
    double spin:optics:psfSigma = {PSF}
}}"""
LAMP = f"""{CAMERA}
over "Lights"
{{
    over "Sun" (
        active = false
    )
    {{
    }}
    def RectLight "Lamp"
    {{
        float inputs:intensity = 8000
        float inputs:width = 1
        float inputs:height = 1
        double3 xformOp:translate = (-2.2, 0.4, -0.3)
        float3 xformOp:rotateXYZ = (0, -90, 0)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
    }}
}}"""
VARIANTS = {"camera": CAMERA, "lamp": LAMP}


def plant(stage: Path, folder: Path, *, frames: int) -> Path:
    """Copy a stage of so many pictures and add the variants to it; returns its root layer."""
    shutil.copytree(stage.parent, folder)
    sets = "\n".join(f'"{name}" {{\n{text}\n}}' for name, text in VARIANTS.items())
    metadata, body = 'prepend variantSets = ["augmentation"]', f'variantSet "augmentation" = {{\n{sets}\n}}'
    (folder / "planted.usda").write_text(over_stage(frames=frames, metadata=metadata, body=body))
    return folder / "planted.usda"


@pytest.fixture(scope="session")
def real(library, small_stage):
    """A folder of pictures by variant, made with another seed than that of `gap`: nominal, camera, lamp, which has the
    camera too. Their stage is beside them."""

    def make(folder) -> None:
        planted = plant(small_stage, folder / "stage", frames=8)
        spin_usd.render(
            planted, out=folder / "dataset", variants="all", renderer="raycast", samples=4, labels="none", seed=7,
            frames=f"0:{FRAMES}",
        )  # fmt: skip

    return library.folder("real", make) / "dataset" / "image"


@pytest.fixture(scope="session")
def large(library, poses):
    """The folder of a stage of four pictures of 480 x 300, `stage`, and of pictures of it by the planted camera:
    `dataset/image/camera`. Smaller targets have too few clear edges for a point spread function."""

    def make(folder) -> None:
        (folder / "poses.json").write_text(json.dumps(poses[:4]))
        (folder / "camera.json").write_text(json.dumps(speedplus_camera(divide=4)))
        made = spin_usd.author(
            poses=folder / "poses.json", target="cubesat", camera=folder / "camera.json", out=folder / "stage"
        )
        planted = plant(Path(made.root), folder / "planted", frames=4)
        spin_usd.render(
            planted, out=folder / "dataset", variants="camera", renderer="raycast", samples=4, labels="none", seed=7
        )

    return library.folder("large", make)


@pytest.fixture(scope="session")
def poses(small_stage):
    """The poses of those pictures, in SPEED+'s format."""
    listed = json.loads((small_stage.parent.parent / "poses.json").read_text())
    assert len(listed) == len(json.loads(EXAMPLE_POSES.read_text()))
    return listed


@pytest.fixture(scope="session")
def gap(tmp_path_factory):
    """Compare pictures with a stage, by raycast."""

    def compared(folder, stage, **given):
        given = {"out": tmp_path_factory.mktemp("gap") / "report", "renderer": "raycast", "samples": 4} | given
        return spin_usd.gap(folder, stage, **given)

    return compared
