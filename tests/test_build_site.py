"""The site of the documents: Sphinx builds it without a warning, and it has a page of all that the code offers."""

import importlib
import re
import subprocess
import sys

import numpy as np
import pytest

import spin_usd
from spin_usd.command_line import app
from spin_usd.commands.check.rules import RULES
from spin_usd.exchange.table import EXPORT_FORMATS
from spin_usd.labels.table import LABELS
from spin_usd.renderers.embree.face_findings import face_findings
from spin_usd.stage.augment.parameters import PARAMETERS
from tests.cases.scenes import box, target
from tests.conftest import REPOSITORY

PYTHON = REPOSITORY / ".venv-docs" / "bin" / "python"
SCHEMAS = [path.name.removesuffix(".schema.json") for path in (REPOSITORY / "schemas").glob("*.json")]
OFFERED = {
    "commands": [command.callback.__name__ for command in app.registered_commands],
    "python": [f"spin_usd.{name}" for name in spin_usd.__all__ if name.islower() and not name.startswith("_")],
    "labels": list(LABELS),
    "parameters": list(PARAMETERS),
    "troubleshooting": list(RULES),
    "formats": list(EXPORT_FORMATS),
    "bundled": [path.stem for path in (REPOSITORY / "stages" / "cameras").glob("*.usda")],
    "schemas": SCHEMAS,
}
"""What each page of the reference has a heading or a row of."""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    if not PYTHON.is_file():
        pytest.skip("no .venv-docs; tools/docs_environment makes it")
    out = tmp_path_factory.mktemp("built") / "site"
    built = subprocess.run([PYTHON, REPOSITORY / "tools" / "build_site", "--out", out], capture_output=True, text=True)
    assert built.returncode == 0, built.stdout + built.stderr
    return out


@pytest.mark.campaign
def test_every_document_is_a_page(site) -> None:
    for document in (REPOSITORY / "docs").rglob("*.md"):
        assert (site / document.relative_to(REPOSITORY)).with_suffix(".html").is_file(), document


@pytest.mark.campaign
@pytest.mark.parametrize("page", OFFERED)
def test_the_reference_has_all_that_the_code_offers(site, page) -> None:
    text = re.sub(r"<[^>]*>", "", (site / "docs" / "reference" / f"{page}.html").read_text())
    missing = [name for name in OFFERED[page] if not re.search(rf"\b{re.escape(name)}\b", text)]
    assert OFFERED[page]
    assert not missing


@pytest.fixture(scope="module")
def troubleshooting():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(REPOSITORY / "tools")
        yield importlib.import_module("pages.troubleshooting")


@pytest.fixture(scope="module")
def messages(troubleshooting):
    """What is found and what to do, of every message in the code, which is read once."""
    return list(troubleshooting.messages())


def test_the_page_of_messages_has_every_rule_with_what_to_do(troubleshooting) -> None:
    rows = [row.replace("\\", "") for row in troubleshooting.page().splitlines()]
    for code, rule in RULES.items():
        assert f"| `{code}` | {rule.meaning} | {rule.remedy} |" in rows


WRONG = {
    "no dataset": lambda folder: spin_usd.Dataset(folder),
    "no format": lambda folder: spin_usd.export(folder, to="tape", out=folder / "out"),
    "no stage": lambda folder: spin_usd.plan(folder / "stage"),
    "no shards": lambda folder: spin_usd.merge([], out=folder / "out"),
}


@pytest.mark.parametrize("ask", WRONG.values(), ids=WRONG)
def test_the_page_of_messages_has_what_users_read(messages, ask, tmp_path) -> None:
    with pytest.raises(spin_usd.SpinError) as raised:
        ask(tmp_path)
    assert [found for found, do in messages if do and _is_of(raised.value.found, found) and _is_of(raised.value.do, do)]


def test_the_page_of_messages_has_what_is_noted(messages) -> None:
    """By the words that `author` and `check` print; what to do is the rule's."""
    points, faces = box()
    (noted,) = face_findings(target(points, np.concatenate([faces, faces])))
    remedies = [do for found, do in messages if _is_of(noted.message, found)]
    assert remedies == [RULES[noted.code].remedy]


def _is_of(text, stem) -> bool:
    return re.fullmatch(".*".join(map(re.escape, stem.split("…"))), text) is not None


def test_a_folder_of_other_things_is_kept(tmp_path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    command = [sys.executable, REPOSITORY / "tools" / "build_site", "--out", tmp_path]
    refused = subprocess.run(command, capture_output=True, text=True)
    assert refused.returncode == 2
    assert "has other things than a site in it" in refused.stderr
    assert (tmp_path / "mine.txt").read_text() == "mine"
