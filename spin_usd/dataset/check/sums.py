"""Rule: SHA256SUMS lists the files of the dataset's stage as they are; else a render refuses to replace the stage."""

from collections.abc import Iterator

from spin_usd.dataset.check.digests import MAKE_AGAIN
from spin_usd.dataset.check.inventory import Inventory
from spin_usd.dataset.check.provenance import RENDER_AGAIN
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.file_digests import has_list, unlisted
from spin_usd.dataset.store.names import STAGE
from spin_usd.dataset.store.stage_layers import STAGE_SUMS
from spin_usd.scene.finding import Finding

RESTORE = f"restore it, or move stage/ elsewhere and {RENDER_AGAIN}"


def sums_findings(store: Store, inventory: Inventory) -> Iterator[Finding]:
    """Find whether the list is damaged or lost, and which files are not as it says, of those that no record knows."""
    if STAGE in inventory.missing or store.folder.in_the_way(STAGE_SUMS):
        return
    wrong = {path.relative_to(store.root).as_posix() for path in unlisted(store.stage)}
    vouched = wrong & {name for (name, _), whole in inventory.layers.items() if whole}
    told = {name for (name, _), whole in inventory.layers.items() if not whole} - vouched
    listing = has_list(store.stage)
    if vouched or not listing:
        do = MAKE_AGAIN if wrong == vouched else RENDER_AGAIN
        yield Finding(code="sums", where=STAGE_SUMS, message=f"does not list the files of stage/ as they are; {do}")
    for name in sorted(wrong - vouched - told) if listing else ():
        yield Finding(code="sums", where=name, message=f"is not as {STAGE_SUMS} lists it; {RESTORE}")
