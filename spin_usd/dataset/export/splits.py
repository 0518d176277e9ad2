"""Splits: which of a dataset's poses train, and which validate and test."""

import hashlib
import re
from collections.abc import Mapping, Sequence
from math import isclose, isfinite

from spin_usd.errors import InputError

WRITE = "write for example train=0.8,validation=0.2"
NAME = re.compile(r"[a-z][a-z0-9_]{0,40}")
DEFAULT = "train"


def read_split(text: str | None) -> dict[str, float]:
    """Return the share of each split that "train=0.8,validation=0.2" says; all is "train" where it is None.

    Raises InputError unless the shares are positive and their sum is 1.
    """
    if text is None:
        return {DEFAULT: 1.0}
    shares: dict[str, float] = {}
    for item in text.split(","):
        name, _, number = (part.strip() for part in item.partition("="))
        if not NAME.fullmatch(name) or name in shares:
            raise InputError(f"split {text!r} has {name!r} as a name", do=f"{WRITE}; small letters, each name once")
        shares[name] = _share(number, text)
    if not isclose(total := sum(shares.values()), 1, abs_tol=1e-9):
        raise InputError(f"the shares of split {text!r} sum up to {total:g}", do=f"make it 1: {WRITE}")
    return shares


def _share(number: str, text: str) -> float:
    try:
        share = float(number)
        if not (isfinite(share) and share > 0):
            raise ValueError
    except ValueError:
        raise InputError(f"split {text!r} has the share {number!r}", do=WRITE) from None
    return share


def named_splits(shares: Mapping[str, float], names: Mapping[str, str] | None, *, format_name: str) -> dict[str, float]:
    """Return the shares by the format's own `names` of splits. Raises InputError for a split that it does not have."""
    if names is None:
        return dict(shares)
    for split in shares:
        if split not in names:
            do = f"choose among {', '.join(names)}"
            raise InputError(f"{format_name} has no split {split!r}", do=do)
    return {names[split]: share for split, share in shares.items()}


def split_of_each(groups: Sequence[str], shares: Mapping[str, float], *, seed: int) -> dict[str, str]:
    """Return the split of each of the `groups`: pictures of one group go together.

    Which go where is decided by a digest of the seed and the group: it is the same on every machine, in any order. Each
    split gets its share of the groups, rounded.
    """
    ranked = sorted(set(groups), key=lambda group: hashlib.sha256(f"{seed} {group}".encode()).digest())
    found: dict[str, str] = {}
    begin, upto = 0, 0.0
    for name, share in shares.items():
        upto += share
        end = round(upto * len(ranked))
        found |= dict.fromkeys(ranked[begin:end], name)
        begin = end
    return found
