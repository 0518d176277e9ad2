"""tools/fuzz: it sees what breaks a promise, and a short run of it finds nothing that does."""

import subprocess
import sys
from functools import partial

import pytest

from tests.conftest import REPOSITORY

sys.path.insert(0, str(REPOSITORY / "tools"))
from fuzz import Sandbox, Verdict, attempt, verdict_of
from fuzz_inputs import SUBJECTS, make_seeds, mutate


@pytest.fixture
def sandbox(tmp_path):
    return Sandbox(tmp_path / "sandbox")


def test_what_is_only_read_outside_is_an_escape(sandbox) -> None:
    sandbox.begin()
    (sandbox.outside / "secret.json").read_text()
    assert list(sandbox.faults()) == [(Verdict.ESCAPE, "read: outside/secret.json")]


def test_what_is_changed_deleted_or_made_outside_is_an_escape(sandbox) -> None:
    sandbox.begin()
    (sandbox.outside / "secret.json").unlink()
    (sandbox.outside / "secret.mtl").write_text("mine")
    (sandbox.outside / "new").touch()
    said = {f"{what}: outside/{name}" for what, name in (("changed", "secret.json"), ("changed", "secret.mtl"))}
    assert set(sandbox.faults()) == {(Verdict.ESCAPE, each) for each in (*said, "made: outside/new")}


def test_what_the_user_had_and_what_stays_behind_are_losses(sandbox) -> None:
    (sandbox.work / "ds").mkdir()
    for name in ("poses.json", "ds/record.json"):
        (sandbox.work / name).write_text("{}")
    sandbox.begin()
    (sandbox.work / "poses.json").unlink()
    (sandbox.work / "ds" / "record.json").write_text("[]")
    (sandbox.work / "ds" / "thesis.txt").write_text("gone")
    (sandbox.work / ".out.123").touch()
    (sandbox.folder / "tmp" / "left").touch()
    said = ["lost: work/ds/thesis.txt", "lost: work/poses.json", "left: tmp/left", "left: work/.out.123"]
    assert list(sandbox.faults()) == [(Verdict.LOSS, each) for each in said]


@pytest.mark.parametrize(
    ("code", "said", "verdict"),
    [
        (0, "", "fine"),
        (1, "", "findings"),
        (2, "spin-usd: no", "refused"),
        (3, "spin-usd: internal error: KeyError: 'a'", "tracebacks"),
        (2, "Traceback (most recent call last)", "tracebacks"),
        (-11, "", "crashes"),
        (None, "", "hangs"),
        (2, "spin-usd: \x1b[31mred", "escapes"),
    ],
)
def test_each_end_of_a_command_has_its_verdict(code, said, verdict) -> None:
    assert verdict_of(code, said) == verdict


@pytest.mark.campaign
@pytest.mark.timeout(600)
def test_every_good_file_is_accepted_and_the_same_chance_gives_the_same_mutant(tmp_path, monkeypatch) -> None:
    """Else its mutants would be refused for another reason than what was done to them."""
    seeds = tmp_path / "seeds"
    seeds.mkdir()
    make_seeds(seeds)
    for subject in SUBJECTS:
        made = []
        for folder in (tmp_path / "a" / subject.name, tmp_path / "b" / subject.name):
            folder.mkdir(parents=True)
            mutate(subject, seeds, folder, "1")
            made.append({p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()})
        assert made[0] == made[1]
    monkeypatch.setattr("fuzz.mutate", partial(mutate, change=lambda data, rng: data))
    monkeypatch.setenv("SPIN_USD_IN_PROCESS", "1")
    outcomes = [attempt(subject, seeds, 0, 0, None) for subject in SUBJECTS]
    assert [each for each in outcomes if each.verdict not in (Verdict.FINE, Verdict.FINDINGS)] == []


@pytest.mark.campaign
@pytest.mark.timeout(600)
def test_a_short_run_finds_nothing(tmp_path) -> None:
    command = [sys.executable, REPOSITORY / "tools" / "fuzz.py", "--minutes", "0.5", "--keep", tmp_path]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "| all |" in done.stdout
