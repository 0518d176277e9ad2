"""Compare what renders cost by the stage's own measurement with what was expected, for the next expectation."""

from pathlib import Path

from spin_usd.accuracy.measurement import Configuration, Measurement
from spin_usd.errors import InputError
from spin_usd.picture.make_picture import BEAUTY_PASS
from spin_usd.planning.cost import Timings, expected_work
from spin_usd.planning.make_plan import Plan
from spin_usd.planning.work import CommonWork, Task
from spin_usd.processes.machine import machine
from spin_usd.store.measurement_file import FILE, folder_of, measurement_file, read_measurement


def measured_beside(stage: Path, plan: Plan, options: CommonWork) -> tuple[Timings, list[str]]:
    """Return the timings of the measurement that lies beside the stage, none where it is not of this stage on this
    machine; and notes on what is wrong with it, where it cannot be used."""
    if not (folder_of(stage) / FILE).exists():
        return Timings(), []
    try:
        measurement = read_measurement(measurement_file(stage))
    except InputError as e:
        return Timings(), [f"the measurement beside the stage is not used: {e}"]
    known = plan.stages.get(measurement.variant)
    if known is None or known["hash"] != measurement.stage or dict(measurement.machine) != machine():
        return Timings(), []
    return measured_renders(measurement, plan, options), []


def measured_renders(measurement: Measurement, plan: Plan, options: CommonWork) -> Timings:
    """Return the timings of pictures that were measured and are planned, rendered as the options say."""
    setting, found = Configuration(renderer=options.renderer, effort=options.effort), Timings()
    cpu_s = {figures.frame: figures.cpu_s for figures in measurement.figures if figures.setting == setting}
    for picture in plan.pictures:
        if picture.variant == measurement.variant and picture.frame in cpu_s:
            expected = expected_work(Task(picture=picture, label_pass=False, render=True), options)
            found.add({BEAUTY_PASS: expected[BEAUTY_PASS]}, {BEAUTY_PASS: cpu_s[picture.frame]})
    return found
