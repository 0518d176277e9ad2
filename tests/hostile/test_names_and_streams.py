"""Names that are hard to write and streams that take nothing: the command does its work, or says why not."""

import os
import resource
import shutil
import signal
import subprocess
import sys
import time

import pytest

from tests.hostile.conftest import slow

SPIN_USD = [sys.executable, "-m", "spin_usd.command_line"]
FOLDERS = ["run[1]", *map(slow, ("a b", "a'b\"c", "büro-数据", "a{b}*?", "%s"))]


@pytest.mark.parametrize("name", FOLDERS, ids=ascii)
def test_a_stage_in_a_folder_of_any_name_is_found_and_rendered(place, spin_usd, name) -> None:
    shutil.copytree(place.stage, place.folder / name / "s")
    spin_usd("render", f"{name}/s", "--renderer", "raycast", "--workers", "1", "--out", f"b{name}/d", cwd=place.folder)
    assert (place.folder / f"b{name}" / "d" / "dataset.json").is_file()


@pytest.mark.parametrize("name", [slow("run[1]"), slow("a'b"), slow("büro-数据")], ids=ascii)
def test_a_stage_is_authored_into_a_folder_of_any_name_and_checked(place, spin_usd, name) -> None:
    spin_usd(*place.author("--target", "box.obj", out=f"{name}/s"), cwd=place.folder)
    spin_usd("check", f"{name}/s", cwd=place.folder)


@pytest.mark.parametrize("command", ["check", slow("plan"), slow("author")])
def test_a_path_that_usd_cannot_hold_is_refused(place, spin_usd, command) -> None:
    """USD's paths are UTF-8. What cannot be printed is printed with escapes."""
    name = os.fsdecode(b"x\xffy")
    shutil.copytree(place.stage, place.folder / name / "s")
    given = place.author(out=f"{name}/new") if command == "author" else (command, f"{name}/s")
    refused = spin_usd(*given, cwd=place.folder, code=1 if command == "check" else 2)
    assert "UTF-8" in refused.stdout + refused.stderr
    (refused.stdout + refused.stderr).encode()


@pytest.mark.parametrize(
    "arguments",
    [
        ("reproduce", "ds", "a" * 5000),
        ("reproduce", "ds", "img000001", "--variant", "a" * 5000),
        ("check", "a" * 5000),
        ("plan", "a" * 5000),
        ("export", "a" * 5000, "--to", "coco", "--out", "x"),
    ],
    ids=lambda arguments: " ".join(arguments)[:30],
)
def test_a_name_that_is_too_long_is_refused(place, spin_usd, arguments) -> None:
    done = spin_usd(*arguments, cwd=place.folder, code=2)
    assert "internal" not in done.stderr


def test_a_file_name_forges_no_line_and_no_colour(place, spin_usd) -> None:
    for name in ("x\nerror: forged\n\x1b[31m", "\u202egpj.exe", os.fsdecode(b"\xff\xfe")):
        (place.dataset / "image" / "nominal" / name).touch()
    found = spin_usd("check", "ds", cwd=place.folder, code=0)
    printed = found.stdout + found.stderr
    assert not [line for line in printed.splitlines() if line.startswith("error: forged")]
    assert "\x1b" not in printed
    assert "\u202e" not in printed
    printed.encode()


def called(place, *arguments, shell, before=None):
    """Run the command with its streams as the shell's words say; returns exit code and standard error."""
    command = " ".join([*SPIN_USD, *arguments, shell])
    done = subprocess.run(["bash", "-c", command], cwd=place.folder, capture_output=True, text=True, preexec_fn=before)
    assert "Traceback" not in done.stderr
    assert "internal error" not in done.stderr
    return done.returncode


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shell", "codes"),
    [
        ("> /dev/full", {2}),
        ("2> /dev/full", {0}),
        ("2>&-", {0}),
        (">&-", {0, 2}),
        ("> /dev/full 2> /dev/full", {2}),
        ("| head -0; exit ${PIPESTATUS[0]}", {0, 141, 128 + signal.SIGPIPE}),
    ],
)
def test_streams_that_are_full_or_closed_change_no_finding_into_another(place, shell, codes) -> None:
    """Exit code 1 would mean findings, 3 a defect."""
    assert called(place, "check", "ds", shell=shell) in codes


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limit", "value", "codes"),
    [
        (resource.RLIMIT_AS, 8_000_000 << 10, {0}),
        (resource.RLIMIT_AS, 1_000_000 << 10, {1, 2}),
        (resource.RLIMIT_NOFILE, 12, {0, 2}),
        (resource.RLIMIT_FSIZE, 10_000, {0, 2}),
    ],
)
def test_hard_limits_are_kept_to_or_said(place, limit, value, codes) -> None:
    assert called(place, "check", "st", shell="", before=lambda: resource.setrlimit(limit, (value, value))) in codes


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP], ids=lambda number: number.name)
def test_a_signal_ends_a_render_with_a_word_and_leaves_nothing(place, number) -> None:
    process = subprocess.Popen(
        [*SPIN_USD, *place.render(out="new")],
        cwd=place.folder,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while not (place.folder / "new" / ".lock").exists() and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode in (0, 128 + number), said
    assert process.returncode == 0 or f"stopped by {number.name}" in said
    assert not (place.folder / "new" / ".work").exists()
