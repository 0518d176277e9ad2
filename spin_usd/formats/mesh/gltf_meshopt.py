"""EXT_meshopt_compression: decodes the bytes of a buffer view.

Source: the extension's text, whose appendices define the three streams and the three filters; no maintained package
decodes them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.files.size_limits import MAX_MODEL

MESHOPT = "EXT_meshopt_compression"
ATTRIBUTES, TRIANGLES, INDICES = 0xA0, 0xE1, 0xD1  # first bytes of the streams
HEADS = {"ATTRIBUTES": ATTRIBUTES, "TRIANGLES": TRIANGLES, "INDICES": INDICES}
GROUP = 16  # deltas that share a bit width
MAX_BLOCK_BYTES, MAX_BLOCK = 8192, 256
MOST_IN_A_BYTE = 4 * GROUP  # elements: a head of two bits stands for a group
TABLE_BYTES = 16  # of a stream of triangles, at its end
NO_EDGE, PAIR_FOLLOWS, ALL_TOLD = 0xF0, 0xFE, 0xFF  # least codes of triangles that continue no edge, whose codes of
# two corners are no entry of the table, and whose first corner is coded as well
BESIDE_LAST, TOLD = 13, 15  # codes of a corner: before the last coded one, and coded
RAW = 3  # the kind of a group whose deltas are whole bytes
WIDTHS = {1: 2, 2: 4}  # kind of a group -> bits of each of its deltas
ESCAPED = {
    kind: bytes(sum(byte >> at & 2**bits - 1 == 2**bits - 1 for at in range(0, 8, bits)) for byte in range(256))
    for kind, bits in WIDTHS.items()
}
"""Number of deltas in each byte that refer to a following byte."""


@dataclass(frozen=True, kw_only=True)
class Compressed:
    """The extension's description of the `count` elements of `stride` bytes in a compressed buffer view."""

    count: int
    stride: int
    mode: str
    filter: str


def decoded_view(said: Compressed, data: bytes) -> bytes:
    """Return what the compressed `data` of a buffer view holds; `said` describes it. Raises any built-in error for
    damaged data."""
    count, stride = said.count, said.stride
    if not (0 < count <= MOST_IN_A_BYTE * len(data) and 0 < stride <= MAX_BLOCK and count * stride <= MAX_MODEL):
        raise ValueError(f"a compressed buffer view of {len(data)} bytes has {count} elements of {stride} bytes")
    if data[0] != HEADS[said.mode]:
        raise ValueError(f"a compressed buffer view begins with {data[0]:#x}")
    if said.mode == "ATTRIBUTES":
        return _filtered(_attributes(data, count, stride), said.filter).tobytes()
    indices = _triangles(data, count) if said.mode == "TRIANGLES" else _indices(data, count)
    return np.array(indices, np.uint32).astype({2: "<u2", 4: "<u4"}[stride]).tobytes()


