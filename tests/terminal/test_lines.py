import json

import pytest

from spin_usd.errors import InputError, printable
from spin_usd.terminal.lines import print_err, print_out

HOSTILE = {
    "line": "x\nerror: forged",
    "colour": "\x1b[31mred",
    "carriage return": "error\rok",
    "direction": "gnp.\u202eevil",
    "separator": "a\u2028b",
    "not UTF-8": "x\udcff",
    "zero": "a\0b",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_line_stays_one_and_steers_no_terminal(name, capsys) -> None:
    text = HOSTILE[name]
    print_out(text)
    print_err(text)
    printed = capsys.readouterr()
    assert printed.out == printed.err
    assert printed.out.count("\n") == 1
    assert printed.out[:-1].isprintable()
    printed.out.encode()


def test_what_is_printable_stays_as_it_is() -> None:
    assert printable("Raumfähre 衛星 · 3 m\\n") == "Raumfähre 衛星 · 3 m\\n"


@pytest.mark.parametrize("name", HOSTILE)
def test_an_error_names_a_file_in_one_line(name) -> None:
    error = str(InputError("is not there", where=HOSTILE[name]))
    assert error == f"{printable(HOSTILE[name])}: is not there"


@pytest.mark.parametrize("name", HOSTILE)
def test_json_for_programs_holds_the_name_itself(name, capsys) -> None:
    print_out(json.dumps({"where": HOSTILE[name]}))
    assert json.loads(capsys.readouterr().out) == {"where": HOSTILE[name]}


@pytest.mark.parametrize("length", [10, 590, 10**5])
def test_a_long_quotation_loses_its_middle_and_not_what_to_do(length) -> None:
    where, found = f"/first{'x' * length}/last.usda", f"holds {'y' * length} here"
    error = str(InputError(found, where=where, do="give another file"))
    assert error.startswith("/first")
    assert "/last.usda: holds " in error
    assert error.endswith(" here; give another file")
    assert len(error) <= 604
    assert ("…" in error) == (length > 500)
