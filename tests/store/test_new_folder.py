import os
import subprocess
import sys
from pathlib import Path

import pytest

from spin_usd.errors import StageError
from spin_usd.store.new_folder import nothing_left_of

KILLED = (
    "import os, sys; from pathlib import Path; from spin_usd.store.new_folder import new_folder\n"
    "with new_folder(Path(sys.argv[1])) as folder:\n"
    "    (folder / 'layer.usda').touch(); os.kill(os.getpid(), 9)\n"
)


def _killed_while_it_makes(out: Path) -> None:
    subprocess.run([sys.executable, "-c", KILLED, out])
    assert len(os.listdir(out.parent)) == 1
    raise StageError("the child died")


def test_a_process_that_is_killed_leaves_nothing_beside_its_folder(tmp_path) -> None:
    with pytest.raises(StageError), nothing_left_of(tmp_path / "out"):
        _killed_while_it_makes(tmp_path / "out")
    assert os.listdir(tmp_path) == []
