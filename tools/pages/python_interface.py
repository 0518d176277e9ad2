"""The reference of the Python interface: what `spin_usd` offers, what its functions return, and its errors."""

import inspect
from collections.abc import Iterable, Iterator

import spin_usd
from spin_usd import errors

INTRODUCTION = """# Python interface

What `import spin_usd` offers. [From Python](../how-to/python.md) shows it at work.
"""


def page() -> str:
    """Return the page, in Markdown; Sphinx fills it from the docstrings."""
    offered = [getattr(spin_usd, name) for name in spin_usd.__all__ if not name.startswith("__")]
    functions = [each for each in offered if inspect.isfunction(each)]
    readers = [each for each in offered if inspect.isclass(each) and not issubclass(each, Exception)]
    reports = [inspect.signature(function).return_annotation for function in functions]
    raised = [each for each in vars(errors).values() if inspect.isclass(each) and issubclass(each, Exception)]
    parts = (
        ("Functions", (f"autofunction:: spin_usd.{each.__name__}" for each in functions)),
        ("A dataset as Python reads it", _classes(readers)),
        ("What the functions return", _classes(each for each in reports if inspect.isclass(each))),
        ("Errors", _classes(raised)),
    )
    return "\n".join((INTRODUCTION, *(line for title, directives in parts for line in _part(title, directives))))


def _classes(classes: Iterable[type]) -> Iterator[str]:
    for each in classes:
        named = f"autoclass:: {each.__module__}.{each.__name__}"
        yield f"{named}\n   :members:\n   :inherited-members: Exception, BaseException"


def _part(title: str, directives: Iterable[str]) -> Iterator[str]:
    yield f"## {title}\n"
    for directive in directives:
        yield f"```{{eval-rst}}\n.. {directive}\n```\n"
