"""What a real shell completes when Tab is pressed."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

BASH = """
source <(_SPIN_USD_COMPLETE=source_bash spin-usd)
read -ra COMP_WORDS <<< "$1"
[[ $1 == *" " ]] && COMP_WORDS+=("")
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
completer=$(complete -p spin-usd | sed 's/.*-F \\([^ ]*\\) .*/\\1/')
$completer spin-usd "${COMP_WORDS[COMP_CWORD]}"
printf '%s\\n' "${COMPREPLY[@]}"
"""
LOADED = """
import atexit, sys
atexit.register(lambda: print(*{name.partition(".")[0] for name in sys.modules}, file=sys.stderr))
from spin_usd.command_line import run
run()
"""
HEAVY = {"annotated_types", "jsonschema", "numpy", "psutil", "pydantic", "rich", "scipy", "trimesh", "viser"}


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """What completion reads of a dataset, with names in it that a shell would take for more than a word."""
    folder = tmp_path_factory.mktemp("completed") / "dataset"
    (folder / "records" / "nominal").mkdir(parents=True)
    for name in ("img000001", "img000002", "evil$(id)", "two words", "new\nline"):
        (folder / "records" / "nominal" / f"{name}.json").touch()
    (folder / "dataset.json").write_text('{"variants": ["nominal", "noisy_1", "`id`"]}')
    return folder


@pytest.fixture(scope="module")
def completed():
    """What bash offers for a line that ends where the cursor is."""
    if shutil.which("bash") is None:
        pytest.skip("no bash")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"

    def complete(line):
        command = ["bash", "--norc", "--noprofile", "-c", BASH, "bash", line]
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PATH": path}, check=True)
        assert done.stderr == ""
        return done.stdout.split()

    return complete


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("spin-usd re", ["render", "reproduce"]),
        ("spin-usd check --cross-", ["--cross-pictures"]),
        ("spin-usd author --frames 1 --frames 2 --target t", ["tango"]),
        ("spin-usd author --camera spa", ["spacesense", "spades", "spark"]),
        ("spin-usd render missing/stage --quality ", ["preview", "draft", "standard", "reference"]),
        ("spin-usd show DATASET --images ", ["jpeg", "small", "original"]),
        ("spin-usd render stage --device c", ["cuda", "cpu"]),
        ("spin-usd export --to spe", ["speedplus", "speed"]),
        ("spin-usd reproduce DATASET img", ["img000001", "img000002"]),
        ("spin-usd reproduce DATASET img000001 --variant no", ["nominal", "noisy_1"]),
        ("spin-usd reproduce missing img", []),
        ("spin-usd check ", []),  # bash goes on with the names of files
    ],
)
def test_bash_completes_commands_options_and_names(line, offered, completed, dataset) -> None:
    assert completed(line.replace("DATASET", str(dataset))) == offered


def test_names_in_a_dataset_that_are_more_than_a_word_are_not_offered(completed, dataset) -> None:
    assert completed(f"spin-usd reproduce {dataset} ") == ["img000001", "img000002"]


@pytest.mark.parametrize("line", ["spin-usd pl", "spin-usd author --target t", "spin-usd plan --quality "])
def test_completing_loads_nothing_heavy(line) -> None:
    words = {"COMP_WORDS": line, "COMP_CWORD": str(line.count(" ")), "_SPIN_USD_COMPLETE": "complete_bash"}
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, env={**os.environ, **words})
    assert done.stdout.strip()
    assert not HEAVY & set(done.stderr.split())


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_script_is_there_for_each_shell_and_the_shell_can_read_it(shell) -> None:
    environment = {**os.environ, "_SPIN_USD_COMPLETE": f"source_{shell}"}
    command = [sys.executable, "-m", "spin_usd.command_line"]
    script = subprocess.run(command, capture_output=True, text=True, env=environment, check=True).stdout
    assert "_SPIN_USD_COMPLETE" in script
    if shutil.which(shell):
        subprocess.run([shell, "-n"], input=script, text=True, check=True)
