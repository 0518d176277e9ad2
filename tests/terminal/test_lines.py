"""Lines stay one each, whatever is in them. Output that does not arrive changes the exit code, and nothing else."""

import json
import os
import subprocess
import sys

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
COMMAND = [sys.executable, "-m", "spin_usd.command_line"]
VERSION = [*COMMAND, "--version"]  # prints, reads nothing, and starts no child
REFUSED = [*COMMAND, "check", "no such path"]


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


def run(command, **streams):
    done = subprocess.run(command, text=True, **({"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | streams))
    assert "Traceback" not in f"{done.stdout}{done.stderr}"
    assert "Exception ignored" not in f"{done.stderr}"
    return done


def full():
    return open("/dev/full", "w")


@pytest.mark.parametrize("command", [VERSION, [*COMMAND, "--help"], [*COMMAND, "export", "--list"]])
def test_a_full_standard_output_is_one_sentence(command) -> None:
    with full() as disk:
        done = run(command, stdout=disk)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "No space left" in done.stderr


def test_a_closed_standard_output_is_one_sentence() -> None:
    done = run(VERSION, stdout=None, preexec_fn=lambda: os.close(1))
    assert done.returncode == 2
    assert "standard output cannot be written" in done.stderr


@pytest.mark.parametrize(("command", "code"), [(VERSION, 0), (REFUSED, 2)])
def test_standard_error_decides_nothing(command, code) -> None:
    with full() as disk:
        assert run(command, stderr=disk).returncode == code
    assert run(command, stderr=None, preexec_fn=lambda: os.close(2)).returncode == code


@pytest.mark.parametrize(("command", "code"), [(VERSION, 0), (REFUSED, 2)])
def test_a_reader_that_goes_away_changes_no_verdict(command, code) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    try:
        assert run(command, stdout=writer, stderr=writer).returncode == code
    finally:
        os.close(writer)


def test_no_file_becomes_standard_output_where_that_is_closed() -> None:
    code = (
        "from spin_usd.terminal.lines import lasting_streams; lasting_streams()\n"
        "import os, sys; sys.exit(os.open(os.devnull, os.O_RDONLY))"
    )

    def close_all() -> None:
        for descriptor in range(3):
            os.close(descriptor)

    done = run([sys.executable, "-c", code], stdout=None, stderr=None, preexec_fn=close_all)
    assert done.returncode > 2
