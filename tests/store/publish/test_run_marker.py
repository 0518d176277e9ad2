"""Who writes to a URL second is told, and a killed run's marker holds nobody up for long."""

import json
import os
import platform
import time

import pytest

from spin_usd.errors import InputError
from spin_usd.store.publish.dataset_url import MARKER, DatasetUrl
from spin_usd.store.publish.mirror import OVER_S, marked


@pytest.fixture
def url(tmp_path):
    pytest.importorskip("fsspec")
    return DatasetUrl(f"file://{tmp_path}/dataset")


def test_a_second_run_is_refused_until_the_first_has_ended(url) -> None:
    with marked(url):
        assert url.names() == []  # the marker is no file of the dataset
        on = rf"another run \(process {os.getpid()} on {platform.node()}\)"
        with pytest.raises(InputError, match=on), marked(url):
            pass
        assert url.read(MARKER)
    with marked(url):
        pass
    assert url.read(MARKER) is None


@pytest.mark.parametrize(
    ("said", "refused"),
    [
        ({"process": 2**22 + 1}, False),  # no process has that number: it was killed
        ({"host": "elsewhere"}, True),
        ({"host": "elsewhere", "time": time.time() - 2 * OVER_S}, False),
        ({"process": "none"}, False),
    ],
)
def test_what_was_killed_is_over(url, tmp_path, said, refused) -> None:
    first = {"token": "a", "host": platform.node(), "process": os.getpid(), "time": time.time()}
    (tmp_path / "marker").write_text(json.dumps(first | said))
    url.put(MARKER, tmp_path / "marker")
    if refused:
        with pytest.raises(InputError, match="on elsewhere"), marked(url):
            pass
    else:
        with marked(url):
            pass