def _attributes(data: bytes, count: int, stride: int) -> NDArray[np.uint8]:
    """Return the elements (count, stride) as bytes. In blocks of elements each byte has a run of deltas, group by
    group; each is from the same byte of the element before, the first from that at the stream's end."""
    block = min(MAX_BLOCK_BYTES // stride // GROUP * GROUP, MAX_BLOCK)
    sizes = [min(block, count - first) for first in range(0, count, block)]
    kinds, starts = _groups(data, [-(-size // GROUP) for size in sizes], stride)
    values = _deltas(np.frombuffer(data, np.uint8), np.array(kinds, np.uint8), np.array(starts, np.int64))
    deltas, first = [], 0
    for size in sizes:
        groups = -(-size // GROUP) * stride
        deltas.append(values[first : first + groups].reshape(stride, -1)[:, :size].T)
        first += groups
    zigzag = np.concatenate(deltas)
    signed = (zigzag >> 1) ^ (np.uint8(0) - (zigzag & 1))
    found = np.cumsum(signed, axis=0, dtype=np.uint8) + np.frombuffer(data[-stride:], np.uint8)
    return np.ascontiguousarray(found)


def _groups(data: bytes, counts: list[int], stride: int) -> tuple[list[int], list[int]]:
    """Return the kind of each group, and where its bytes begin; `counts`: the groups of a byte in each block."""
    kinds, starts, at = [], [], 1
    for groups in counts:
        for _ in range(stride):
            head, at = at, at + (groups + 3) // 4
            for group in range(groups):
                kind = data[head + group // 4] >> group % 4 * 2 & 3
                kinds.append(kind)
                starts.append(at)
                if kind == RAW:
                    at += GROUP
                elif kind:
                    size = GROUP * WIDTHS[kind] // 8
                    at += size + sum(data[at : at + size].translate(ESCAPED[kind]))
    if at + stride > len(data):
        raise ValueError("a compressed buffer view ends too early")
    return kinds, starts


def _deltas(data: NDArray[np.uint8], kinds: NDArray[np.uint8], starts: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the deltas (G, 16) of groups of these kinds that begin there."""
    values = np.zeros((len(kinds), GROUP), np.uint8)
    of = np.flatnonzero(kinds == RAW)
    values[of] = data[starts[of, None] + np.arange(GROUP)]
    for kind, bits in WIDTHS.items():
        of, size, most = np.flatnonzero(kinds == kind), GROUP * bits // 8, 2**bits - 1
        packed = data[starts[of, None] + np.arange(size)]
        found = (packed[:, :, None] >> np.arange(8 - bits, -1, -bits).astype(np.uint8) & most).reshape(-1, GROUP)
        escaped = found == most
        follows = starts[of, None] + size + np.cumsum(escaped, axis=1) - escaped
        values[of] = np.where(escaped, data[np.where(escaped, follows, 0)], found)
    return values


def _filtered(data: NDArray[np.uint8], name: str) -> NDArray[Any]:
    if name == "NONE":
        return data
    if name == "EXPONENTIAL":  # 8 bits of an exponent above 24 of a whole number
        whole = data.view("<i4")
        return np.asarray(np.ldexp((whole << 8 >> 8).astype(np.float32), whole >> 24), "<f4")
    kind = {4: "<i1", 8: "<i2"}[data.shape[1]]
    numbers = data.view(kind)
    largest = np.iinfo(numbers.dtype).max
    found = numbers.copy()
    if name == "OCTAHEDRAL":
        vectors = numbers[:, :3].astype(np.float64)
        vectors[:, 2] -= np.abs(vectors[:, :2]).sum(1)
        vectors[:, :2] += np.where(vectors[:, :2] >= 0, 1, -1) * np.minimum(vectors[:, 2:], 0)
        found[:, :3] = _rounded(vectors / np.linalg.norm(vectors, axis=1, keepdims=True) * largest)
        return found
    if name != "QUATERNION":
        raise ValueError(f"a compressed buffer view has the filter {name!r}")
    left_out = numbers[:, 3] & 3
    three = numbers[:, :3] / (numbers[:, 3:] | 3) / np.sqrt(2)
    four = np.c_[np.sqrt(np.maximum(0, 1 - (three**2).sum(1))), three]
    np.put_along_axis(found, (left_out[:, None] + np.arange(4)) & 3, _rounded(four * largest).astype(kind), axis=1)
    return found


def _rounded(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.trunc(values + np.copysign(0.5, values)))


class _Numbers:
    """Whole numbers of 7 bits a byte; `last`: base of the differences of each of two sequences."""

    def __init__(self, data: bytes, at: int) -> None:
        self._data, self._at, self.last = data, at, [0, 0]

    def byte(self) -> int:
        self._at += 1
        return self._data[self._at - 1]

    def number(self) -> int:
        found = 0
        for shift in range(0, 35, 7):
            byte = self.byte()
            found |= (byte & 127) << shift
            if byte < 128:
                break
        return found

    def moved(self, difference: int, which: int = 0) -> int:
        self.last[which] = (self.last[which] + difference) & 0xFFFFFFFF
        return self.last[which]


def _signed(number: int) -> int:
    return number >> 1 ^ -(number & 1)


def _indices(data: bytes, count: int) -> list[int]:
    """Return indices; each differs from one of two that were last met."""
    numbers = _Numbers(data, 1)
    return [numbers.moved(_signed(number >> 1), number & 1) for number in (numbers.number() for _ in range(count))]


def _triangles(data: bytes, count: int) -> list[int]:
    """Return the corners of triangles. The code of each triangle selects the edge among the last 16 that it continues,
    or none, and whether its other corners are new, among the last 16, or follow as numbers."""
    if count % 3:
        raise ValueError(f"a compressed buffer view has {count} corners of triangles")
    numbers, table = _Numbers(data, 1 + count // 3), data[-TABLE_BYTES:]
    edges, known = [(-1, -1)] * 16, [-1] * 16  # the newest last
    found: list[int] = []
    following = 0  # the next new corner
    for code in data[1 : 1 + count // 3]:
        if code < NO_EDGE:
            (a, b), which = edges[-1 - (code >> 4)], code & 15
            if 0 < which < BESIDE_LAST:
                c = known[-1 - which]
            else:
                beside = {BESIDE_LAST: -1, BESIDE_LAST + 1: 1}
                c = following if which == 0 else numbers.moved(beside.get(which) or _signed(numbers.number()))
                following += which == 0
                known = [*known[-15:], c]
            edges = [*edges[-14:], (c, b), (a, c)]
        else:
            pair = table[code & 15] if code < PAIR_FOLLOWS else numbers.byte()
            if code >= PAIR_FOLLOWS and pair == 0:
                following = 0
            corners, met = [], []
            for which in (TOLD if code == ALL_TOLD else 0, pair >> 4, pair & 15):
                if which == 0:
                    corner, following = following, following + 1
                else:
                    told = which == TOLD and code >= PAIR_FOLLOWS
                    corner = numbers.moved(_signed(numbers.number())) if told else known[-which]
                corners.append(corner)
                met += [corner] if which in (0, TOLD) else []
            a, b, c = corners
            known = [*known, *met][-16:]
            edges = [*edges[-13:], (b, a), (c, b), (a, c)]
        found += (a, b, c)
    return found
