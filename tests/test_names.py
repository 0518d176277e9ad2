"""`import spin_usd` offers the commands as functions, and loads nothing before it is used."""

import inspect
import subprocess
import sys

import pytest
import typer

import spin_usd
from spin_usd.command_line import app

CALLBACKS = {"on_progress", "on_note"}
ON_THE_COMMAND_LINE_ALONE = {"as_json", "list_formats", "list_parameters", "minimal", "unfolded"}
LISTS = {
    "variant",
    "leave_out",
    "camera",
    "variants",
    "option",
    "tags",
    "also",
    "occluder",
}  # whose default is an empty one, of either type
FUNCTIONS = ("author", "augment", "plan", "render", "merge", "check", "measure", "reproduce", "export", "show")


def loaded(code: str) -> set[str]:
    """The modules that a fresh Python has loaded after `code`."""
    report = "\nimport sys; print('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code + report], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_importing_loads_nothing_but_the_package_itself() -> None:
    without = loaded("import importlib, typing")
    assert {name for name in loaded("import spin_usd") - without if "." in name or "spin" in name} == {"spin_usd"}


def test_the_functions_load_neither_usd_nor_blender() -> None:
    every = ", ".join(spin_usd.__all__)
    assert not {"pxr", "bpy", "typer", "torch"} & loaded(f"from spin_usd import {every}")


@pytest.mark.parametrize("name", spin_usd.__all__)
def test_every_name_is_there_and_documented(name: str) -> None:
    assert name in dir(spin_usd)
    assert inspect.getdoc(getattr(spin_usd, name))


def test_another_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="no attribute 'rendr'"):
        spin_usd.rendr  # noqa: B018


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_takes_what_its_command_takes(name: str) -> None:
    command = typer.main.get_command(app).commands[name]  # type: ignore[attr-defined]
    options = {option.name for option in command.params} - ON_THE_COMMAND_LINE_ALONE
    parameters = inspect.signature(getattr(spin_usd, name)).parameters
    assert set(parameters) - CALLBACKS == options


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_has_the_defaults_of_its_command(name: str) -> None:
    command = typer.main.get_command(app).commands[name]  # type: ignore[attr-defined]
    parameters = inspect.signature(getattr(spin_usd, name)).parameters
    defaults = {name: each.default for name, each in parameters.items() if each.default is not each.empty}
    for option in command.params:
        if option.name in defaults and option.name not in LISTS:
            assert defaults[option.name] == option.default, option.name


@pytest.mark.parametrize("name", [name for name in FUNCTIONS if name not in ("author", "plan")])
def test_a_docstring_says_what_every_argument_is(name: str) -> None:
    function = getattr(spin_usd, name)
    text = inspect.getdoc(function) or ""
    assert not [each for each in inspect.signature(function).parameters if f"\n    {each}: " not in text]
