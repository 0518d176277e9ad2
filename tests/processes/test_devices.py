"""Devices are asked of a child in bounded time, and what is not there is refused by the command line."""

import json

import pytest

from spin_usd.commands.doctor.run import _devices
from spin_usd.errors import UnsupportedError
from spin_usd.processes import child, devices
from spin_usd.renderers.device import DEVICES

pytestmark = pytest.mark.children


@pytest.fixture(scope="module")
def usable():
    return devices.usable_devices()


def test_the_processor_is_always_there_and_comes_last(usable) -> None:
    assert usable[-1] == "cpu"
    assert [name for name in DEVICES if name in usable] == usable


def test_drivers_that_hang_end_with_the_child_and_doctor_goes_on(monkeypatch) -> None:
    monkeypatch.setattr(devices, "PATIENCE_S", 0.01)
    monkeypatch.setattr(child, "LOOK_S", 0.05)
    with pytest.raises(UnsupportedError, match=r"processor time.*; choose --device cpu"):
        devices.usable_devices()
    line = _devices()
    assert line.found.startswith("cpu; the search for others failed")
    assert "--device cpu" in line.remedy


@pytest.mark.parametrize("command", ["plan", "render"])
def test_a_device_that_is_not_there_is_refused(command, small_stage, tmp_path, spin_usd, usable) -> None:
    absent = next(name for name in ("oneapi", "hip", "metal") if name not in usable)
    out = ["--out", tmp_path / "dataset"] if command == "render" else []
    said = spin_usd(command, small_stage, "--device", absent, *out, code=2).stderr
    assert f"this machine has no device {absent}; choose --device {' or '.join(usable)}" in said
    assert not (tmp_path / "dataset" / "records").exists()


def test_the_plan_says_what_auto_takes(small_stage, spin_usd, usable) -> None:
    plan = json.loads(spin_usd("plan", small_stage, "--device", "auto", "--json").stdout)
    assert plan["device"] == next(name for name in usable if DEVICES[name].shaders)  # its lens distorts
    assert f"--device auto: light is rendered on {plan['device']}" in plan["notes"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--device", "gpu"], "there is no device 'gpu'; choose cpu or auto or optix"),
        (["--device", "cuda", "--renderer", "raycast"], "choose --renderer blender"),
        (["--device", "cuda", "--labels-only"], "where no light is rendered; leave --device out"),
    ],
)
def test_what_does_not_go_together_is_refused(options, said, small_stage, spin_usd) -> None:
    assert said in spin_usd("plan", small_stage, *options, code=2).stderr


def test_a_record_names_its_device_and_another_s_is_reproduced_on_the_processor(rendered_elsewhere, spin_usd, usable):
    dataset, frame = rendered_elsewhere
    said = spin_usd("reproduce", dataset, frame, code=2).stderr
    assert f"no device metal; choose --device {' or '.join(usable)}" in said
    again = spin_usd("reproduce", dataset, frame, "--device", "cpu")
    assert "made on metal, and made again on cpu: the image's bytes may differ" in again.stderr


@pytest.fixture
def rendered_elsewhere(small_stage, tmp_path, spin_usd, usable):
    """A dataset whose one record says that its light was rendered on a Mac; and the frame's name."""
    if "metal" in usable:
        pytest.skip("metal is here")
    spin_usd("render", small_stage, "--out", tmp_path, "--frames", "0:1", "--renderer", "raycast", "--samples", "1")
    (record,) = (tmp_path / "records" / "nominal").iterdir()
    stated = json.loads(record.read_text())
    assert stated["provenance"]["render"]["device"] == "cpu"
    stated["provenance"]["render"]["device"] = "metal"
    record.write_text(json.dumps(stated))
    return tmp_path, record.stem
