"""Numbers so large or so small that formulas overflow: one sentence from the readers, a finding of check."""

import pytest

from spin_usd.errors import GeometryError, StageError
from spin_usd.geometry.camera import Camera
from spin_usd.stage.check.check_stage import check_stage

BOX = 'def Cube "Box" {{\ndouble3 xformOp:scale = ({0}, {0}, {0})\nuniform token[] xformOpOrder = ["xformOp:scale"]\n}}'
FAR = 'double3 xformOp:translate = (0, 0, {})\nuniform token[] xformOpOrder = ["xformOp:translate"]'


@pytest.mark.parametrize(
    "options",
    [
        *({"metadata": f"metersPerUnit = {unit}"} for unit in ("0", "-1", "nan", "inf", "1e300", "1e-300")),
        *({"geometry": BOX.format(size)} for size in ("0", "1e300", "1e20", "1e-13")),
        *({"pose": FAR.format(z)} for z in ("-1e300", "-1e16", "nan")),
    ],
    ids=str,
)
def test_what_overflows_is_refused(make_stage, read_scene, options) -> None:
    with pytest.raises(StageError):
        read_scene(**options)
    assert any(finding.severity == "error" for finding in check_stage(make_stage(**options)))


@pytest.mark.parametrize("number", [1e300, -1e308, 1e-320])
@pytest.mark.parametrize("name", ["fx", "cy", "k1", "k3"])
def test_no_lens_has_numbers_whose_powers_overflow(number, name) -> None:
    numbers = {"fx": 100.0, "fy": 100.0, "cx": 32.0, "cy": 24.0}
    distortion = (number, 0.0, 0.0, 0.0, 0.0) if name == "k1" else (0.1, 0.0, 0.0, 0.0, number)
    changed = {"distortion": distortion} if name.startswith("k") else {**numbers, name: number}
    with pytest.raises(GeometryError, match="expected"):
        Camera(width=64, height=48, **(numbers | changed))
