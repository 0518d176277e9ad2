"""The valid records of a dataset, and the requests that make its pictures again by them."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from msgspec import UNSET

from spin_usd.errors import InputError
from spin_usd.labels.table import LABELS
from spin_usd.options import PictureOptions
from spin_usd.picture.kinds import IMAGE, RADIANCE
from spin_usd.planning.effort_choice import Basis, Chosen
from spin_usd.planning.request import RenderRequest
from spin_usd.records.record import EffortChoice, Record
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import picture_of
from spin_usd.store.read_documents import read_record

Records = Mapping[str, Record]
"""Valid records by their pictures' names, "variant/frame"."""


def valid_records(store: Store) -> Records:
    """Read the dataset's records, except damaged ones."""
    found: dict[str, Record] = {}
    for name in store.records():
        with suppress(InputError):
            frame, variant = picture_of(name)
            found[f"{variant}/{frame}"] = read_record(store.folder, name)
    return found


def requests(stage: Path, names: Iterable[str], records: Records) -> dict[RenderRequest, set[str]]:
    """Return the pictures of these names by the request that makes them again: by their own record, or if that is lost,
    by most records of their variant, or most of all. None if there is no record."""
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


def of_variants(request: RenderRequest, variants: tuple[str, ...]) -> RenderRequest:
    """Return the same request for these variants."""
    return replace(request, options=replace(request.options, variants=variants))


def _variant(name: str) -> str:
    return name.partition("/")[0]


def _request(stage: Path, record: Record) -> RenderRequest:
    """Return the request for all pictures that were made as this one; it names no variant and no frame."""
    kinds, settings, chosen = record.files, record.settings, record.provenance.render.chosen
    options = PictureOptions(
        stage,
        seed=settings.seed,
        renderer=settings.renderer,
        device=settings.device,
        labels=tuple(kind for kind in LABELS if kind in kinds) or "none",
        labels_only=IMAGE not in kinds,
        radiance=RADIANCE in kinds,
        **record.options,
    )
    return RenderRequest(options=options, effort=settings.effort, chosen=None if chosen is UNSET else _chosen(chosen))


def _chosen(recorded: EffortChoice) -> Chosen:
    """Make the reason of an effort again; its expected error is not recorded."""
    measured = recorded.measurement
    basis = None if measured is UNSET else Basis(sha256=measured, variant="", stage="")
    return Chosen(by=recorded.by, asked=recorded.asked, reason=recorded.reason, basis=basis)
