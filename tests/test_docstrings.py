"""Docstrings of fields begin with a noun."""

import ast
import re
from collections.abc import Iterator

from tests.conftest import REPOSITORY

PACKAGE = REPOSITORY / "spin_usd"
PRONOUN = re.compile(r"(That|Those|The one|What|Which|Whether it|These|This)\b")


def documented_fields(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """The line and the docstring of each field of a class, and of each documented name of a module."""
    for scope in ast.walk(tree):
        if not isinstance(scope, ast.ClassDef | ast.Module):
            continue
        for field, text in zip(scope.body, scope.body[1:], strict=False):
            match field, text:
                case ast.AnnAssign() | ast.Assign(), ast.Expr(ast.Constant(str(docstring))):
                    yield text.lineno, docstring


def test_docstrings_of_fields_begin_with_a_noun() -> None:
    found = [
        f"{path.relative_to(PACKAGE)}:{line}: {text}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for line, text in documented_fields(ast.parse(path.read_text()))
        if PRONOUN.match(text)
    ]
    assert not found
