"""Output that does not arrive: the exit code says so where it was asked for, and nothing else changes."""

import os
import subprocess
import sys

import pytest

COMMAND = [sys.executable, "-m", "spin_usd.command_line"]
VERSION = [*COMMAND, "--version"]  # prints, reads nothing, and starts no child
REFUSED = [*COMMAND, "check", "no such path"]


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
        "from spin_usd.terminal.streams import lasting_streams; lasting_streams()\n"
        "import os, sys; sys.exit(os.open(os.devnull, os.O_RDONLY))"
    )

    def close_all() -> None:
        for descriptor in range(3):
            os.close(descriptor)

    done = run([sys.executable, "-c", code], stdout=None, stderr=None, preexec_fn=close_all)
    assert done.returncode > 2
