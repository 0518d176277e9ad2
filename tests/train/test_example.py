"""The docs' loops of PyTorch as they stand, and FreshDataset in its loader."""

import itertools
import json
import re
import subprocess

import pytest

from tests.conftest import REPOSITORY
from tests.train.conftest import PYTHON

pytestmark = pytest.mark.slow


@pytest.fixture
def printed(tmp_path):
    """What a program prints when .venv-train runs it on `tmp_path`."""
    if not PYTHON.is_file():
        pytest.skip("no .venv-train; tools/train_environment makes it")

    def run(program, *arguments):
        command = [PYTHON, REPOSITORY / "docs" / program, *(arguments or [tmp_path])]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    return run


def test_the_example_of_pytorch_learns(printed) -> None:
    off = [float(number) for number in re.findall(r"are (\S+) pixels off", printed("train_pytorch.py"))]
    assert len(off) == 3
    assert off[-1] < off[0] / 3


def test_the_example_of_events_learns(printed) -> None:
    if subprocess.run([PYTHON, "-c", "import h5py"], check=False).returncode:
        pytest.skip("no .venv-train with h5py; tools/train_environment makes it")
    off = [float(number) for number in re.findall(r"is (\S+) m off", printed("train_events.py"))]
    assert len(off) == 5
    assert off[-1] < off[0] / 2


LOADERS = """
import hashlib, json, sys
from torch.utils.data import DataLoader
from spin_usd import FreshDataset

def digest(batch):
    return hashlib.sha256(batch["image"].tobytes()).hexdigest()

if __name__ == "__main__":
    fresh = FreshDataset(*sys.argv[1:], seed=5).crop(size=32)[:6]
    found = []
    several = (2, "fork", False), (2, "fork", True), (1, "forkserver", True), (2, "spawn", True)
    for workers, method, lasting in [(0, None, False), *several]:
        context = {"multiprocessing_context": method, "persistent_workers": lasting} if workers else {}
        loader = DataLoader(fresh, batch_size=2, num_workers=workers, collate_fn=fresh.collate, **context)
        epochs = []
        for epoch in (2, 0, 1):
            fresh.set_epoch(epoch)
            next(iter(loader))  # an epoch that is broken off
            fresh.set_epoch(epoch + 10)
            epochs.append([digest(batch) for batch in loader])
        found.append(epochs)
    print(json.dumps(found))
"""


def test_the_loop_of_fresh_pictures_has_others_in_each_epoch(printed, tmp_path) -> None:
    assert len({*re.findall(r"48 images of mean (\S+),", printed("train_fresh.py"))}) == 3
    program = tmp_path / "loaders.py"
    program.write_text(LOADERS)
    alone, *loaders = json.loads(printed(program, tmp_path / "dataset", tmp_path / "fresh.toml"))
    assert len({*itertools.chain(*alone)}) == 3 * 3  # each batch of each epoch is another
    assert loaders == [alone] * 4
