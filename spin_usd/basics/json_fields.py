"""The fields that JSON documents share."""

from typing import Annotated

from msgspec import Meta, Struct

# A frame's name becomes the stem of files; ".tmp-" in a file's name marks what an interrupted run left half-written.
FRAME_PATTERN = r"(?!.*\.tmp-)[A-Za-z0-9][A-Za-z0-9._-]{0,199}"

UTC_PATTERN = r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d{1,6})?Z$"

Count = Annotated[int, Meta(ge=0)]
Size = Annotated[float, Meta(ge=0)]
Share = Annotated[float, Meta(ge=0, le=1)]
Positive = Annotated[float, Meta(gt=0)]
Sha256 = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
Id = Annotated[int, Meta(ge=1, le=65535)]
Pixel = Annotated[list[float], Meta(min_length=2, max_length=2)]
Span = Annotated[list[float], Meta(min_length=2, max_length=2)]
Vector = Annotated[list[float], Meta(min_length=3, max_length=3)]
Quaternion = Annotated[list[float], Meta(min_length=4, max_length=4)]
FrameName = Annotated[str, Meta(pattern=f"^{FRAME_PATTERN}$")]
VariantName = Annotated[str, Meta(pattern="^[a-z0-9_]+(-[a-z0-9_]+)?$")]
Name = Annotated[str, Meta(pattern="^[a-z][a-z0-9_]*$")]
Number = Annotated[str, Meta(pattern="^[1-9][0-9]*$")]
TagName = Annotated[str, Meta(pattern=r"^[^\s,]([^,\u0000-\u001f]{0,38}[^\s,])?$")]
PictureName = Annotated[str, Meta(pattern=f"^[a-z0-9_]+(-[a-z0-9_]+)?/{FRAME_PATTERN}$")]
FileName = Annotated[str, Meta(pattern=r"^(?!\.{0,2}(/|$))(?![\s\S]*/\.{0,2}(/|$))[^\u0000]{1,4000}$")]
"""Of a file below a folder: parts with slashes between them, none of them empty, . or .., so that it never leads
out."""


def one_of(*values: str) -> Meta:
    """Return the schema of a text that is one of `values`."""
    return Meta(extra_json_schema={"enum": list(values)})


class JsonStruct(Struct, frozen=True, kw_only=True):
    """An object of a JSON document. A field that is UNSET is not in it; one that a later version adds is passed over by
    who reads it as this type, and is a fault by its schema."""
