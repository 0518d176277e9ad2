"""Elements of an XML text with their lines, which parsers that build objects do not report."""

from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from spin_usd.errors import InputError


@dataclass(kw_only=True, eq=False)
class XmlElement:
    """An element of an XML document."""

    name: str
    """Tag without its namespace."""
    line: int
    """Line of the tag, from 1."""
    around: str
    """Tag of the element around it, "" for the outermost one."""
    again: bool
    """True if another of its name is before it in the same element."""
    children: list[str] = field(default_factory=list)
    """Tags of the elements directly in it."""
    text: str = ""
    """Characters directly in it."""


def xml_elements(text: str, path: Path) -> list[XmlElement]:
    """Return the elements in the order of their tags. Raises InputError, with the line, for text that is not XML, and
    for entities."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError("defines entities, which no message needs", where=path, do="remove its DOCTYPE")
    found: list[XmlElement] = []
    within = [XmlElement(name="", line=0, around="", again=False)]
    parser = expat.ParserCreate()

    def start(tag: str, _attributes: dict[str, str]) -> None:
        name, parent = tag.rpartition(":")[2], within[-1]
        again = name in parent.children
        within.append(XmlElement(name=name, line=parser.CurrentLineNumber, around=parent.name, again=again))
        parent.children.append(name)
        found.append(within[-1])

    def add(text: str) -> None:
        within[-1].text += text

    parser.StartElementHandler, parser.CharacterDataHandler = start, add
    parser.EndElementHandler = lambda _tag: within.pop()
    try:
        parser.Parse(text.lstrip(), True)
    except expat.ExpatError as error:
        broken = "is not XML from there on: a tag is cut, or lacks its partner"
        raise InputError(broken, where=f"{path}, line {error.lineno}", do="mend it, or copy the file again") from None
    return found
