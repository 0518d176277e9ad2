"""A measurement as text: what the tables say is what was measured."""

from dataclasses import replace

from spin_usd.accuracy.measurement import Execution, Failure, LabelFigures, Saving
from spin_usd.accuracy.report import HEADINGS, SETTINGS, choices, in_full, in_short
from spin_usd.scene.effort import QUALITIES
from tests.cases.measurements import figures, measurement, setting, usual


def table(text, headings):
    """The rows of the Markdown table with these headings, each a dict."""
    lines = text[text.index(f"| {' | '.join(headings)} |") :].partition("\n\n")[0].splitlines()[2:]
    rows = [[cell.strip(" `") for cell in line.strip("| ").split(" | ")] for line in lines]
    return [dict(zip(headings, cells, strict=False)) for cells in rows]


COLUMNS = ("CPU s", "wall s", "error", "of it bias", "of it noise", "brightness", "error, DN", "structure")
# Worked out by hand from what is measured in tests/cases/measurements.py: seconds are the mean over three pictures,
# whose costs are as 1, 1.4 and 1.8, errors those of the third, and a structure is a quarter of its error.
BY_HAND = {
    "raycast samples=1": ("0.05", "0.025", "70 ± 0 %", "69 %", "11.8 %", "-1 %", "7 ± 0", "0.175"),
    "blender samples=4": ("0.546", "0.273", "36 ± 0 %", "0 %", "36 %", "-1 %", "3.6 ± 0", "0.09"),
    "blender samples=64": ("5.59", "2.79", "9 ± 0 %", "0 %", "9 %", "-1 %", "0.9 ± 0", "0.0225"),
    "blender samples=4,denoiser=fast": ("0.686", "0.343", "10.1 ± 0 %", "2 %", "9.9 %", "-1 %", "1.01 ± 0", "0.0253"),
    f"blender {QUALITIES['reference'].text}": (
        *("22.4", "11.2", "2.4 ± 0 %", "0 %", "2.4 %", "-1 %", "0.24 ± 0", "0.006"),
    ),
}


def test_the_settings_table_has_each_setting_with_its_cost_and_the_error_of_its_worst_picture() -> None:
    rows = table(in_full(usual()), SETTINGS)
    assert len(rows) == len({each.setting for each in usual().figures}) == 24
    seconds = [float(row["CPU s"]) for row in rows]
    assert seconds == sorted(seconds)
    by_setting = {row["setting"]: row for row in rows}
    for name, cells in BY_HAND.items():
        assert tuple(by_setting[name][column] for column in COLUMNS) == cells


def test_a_figure_stands_with_its_uncertainty_and_a_bias_within_that_is_none() -> None:
    """An error of 12 %, whose square is 0.0144, and 15 % where that is 0.0081 more."""
    known = figures(setting("samples=2"), cpu_s=1.0, error=0.12, bias=0.05, error_dn=4.0)
    unsure = replace(known, uncertainty=0.0081, error_dn_uncertainty=0.5)
    said = [table(in_full(measurement([each])), SETTINGS)[0] for each in (known, unsure)]
    assert [row["error"] for row in said] == ["12 ± 0 %", "12 ± 3 %"]
    assert [row["error, DN"] for row in said] == ["4 ± 0", "4 ± 0.5"]
    assert [row["of it bias"] for row in said] == ["5 %", "0 %"]
    assert "12 ± 3 %" in in_short(measurement([unsure]))


def test_rows_on_a_front_are_marked() -> None:
    """By either criterion the preview, two plain samples, for less than one of them denoised, and all that are."""
    rows = table(in_full(usual()), SETTINGS)
    denoised = [f"blender samples={n},denoiser=fast" for n in (1, 2, 4, 8, 16, 32, 64, 256)]
    best = ["raycast samples=1", "blender samples=2", *denoised]
    for criterion in ("light", "image"):
        assert [row["setting"] for row in rows if criterion in row["front"].split()] == best


