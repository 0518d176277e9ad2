"""A COLLADA file's XML: its elements by their references, and its numbers.

Source: COLLADA 1.4.1 and 1.5. docs/concepts/decisions.md explains why we do not use pycollada.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import decoding
from spin_usd.basics.nesting import MAX_DEPTH, NestingError
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_ELEMENTS_OF_XML, MAX_MODEL
from spin_usd.files.user_file import read_bytes

MEND = "export the model again"


@dataclass(frozen=True)
class DaeDocument:
    """The elements of a COLLADA file; tags have no namespaces."""

    path: Path
    root: Element
    """COLLADA's element."""
    ids: dict[tuple[str, str], Element]
    """Its elements by their tag and id."""

    def named(self, tag: str, url: str | None) -> Element | None:
        """Return the element of the file that a URL such as "#hull" means; None where it is in another file, or
        nowhere."""
        return self.ids.get((tag, unquote(url)[1:])) if url and url.startswith("#") else None

    def numbers(self, element: Element | None, count: int | None = None) -> Float:
        """Return the numbers that stand in an element. Raises InputError for others than `count`."""
        found: Float = self._parsed(element, np.float64)
        if count is not None and len(found) != count:
            raise self.damaged(element, f"holds {len(found)} numbers, expected {count}")
        return found

    def indices(self, element: Element | None) -> NDArray[np.int64]:
        """Return the whole numbers from 0 that stand in an element. Raises InputError."""
        found: NDArray[np.int64] = self._parsed(element, np.int64)
        if len(found) and found.min() < 0:
            raise self.damaged(element, f"holds {found.min()}, expected numbers from 0")
        return found

    def values(self, source: str | None, width: int) -> Float:
        """Return (N, width) of the source that a URL means: the first numbers of each of its rows. Raises
        InputError."""
        element = self.named("source", source)
        array = None if element is None else element.find("float_array")
        accessor = None if element is None else element.find("technique_common/accessor")
        if element is None or array is None or accessor is None:
            raise InputError(f"has no numbers {source!r}", where=self.path, do=MEND)
        data = self.numbers(array)
        count, offset, stride = (whole(self, accessor, name, default) for name, default in ACCESSOR)
        named = [at for at, param in enumerate(accessor.findall("param")) if param.get("name")]
        columns = (named or list(range(stride)))[:width]
        if len(columns) < width or columns[-1] >= stride or (count and offset + count * stride > len(data)):
            raise self.damaged(accessor, f"counts more than the {len(data)} numbers of {source!r}")
        rows = data[offset : offset + count * stride].reshape(count, stride)
        return np.ascontiguousarray(rows[:, columns])

    def damaged(self, element: Element | None, found: str) -> InputError:
        tag = "an element that is missing" if element is None else f"its <{element.tag}>"
        return InputError(f"is damaged: {tag} {found}", where=self.path, do=MEND)

    def _parsed(self, element: Element | None, kind: type[np.generic]) -> NDArray[Any]:
        words = (element.text or "").split() if element is not None else []
        try:
            return np.array(words, kind)
        except (ValueError, OverflowError):
            raise self.damaged(element, "contains text that is not a number, or decimal commas") from None


ACCESSOR = (("count", 0), ("offset", 0), ("stride", 1))


def whole(document: DaeDocument, element: Element, name: str, default: int) -> int:
    """Return an attribute that is a whole number from 0. Raises InputError."""
    text = element.get(name)
    if text is None:
        return default
    if not (text.strip().isascii() and text.strip().isdigit() and len(text) < 20):
        raise document.damaged(element, f"has the {name} {text[:40]!r}, expected a whole number from 0")
    return int(text)


def read_dae_document(path: Path) -> DaeDocument:
    """Read the file at `path`. Raises InputError."""
    parser = ElementTree.XMLParser(target=_Builder(path))
    with decoding(path):
        parser.feed(read_bytes(path, MAX_MODEL))
        root = parser.close()
    if root.tag != "COLLADA":
        raise InputError(f"is XML of a <{root.tag}>, not of COLLADA", where=path)
    return DaeDocument(path, root, {(each.tag, each.get("id", "")): each for each in reversed(list(root.iter()))})


NAMED = {"meter": 1.0, "metre": 1.0, "centimeter": 0.01, "millimeter": 0.001, "inch": 0.0254, "foot": 0.3048}


def unit_notes(document: DaeDocument) -> Iterator[str]:
    """Yield a note if the unit's name and number contradict each other, and one on animations."""
    name = next((unit.get("name", "") for unit in document.root.iterfind("asset/unit")), "")
    metres, named = metres_per_unit(document), NAMED.get(name.strip().lower())
    if metres and named and abs(metres / named - 1) > 0.01:
        yield f"its <unit> is called {name!r} but has {metres:g} metres, which was taken"
    if document.root.find("library_animations/animation") is not None:
        yield "its animations are not applied: it is read in its stored rest state"


def metres_per_unit(document: DaeDocument) -> float | None:
    """Return the length of the file's unit, None if it states none: exporters differ in their default. Raises
    InputError."""
    text = next((unit.get("meter") for unit in document.root.iterfind("asset/unit")), None)
    if text is None:
        return None
    try:
        metres = float(text)
    except ValueError:
        metres = 0.0
    if not 0 < metres < float("inf"):
        raise InputError(f"has a unit of {text[:40]!r} metres", where=document.path, do="mend its <unit>")
    return metres


def unit_of(path: Path) -> float | None:
    """Return the length in metres of the unit of the COLLADA file at `path`, None if it states none. Raises
    InputError."""
    return metres_per_unit(read_dae_document(path))


class _Builder(ElementTree.TreeBuilder):
    """Builds elements without namespaces, of bounded number and depth, from a file without declarations: COLLADA has no
    DOCTYPE, which could refer to other files or expand without end."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path, self._count, self._depth = path, 0, 0

    def doctype(self, *_: object) -> None:
        raise InputError("has a DOCTYPE, which no COLLADA file has", where=self._path, do="remove it")

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self._count += 1
        self._depth += 1
        if self._count > MAX_ELEMENTS_OF_XML:
            raise InputError(f"has more than {MAX_ELEMENTS_OF_XML} elements", where=self._path)
        if self._depth > MAX_DEPTH:
            raise NestingError
        return super().start(tag.rpartition("}")[2], attrs)

    def end(self, tag: str) -> Element:
        self._depth -= 1
        return super().end(tag.rpartition("}")[2])


def inputs(element: Element) -> Iterator[tuple[str, str | None, int, int]]:
    """Yield (semantic, URL, offset, set) of an element's inputs."""
    for each in element.findall("input"):
        yield each.get("semantic", ""), each.get("source"), _small(each.get("offset")), _small(each.get("set"))


def _small(text: str | None) -> int:
    """Return a whole number of at most three digits, 0 for other text."""
    return int(text) if text and text.isascii() and text.isdigit() and len(text) < 4 else 0
