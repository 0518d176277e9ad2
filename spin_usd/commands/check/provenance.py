"""Rule: the stage in the dataset is the one that made the picture."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from spin_usd.commands.check.digests import digest_findings
from spin_usd.commands.check.inventory import Inventory
from spin_usd.commands.check.special_files import LINK, SPECIAL
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.store.names import STAGE
from spin_usd.store.stage_layers import layers_of

RENDER_AGAIN = "run spin-usd render again with the stage that made the pictures"


def provenance_findings(where: str, variant: str, stage: Mapping[str, Any], inventory: Inventory) -> Iterator[Finding]:
    """Yield a warning where the stage has changed since, an error for each of its layers that is not as it was.

    where: the record of a picture · variant, stage: the picture's, and what its provenance says of the stage.
    """
    description = inventory.description
    if description and description["stage"]["hashes"].get(variant) != stage["hash"]:
        message = "was made from another state of the stage; run spin-usd render again"
        yield Finding(code="outdated", where=where, message=message, severity=WARNING)
        return
    for layer in layers_of(stage):
        if layer not in inventory.layers and not inventory.missing & {layer[0], STAGE}:
            found = [_of_layer(finding) for finding in digest_findings(inventory.root, *layer)]
            inventory.layers[layer] = not found
            yield from found


def _of_layer(finding: Finding) -> Finding:
    if finding.code in (LINK, SPECIAL):
        return finding
    return replace(finding, code="layer", message=f"is not as it was when pictures were made; {RENDER_AGAIN}")
