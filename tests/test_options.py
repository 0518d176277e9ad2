"""An argument of a wrong type is refused at the door, by name, before anything is started or written."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest

import spin_usd
from spin_usd.options import Argument, Listening, Option, Options, run_with, takes

WRONG: list[tuple[str, dict[str, Any], str]] = [
    ("render", {"workers": 1.5}, "workers is 1.5; make it a whole number or None"),
    ("render", {"workers": "a"}, "workers is 'a'; make it a whole number or None"),
    ("render", {"workers": True}, "workers is True; make it a whole number or None"),
    ("render", {"seed": "a"}, "seed is 'a'; make it a whole number or None"),
    ("render", {"seed": 1.5}, "seed is 1.5; make it a whole number or None"),
    ("render", {"samples": "4"}, "samples is '4'; make it a whole number or None"),
    ("render", {"frames": 3}, "frames is 3; make it text or None"),
    ("render", {"frames": slice(0, 2)}, "frames is slice(0, 2, None); make it text or None"),
    ("render", {"effort": 5}, "effort is 5; make it text or None"),
    ("render", {"labels": 5}, "labels is 5; make it text or a list, each text"),
    ("render", {"labels": [5]}, "labels is [5]; make it text or a list, each text"),
    ("render", {"on_progress": 3}, "on_progress is 3; make it a function or None"),
    ("plan", {"explain": "no"}, "explain is 'no'; make it True or False"),
    ("author", {"seed": "x"}, "seed is 'x'; make it a whole number"),
    ("author", {"count": "4"}, "count is '4'; make it a whole number or None"),
    ("author", {"sun_direction": ["0", 0, 1]}, "make it text or a list, each a number or None"),
    ("author", {"sun_direction": "0,0,x"}, "sun_direction '0,0,x' is not X,Y,Z"),
    ("measure", {"max_samples": "x"}, "max_samples is 'x'; make it a whole number"),
    ("measure", {"reference_share": "0.1"}, "reference_share is '0.1'; make it a number"),
]


@pytest.mark.parametrize(("name", "given", "sentence"), WRONG)
def test_a_wrong_type_is_refused(name: str, given: dict[str, Any], sentence: str, tmp_path: Path) -> None:
    stage = () if name == "author" else (tmp_path / "gone.usda",)
    out = {} if name == "plan" else {"out": tmp_path / "out"}
    with pytest.raises(spin_usd.SpinError) as raised:
        getattr(spin_usd, name)(*stage, **out, **given)
    assert sentence in str(raised.value)
    assert not list(tmp_path.iterdir())


@dataclass(frozen=True)
class Example(Listening):
    path: Annotated[str | Path, Argument("A path.")]
    _: KW_ONLY
    numbers: Annotated[str | Sequence[float] | None, Option("Some numbers.", "X,...")] = None


@takes(Example)
def example(options: Example) -> object:
    """Return the numbers.

    Raises nothing.
    """
    return options.numbers


@pytest.mark.parametrize("numbers", ["0,0,1", (0, 0, -1.0), [1], np.array([0, 0, 1]), None])
def test_what_the_annotations_allow_is_passed_on(numbers: Any) -> None:
    assert example(Path("x"), numbers=numbers, on_progress=print) is numbers


def test_a_position_is_checked_as_a_name_is() -> None:
    with pytest.raises(spin_usd.SpinError, match="path is 3; make it text or a path"):
        example(3)  # type: ignore[arg-type]


def test_python_itself_refuses_what_no_parameter_takes() -> None:
    with pytest.raises(TypeError, match="unexpected keyword argument 'nmbers'"):
        example("x", nmbers=[1])  # type: ignore[call-arg]


def test_options_that_are_built_are_not_validated_again(monkeypatch) -> None:
    built = Example("x", numbers=[1])
    monkeypatch.setattr(Options, "__post_init__", lambda _: pytest.fail("they were built again"))
    assert run_with(example, built.telling(print)) is built.numbers


def test_listeners_are_told_by_the_options_that_were_given_them_alone() -> None:
    built = Example("x")
    assert built.telling(print).progress is print
    assert built.on_progress is None


def test_what_is_run_with_options_fails_as_the_function_does() -> None:
    @takes(Options)
    def function(_: Options) -> None:
        b"\xff".decode()

    with pytest.raises(spin_usd.SpinError, match="not UTF-8"):
        run_with(function, Options())
