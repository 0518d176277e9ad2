"""What NVIDIA's validator of USD, which others hold models and stages to, finds in authored ones."""

import json
import os
import subprocess

import pytest
import trimesh

from spin_usd.plugin_path import plugin_path

MEANT = {
    "DefaultPrimChecker": "/Render stands beside /World, where UsdRender has it",
    "UsdAsciiPerformanceChecker": "layers of the bundled targets are text, to be read and compared",
    "WeldChecker": "Tango's whips end in points of their own, which their caps do not share",
}
"""The rules that find something, and why that stays."""


@pytest.fixture(params=["tango", "own"])
def stage(request, small_stage, tmp_path, spin_usd):
    if request.param == "tango":
        return small_stage
    trimesh.creation.box((1.0, 0.8, 0.6)).export(tmp_path / "craft.obj")
    given = ("--target", tmp_path / "craft.obj", "--units-per-metre", "1", "--also", "cubesat:distance=1..5 count=2")
    shown = ("--sample", "range=4..8 inside=1 count=2", "--camera", "speedplus", "--environment", "earth")
    spin_usd("author", *given, *shown, "--lidar", "flash", "--out", tmp_path / "stage")
    return tmp_path / "stage" / "dataset.usda"


@pytest.mark.slow
def test_it_finds_only_what_is_meant(readers, stage, tmp_path) -> None:
    command = [readers.with_name("nvidia_usd_validate"), stage, "--json-output", tmp_path / "found.json"]
    subprocess.run(command, env={**os.environ, "PXR_PLUGINPATH_NAME": str(plugin_path())}, capture_output=True)
    report = json.loads((tmp_path / "found.json").read_text())
    found = {each["rule"]["name"]: each["issues"] for each in report["rules"] if each["issues"]}
    assert {name: found[name] for name in found.keys() - MEANT.keys()} == {}
    assert "DefaultPrimChecker" in found  # it has looked
