"""Renders that are asked for a result, a quality or an error, and find out themselves how hard to try."""

import json
import shutil
from dataclasses import asdict, replace
from pathlib import Path

import pytest
from msgspec import UNSET, to_builtins

from spin_usd.accuracy.choice import choose
from spin_usd.accuracy.front import Criterion
from spin_usd.commands.plan.report import planned_choice
from spin_usd.errors import InputError
from spin_usd.files.sha256 import sha256_of
from spin_usd.options import EffortOptions
from spin_usd.planning.effort_choice import doubts, setting_of
from spin_usd.records.record import EffortChoice, StageProvenance
from spin_usd.scene.effort import QUALITIES, Effort
from spin_usd.store.measurement_file import FILE, folder_of, read_measurement
from tests.cases.measurements import figures, measurement, setting, usual
from tests.cases.records import record_at, record_files

OF_EFFORT = ("samples", "effort", "quality")


def written(folder, found):
    """The path of its measure.json."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / FILE).write_text(json.dumps(to_builtins(found)))
    return folder / FILE


def asked(stage=Path("stage.usda"), **ways):
    options = EffortOptions(**{name: ways.pop(name) for name in OF_EFFORT if name in ways})
    return setting_of(stage, options, **{"renderer": None, **ways})


@pytest.fixture
def measured_stage(tmp_path):
    written(folder_of(tmp_path / "stage.usda"), usual())
    return tmp_path / "stage.usda"


def of_stage(digest):
    return StageProvenance(root="dataset.usda", hash=digest, files={}, variants={})


def test_a_measurement_is_read_as_it_was_written(tmp_path) -> None:
    assert read_measurement(written(tmp_path, usual())) == usual()


def test_figures_of_other_formulas_are_refused(tmp_path) -> None:
    file = written(tmp_path, usual())
    of_old = json.loads(file.read_text())
    del of_old["formulas"]
    for told in (of_old, of_old | {"formulas": 1}):
        file.write_text(json.dumps(told))
        with pytest.raises(InputError, match=r"measure\.json: .*formulas.*; measure again with spin-usd measure$"):
            read_measurement(file)


def spoilt(old, new):
    """The text of a measure.json in which `old`, which it has, is `new`."""
    text = json.dumps(to_builtins(usual()))
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (spoilt('"cpu_s": 0.21', '"cpu_s": NaN'), "is not JSON .NaN is not a finite number"),
        (spoilt('"cpu_s": 0.21', '"cpu_s": -Infinity'), "is not JSON .-Infinity is not a finite number"),
        (spoilt('"cpu_s": 0.21', '"cpu_s": 1e999'), "is not JSON .1e999 is not a finite number"),
        (spoilt('"cpu_s": 0.21', f'"cpu_s": 1{"0" * 999}'), "is not JSON .10000000000000000000 is not a finite number"),
        (
            spoilt('"variant": "nominal"', f'"variant": {"[" * 200000}{"]" * 200000}'),
            "is not JSON .it is nested more than 100 deep",
        ),
        (spoilt('"samples": 1,', '"samples": 0,'), "samples"),
        (spoilt('"samples": 1,', '"samples": 1.0,'), "samples.*1.0 is not of type 'integer'"),
        (spoilt('"frame": "img000001"', '"frame": "img000099"'), "has figures of img000099, which is not among its"),
    ],
)
def test_a_damaged_measurement_is_named(tmp_path, text, names) -> None:
    (tmp_path / FILE).write_text(text)
    with pytest.raises(InputError, match=rf"measure\.json: .*{names}.*; measure again with spin-usd measure$"):
        read_measurement(tmp_path / FILE)


def test_a_plan_says_that_the_measurement_beside_the_stage_is_damaged(small_stage, tmp_path, spin_usd) -> None:
    shutil.copytree(small_stage.parent, tmp_path / "stage")
    stage = tmp_path / "stage" / small_stage.name
    written(folder_of(stage), usual()).write_text("{")
    done = spin_usd("plan", stage, "--json")
    (note,) = json.loads(done.stdout)["notes"]
    assert note.startswith("the measurement beside the stage is not used: ")
    assert done.stderr.endswith(f"note: {note}\n")


@pytest.mark.parametrize(
    ("ways", "effort"),
    [
        ({}, QUALITIES["standard"]),
        ({"samples": 5}, replace(QUALITIES["standard"], samples=5)),
        ({"effort": "samples=5"}, Effort(samples=5)),
        ({"effort": "samples=5,denoiser=high,bounces=0"}, Effort(samples=5, denoiser="high", bounces=0)),
    ],
)
def test_an_effort_that_was_given_was_not_chosen(ways, effort) -> None:
    setting, chosen = asked(**ways)
    assert (setting.renderer, setting.effort, chosen) == ("blender", effort, None)
    assert asked(**ways, renderer="raycast")[0].renderer == "raycast"


@pytest.mark.parametrize("name", QUALITIES)
def test_a_quality_is_the_effort_of_its_name_and_says_so(name) -> None:
    setting, chosen = asked(quality=name)
    assert setting.effort == QUALITIES[name]
    assert chosen.recorded == EffortChoice(
        by="quality", asked=name, reason=f"the quality {name} is {setting.effort.text}"
    )


def test_an_error_is_looked_up_beside_the_stage(measured_stage) -> None:
    setting, chosen = asked(measured_stage, error="0.1")
    choice = choose(usual(), error=0.1)
    assert setting == choice.setting
    digest = sha256_of(folder_of(measured_stage) / FILE)
    assert chosen.recorded == EffortChoice(by="error", asked="0.1", reason=choice.reason, measurement=digest)


def test_auto_is_the_detectors_noise(measured_stage) -> None:
    assert asked(measured_stage, error="auto")[0] == choose(usual(), auto=True).setting


def test_raycast_is_chosen_only_where_it_is_asked_for(measured_stage) -> None:
    assert asked(measured_stage, error="0.9")[0] == choose(usual(), error=0.9).setting
    assert asked(measured_stage, error="0.9")[0].renderer == "blender"
    assert asked(measured_stage, error="0.9", renderer="raycast")[0].renderer == "raycast"


def test_of_a_quality_a_note_says_what_was_measured_of_it_on_this_stage(measured_stage) -> None:
    _, chosen = asked(measured_stage, quality="reference")
    (said,) = doubts(chosen, {"nominal": of_stage(usual().stage)})
    assert said.startswith("the quality reference: expected error 2.4 %, for 22.4 CPU s a picture, as measured on this")
    assert planned_choice(chosen, {"nominal": of_stage(usual().stage)}).expected.error == pytest.approx(0.024)
    assert to_builtins(planned_choice(chosen, {"nominal": of_stage("6" * 64)})) == to_builtins(chosen.recorded)
    assert chosen.recorded.measurement is UNSET
    assert doubts(chosen, {"nominal": of_stage("6" * 64)}) == []


def test_of_a_quality_a_note_names_what_is_cheaper_and_more_exact(tmp_path) -> None:
    draft, better = setting(QUALITIES["draft"]), setting("samples=3")
    made = [figures(draft, cpu_s=2.0, error=0.2), figures(better, cpu_s=1.0, error=0.1)]
    preview = figures(setting("samples=1", "raycast"), cpu_s=0.1, error=0.01)
    written(folder_of(tmp_path / "stage.usda"), measurement([*made, preview]))
    assert asked(tmp_path / "stage.usda", quality="draft")[1].note.endswith(
        "; blender samples=3 is cheaper and more exact: 10 % for 1 CPU s a picture"
    )


@pytest.mark.parametrize("name", ["", FILE])
def test_another_measurement_can_be_named(tmp_path, name) -> None:
    file = written(tmp_path / "elsewhere", usual())
    assert asked(measured=file.parent / name, error="0.1")[0] == choose(usual(), error=0.1).setting


@pytest.mark.parametrize(
    ("ways", "names"),
    [
        ({"samples": 4, "quality": "draft"}, "samples and quality are given together; give one of them"),
        ({"effort": "samples=1", "error": "auto"}, "effort and error are given together; give one of them"),
        ({"samples": 1, "measured": Path("x")}, "measured is given without error; give error too"),
        ({"quality": "best"}, "there is no quality 'best'; choose among preview, draft, standard, reference"),
        ({"error": "5%"}, "error is '5%'; make it a number above 0, such as 0.05 for 5 %, or auto"),
        ({"error": ""}, "error is ''; make it a number above 0"),
        ({"error": "1_0"}, "error is '1_0'; make it a number above 0"),
        ({"effort": ""}, "^effort is empty; write name=value"),
        ({"quality": "preview", "renderer": "raycast"}, "quality 'preview' needs blender: raycast has no denoiser"),
        ({"error": "-1"}, "an error of -1 is not a bound"),
        ({"error": "0.0001"}, "no setting measured has an error of at most 0.01 %"),
        ({"error": "auto", "measured": Path("nowhere")}, "nowhere: cannot be read"),
    ],
)
def test_what_cannot_be_asked_is_refused(measured_stage, ways, names) -> None:
    with pytest.raises(InputError, match=names):
        asked(measured_stage, **ways)


def test_a_stage_that_was_not_measured_says_what_to_run(tmp_path) -> None:
    stage = tmp_path / "stage.usda"
    with pytest.raises(
        InputError, match=rf"has no measured/measure.json beside it; run spin-usd measure {stage} first"
    ):
        asked(stage, error="0.1")


def test_doubts_are_about_another_state_of_the_stage_and_other_variants(measured_stage) -> None:
    _, chosen = asked(measured_stage, error="0.1")
    here, changed = (of_stage(hash) for hash in (usual().stage, "6" * 64))
    assert doubts(chosen, {"nominal": here}) == []
    (said,) = doubts(chosen, {"nominal": changed})
    assert "of the stage as it was" in said
    (said,) = doubts(chosen, {"nominal": here, "dark": changed})
    assert "only the variant nominal was measured" in said
    assert doubts(None, {"nominal": changed}) == []
    assert doubts(asked(quality="draft")[1], {"dark": changed}) == []


def test_a_plan_says_what_was_chosen_and_why(small_stage, tmp_path, spin_usd) -> None:
    """Also where the measurement is of the stage as it was; then with a note."""
    file = written(tmp_path, usual())
    done = spin_usd("plan", small_stage, "--error", "0.1", "--measured", file, "--json")
    choice = choose(usual(), error=0.1)
    said = json.loads(done.stdout)
    assert (said["renderer"], said["effort"]) == ("blender", asdict(choice.setting.effort))
    assert said["chosen"]["reason"] == choice.reason
    assert said["chosen"]["expected"]["error"] == pytest.approx(choice.outcome.error(Criterion.LIGHT).expected)
    assert said["chosen"]["expected"]["cpu_s"] == pytest.approx(choice.outcome.cpu_s)
    assert isinstance(said["bytes"], int)
    (note,) = said["notes"]
    assert note.startswith("the measurement is of the stage as it was")
    assert f"note: {note}\n" in done.stderr
    written(tmp_path, replace(usual(), stage=said["hashes"]["nominal"]))
    done = spin_usd("plan", small_stage, "--error", "0.1", "--measured", tmp_path)
    assert choice.reason in done.stdout.splitlines()
    assert "note" not in done.stderr


@pytest.mark.slow
def test_a_record_says_why_and_the_picture_is_the_one_of_the_same_effort_given(small_stage, tmp_path, spin_usd) -> None:
    shutil.copytree(small_stage.parent, tmp_path / "stage")
    stage, out = tmp_path / "stage" / small_stage.name, tmp_path / "dataset"
    file = written(folder_of(stage), usual())
    common = ("render", stage, "--out", out, "--frames", "0:1", "--labels", "none", "--json")
    assert json.loads(spin_usd(*common, "--renderer", "raycast", "--error", "0.9").stdout)["made"] == 1
    (path,) = record_files(out)
    render = record_at(path)["provenance"]["render"]
    assert (render["renderer"], render["chosen"]["by"], render["chosen"]["asked"]) == ("raycast", "error", "0.9")
    assert render["chosen"]["measurement"] == sha256_of(file)
    again = json.loads(spin_usd(*common, "--renderer", "raycast", "--samples", "1").stdout)
    assert (again["made"], again["reused"]) == (0, 1)
    spin_usd("reproduce", out, path.stem)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("--samples", "2", "--error", "auto"), "samples and error are given together; give one of them"),
        (("--error", "auto", "--measured", ""), "--measured is ''; make it a path; the current folder is '.'"),
        (("--labels-only", "--quality", "draft"), "quality is given with labels_only, which renders no light; drop one of them"),  # noqa: E501
    ],
)  # fmt: skip
def test_ways_that_do_not_go_together_are_wrong_usage(spin_usd, given, said) -> None:
    done = spin_usd("render", "stage.usda", "--out", "d", *given, code=2)
    assert done.stderr == f"spin-usd: {said}\n"
