"""The figures in the documents: tools/build_docs writes them, and says which are no longer what was measured."""

import json
import re
import runpy
import sys

import pytest

from tests.conftest import REPOSITORY

DOCUMENTS = (REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md")))


@pytest.fixture
def program(monkeypatch):
    """The names in tools/build_docs."""
    monkeypatch.syspath_prepend(REPOSITORY / "tools")
    return runpy.run_path(str(REPOSITORY / "tools" / "build_docs"))


@pytest.fixture
def build_docs(program, monkeypatch):
    """Run it with these arguments; returns what it exits with: 0, or what is to be said."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["build_docs", *map(str, arguments)])
        try:
            program["main"]()
        except SystemExit as end:
            return end.code or 0
        return 0

    return run


def test_the_documents_have_every_block_of_figures_once(program) -> None:
    found = [
        name
        for document in DOCUMENTS
        for name in re.findall(r"^<!-- generated: (\w+) -->$", document.read_text(), re.MULTILINE)
    ]
    assert sorted(found) == sorted(program["BLOCKS"])


def test_the_figures_of_the_documents_are_those_measured(build_docs) -> None:
    assert build_docs("--check") == 0


def test_a_block_that_is_not_what_its_figures_make_is_named_and_fixed(build_docs, tmp_path) -> None:
    found = {"frame": [192, 120], "pictures": 8, "target_share": {"median": 0.1}}
    spread = {"median": 2.0, "least": 1.0, "most": 4.0}
    figures = {"labels": {**found, "seconds": {"depth": spread}, "in_all": spread}}
    (tmp_path / "bench.json").write_text(json.dumps(figures))
    document, own = tmp_path / "page.md", "before\n<!-- generated: labels -->\n{}<!-- end -->\nafter\n"
    document.write_text(own.format("old\n"))
    asked = [document, "--figures", tmp_path]
    assert str(document) in str(build_docs(*asked, "--check"))
    assert document.read_text() == own.format("old\n")
    assert build_docs(*asked) == 0
    assert build_docs(*asked, "--check") == 0
    assert "| depth | 2 (1 to 4) |" in document.read_text()
    assert document.read_text().startswith("before\n")
    assert document.read_text().endswith("after\n")


def test_a_block_without_figures_is_empty_and_its_benchmark_is_named(build_docs, tmp_path, capsys) -> None:
    document = tmp_path / "page.md"
    document.write_text("<!-- generated: labels -->\nold\n<!-- end -->\n")
    assert build_docs(document, "--figures", tmp_path) == 0
    assert "labels: not measured yet: run tools/bench labels" in capsys.readouterr().err
    assert document.read_text() == "<!-- generated: labels -->\n<!-- end -->\n"
