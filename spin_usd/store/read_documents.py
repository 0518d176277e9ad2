"""The doors by which the records of pictures and of events, and dataset.json, come in."""

from contextlib import suppress
from pathlib import Path

from msgspec import DecodeError, Struct, convert
from msgspec.json import Decoder, decode

from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.files.size_limits import MAX_RECORD
from spin_usd.picture.kinds import FILE_KINDS
from spin_usd.records.descriptions import DatasetDescription
from spin_usd.records.event_record import EventRecord
from spin_usd.records.record import Record
from spin_usd.store.json_schema import read_json, valid
from spin_usd.store.names import DESCRIPTION, event_record_of, events_of

CHECK = "run spin-usd check on the dataset"
SCHEMA = "record-1"
_DECODER = Decoder(Record)


class _Named(Struct):
    schema: str


def read_dataset_json(folder: Folder) -> DatasetDescription:
    """Read the dataset.json in the folder of a dataset. Raises InputError with its fault."""
    return convert(read_json(folder, DESCRIPTION, "dataset-1"), DatasetDescription)


def read_record(folder: Folder, name: str) -> Record:
    """Read the record in the file `name` of the folder. Raises InputError with its fault."""
    return decoded_record(folder.read(name, MAX_RECORD), folder.root / name)


def decoded_record(data: bytes, where: Path) -> Record:
    """Return the record in the `data` of a file; fields of later versions are ignored. Raises InputError with its
    fault."""
    try:
        return _DECODER.decode(data)
    except (DecodeError, RecursionError) as e:  # the schema finds the same, in words for people
        _refuse_other_schema(data, where)
        valid(data, SCHEMA, where, do=CHECK)
        raise InputError(f"is not a record of a picture ({e})", where=where, do=CHECK) from e


def read_event_record(folder: Folder, variant: str) -> EventRecord:
    """Read the record of the variant's events. Raises InputError with its fault."""
    name = event_record_of(variant)
    record = convert(read_json(folder, name, "events-1"), EventRecord)
    if (record.variant, record.file) != (variant, events_of(variant)):
        raise InputError("its variant and file differ from its own path", where=folder.root / name, do=CHECK)
    return record


def _refuse_other_schema(data: bytes, where: Path) -> None:
    with suppress(DecodeError, RecursionError):
        if (found := decode(data, type=_Named).schema) != SCHEMA:
            do = "read it with the spin_usd that made it"
            raise InputError(f"is of schema {found!r}, and this version reads {SCHEMA}", where=where, do=do)


def recorded_files(record: Record | None, variant: str, frame: str) -> dict[str, str]:
    """Return the path by kind of the record's files; none without a record, or if it names files that cannot be this
    picture's."""
    paths = {kind: file.path for kind, file in record.files.items()} if record else {}
    named = (path.rpartition(".")[0] == f"{kind}/{variant}/{frame}" for kind, path in paths.items())
    return paths if paths.keys() <= set(FILE_KINDS) and all(named) else {}
