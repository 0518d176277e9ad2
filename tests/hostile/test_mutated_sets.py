"""Data sets of others whose lists have a few values, lines or bytes changed: findings or a sentence, in any layout."""

import json
import random
import re
import shutil
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from spin_usd import check
from spin_usd.audit.list_rules import list_findings
from spin_usd.audit.posed_targets import AuditedPicture, AuditedSet
from spin_usd.errors import SpinError
from spin_usd.exchange.sets.table import read_set
from tests.cases.foreign_sets import LAYOUTS

SECONDS = 36.0  # of the slow test, over all layouts
LISTS = (".json", ".csv", ".txt", ".yaml")
VALUES: list[Any] = [
    None, True, "", "x", "../../etc/passwd", "/etc/passwd", "\x1b[31m\n\x00",
    -1, 0, 1, 1e308, -1e-320, 10**400, float("nan"),
    float("inf"), float("-inf"), [], {}, [[]], [None], [1, 2], {"id": 1}, "1e999", "9" * 5000, [float("nan")] * 12,
]  # fmt: skip
CELLS = [
    "",
    "nan",
    "inf",
    "-1e308",
    "1e999",
    "9" * 5000,
    "x",
    '"',
    "../..",
    "[1, 2]",
    "[]",
    "\x00",
    "(1,2,3,4,5)",
    ",,,,,",
]


def lists(folder: Path) -> list[Path]:
    """Return the lists that readers of the layout look into."""
    names = ("export.json", "pictures.csv", "README.md")
    return sorted(path for path in folder.rglob("*") if path.suffix in LISTS and path.name not in names)


def places(document, found):
    """Return each (container, key) of a JSON document."""
    for key in list(document) if isinstance(document, dict) else range(len(document)):
        found.append((document, key))
        if isinstance(document[key], dict | list):
            places(document[key], found)
    return found


def mutated_json(text: str, rng: random.Random) -> str:
    document = json.loads(text)
    for _ in range(rng.randint(1, 3)):
        found = places(document, [])
        if not found:
            break
        container, key = rng.choice(found)
        kind = rng.random()
        if kind < 0.7:
            container[key] = rng.choice(VALUES)
        elif kind < 0.85:
            del container[key]
        elif isinstance(container, list):
            container.insert(key, container[key])
        else:
            container[rng.choice(("x", "\u202e", str(key) * 2))] = container.pop(key)
    return json.dumps(document)


def mutated_text(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    for _ in range(rng.randint(1, 3)):
        line = rng.randrange(len(lines))
        kind = rng.random()
        if kind < 0.6:
            cells = re.split(r"([, ]+)", lines[line])
            cells[rng.randrange(len(cells))] = rng.choice(CELLS)
            lines[line] = "".join(cells)
        elif kind < 0.8:
            lines.insert(line, rng.choice(lines))
        elif len(lines) > 1:
            del lines[line]
    return "\n".join(lines)


def mutate(path: Path, rng: random.Random) -> None:
    """Change values of a list, or one time of five its bytes."""
    data = path.read_bytes()
    if rng.random() < 0.2:
        wrong = bytearray(data)
        for _ in range(rng.randint(1, 4)):
            wrong[rng.randrange(len(wrong))] = rng.randrange(256)
        path.write_bytes(wrong[: rng.randrange(len(wrong))] if rng.random() < 0.3 else wrong)
    elif path.suffix == ".json":
        path.write_text(mutated_json(data.decode(), rng))
    else:
        path.write_text(mutated_text(data.decode(), rng))


def check_mutated(foreign_sets, folder, name, seed, *, whole) -> None:
    """Read the set with one changed list, and hold its lists to the rules; whole: check and repair it too. Any other
    error than a SpinError is one of ours, and fails the test."""
    source = foreign_sets.export(name)
    rng = random.Random(f"{name} {seed}")
    path = rng.choice(lists(source))
    changed = folder / path.relative_to(source)
    mutate(changed, rng)
    layout = LAYOUTS[name].read_as
    try:
        with suppress(SpinError):
            labels, _, _ = read_set(folder, layout)
            pictures = [AuditedPicture(labels=each, measures=None) for each in labels.pictures]
            list(list_findings(AuditedSet(labels=labels, pictures=pictures)))
        with suppress(SpinError):
            if whole:
                out = folder.with_name("out")
                check(folder, layout=layout, repair_to=out, **foreign_sets.options(name))
    except Exception as error:
        error.add_note(f"{name}, seed {seed}: {changed.relative_to(folder)}")
        raise
    shutil.rmtree(folder.with_name("out"), ignore_errors=True)
    shutil.copyfile(path, changed)


@pytest.mark.parametrize("name", ["speedplus", "coco", "bop", "urso", "yolo pose", "spark 2021", "kitti"])
def test_a_few_mutated_lists_of_each_kind(foreign_sets, tmp_path, name) -> None:
    folder = foreign_sets.copy(name, tmp_path / "set")
    for seed in range(40):
        check_mutated(foreign_sets, folder, name, seed, whole=False)


@pytest.mark.slow
@pytest.mark.parametrize("name", LAYOUTS)
def test_mutated_lists(foreign_sets, tmp_path, name) -> None:
    """As many as fit into the time; one of 32 with its pixels."""
    folder = foreign_sets.copy(name, tmp_path / "set")
    start, seed = time.monotonic(), 1000
    while time.monotonic() - start < SECONDS / len(LAYOUTS):
        check_mutated(foreign_sets, folder, name, seed, whole=seed % 32 == 0)
        seed += 1
    assert seed > 1000
