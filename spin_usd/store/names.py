"""The names of what lies in a dataset's folder, whatever kinds of file its pictures have."""

DESCRIPTION = "dataset.json"
STAGE = "stage"
RECORDS = "records"
CACHE = "cache"
SHARDS = "shards.json"


def record_of(variant: str, frame: str) -> str:
    """Return the name of a picture's record."""
    return f"{RECORDS}/{variant}/{frame}.json"


def picture_of(record: str) -> tuple[str, str]:
    """Return (frame, variant) of the picture whose record has that name."""
    _, variant, file = record.split("/")
    return file.removesuffix(".json"), variant


def is_record(name: str) -> bool:
    """Return whether a file of that name, below RECORDS, is a record."""
    return name.count("/") == 2 and name.endswith(".json")
