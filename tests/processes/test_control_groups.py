"""Limits of control groups, in both versions: files as the kernel writes them, and a group of this machine."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from spin_usd.processes import child_limits, control_groups, processors

FIRST = {"cpu/cpu.cfs_quota_us": "150000", "cpu/cpu.cfs_period_us": "100000", "memory/memory.limit_in_bytes": "3000000"}
SECOND = {"cpu.max": "150000 100000", "memory.max": "3000000"}


@pytest.mark.parametrize(("lines", "files"), [("4:cpu,cpuacct:/a/b\n3:memory:/a/b\n", FIRST), ("0::/a/b\n", SECOND)])
def test_the_tightest_group_counts(monkeypatch, tmp_path, lines, files) -> None:
    monkeypatch.setattr(control_groups, "OWN", tmp_path / "own")
    monkeypatch.setattr(control_groups, "CGROUPS", tmp_path)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {*range(0, 16, 2)})
    (tmp_path / "own").write_text(lines)
    assert processors.usable_cpus() == [*range(0, 16, 2)]
    for name, content in files.items():
        controller, _, file = name.rpartition("/")
        for group, text in (("", content.replace("150000", "-1" if controller else "max")), ("a", content)):
            (tmp_path / controller / group).mkdir(parents=True, exist_ok=True)
            (tmp_path / controller / group / file).write_text(text + "\n")
    assert len(processors.usable_cpus()) == 2  # one and a half
    assert child_limits.machine_memory() == 3000000


def test_a_quota_of_this_machine_is_kept() -> None:
    group = Path("/sys/fs/cgroup/cpu/spin_usd_test")
    if len(processors.usable_cpus()) < 2 or not os.access(group.parent, os.W_OK):
        pytest.skip("one processor, or groups that cannot be made here")
    try:
        group.mkdir()
        (group / "cpu.cfs_quota_us").write_text("100000")
    except OSError:
        pytest.skip("groups cannot be made here")
    program = f"""
import os; open("{group}/tasks", "w").write(str(os.getpid()))
from spin_usd.processes.processors import usable_cpus; print(len(usable_cpus()))"""
    try:
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    finally:
        group.rmdir()
    assert done.stdout == "1\n"
