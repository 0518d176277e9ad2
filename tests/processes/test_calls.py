"""What parents ask of children is what children take and give: the types at both ends of every call."""

import gc
from importlib import import_module
from pkgutil import walk_packages
from types import NoneType
from typing import Any, get_type_hints

import pytest

import spin_usd
from spin_usd.processes.call import Call


def calls():
    for module in walk_packages(spin_usd.__path__, "spin_usd."):
        if "cluster" not in module.name and not module.name.startswith(("spin_usd.store.publish", "spin_usd.__main__")):
            import_module(module.name)
    return {each.place: each for each in gc.get_objects() if isinstance(each, Call) and each.place[:9] == "spin_usd."}


CALLS = calls()


@pytest.mark.parametrize("place", sorted(CALLS))
def test_a_call_has_the_types_of_its_function(place) -> None:
    call = CALLS[place]
    name, _, method = place.partition(":")[2].partition(".")
    found = getattr(import_module(call.module), name)
    is_class = isinstance(found, type) and not method
    hints = get_type_hints(found.__init__ if is_class else getattr(found, method) if method else found)
    answer = hints.pop("return")
    if is_class:
        opened = getattr(found, "opened", None)
        answer = get_type_hints(opened.fget)["return"] if opened else _opened_in(found) or NoneType
    hints.pop("progress", None)
    (request,) = hints.values() or [NoneType]
    assert Any not in (call.request, call.answer)
    assert request in (call.request, call.request | None)
    assert answer == call.answer


def _opened_in(found):
    """Return the type of the attribute `opened` where a class annotates it."""
    return get_type_hints(found).get("opened")
