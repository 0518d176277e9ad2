"""Waiting for a descriptor, also one whose number select(2) does not take."""

import fcntl
import os
import resource

import pytest

from spin_usd.processes.readable import readable

HIGH = 1500


@pytest.fixture(params=[3, HIGH])
def pipe(request):
    """A pipe whose reading end has that number at least."""
    if resource.getrlimit(resource.RLIMIT_NOFILE)[0] <= HIGH:
        pytest.skip("so many files may not be open (ulimit -n)")
    first, write = os.pipe()
    read = fcntl.fcntl(first, fcntl.F_DUPFD, request.param)
    yield read, write
    for each in {first, read}:
        os.close(each)


def test_what_is_written_and_the_end_are_readable(pipe) -> None:
    read, write = pipe
    assert not readable(read, 0.01)
    os.write(write, b"x")
    assert readable(read, 0)
    assert os.read(read, 2) == b"x"
    os.close(write)
    assert readable(read, 0)
    assert os.read(read, 2) == b""
