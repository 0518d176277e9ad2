"""Rules: files of the dataset and its stage have the recorded bytes, and none is a link."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from spin_usd.commands.check.inventory import Inventory
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.files.node import Node, NodeType
from spin_usd.records.record import StageProvenance
from spin_usd.scene.finding import ERROR, WARNING, Finding
from spin_usd.store.dataset_folder import LOCK, OWN
from spin_usd.store.names import STAGE

MAKE_AGAIN = "run spin-usd check --repair"
LINK, SPECIAL = "link", "special"
EVENTS_AGAIN = "remove the events' record, and run spin-usd render again with --events"
RENDER_AGAIN = "run spin-usd render again with the stage that made the pictures"


def digest_findings(root: Path, name: str, sha256: str, *, do: str = MAKE_AGAIN) -> Iterator[Finding]:
    """Find whether the file `name` of the dataset in `root` is missing, unreadable, or differs from the recorded bytes,
    with the remedy `do`. If a link is in its way, the finding is on the link."""
    folder = Folder(root)
    try:
        found = folder.sha256(name)
    except InputError as e:
        yield _unread(folder, name, e.found, do)
        return
    if found != sha256:
        yield Finding(code="sha256", where=name, message=f"differs from its record; {do}")


def _unread(folder: Folder, name: str, reason: str, do: str) -> Finding:
    if node := folder.in_the_way(name):
        return special_file_finding(node)
    match folder.type_of(name):
        case None:
            message = f"the file is missing; {do}"
        case NodeType.FOLDER:
            message = f"is a folder; move it elsewhere, and {do}"
        case _:
            message = f"{reason}; {do}"
    return Finding(code="missing", where=name, message=message)


def special_file_finding(node: Node) -> Finding:
    """Return a finding on a node that is neither file nor folder: a render refuses it where the dataset's own should
    be."""
    severity = ERROR if node.name.partition("/")[0] in (*OWN, LOCK) else WARNING
    message = f"is a {node.type}, which is not followed; replace it by its target, or remove it"
    code = LINK if node.type is NodeType.LINK else SPECIAL
    return Finding(code=code, where=node.name, message=message, severity=severity)


def provenance_findings(where: str, variant: str, stage: StageProvenance, inventory: Inventory) -> Iterator[Finding]:
    """Yield a warning if the stage has changed since, and an error for each of its changed layers.

    Args:
        where: The record of a picture.
        variant: The picture's.
        stage: Its entry in the picture's provenance.
    """
    description = inventory.description
    if description and description.stage.hashes.get(variant) != stage.hash:
        message = "was made from another state of the stage; run spin-usd render again"
        yield Finding(code="outdated", where=where, message=message, severity=WARNING)
        return
    for layer in stage.layers:
        if layer not in inventory.layers and not inventory.missing & {layer[0], STAGE}:
            found = [_of_layer(finding) for finding in digest_findings(inventory.root, *layer)]
            inventory.layers[layer] = not found
            yield from found


def _of_layer(finding: Finding) -> Finding:
    if finding.code in (LINK, SPECIAL):
        return finding
    return replace(finding, code="layer", message=f"is not as it was when pictures were made; {RENDER_AGAIN}")
