import json
import time
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.basics.nesting import MAX_DEPTH, NestingError, finite_json, parsed_json, parsed_toml

SOON_S = 2.0

VALUES = st.recursive(
    st.text(alphabet='ab"\\[]{}/é') | st.integers() | st.none(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(alphabet='"\\[{x'), inner, max_size=3),
    max_leaves=40,
)


@given(VALUES, st.booleans())
def test_what_is_not_deep_is_parsed_as_python_does(value, escaped) -> None:
    """Among 60 lists, so that brackets are counted, in strings or not."""
    text = json.dumps([value, *[[]] * MAX_DEPTH], ensure_ascii=escaped)
    assert parsed_json(text) == parsed_json(text.encode()) == json.loads(text)


DEEP_JSON = {
    "lists": "[" * 200_000,
    "objects": '{"a":' * 200_000,
    "just too deep": "[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1),
    "closed in a string": '["' + "]" * 500 + '",' + "[" * (MAX_DEPTH + 1),
    "after a quote in a string": '["\\"",' + "[" * (MAX_DEPTH + 1),
    "after a backslash in a string": '["\\\\",' + "[" * (MAX_DEPTH + 1),
    "far in": "[" + "1," * 1_500_000 + "[" * MAX_DEPTH,
}


@pytest.mark.parametrize("name", DEEP_JSON)
def test_deep_json_is_refused_before_it_is_parsed(name) -> None:
    with pytest.raises(NestingError):
        parsed_json(DEEP_JSON[name])


@pytest.mark.parametrize("text", ["[" * MAX_DEPTH + "]" * MAX_DEPTH, '["' + "[" * 500 + '"' + ",[]" * MAX_DEPTH + "]"])
def test_json_that_is_deep_enough_is_taken(text) -> None:
    assert parsed_json(text) == json.loads(text)


DEEP_TOML = {
    "a key": "a" + ".a" * 50_000 + " = 1",
    "a key with blanks": "a" + " . a" * 50_000 + " = 1",
    "a quoted key": '"a"' + """.'a'""" * 50_000 + " = 1",
    "a table": "[a" + ".a" * 50_000 + "]",
    "an array": "a = " + "[" * 100_000,
    "inline tables": "a = " + "{a = " * 100_000,
}


@pytest.mark.parametrize("name", DEEP_TOML)
def test_deep_toml_is_refused_soon(name) -> None:
    began = time.process_time()
    with pytest.raises(NestingError):
        parsed_toml(DEEP_TOML[name])
    assert time.process_time() - began < SOON_S


@pytest.mark.parametrize(
    "text",
    ["a = [" + "0.5,1.5," * 5000 + "]", "b = '" + "c" * 200_000 + "'", "a.b.c = 1.5 # 1.2.3", "a" * 200_000 + " = 1"],
)
def test_long_toml_is_taken_soon(text) -> None:
    began = time.process_time()
    assert parsed_toml(text) == tomllib.loads(text)
    assert time.process_time() - began < SOON_S


@pytest.mark.parametrize("number", ["NaN", "-Infinity", "1e400", "9" * 400])
def test_json_of_ours_has_finite_numbers(number) -> None:
    """What could not be written again is damaged."""
    with pytest.raises(ValueError, match="is not a finite number"):
        finite_json(f'{{"pose": [0.5, {number}]}}')
    assert finite_json(b'{"pose": [0.5, 2]}') == {"pose": [0.5, 2]}
