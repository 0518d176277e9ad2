"""tools/fuzz: it sees what breaks a promise, and a short run of it finds nothing that does."""

import subprocess
import sys

import pytest

from tests.conftest import REPOSITORY


@pytest.fixture
def fuzzing(monkeypatch):
    """Its modules, which lie beside the tool."""
    monkeypatch.syspath_prepend(REPOSITORY / "tools")


@pytest.fixture
def sandbox(fuzzing, tmp_path):
    from fuzzing.sandbox import Sandbox

    (tmp_path / "seeds").mkdir()
    (tmp_path / "seeds" / "texture.png").write_bytes(b"png")
    return Sandbox(tmp_path / "sandbox", tmp_path / "seeds")


@pytest.mark.skipif(sys.platform != "linux", reason="files that are only read are seen by inotify")
def test_what_is_only_read_outside_is_an_escape(sandbox) -> None:
    sandbox.begin()
    (sandbox.outside / "secret.json").read_text()
    sandbox.end()
    assert "opened: outside/secret.json" in sandbox.escapes()


def test_what_is_deleted_or_made_outside_is_an_escape(sandbox) -> None:
    sandbox.begin()
    (sandbox.outside / "run.tmp-1").unlink()
    (sandbox.outside / "new").touch()
    sandbox.end()
    assert {"changed: outside/run.tmp-1", "changed: outside/new"} <= set(sandbox.escapes())


def test_what_the_user_had_and_what_stays_behind_are_losses(sandbox) -> None:
    sandbox.write("ds/thesis.txt", "precious")
    sandbox.write("ds/record.json", "{}")
    sandbox.begin()
    sandbox.write("ds/record.json", "[]")
    sandbox.write("ds/thesis.txt", "gone")
    sandbox.write(".out.123", "")
    sandbox.end()
    assert sandbox.losses(("ds",)) == ["lost: work/ds/thesis.txt", "left: work/.out.123"]
    assert sandbox.escapes() == []


@pytest.mark.parametrize(
    ("code", "err", "verdict"),
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
def test_each_end_of_a_command_has_its_verdict(fuzzing, code, err, verdict) -> None:
    from fuzzing.attempt import verdict_of
    from fuzzing.running.ended import Ended, call

    assert verdict_of(call("check", "x"), Ended(code=code, out="", err=err, seconds=0)) == verdict


def test_the_corpus_has_its_classes_and_each_input_its_own_name(fuzzing) -> None:
    from fuzzing.corpus.corpus import corpus

    titles = [trial.title for trial in corpus()]
    assert len(titles) == len(set(titles)) >= 300
    assert {title.partition("/")[0] for title in titles} == {
        *("paths", "links", "special files", "cycles", "bombs", "numbers", "indices", "counts", "nesting", "names"),
        *("encodings", "limits", "signals"),
    }


def test_a_campaign_goes_on_where_its_log_ends(fuzzing, tmp_path) -> None:
    """And tries again what failed; a part of a line, which a kill leaves, is no line."""
    from fuzzing.log import Log
    from fuzzing.trial import Outcome, Trial, Verdict

    file = tmp_path / "log"
    log = Log(file, seed=3)
    for name, verdict in (("1", Verdict.REFUSED), ("2", Verdict.HANG), ("3", Verdict.HANG), ("3", Verdict.FINE)):
        trial = Trial(kind="usda", name=name, prepare=lambda sandbox: [])
        log.add(trial, Outcome(verdict=verdict, commands=(), why="", seconds=1))
    whole = file.read_text()
    file.write_text(whole + whole[:40])
    results = Log(file, seed=3).results()
    assert [results.held(f"usda/{name}") for name in range(1, 5)] == [True, False, True, False]
    assert results.by_kind == {"usda": {Verdict.REFUSED: 1, Verdict.HANG: 1, Verdict.FINE: 1}}
    with pytest.raises(SystemExit, match="seed 3"):
        Log(file, seed=4)


@pytest.mark.slow
def test_every_good_file_is_accepted_before_it_is_mutated(fuzzing, tmp_path, monkeypatch) -> None:
    """Else its mutants would be refused for another reason than what was done to them."""
    from fuzzing.campaign import Campaign
    from fuzzing.mutation import mutants
    from fuzzing.mutation.subjects import SUBJECTS
    from fuzzing.trial import Verdict

    monkeypatch.setattr(mutants, "_changed", lambda source, rng: source.read_bytes())
    campaign = Campaign(tmp_path, keep=None, seed=0, workers=1)
    campaign.try_all(mutants.mutant(subject, 0, number) for subject in SUBJECTS for number in range(3))
    seen = {kind: set(verdicts) for kind, verdicts in campaign.results.by_kind.items()}
    assert {kind: found for kind, found in seen.items() if not found <= {Verdict.FINE, Verdict.FINDINGS}} == {}


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_short_run_finds_nothing(tmp_path) -> None:
    command = [sys.executable, REPOSITORY / "tools" / "fuzz.py", "--minutes", "0.5", "--keep", tmp_path]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "| all |" in done.stdout
