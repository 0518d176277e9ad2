"""The functions that a child process calls, found by their places."""

from collections.abc import Callable
from functools import cache
from importlib import import_module
from inspect import signature
from typing import Any, get_type_hints

from msgspec import convert


class ChildCalls:
    """Answers calls, as Call describes them. `progress` is called as work goes on."""

    def __init__(self, progress: Callable[..., None]) -> None:
        self._progress = progress
        self._opened: dict[str, Any] = {}  # by class

    def answer(self, place: str, request: Any) -> Any:
        """Return the answer of the function at that place, for JSON."""
        module, _, path = place.partition(":")
        name, _, method = path.partition(".")
        found = getattr(import_module(module), name)
        if method:
            opened = self._opened[name] = self._opened.get(name) or found()
            result = self._call(getattr(found, method), request, opened)
        else:
            result = self._call(found, request)
        if isinstance(found, type) and not method:
            self._opened[name] = result
            return getattr(result, "opened", None)
        return result

    def _call(self, function: Callable[..., Any], request: Any, *opened: Any) -> Any:
        of_type, reports = _parameters(function)
        given = () if of_type is None else (convert(request, of_type),)
        return function(*opened, *given, **({"progress": self._progress} if reports else {}))


@cache
def _parameters(function: Callable[..., Any]) -> tuple[Any, bool]:
    """Return the type of the request that the function takes, None where it takes none, and whether it reports
    progress."""
    called = function.__init__ if isinstance(function, type) else function  # type: ignore[misc]
    names = [name for name in signature(function).parameters if name != "self"]
    request = next((name for name in names if name != "progress"), None)
    return None if request is None else get_type_hints(called)[request], "progress" in names
