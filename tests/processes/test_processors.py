"""Workers share the processors out: each gets as many as any other, and none lies idle that could be given."""

import sys
from threading import Event, Thread

import pytest

from spin_usd.processes import processors
from spin_usd.processes.processors import hold_to, share_of, usable_cpus


@pytest.mark.parametrize(("cpus", "count"), [(1, 1), (2, 1), (2, 2), (2, 5), (8, 3), (8, 8), (7, 16)])
def test_each_worker_has_its_share_and_all_processors_are_used_evenly(monkeypatch, cpus, count) -> None:
    there = [3 * number for number in range(cpus)]
    monkeypatch.setattr(processors, "usable_cpus", lambda: there)
    shares = [share_of(number, count) for number in range(count)]
    used = [sum(cpu in share for share in shares) for cpu in there]
    assert {len(share) for share in shares} == {max(cpus // count, 1)}
    assert all(len(set(share)) == len(share) and set(share) <= set(there) for share in shares)
    assert max(used) - min(used) <= 1
    assert used.count(0) < count  # fewer than would give each worker one more


@pytest.mark.skipif(sys.platform != "linux", reason="other systems cannot hold a process to processors")
def test_a_process_and_its_threads_keep_to_what_it_is_held_to() -> None:
    before, told = usable_cpus(), Event()
    held: list[int] = []
    thread = Thread(target=lambda: held.extend(usable_cpus() if told.wait(10) else ()))
    thread.start()
    try:
        hold_to(before[-1:])
        assert usable_cpus() == before[-1:]
    finally:
        told.set()
        thread.join()
        hold_to(before)
    assert held == before[-1:]
