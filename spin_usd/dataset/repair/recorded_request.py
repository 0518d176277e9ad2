"""How a picture was asked for, by its record."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from spin_usd.dataset.picture.make_picture import IMAGE, RADIANCE
from spin_usd.dataset.plan.effort_choice import Basis, Chosen
from spin_usd.dataset.render.request import RenderRequest
from spin_usd.dataset.repair.damage import Records
from spin_usd.dataset.store.recorded_settings import recorded_settings
from spin_usd.labels.table import LABELS


def requests(stage: Path, names: Iterable[str], records: Records) -> dict[RenderRequest, set[str]]:
    """Return the pictures of these names by the request that makes them as they were: what their own record says, and
    where that is lost, what most records of their variant say, or most of all. None where there is no record."""
    recorded = {name: _request(stage, record) for name, record in records.items()}
    by_variant = defaultdict[str, Counter[RenderRequest]](Counter)
    for name, request in recorded.items():
        by_variant[_variant(name)][request] += 1
    of_all = sum(by_variant.values(), Counter[RenderRequest]())
    found = defaultdict[RenderRequest, set[str]](set)
    for name in names if of_all else ():
        usual = by_variant.get(_variant(name)) or of_all
        found[recorded.get(name) or usual.most_common(1)[0][0]].add(name)
    return dict(found)


def _variant(name: str) -> str:
    return name.partition("/")[0]


def _request(stage: Path, record: Mapping[str, Any]) -> RenderRequest:
    """Return the request for all pictures that were made as this one; it names no variant and no frame."""
    kinds, settings = record["files"], recorded_settings(record)
    chosen = record["provenance"]["render"].get("chosen")
    return RenderRequest(
        stage=stage,
        effort=settings.effort,
        chosen=_chosen(chosen) if chosen else None,
        seed=settings.seed,
        renderer=settings.renderer,
        device=settings.device,
        labels=tuple(kind for kind in LABELS if kind in kinds),
        image=IMAGE in kinds,
        radiance=RADIANCE in kinds,
        image_suffix=Path(kinds[IMAGE]["path"]).suffix if IMAGE in kinds else ".png",
    )


def _chosen(recorded: Mapping[str, str]) -> Chosen:
    """Make the reason of an effort again; what was expected of it is not recorded."""
    basis = Basis(sha256=recorded["measurement"], variant="", stage="") if "measurement" in recorded else None
    return Chosen(by=recorded["by"], asked=recorded["asked"], reason=recorded["reason"], basis=basis)
