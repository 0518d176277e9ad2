"""Find whether a dataset's pictures were made from the stage that is to be rendered, edited perhaps, or from another.

A stage made by `author` is the same while its files and options are the same; any other stage while the name of its
root layer is the same. dataset.json keeps these facts as its origin. A stage is another if a target or a part has
another id, because existing labels contain the old one.
"""

from collections.abc import Iterator, Sequence
from typing import Any

from msgspec import UNSET

from spin_usd.errors import InputError
from spin_usd.files.node import NodeType
from spin_usd.options import flag_of
from spin_usd.planning.make_plan import Plan
from spin_usd.records.descriptions import DatasetDescription, StageOrigin
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import DESCRIPTION, picture_of
from spin_usd.store.read_documents import read_dataset_json

ROOT = "root"  # of a stage that `author` did not make
IDS = "ids"  # of targets and parts
WORDS = {ROOT: "root layer", IDS: "ids of targets and parts"}


def other_origin(store: Store, plan: Plan) -> tuple[str, ...]:
    """Return the names of the inputs and options in which the planned stage differs from the dataset's own; none if it
    is the same stage, or the dataset has none of its pictures."""
    if store.folder.type_of(DESCRIPTION) is not NodeType.FILE:
        return ()
    names, variants = set(plan.names), set(plan.known_variants)
    if not any(frame in names and variant in variants for frame, variant in map(picture_of, store.records())):
        return ()
    return differences(read_dataset_json(store.folder), plan)


def differences(description: DatasetDescription, plan: Plan) -> tuple[str, ...]:
    """Return the names of the inputs and options in which the planned stage differs from the stage of this
    dataset.json."""
    origin = description.stage.origin
    before, now = _deciding(plan.origin if origin is UNSET else origin), _deciding(plan.origin)
    differing = {name for name in {*before, *now} if before.get(name) != now.get(name)}
    return tuple(sorted(differing or set(_renumbered(description, plan))))


def _renumbered(description: DatasetDescription, plan: Plan) -> Iterator[str]:
    """Yield IDS where a target or a part that dataset.json lists has another id in the plan, or its id is another's."""
    content = plan.content
    targets = {target.path: target.id for target in description.targets}
    parts = {part.path: int(number) for number, part in description.parts.items()}
    planned_parts = {part.path: int(number) for number, part in content.parts.items()}
    for before, now in ((targets, {target.path: target.id for target in content.targets}), (parts, planned_parts)):
        moved = any(before[path] != now[path] for path in before.keys() & now.keys())
        if moved or any(number in now.values() for path, number in before.items() if path not in now):
            yield IDS


def _deciding(origin: StageOrigin) -> dict[str, Any]:
    """Return by name the facts of that origin that decide pictures: files count by their bytes, not by their names."""
    files = {} if origin.inputs is UNSET else {name: file.sha256 for name, file in origin.inputs.items()}
    options = {} if origin.options is UNSET else origin.options
    return {**files, **options, **({} if origin.root is UNSET else {ROOT: origin.root})}


def in_words(other: Sequence[str]) -> str:
    """Return a message on pictures of another stage, which names the differences by the options of `author`."""
    names = [WORDS.get(name, flag_of(name)) for name in other]
    return f"holds pictures of another stage, which differs in: {', '.join(names)}"


def refuse(store: Store, other: Sequence[str]) -> None:
    """Raise InputError if there is any."""
    if other:
        do = "choose another folder, or add --replace, which removes them all"
        raise InputError(in_words(other), where=store.root, do=do)
