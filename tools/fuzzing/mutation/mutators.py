"""Changes to the bytes of a file: what breaks, what lies, and what a parser did not expect."""

import random
import re
import struct
from collections.abc import Callable

from fuzzing.mutation.words import BINARY_NUMBERS, NUMBERS, WORDS

Mutator = Callable[[bytes, random.Random], bytes]
NUMBER = re.compile(rb"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")
TOKEN = re.compile(rb"[A-Za-z_][\w:.]*")
QUOTED = re.compile(rb'"[^"\n]*"|@[^@\n]*@')
LONGEST = 1 << 22  # bytes that a mutant may grow to


def flip_bits(data: bytes, rng: random.Random) -> bytes:
    """One to eight bits turned."""
    changed = bytearray(data)
    for _ in range(rng.randint(1, 8)):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def set_bytes(data: bytes, rng: random.Random) -> bytes:
    """A run of bytes that are all 0, all 255, or random."""
    at, length = _block(data, rng, 32)
    fill = rng.choice((b"\0" * length, b"\xff" * length, rng.randbytes(length)))
    return data[:at] + fill + data[at + length :]


def truncate(data: bytes, rng: random.Random) -> bytes:
    """The beginning alone."""
    return data[: rng.randrange(len(data))]


def delete_block(data: bytes, rng: random.Random) -> bytes:
    """Without some bytes."""
    at, length = _block(data, rng, max(1, len(data) // 4))
    return data[:at] + data[at + length :]


def copy_block(data: bytes, rng: random.Random) -> bytes:
    """Some bytes again, elsewhere, once or many times."""
    at, length = _block(data, rng, max(1, len(data) // 4))
    to, times = rng.randrange(len(data)), rng.choice((1, 1, 2, 50))
    return data[:to] + data[at : at + length] * times + data[to:]


def copy_line(data: bytes, rng: random.Random) -> bytes:
    """A line of text in place of another, or before it."""
    lines = data.splitlines(keepends=True)
    to = rng.randrange(len(lines))
    lines[to : to + rng.randint(0, 1)] = [rng.choice(lines)]
    return b"".join(lines)


def delete_lines(data: bytes, rng: random.Random) -> bytes:
    """Without some lines of text."""
    lines = data.splitlines(keepends=True)
    at = rng.randrange(len(lines))
    del lines[at : at + rng.randint(1, 5)]
    return b"".join(lines)


def replace_number(data: bytes, rng: random.Random) -> bytes:
    """A number in the text by an extreme one."""
    return _replaced(data, NUMBER, rng, lambda _: rng.choice(NUMBERS))


def replace_token(data: bytes, rng: random.Random) -> bytes:
    """A word in the text by a word of the formats, or by another of its own."""
    own = TOKEN.findall(data)
    return _replaced(data, TOKEN, rng, lambda _: rng.choice(own if own and rng.random() < 0.5 else WORDS))


def replace_quoted(data: bytes, rng: random.Random) -> bytes:
    """A text in quotes, or a path, by a hostile one."""
    return _replaced(data, QUOTED, rng, lambda old: old[:1] + rng.choice(WORDS) + old[-1:])


def insert_word(data: bytes, rng: random.Random) -> bytes:
    """A word of the formats somewhere."""
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice(WORDS) + data[at:]


def nest(data: bytes, rng: random.Random) -> bytes:
    """Brackets that open, many times."""
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice((b"[", b"{", b"(", b'{"a":', b"<")) * rng.choice((3, 300, 30000)) + data[at:]


def replace_binary_number(data: bytes, rng: random.Random) -> bytes:
    """Two, four or eight bytes by an extreme number."""
    kind, value = rng.choice(BINARY_NUMBERS)
    new = struct.pack(kind, value)
    at = rng.randrange(max(1, len(data) - len(new)))
    if rng.random() < 0.5:
        at -= at % 4
    return data[:at] + new + data[at + len(new) :]


ANY: tuple[Mutator, ...] = (flip_bits, set_bytes, truncate, delete_block, copy_block, replace_binary_number)
TEXT: tuple[Mutator, ...] = (
    *ANY[:5],
    copy_line,
    delete_lines,
    replace_number,
    replace_number,
    replace_number,
    replace_token,
    replace_token,
    replace_quoted,
    insert_word,
    nest,
)


def mutated(data: bytes, rng: random.Random) -> bytes:
    """`data` after one to four changes; those of text for text."""
    mutators = TEXT if _is_text(data) else ANY
    for _ in range(rng.choice((1, 1, 1, 2, 3, 4))):
        if not data:
            break
        data = rng.choice(mutators)(data, rng)[:LONGEST]
    return data


def _block(data: bytes, rng: random.Random, longest: int) -> tuple[int, int]:
    length = min(rng.randint(1, longest), len(data))
    return rng.randrange(len(data) - length + 1), length


def _replaced(data: bytes, pattern: re.Pattern[bytes], rng: random.Random, new: Callable[[bytes], bytes]) -> bytes:
    """With one place that the pattern finds replaced; all equal ones now and then."""
    found = list(pattern.finditer(data))
    if not found:
        return data
    one = rng.choice(found)
    word = new(one.group())
    if rng.random() < 0.1:
        return data.replace(one.group(), word)
    return data[: one.start()] + word + data[one.end() :]


def _is_text(data: bytes) -> bool:
    return b"\0" not in data[:4096] and sum(byte >= 128 for byte in data[:4096]) < 64
