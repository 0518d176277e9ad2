"""Findings on a dataset's pictures, which children look at: their files are decoded there."""

from collections.abc import Iterator
from typing import Any

from spin_usd.dataset.check.digests import MAKE_AGAIN
from spin_usd.dataset.check.inventory import Inventory
from spin_usd.dataset.check.provenance import provenance_findings
from spin_usd.dataset.process.deaths import ChildDiedError
from spin_usd.dataset.process.shared_calls import Call
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.errors import SpinError
from spin_usd.scene.finding import Finding


def picture_call(store: Store, record: str) -> Call:
    """Return what a child is asked about the picture whose record is the file `record`."""
    return Call("check_picture", {"dataset": str(store.root), "record": record})


def answered_findings(call: Call, answer: Any, inventory: Inventory) -> Iterator[Finding]:
    """Yield all that is wrong with the picture of that `call`, and add what its record lists to the inventory.

    A picture of which a child dies has a finding; any other SpinError in place of the answer is raised.
    """
    where = call.arguments["record"]
    if isinstance(answer, ChildDiedError):
        inventory.unread.add(where)
        message = f"cannot be checked: {answer.found}; {MAKE_AGAIN}"
        yield Finding(code="unreadable", where=where, message=message)
        return
    if isinstance(answer, SpinError):
        raise answer
    yield from (Finding(**each) for each in answer["findings"])
    if listed := answer["listed"]:
        inventory.add(listed["files"], listed["uses"])
        yield from provenance_findings(where, listed["variant"], listed["stage"], inventory)
    else:
        inventory.unread.add(where)
