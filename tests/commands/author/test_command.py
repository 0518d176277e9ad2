"""`spin-usd author`: what its help says, and the stage of one page."""

import json
import re
import shlex

import pytest
import typer
from typer.core import TyperGroup

from spin_usd.basics.resources import BUNDLED, bundled, bundled_names, stages
from spin_usd.command_line import app
from spin_usd.stage.composition.open_layer import open_layer
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.terminal.help_text import EXAMPLES
from tests.conftest import REPOSITORY

COMMAND_LINE = typer.main.get_command(app)
assert isinstance(COMMAND_LINE, TyperGroup)
COMMANDS = COMMAND_LINE.commands


def test_the_help_names_all_that_travels_along_or_who_lists_it(spin_usd) -> None:
    text = spin_usd("author", "--help").stdout
    said = set(re.findall(r"[\w]+", text))
    for kind in BUNDLED:
        assert bundled_names(kind)
        assert set(bundled_names(kind)) <= said or f"list {kind}s" in " ".join(text.replace("│", " ").split())


def test_lights_and_environments_are_reported_apart_as_usd_reads_them() -> None:
    for kind, prim in (("lights", "Lights"), ("environment", "Environment")):
        assert {open_layer(bundled(kind, name)).defaultPrim for name in bundled_names(kind)} == {prim}
    files = {file.stem for file in (REPOSITORY / "stages" / "environments").glob("*.usda")}
    assert set(bundled_names("lights")) | set(bundled_names("environment")) == files


@pytest.mark.parametrize("command", COMMANDS)
def test_examples_use_options_that_there_are_and_flags_take_nothing(spin_usd, command) -> None:
    known = {option for param in COMMANDS[command].params for option in param.opts}
    for example in EXAMPLES.get(command, ()):
        name, _, *words = shlex.split(example)
        assert name == "spin-usd"
        assert {word for word in words if word.startswith("--")} <= known | {"--error", "--out"}, example
    assert "<bool>" not in spin_usd(command, "--help").stdout


@pytest.mark.parametrize("command", COMMANDS)
def test_each_argument_and_option_has_its_help(command) -> None:
    assert [param.name for param in COMMANDS[command].params if not getattr(param, "help", None)] == []


def test_without_pictures_the_sampler_is_named(spin_usd, tmp_path) -> None:
    said = spin_usd("author", "--target", "tango", "--camera", "speedplus", "--out", tmp_path / "x", code=2).stderr
    assert "give a pose list, such as --poses FILE, or a distribution, --sample" in said


def test_the_stage_of_one_page_has_no_findings_and_renders(spin_usd, tmp_path) -> None:
    root = json.loads(spin_usd("author", "--minimal", "--json", "--out", tmp_path / "page").stdout)["root"]
    assert [path.name for path in (tmp_path / "page").iterdir()] == ["dataset.usda"]
    assert spin_usd("check", root).stdout.endswith("0 errors, 0 warnings\n")
    spin_usd("render", tmp_path / "page", "--out", tmp_path / "made", "--renderer", "raycast", "--samples", 1)
    dataset = json.loads((tmp_path / "made" / "dataset.json").read_text())
    assert {part["class"] for part in dataset["parts"].values()} == {"spacecraft", "antenna"}
    record = json.loads((tmp_path / "made" / "records" / "nominal" / "near.json").read_text())
    assert record["pose"]["t_cam_body"] == pytest.approx([0, 0, 8], abs=1e-12)  # as its comments say
    assert [record["camera"][name] for name in ("fx", "fy", "cx", "cy")] == [800, 800, 320, 240]


def test_the_stage_of_one_page_takes_nothing_else(spin_usd, tmp_path) -> None:
    said = spin_usd("author", "--minimal", "--target", "tango", "--seed", 3, "--out", tmp_path / "page", code=2).stderr
    assert "--target and --seed are given with --minimal" in said or "--seed and --target" in said
    assert not (tmp_path / "page").exists()


def test_what_many_sampled_pictures_share_is_told(spin_usd, tmp_path) -> None:
    def notes(sample, *more):
        out = tmp_path / str(len(list(tmp_path.iterdir())))
        given = ("--target", "cubesat", "--camera", "speedplus", "--resolution", "64", "--environment", "earth")
        return spin_usd("author", "--sample", sample, *given, *more, "--out", out).stderr

    few, many = "range=0.5..1 count=9", "range=0.5..1 count=10"
    assert "the same" not in notes(few)
    assert "all 10 pictures have the same Sun: sun.direction=uniform in --sample" in notes(many)
    assert "the same" not in notes(many, "--sun-direction", "0.3,-0.5,-0.8")
    (tmp_path / "once.toml").write_text("""schema = "sample-1"
part = [{ name = "a", names = "i{picture}", pictures = 10, poses = { range = { distribution = "fixed", value = 1 }, attitude = { distribution = "attitudes" } }, sample = { "sun.direction" = { distribution = "directions" } } }]
""")  # noqa: E501
    once = notes(tmp_path / "once.toml")
    assert (
        'sun.direction is drawn once for all 10 pictures of a part: per = "frame" draws another value in each' in once
    )


@pytest.mark.parametrize(
    ("given", "earths"),
    [
        (("--sample", "range=0.5..1 count=3"), 3),
        (("--sample", "range=0.5..1 earth.attitude=1,0,0,0 count=3"), 1),
        (("--sample", "range=0.5..1 earth.altitude=500..600km count=3"), 3),
        (("--sample", "fly_around", "--count", 3), 1),
        (("--poses", stages() / "examples" / "tango_speedplus_poses.json", "--frames", "0:3"), 1),
    ],
)
def test_sampled_pictures_have_other_earths_unless_one_is_given(spin_usd, tmp_path, given, earths) -> None:
    """Pictures of a trajectory, and of a list that may be one, have the same Earth."""
    common = ("--target", "cubesat", "--camera", "speedplus", "--resolution", 64, "--environment", "earth")
    spin_usd("author", *given, *common, "--out", tmp_path / "stage")
    reader = StageReader(tmp_path / "stage" / "dataset.usda")
    planets = [planet for frame in reader.frames for planet in reader.scene(frame).environment.planets]
    assert len(planets) == 3
    assert len({planet.T_cam_planet.rotation.tobytes() for planet in planets}) == earths
