"""Rule: the stage in the dataset is the one that made the picture."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from spin_usd.dataset.check.digests import digest_findings
from spin_usd.dataset.check.inventory import Inventory
from spin_usd.scene.finding import WARNING, Finding

RENDER_AGAIN = "run spin-usd render again with the stage that did"


def provenance_findings(where: str, variant: str, stage: Mapping[str, Any], inventory: Inventory) -> Iterator[Finding]:
    """Yield a warning where the stage has changed since, an error for each of its layers that is not as it was.

    where: the record of a picture · variant, stage: the picture's, and what its provenance says of the stage.
    """
    if inventory.description["stage"]["hashes"].get(variant) != stage["hash"]:
        message = "was made from another state of the stage; run spin-usd render again"
        yield Finding(code="outdated", where=where, message=message, severity=WARNING)
        return
    folder = Path(stage["root"]).parent
    for layer, sha256 in stage["files"].items():
        if (layer, sha256) not in inventory.layers:
            inventory.layers.add((layer, sha256))
            for finding in digest_findings(inventory.root, (folder / layer).as_posix(), sha256):
                message = f"is not the layer that made the pictures; {RENDER_AGAIN}"
                yield Finding(code="layer", where=finding.where, message=message)
