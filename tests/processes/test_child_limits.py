import os
import resource
import subprocess
import sys

import pytest

from spin_usd.processes import child_limits
from spin_usd.processes.child import Child

pytestmark = pytest.mark.children


HARD = 6 << 30  # bytes, less than half of most machines' memory

ASKED = (
    "import resource; from spin_usd.processes.child import Child\n"
    "from spin_usd.processes.open_renderer import TRY_RENDERER\n"
    "with Child() as child:\n"
    "    print(*resource.prlimit(child.process.pid, resource.RLIMIT_AS))\n"
    "    print(child.call(TRY_RENDERER, 'raycast'))\n"
)


@pytest.mark.parametrize("given", [(HARD, HARD), (HARD, resource.RLIM_INFINITY)])
def test_a_child_takes_no_more_than_whoever_started_us_allows(given) -> None:
    """Only root may raise a hard limit, and a soft one is somebody's wish."""
    limited = subprocess.run(
        [sys.executable, "-c", ASKED],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, given),
        capture_output=True,
        text=True,
        check=True,
    )
    taken, answer = limited.stdout.splitlines()
    assert all(0 < int(each) <= HARD for each in taken.split())
    assert "embreex" in answer


def test_every_child_has_a_limit_and_leaves_no_core_file() -> None:
    with Child() as child:
        taken = resource.prlimit(child.process.pid, resource.RLIMIT_AS)
        assert taken == (child_limits.reading_memory(),) * 2
        assert resource.prlimit(child.process.pid, resource.RLIMIT_CORE) == (0, 0)


def test_no_child_may_have_more_than_the_machine() -> None:
    assert 0 < child_limits.machine_memory() <= os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


@pytest.mark.parametrize(
    ("limit", "most", "word"),
    [(resource.RLIMIT_AS, 1 << 30, "ulimit -v"), (resource.RLIMIT_NOFILE, 12, "ulimit -n")],
)
def test_a_limit_that_leaves_no_room_is_one_sentence(limit, most, word) -> None:
    refused = subprocess.run(
        [sys.executable, "-m", "spin_usd.command_line", "check", "/tmp"],
        preexec_fn=lambda: resource.setrlimit(limit, (most, most)),
        capture_output=True,
        text=True,
    )
    assert refused.returncode == 2
    assert word in refused.stderr
    assert refused.stderr.count("\n") == 1
