"""The child's part of `check` of a dataset: faults of one picture, and the contents of its record, as JSON."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from msgspec import convert
from numpy.typing import NDArray

from spin_usd.basics.faults import reading
from spin_usd.commands.check.calls import CheckPicture, ListedPicture, PictureAnswer
from spin_usd.commands.check.digests import MAKE_AGAIN, digest_findings
from spin_usd.commands.check.in_child.boxes import box_findings
from spin_usd.commands.check.in_child.checked_picture import CheckedPicture
from spin_usd.commands.check.in_child.keypoints import keypoint_findings
from spin_usd.commands.check.in_child.labels import count_findings, label_findings
from spin_usd.commands.check.in_child.pose import pose_findings
from spin_usd.errors import InputError, SpinError
from spin_usd.files.folder import FileIn, Folder
from spin_usd.picture.brightness import tone_findings
from spin_usd.reading.description import Named
from spin_usd.reading.picture_file import read_picture_file
from spin_usd.records.descriptions import DatasetDescription
from spin_usd.records.record import Record, RecordedFile
from spin_usd.scene.finding import Finding
from spin_usd.store.cache import uses
from spin_usd.store.json_schema import read_json
from spin_usd.store.names import picture_of
from spin_usd.store.read_documents import read_dataset_json


def picture_findings(request: CheckPicture) -> PictureAnswer:
    """Return what is wrong with a picture."""
    root, record = Path(request.dataset), request.record
    try:
        with reading(record):
            content = convert(read_json(Folder(root), record, "record-1"), Record)
    except SpinError as e:
        return PictureAnswer(findings=[_finding("record", record, e)])
    found = dict.fromkeys(_findings(root, record, content))  # numbers that one rule cannot take, others cannot either
    return PictureAnswer(findings=list(found), listed=_listed(content))


def read_arrays(root: Path, files: Mapping[str, RecordedFile]) -> Iterator[tuple[str, NDArray[Any] | Finding]]:
    """Yield the numbers of each of a record's `files` by its kind, or a finding on one that cannot be decoded."""
    for kind, file in files.items():
        try:
            with reading(file.path):
                yield kind, read_picture_file(FileIn(Folder(root), file.path), kind, file.dtype, len(file.channels))
        except SpinError as e:
            yield kind, _finding("unreadable", file.path, e)


def _listed(record: Record) -> ListedPicture:
    return ListedPicture(
        variant=record.variant,
        stage=record.provenance.stage,
        files=[file.path for file in record.files.values()],
        uses=list(uses(record)),
    )


def _findings(root: Path, where: str, record: Record) -> Iterator[Finding]:
    if (record.frame, record.variant) != picture_of(where):
        message = f"its frame and variant differ from its own path; {MAKE_AGAIN}"
        yield Finding(code="record", where=where, message=message)
    wrong = [each for file in record.files.values() for each in digest_findings(root, file.path, file.sha256)]
    found = {} if wrong else dict(read_arrays(root, record.files))
    wrong += [each for each in found.values() if isinstance(each, Finding)]
    yield from wrong
    arrays = {} if wrong else {kind: each for kind, each in found.items() if not isinstance(each, Finding)}
    description = _description(str(root))
    if description is None:  # numbers mean nothing without their targets
        return
    picture = CheckedPicture(where=where, record=record, description=description, arrays=arrays)
    for rule in PICTURE_RULES:
        try:
            with reading(where):
                yield from rule(picture)
        except SpinError as e:
            yield _finding("numbers", where, e)


def _finding(code: str, where: str, error: SpinError) -> Finding:
    return Finding(code=code, where=where, message=f"{error.found}; {MAKE_AGAIN}")


@cache
def _description(root: str) -> DatasetDescription | None:
    """Return dataset.json; None if it is unusable, which is a separate finding."""
    with suppress(InputError):
        return read_dataset_json(Folder(Path(root)))
    return None


def target_id_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Yield an error if ids or names of the record's targets, which are the shown ones, differ from dataset.json: the
    picture's labels then mean other targets."""
    there, here = (_names(each.targets) for each in (picture.description, picture.record))
    if not here.items() <= there.items():
        found = f"its targets are {_in_words(here)}, but dataset.json has {_in_words(there)}"
        yield Finding(code="target-ids", where=picture.where, message=f"{found}; {MAKE_AGAIN}")


def _names(targets: Iterable[Named]) -> dict[int, str]:
    return {target.id: target.name for target in targets}


def _in_words(names: dict[int, str]) -> str:
    return ", ".join(f"{number} {name!r}" for number, name in sorted(names.items()))


def brightness_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Return a warning for each reason why little of the target shows."""
    return tone_findings(picture.record, picture.where)


PICTURE_RULES: tuple[Callable[[CheckedPicture], Iterator[Finding]], ...] = (
    target_id_findings,
    brightness_findings,
    label_findings,
    pose_findings,
    box_findings,
    count_findings,
    keypoint_findings,
)
"""The rules, in the order in which their findings are reported."""
