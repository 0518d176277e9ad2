"""Every name that travels with spin_usd is listed with what it is."""

import json

import pytest
from typer.testing import CliRunner

from spin_usd.basics.resources import BUNDLED, bundled_names
from spin_usd.command_line import app
from spin_usd.commands.list.command import LISTS
from spin_usd.errors import InputError
from spin_usd.exchange.table import EXPORT_FORMATS
from spin_usd.labels.table import LABELS


def test_all_names_are_listed_each_with_a_sentence() -> None:
    done = CliRunner().invoke(app, ["list"])
    assert done.exit_code == 0
    first = {line.split()[0] for line in done.output.splitlines() if line.strip()}
    assert first >= {name for kind in BUNDLED for name in bundled_names(kind)} | LABELS.keys() | EXPORT_FORMATS.keys()
    for kind in LISTS.values():
        for name, said in kind.names().items():
            assert len(said) > 10, name
            assert said.count("(") == said.count(")"), said


def test_programs_read_the_same_names_as_json() -> None:
    cameras = json.loads(CliRunner().invoke(app, ["list", "cameras", "--json"]).output)
    assert cameras == {"cameras": dict(LISTS["cameras"].names())}
    assert json.loads(CliRunner().invoke(app, ["list", "--json"]).output).keys() == LISTS.keys()


def test_one_kind_is_listed_and_another_word_is_refused() -> None:
    done = CliRunner().invoke(app, ["list", "cameras"])
    assert "speedplus" in done.output
    assert "tango" not in done.output
    assert isinstance(CliRunner().invoke(app, ["list", "looks"]).exception, InputError)


@pytest.mark.parametrize("option", [kind.option for kind in LISTS.values()])
def test_the_options_are_there(option) -> None:
    command, flag = option.split(",")[0].split()
    assert flag in CliRunner().invoke(app, [command, "--help"]).output
