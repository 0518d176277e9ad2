"""The table of rules has every code that a finding can have, and no other."""

import ast
import re

from spin_usd.commands.check.rules import RULES
from spin_usd.picture.brightness import WORDS
from spin_usd.scene.derived.views import ViewKind
from spin_usd.stage.check.every_picture import CODES
from tests.conftest import REPOSITORY

PACKAGE = REPOSITORY / "spin_usd"
TABLE = PACKAGE / "commands" / "check" / "rules.py"
CALLS = {"Fault", "Finding", "LabelFault", "SetFinding", "fault", "finding", "_finding", "_once"}
"""What makes a finding: its code is the argument `code` or `rule`, or the first."""


def made(tree):
    """The codes in the calls of a file that make a finding."""
    for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
        name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
        noted = name == "add" and ast.unparse(call.func).endswith("notes.add")
        if name in CALLS or noted:
            given = [each.value for each in call.keywords if each.arg in ("code", "rule")] + call.args[:1]
            for node in given:
                if isinstance(node, ast.Constant) and re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", str(node.value)):
                    yield node.value


def test_the_table_has_every_code_that_the_package_makes() -> None:
    found = {code for path in PACKAGE.rglob("*.py") for code in made(ast.parse(path.read_text()))}
    found |= {CODES[kind] for kind in ViewKind if kind in CODES} | {fault.replace("_", "-") for fault in WORDS}
    assert len(found) > 60
    assert found - set(RULES) == set()


def test_every_code_of_the_table_stands_in_the_package() -> None:
    text = "".join(path.read_text() for path in PACKAGE.rglob("*.py") if path != TABLE)
    words = {word.replace("_", "-") for word in re.findall(r'"([\w-]+)"', text)}
    assert set(RULES) - words == set()
