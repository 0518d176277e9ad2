"""The files of a measurement for people: small, legible anywhere, the same to the byte each time."""

import os
import re
import subprocess
import sys
from xml.etree import ElementTree

import pytest

from spin_usd.commands.measure.measurement_folder import write_report
from spin_usd.commands.measure.plot import kind_of, plot
from tests.cases.measurements import figures, measurement, setting, usual
from tests.conftest import REPOSITORY

SVG = "{http://www.w3.org/2000/svg}"
ALONE = """
from spin_usd.commands.measure.plot import plot
from tests.cases.measurements import usual
print(plot(usual()), end="")
"""


def texts(svg):
    return [each.text for each in ElementTree.fromstring(svg).iter(f"{SVG}text")]


def points(svg):
    return len(list(ElementTree.fromstring(svg).iter(f"{SVG}use")))


def test_the_plot_is_the_same_to_the_byte_in_another_process_and_small() -> None:
    alone = subprocess.run([sys.executable, "-c", ALONE], capture_output=True, text=True, check=True, cwd=REPOSITORY)
    assert alone.stdout == plot(usual())
    assert len(alone.stdout) < 40_000


def test_the_plot_is_the_same_whatever_the_users_own_settings_are(tmp_path) -> None:
    (tmp_path / "matplotlibrc").write_text("lines.linewidth: 5\naxes.facecolor: red\nsvg.fonttype: path\n")
    alone = subprocess.run(
        [sys.executable, "-c", ALONE],
        capture_output=True,
        text=True,
        check=True,
        cwd=REPOSITORY,
        env={**os.environ, "MPLCONFIGDIR": str(tmp_path)},
    )
    assert alone.stdout == plot(usual())


def test_small_errors_have_ticks_that_can_be_told_apart() -> None:
    """Coordinates are shortened, text is not."""
    cpu_s = {1: 0.001, 4: 0.004, 16: 0.016}
    exact = [figures(setting(f"samples={n}"), cpu_s=s, error=0.004 / n, error_dn=0.006 / n) for n, s in cpu_s.items()]
    ticks = [text for text in texts(plot(measurement(exact))) if re.fullmatch(r"[\d.]+( %)?", text)]
    assert {"0.2 %", "0.05 %", "0.002", "0.005", "0.001"} <= {*ticks}
    assert all(float(tick.removesuffix(" %")) > 0 for tick in ticks)


def test_the_plot_holds_no_date_and_says_its_words_as_text_on_white() -> None:
    svg = plot(usual())
    assert "date" not in svg.lower()
    assert "fill: #ffffff" in svg
    said = texts(svg)
    for quality in (
        *("preview: 1 fast filter 0.2", "draft: 4 fast filter 0.2", "standard: 16 balanced filter 0.2"),
        "reference: 256 bounces=8 filter 0.2",
    ):
        assert said.count(quality) == 2  # in each panel
    assert {"plain samples", "denoised", "adaptive", "others", "raycast", "raycast 1", "32 fast"} <= {*said}
    assert "shaded: at most the detector's noise, 1.5 DN" in said


def test_every_setting_is_a_point_in_each_panel() -> None:
    kinds, rings = 5, 4
    assert points(plot(usual())) == 2 * (len({each.setting for each in usual().figures}) + rings) + kinds


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("samples=7", "plain samples"),
        ("samples=7,denoiser=high", "denoised"),
        ("samples=7,denoiser=high,filter_glossy=0.3", "denoised"),
        ("samples=64,adaptive=0.02,denoiser=fast", "adaptive"),
        ("samples=7,denoiser=fast,reduction=2", "others"),
        ("samples=7,light_tree=off", "others"),
    ],
)
def test_a_setting_is_of_one_kind(text, kind) -> None:
    assert kind_of(setting(text)) == kind
    assert kind_of(setting(text, "raycast")) == "raycast"


def test_a_setting_without_error_cannot_be_shown_on_these_axes_and_spoils_nothing() -> None:
    exact = [figures(setting("samples=1"), cpu_s=1.0), figures(setting("samples=2"), cpu_s=2.0, error=0.1)]
    assert points(plot(measurement(exact))) == 2 + 1  # the other's in each panel and in the legend


def test_the_report_is_written_over_what_was_there(tmp_path) -> None:
    for _ in range(2):
        write_report(tmp_path / "measured", usual(), work=tmp_path)
    assert {path.name for path in (tmp_path / "measured").iterdir()} == {"measure.md", "measure.svg"}
    assert (tmp_path / "measured" / "measure.svg").read_text() == plot(usual())
    assert "](measure.svg)" in (tmp_path / "measured" / "measure.md").read_text()
