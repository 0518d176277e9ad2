"""What people see at a real pseudo-terminal, wide, narrow, without colours and dumb; and what a pipe gets instead."""

import re

import pytest

from spin_usd.commands.check.command import MAX_FOLDED, by_rule, show_findings
from spin_usd.scene.finding import WARNING, Finding

HELP = ("-m", "spin_usd.command_line", "--help")
HOSTILE = "image/\x1b[31m\u202egnp.png"
REMEDY = "run spin-usd check --repair"
FINDINGS = [
    Finding(code="stray", where=HOSTILE, message="is not in any record; move it", severity=WARNING),
    *(Finding(code="sha256", where=f"depth/{n}.exr", message=f"differs from its record; {REMEDY}") for n in range(9)),
    Finding(code="missing", where="depth/nominal/img000001.exr", message=f"the file is missing; {REMEDY}"),
]
SHOW_FINDINGS = (
    "-c",
    "from tests.terminal.test_terminal import FINDINGS; from spin_usd.commands.check.command import show_findings; "
    "import sys; show_findings(FINDINGS, unfolded=len(sys.argv) > 1)",
)
SHOW_PROGRESS = (
    "-c",
    "import time; from spin_usd.terminal.progress import shown\n"
    "with shown() as progress:\n"
    "    for done in range(4): progress('rendering: picture', done, 8); time.sleep(0.1)\n",
)


def seen(written):
    """The lines without escape sequences."""
    return re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", written).replace("\r", "\n").splitlines()


def colours(written):
    """The sequences that set a colour."""
    return [codes for codes in re.findall(r"\x1b\[([0-9;]*)m", written) if re.search(r"\b(3|9)[0-7]\b", codes)]


@pytest.mark.parametrize("arguments", [HELP, SHOW_FINDINGS, SHOW_PROGRESS], ids=["help", "findings", "progress"])
def test_colours_and_escapes_are_for_terminals_that_have_them(arguments, at_terminal) -> None:
    assert colours(at_terminal(*arguments))
    assert not colours(at_terminal(*arguments, NO_COLOR="1"))
    assert "\x1b" not in at_terminal(*arguments, TERM="dumb")


@pytest.mark.parametrize("columns", [40, 80, 120])
@pytest.mark.parametrize("arguments", [HELP, SHOW_FINDINGS, SHOW_PROGRESS], ids=["help", "findings", "progress"])
def test_nothing_is_wider_than_the_terminal(arguments, columns, at_terminal) -> None:
    assert max(map(len, seen(at_terminal(*arguments, columns=columns)))) <= columns


def test_progress_has_a_rate_and_the_time_left(at_terminal) -> None:
    last = next(line for line in reversed(seen(at_terminal(*SHOW_PROGRESS))) if "3/8" in line)
    shown = re.fullmatch(r"rendering: picture .* 3/8 ([\d.]+) (per s|s each) +ETA (\d+):(\d\d):(\d\d)\s*", last)
    assert shown, last
    rate, hours, minutes, seconds = float(shown[1]), *map(int, shown.groups()[2:])
    left = 5 * rate if shown[2] == "s each" else 5 / rate
    assert 3600 * hours + 60 * minutes + seconds == pytest.approx(left, abs=1.5)  # whole seconds, one digit of the rate


def test_a_long_list_is_folded_unless_asked_for_all(at_terminal) -> None:
    folded, whole = at_terminal(*SHOW_FINDINGS), at_terminal(*SHOW_FINDINGS, "all")
    assert folded.count("depth/") - 1 == MAX_FOLDED
    assert f"{9 - MAX_FOLDED} more; --all lists them" in folded
    assert whole.count("depth/") - 1 == 9
    assert "--all" not in whole


def test_a_rule_says_once_how_many_and_what_to_do(at_terminal) -> None:
    lines = [line.strip() for line in seen(at_terminal(*SHOW_FINDINGS)) if line.strip()]
    assert lines[:3] == ["missing  1 error", f"→  {REMEDY}", "depth/nominal/img000001.exr  the file is missing"]
    assert lines[3:6] == ["sha256  9 errors", f"→  {REMEDY}", "depth/0.exr  differs from its record"]


def test_a_name_cannot_steer_the_terminal(at_terminal) -> None:
    assert r"image/\x1b[31m\u202egnp.png" in at_terminal(*SHOW_FINDINGS)


def test_a_pipe_gets_every_finding_in_a_line_and_every_rule_with_its_count(capsys) -> None:
    show_findings(FINDINGS, unfolded=False)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"error [missing]: depth/nominal/img000001.exr: the file is missing; {REMEDY}"
    assert lines[1:10] == [f"error [sha256]: depth/{n}.exr: differs from its record; {REMEDY}" for n in range(9)]
    assert lines[10].startswith(r"warning [stray]: image/\x1b[31m\u202egnp.png: ")
    assert lines[11:] == ["rule missing: 1 error", "rule sha256: 9 errors", "rule stray: 1 warning"]


def test_a_remedy_is_a_rules_where_all_its_findings_have_the_same() -> None:
    texts = {"a": ["x; do this", "y; do this"], "b": ["x; do this", "y; do that"], "c": ["x", "y; do this"], "d": ["x"]}
    findings = [Finding(code=code, where="/", message=text) for code, several in texts.items() for text in several]
    assert [rule.remedy for rule in by_rule(findings)] == ["do this", "", "", ""]
