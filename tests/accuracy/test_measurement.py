"""A measurement and its JSON are one another, by the schema."""

import json
from dataclasses import replace

import pytest
from msgspec import convert, to_builtins

from spin_usd.accuracy.measurement import (
    Configuration,
    Execution,
    Failure,
    Figures,
    LabelFigures,
    MeasuredPicture,
    Measurement,
    Saving,
)
from spin_usd.errors import InputError
from spin_usd.scene.effort import Effort
from spin_usd.store.json_schema import valid

SETTING = Configuration(renderer="blender", effort=Effort(samples=4, denoiser="fast", adaptive=0.03))
FRAME = MeasuredPicture(
    name="img000001",
    index=0,
    region=(1, 2, 30, 40),
    target_pixels=900,
    reference_samples=1024,
    reference_error=0.01,
    noise_dn=1.5,
    reference_capped=True,
)
FIGURES = Figures(
    frame="img000001",
    setting=SETTING,
    seeds=3,
    cpu_s=1.5,
    wall_s=0.8,
    memory_bytes=1 << 28,
    variance=0.01,
    bias_squared=-1e-6,
    uncertainty=0.002,
    brightness=0.001,
    error_dn=0.7,
    error_dn_uncertainty=0.1,
    structure=0.02,
)
MEASUREMENT = Measurement(
    stage="0" * 64,
    variant="nominal",
    machine={"cores": 2, "architecture": "x86_64"},
    versions={"numpy": "2"},
    frames=(FRAME,),
    figures=(FIGURES,),
    labels=(
        LabelFigures(
            frame="img000001",
            renderer="blender",
            against="raycast",
            iou=1.0,
            depth_m=0.0,
            reprojection_px=0.0,
            part_pixels=0,
        ),
    ),
    execution=(Execution(processes=1, threads=2, crop=True, wall_s=3.0, same=True),),
    savings=(
        Saving(
            frame="img000001",
            what="world",
            cpu_s=1.0,
            cpu_s_with=1.1,
            ratio_least=1.05,
            ratio_most=1.2,
            difference=0.0,
            noise=0.1,
        ),
    ),
    failures=(Failure(frame="img000001", what="blender samples=16", reason="it crashed"),),
    reference_share=0.05,
)


def test_it_survives_its_file(tmp_path) -> None:
    path = tmp_path / "measure.json"
    path.write_text(json.dumps(to_builtins(MEASUREMENT)))
    assert convert(valid(path.read_bytes(), "measure-1", path), Measurement) == MEASUREMENT


@pytest.mark.parametrize("spoil", [{"seeds": 1}, {"cpu_s": -1.0}, {"frame": "../x"}, {"memory_bytes": 0.5}])
def test_the_schema_refuses_what_cannot_be(tmp_path, spoil) -> None:
    path = tmp_path / "measure.json"
    path.write_text(json.dumps(to_builtins(replace(MEASUREMENT, figures=(replace(FIGURES, **spoil),)))))
    with pytest.raises(InputError, match="measure-1"):
        valid(path.read_bytes(), "measure-1", path)


def test_a_bias_below_zero_is_no_error() -> None:
    assert FIGURES.error == pytest.approx(0.1)
    assert replace(FIGURES, bias_squared=0.03).error == pytest.approx(0.2)


def test_what_an_error_is_at_most_is_of_its_square() -> None:
    """So that it is more than nothing where the error is none by chance."""
    assert FIGURES.error_at_most**2 == pytest.approx(FIGURES.error**2 + 0.002)
    assert replace(FIGURES, uncertainty=0.0).error_at_most == FIGURES.error
    assert replace(FIGURES, variance=0.0).error_at_most == pytest.approx(0.002**0.5)
    assert FIGURES.error_dn_at_most == pytest.approx(0.8)
