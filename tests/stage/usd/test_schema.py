"""The codeless schema: generated from its source, registered in time, known to other hosts."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from pxr import Usd

from spin_usd.plugin_path import plugin_path
from spin_usd.stage.usd import schema
from tests.conftest import REPOSITORY

SCHEMAS = {
    schema.LENS_API: {
        schema.LENS_MODEL,
        schema.LENS_IMAGE_SIZE,
        *(name for names in schema.LENS_NUMBERS.values() for name in names),
    },
    schema.SENSOR_API: {
        *schema.SENSOR.values(),
        schema.AUTO_EXPOSURE,
        schema.AUTO_EXPOSURE_LEVEL,
        schema.AUTO_EXPOSURE_STOPS,
    },
    schema.EVENT_SENSOR_API: {*schema.EVENT_SENSOR.values()},
    schema.OPTICS_API: {*schema.OPTICS.values()},
    schema.SHUTTER_API: {schema.SHUTTER_READOUT_TIME},
    schema.LIDAR_API: {*schema.LIDAR.values()},
    schema.RANGE_FINDER_API: {schema.RANGE_FINDER_DIVERGENCE},
    schema.CAPTURE_API: {
        schema.CAPTURE_FRAME,
        schema.CAPTURE_SOURCE_FILE,
        schema.CAPTURE_TIME,
        schema.CAPTURE_EPOCH,
        schema.CAPTURE_SEED,
    },
    schema.TARGET_API: {
        schema.TARGET_NAME,
        schema.TARGET_KEYPOINTS,
        schema.TARGET_MERGED_PARTS,
        schema.TARGET_KEEP_TRANSPARENT,
    },
    schema.KEYPOINTS_API: {schema.KEYPOINT_POSITIONS, schema.KEYPOINT_PARTS},
    schema.SHAPE_API: {
        schema.SHAPE_MISSING,
        schema.SHAPE_BULGE,
        schema.SHAPE_BEND,
        schema.SHAPE_BEND_FRAME,
        schema.SHAPE_BEND_LENGTH,
    },
    schema.PLANET_API: {
        schema.PLANET_RADII,
        schema.PLANET_ALBEDO,
        schema.PLANET_ALBEDO_FILE,
        schema.PLANET_CLOUDS_FILE,
        schema.PLANET_CLOUDS_ALBEDO,
        schema.PLANET_NIGHT_FILE,
        schema.PLANET_NIGHT_RADIANCE,
        schema.PLANET_SCALE_HEIGHT,
        schema.PLANET_OPTICAL_DEPTH,
        schema.PLANET_ILLUMINATES,
    },
    schema.STARS_API: {
        schema.STARS_SEED,
        schema.STARS_LIMITING_MAGNITUDE,
        schema.STARS_DIRECTIONS,
        schema.STARS_MAGNITUDES,
        schema.STARS_TEMPERATURES,
    },
    schema.BACK_PLATE_API: {
        schema.BACK_PLATE_FILES,
        schema.BACK_PLATE_RADIANCE,
        schema.BACK_PLATE_PROBABILITY,
        schema.BACK_PLATE_ROLL,
        schema.BACK_PLATE_MIRROR,
    },
}


def run(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, **environment}, check=False
    )


def test_the_committed_files_are_what_usd_generates(tmp_path: Path) -> None:
    subprocess.run([sys.executable, REPOSITORY / "tools" / "build_schema", tmp_path], check=True, capture_output=True)
    for name in ("generatedSchema.usda", "plugInfo.json"):
        assert (tmp_path / name).read_text() == (plugin_path() / name).read_text()


@pytest.mark.parametrize("api", SCHEMAS)
def test_our_names_are_the_schemas(api: str) -> None:
    definition = Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(api)
    assert set(definition.GetPropertyNames()) == SCHEMAS[api]
    assert Usd.SchemaRegistry.GetTypeFromSchemaTypeName(api).typeName == api


def test_the_lens_goes_on_cameras_only() -> None:
    stage = Usd.Stage.CreateInMemory()
    assert stage.DefinePrim("/Camera", "Camera").CanApplyAPI(schema.LENS_API)
    assert not stage.DefinePrim("/Mesh", "Mesh").CanApplyAPI(schema.LENS_API)


def test_another_host_learns_the_schema_from_the_printed_folder() -> None:
    printed = subprocess.run(
        [sys.executable, "-m", "spin_usd.plugin_path"], capture_output=True, text=True, check=True
    ).stdout.strip()
    known = (
        "from pxr import Usd; import sys;"
        "print(bool(Usd.SchemaRegistry().FindAppliedAPIPrimDefinition('SpinLensAPI')), 'spin_usd' in sys.modules)"
    )
    assert run(known, PXR_PLUGINPATH_NAME=printed).stdout.split() == ["True", "False"]
    assert run(known, PXR_PLUGINPATH_NAME="").stdout.split() == ["False", "False"]


def test_the_locator_loads_no_usd() -> None:
    done = run(
        "import spin_usd.plugin_path as p, sys; p.plugin_path(); print('pxr' in sys.modules, 'bpy' in sys.modules)"
    )
    assert done.stdout.split() == ["False", "False"]


def test_a_late_registration_says_what_to_do() -> None:
    done = run("from pxr import Usd; Usd.SchemaRegistry().FindAppliedAPIPrimDefinition('x'); import spin_usd.stage")
    assert done.returncode != 0
    assert "PXR_PLUGINPATH_NAME" in done.stderr
