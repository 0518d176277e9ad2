"""The files that a code host, pre-commit and those who cite the project read."""

import re
import tomllib

import pytest

from tests.conftest import REPOSITORY

YAML = [
    *sorted((REPOSITORY / ".github").rglob("*.yml")),
    REPOSITORY / ".pre-commit-config.yaml",
    REPOSITORY / "CITATION.cff",
]
LINE = re.compile(r"(?P<indent>(  )*)(- )*((?P<key>[\w-]+):( (?P<value>(?!.*: )\S.*))?|[^:\s][^:]*)")
BLOCK_SCALAR = "|"


def keys(text):
    """The keys of YAML that is written plainly, with the number of spaces before each.

    No YAML reader belongs to the locked packages, and these files need none: each line is a comment, a key with or
    without a value, an item, or part of a block scalar.
    """
    found, block = [], None
    for line in text.splitlines():
        indent = len(line) - len(line.lstrip(" "))
        if not line.strip() or line.lstrip().startswith("#") or (block is not None and indent > block):
            continue
        parsed = LINE.fullmatch(line)
        assert parsed, f"not a plain line of YAML: {line!r}"
        found.append((indent, parsed["key"]))
        block = indent if parsed["value"] == BLOCK_SCALAR else None
    return found


@pytest.mark.parametrize("path", YAML, ids=lambda path: path.name)
def test_yaml_is_plain_and_names_no_key_twice(path) -> None:
    tops = [key for indent, key in keys(path.read_text()) if indent == 0]
    assert tops
    assert len(tops) == len(set(tops))


def test_the_workflow_runs_what_ci_runs_with_pinned_actions() -> None:
    text = (REPOSITORY / ".github" / "workflows" / "ci.yml").read_text()
    assert "run: bash .ci/run" in text
    assert (REPOSITORY / ".ci" / "run").is_file()
    actions = re.findall(r"uses: (\S+)", text)
    assert actions
    assert all(re.fullmatch(r"[\w.-]+/[\w.-]+@[0-9a-f]{40}", action) for action in actions)


def test_pre_commit_runs_what_tools_test_runs() -> None:
    hooks = re.findall(r"entry: \.venv/bin/(.+)", (REPOSITORY / ".pre-commit-config.yaml").read_text())
    checks = re.findall(r"\.venv/bin/((?:ruff|mypy)[^&\n]*)", (REPOSITORY / "tools" / "test").read_text())
    assert [hook.replace(" --force-exclude", "") for hook in hooks] == [check.strip(" .") for check in checks]


def test_the_citation_has_the_required_fields_and_the_version_of_the_package() -> None:
    """Required by the Citation File Format 1.2: cff-version, message, title, authors."""
    fields = dict(re.findall(r"^([\w-]+): *(.*)$", (REPOSITORY / "CITATION.cff").read_text(), re.MULTILINE))
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    assert fields["cff-version"] == "1.2.0"
    assert {"message", "title", "authors"} <= fields.keys()
    assert (fields["title"], fields["version"], fields["license"]) == (
        project["name"],
        project["version"],
        project["license"],
    )


def test_the_changelog_has_the_version_of_the_package() -> None:
    version = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]["version"]
    titles = re.findall(r"^## (\S+) \((.+)\)$", (REPOSITORY / "CHANGELOG.md").read_text(), re.MULTILINE)
    (_, state), (released, day) = titles[:2]
    assert (state, released) == ("unreleased", version)
    assert f"date-released: {day}\n" in (REPOSITORY / "CITATION.cff").read_text()
