"""The names in a dataset's folder, for any kinds of files of its pictures."""

DESCRIPTION = "dataset.json"
STAGE = "stage"
RECORDS = "records"
CACHE = "cache"
SHARDS = "shards.json"
EVENTS = "events"
STATE = "state"
EVENT_CHUNKS = f"{CACHE}/{EVENTS}"


def record_of(variant: str, frame: str) -> str:
    """Return the name of a picture's record."""
    return f"{RECORDS}/{variant}/{frame}.json"


def events_of(variant: str) -> str:
    """Return the name of the file with a variant's events."""
    return f"{EVENTS}/{variant}.h5"


def event_record_of(variant: str) -> str:
    """Return the name of the record of a variant's events."""
    return f"{EVENTS}/{variant}.json"


def event_chunks(key: str) -> str:
    """Return the folder of unfinished events."""
    return f"{EVENT_CHUNKS}/{key}"


def event_chunk(key: str, what: str, chunk: int) -> str:
    """Return the name of a chunk of unfinished events: `what` is EVENTS or STATE."""
    return f"{event_chunks(key)}/{what}-{chunk:06d}.npz"


def picture_of(record: str) -> tuple[str, str]:
    """Return (frame, variant) of the picture whose record has that name."""
    _, variant, file = record.split("/")
    return file.removesuffix(".json"), variant


def is_record(name: str) -> bool:
    """Return whether a file of that name, below RECORDS, is a record."""
    return name.count("/") == 2 and name.endswith(".json")