def test_each_criterion_has_a_front_of_its_own() -> None:
    """The dearer one has less error in linear light, and more after the detector."""
    cheap = figures(setting("samples=1"), cpu_s=1.0, error=0.2, error_dn=1.0)
    dear = figures(setting("samples=2"), cpu_s=2.0, error=0.1, error_dn=2.0)
    rows = table(in_full(measurement([cheap, dear])), SETTINGS)
    assert [row["front"] for row in rows] == ["light image", "light"]


def test_a_bias_that_is_less_than_none_by_chance_is_none() -> None:
    odd = replace(figures(setting("samples=2"), cpu_s=1.0, error=0.1), bias_squared=-1e-4)
    (row,) = table(in_full(measurement([odd])), SETTINGS)
    assert row["of it bias"] == "0 %"


def test_the_rest_of_a_measurement_is_there_where_it_was_measured() -> None:
    full = replace(
        usual(),
        labels=(
            LabelFigures(frame="a", renderer="blender", against="raycast", iou=1.0, depth_m=1e-6, reprojection_px=6e-5,
                         part_pixels=7),
        ),
        execution=(Execution(processes=2, threads=1, crop=True, wall_s=3.25, same=True),),
        frames=(*usual().frames[1:], replace(usual().frames[0], reference_capped=True)),
        failures=(Failure(frame="b", what="blender samples=4", reason="a | b"),),
        savings=(
            Saving(frame="a", what="glossy bounces", cpu_s=1.5, cpu_s_with=2.0, ratio_least=1.25, ratio_most=1.5,
                   difference=0.001, noise=0.05),
            Saving(frame="a", what="world", cpu_s=1.5, cpu_s_with=1.5, ratio_least=0.9, ratio_most=1.1,
                   difference=0, noise=0.05),
        ),
    )  # fmt: skip
    text = in_full(full)
    assert "| a | blender | raycast | 1.000000 | 1.0e-06 | 6.0e-05 | 7 |" in text
    assert "| 2 x 1 | yes | 3.25 | yes |" in text
    assert "| glossy bounces | a | 1.5 | 2 | 1.25 to 1.5 | 0.1 % | 5 % |" in text
    assert "| world | a | 1.5 | 1.5 | 0.9 to 1.1 | 0 % | 5 % |" in text
    assert "| blender samples=4 | b | a \\| b |" in text
    assert "| 4096 (no more allowed) |" in text
    assert "glossy bounces" not in in_full(usual())
    assert "## Execution" not in in_full(usual())


def test_the_short_table_is_aligned() -> None:
    lines = in_short(usual()).splitlines()
    assert len({len(line) for line in lines}) == 1
    assert len(lines) == 1 + 24


def test_the_summary_says_what_names_come_to() -> None:
    rows = table(choices(usual()), HEADINGS)
    assert len(rows) == len(QUALITIES) + 2
    for row in rows[: len(QUALITIES)]:
        assert row["setting"] == f"blender {QUALITIES[row['asked'].split()[-1]].text}"
    auto, noiseless = (table(choices(each), HEADINGS)[-1] for each in (usual(), usual(noise_dn=0.01)))
    # The first denoised setting below the noise of 1.5 DN: 0.518 of 5.586 seconds, and sqrt(1.41^2 + 1.5^2) = 2.06.
    assert auto["setting"] == "blender samples=2,denoiser=fast"
    assert (auto["CPU s"], auto["beside samples=64"]) == ("0.518", "9.27 %")
    assert (auto["error, DN"], auto["both together, DN"]) == ("1.41", "2.06")
    assert noiseless["setting"] == "not measured"


def test_where_no_setting_is_as_exact_as_the_detector_the_summary_says_how_near_the_best_comes() -> None:
    far, near = (figures(setting(f"samples={n}"), cpu_s=n, error=2 / n) for n in (4, 8))
    never = table(choices(measurement([far, near])), HEADINGS)[-1]
    assert never["setting"] == "never reached; nearest is `blender samples=8"
    assert (never["error, DN"], never["detector's noise, DN"], never["both together, DN"]) == ("2.5", "1.5", "2.92")


def test_a_quality_that_was_not_measured_has_no_figures() -> None:
    text = choices(measurement([figures(setting("samples=64"), cpu_s=1.0, error=0.01)]))
    assert text.count("not measured") == len(QUALITIES)
