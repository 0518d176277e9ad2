"""A shard of a run: one of several parts of its pictures, each made by a command of its own, here or elsewhere."""

import re
from dataclasses import dataclass

from spin_usd.errors import InputError

MAX_SHARDS = 100_000  # more than any scheduler starts, and a slip of the hand is caught
TEXT = re.compile(r"([0-9]{1,6})/([0-9]{1,6})")


@dataclass(frozen=True, kw_only=True)
class Shard:
    """The shard `number`, from 0, of `count`."""

    number: int
    count: int

    @classmethod
    def parse(cls, text: str) -> "Shard":
        """Read "I/N". Raises InputError where that is no shard."""
        found = TEXT.fullmatch(text.strip())
        number, count = (int(found[1]), int(found[2])) if found else (0, 0)
        if not number < count <= MAX_SHARDS:
            do = f"write I/N: part I, from 0, of a run in N parts, such as 0/3, 1/3 and 2/3; N is {MAX_SHARDS} at most"
            raise InputError(f"there is no shard {text!r}", do=do)
        return cls(number=number, count=count)

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    @property
    def name(self) -> str:
        """Its name where a slash cannot stand."""
        return f"{self.number}-of-{self.count}"
