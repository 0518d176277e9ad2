"""Mutants as trials: the same seed and number give the same mutant."""

import hashlib
import json
import random
from collections.abc import Iterable, Iterator
from functools import partial
from itertools import count
from pathlib import Path

from fuzzing.mutation.archives import WHOLE
from fuzzing.mutation.mutators import mutated
from fuzzing.mutation.subjects import SUBJECTS, Subject
from fuzzing.running.ended import Command
from fuzzing.sandbox import Sandbox
from fuzzing.trial import Trial

INSIDE = 0.5  # of mutants of archives whose archive is whole
SEALED = 0.7  # of mutants of datasets whose digests agree


def mutants(seed: int, *, first: int = 0) -> Iterator[Trial]:
    """Mutants without end: one of each subject in turn."""
    for number in count(first):
        for subject in SUBJECTS:
            yield mutant(subject, seed, number)


def mutant(subject: Subject, seed: int, number: int) -> Trial:
    """The mutant of this number."""
    return Trial(kind=subject.name, name=str(number), prepare=partial(_prepare, subject, seed, number))


def mutant_named(title: str, seed: int) -> Trial | None:
    """The mutant that is called `title`, such as usda/17, or None."""
    kind, _, number = title.rpartition("/")
    subject = next((each for each in SUBJECTS if each.name == kind), None)
    return mutant(subject, seed, int(number)) if subject and number.isdecimal() else None


def _prepare(subject: Subject, seed: int, number: int, sandbox: Sandbox) -> Iterable[Command]:
    rng = random.Random(f"{seed}/{subject.name}/{number}")
    source = rng.choice(subject.found(sandbox.seeds))
    for name in subject.takes:
        sandbox.take(name)
    name = str(source.relative_to(sandbox.seeds))
    content = _changed(source, rng)
    sandbox.write(name, content)
    if subject.name.startswith("texture"):
        stage = (sandbox.seeds / "stage.usda").read_text().replace("texture.png", name)
        sandbox.write("stage.usda", stage)
        name = "stage.usda"
    if subject.sealed and rng.random() < SEALED:
        seal(sandbox.work / "ds")
    return [Command(arguments=tuple(word.replace("{file}", name) for word in rng.choice(subject.commands)))]


def _changed(source: Path, rng: random.Random) -> bytes:
    data, whole = source.read_bytes(), WHOLE.get(source.suffix)
    if whole and rng.random() < INSIDE:
        return whole(data, rng, mutated)
    return mutated(data, rng)


def seal(dataset: Path) -> None:
    """Make the digests of pictures' files and of the stage's right, as whoever wrote the dataset can."""
    for record_file in dataset.glob("records/*/*.json"):
        record = json.loads(record_file.read_text())
        for entry in record["files"].values():
            entry["sha256"] = hashlib.sha256((dataset / entry["path"]).read_bytes()).hexdigest()
        stage = dataset / "stage"
        files = record["provenance"]["stage"]["files"]
        record["provenance"]["stage"]["files"] = {
            name: hashlib.sha256((stage / name).read_bytes()).hexdigest() for name in files
        }
        record_file.write_text(json.dumps(record, indent=1))
