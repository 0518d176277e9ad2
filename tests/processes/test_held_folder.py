"""A killed process leaves its folder, which the next one removes; nobody removes that of a living one."""

import fcntl
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from spin_usd.processes.held_folder import HeldFolder

HOLD = "from spin_usd.processes.held_folder import HeldFolder; folder = HeldFolder(); print(folder.name, flush=True); "


def holder(after: str, place: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", HOLD + after], env={"TMPDIR": str(place)}, stdin=-1, stdout=-1, text=True
    )


def test_what_a_killed_process_left_is_removed_by_the_next(tmp_path) -> None:
    others = tmp_path / "spin_usd-of-another-kind"
    others.mkdir()
    with holder("input()", tmp_path) as living, holder("input()", tmp_path) as killed:
        alive, left = (Path(each.stdout.readline().strip()) for each in (living, killed))
        killed.send_signal(signal.SIGKILL)
        killed.wait()
        (left / "sub").mkdir()
        assert left.is_dir()
        with holder("folder.cleanup()", tmp_path) as after:
            own = Path(after.stdout.readline().strip())
        assert {*tmp_path.iterdir()} == {alive, others}
        assert not own.exists()
        living.kill()


def test_no_other_process_finds_a_folder_before_it_is_locked(tmp_path, monkeypatch) -> None:
    """A process that starts between the two would take it for a leftover, and remove it."""
    found = []
    flock = fcntl.flock
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def locked(*given) -> None:
        found.append({*tmp_path.glob("*/.held")})
        flock(*given)

    monkeypatch.setattr(fcntl, "flock", locked)
    folder = HeldFolder()
    assert found == [set()]
    assert {*tmp_path.glob("*/.held")} == {Path(folder.name, ".held")}
    folder.cleanup()
