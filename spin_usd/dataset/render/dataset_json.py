"""dataset.json: what a dataset holds."""

from collections.abc import Sequence
from typing import Any

from spin_usd.dataset.picture.make_picture import IMAGE, IMAGE_MEANING, KINDS, RADIANCE, RADIANCE_CHANNELS
from spin_usd.dataset.plan.make_plan import Plan
from spin_usd.dataset.render.same_stage import differences
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.json_schema import read_json
from spin_usd.dataset.store.names import DESCRIPTION
from spin_usd.labels.table import LABELS
from spin_usd.scene.derived.part_classes import class_ids

MEANINGS = {
    IMAGE: IMAGE_MEANING,
    RADIANCE: RADIANCE_CHANNELS.meaning,
    **{name: label.channels.meaning for name, label in LABELS.items()},
}


def describe(store: Store, plan: Plan, root: str, kinds: Sequence[str]) -> dict[str, Any]:
    """Return dataset.json by schema dataset-1; what earlier runs made of the same stage's other variants and kinds
    stays listed."""
    before = read_json(store.folder, DESCRIPTION, "dataset-1") if store.folder.type_of(DESCRIPTION) else None
    if before and differences(before, plan):
        before = None
    hashes = dict(before["stage"]["hashes"]) if before else {}
    hashes = {name: hash for name, hash in hashes.items() if name in plan.known_variants}
    hashes |= {name: stage["hash"] for name, stage in plan.stages.items()}
    classes = class_ids(part["class"] for part in plan.description["parts"].values())
    return {
        "schema": "dataset-1",
        "stage": {"root": root, "origin": dict(plan.origin), "hashes": hashes},
        "targets": plan.description["targets"],
        "parts": plan.description["parts"],
        "classes": {str(number): name for name, number in classes.items()},
        "variants": list(hashes),
        "frames": len(plan.names),
        "files": {kind: MEANINGS[kind] for kind in KINDS if kind in kinds or (before and kind in before["files"])},
    }
