"""Reproducible chance: a generator for each sampled value, whatever else is sampled beside it."""

import numpy as np

from spin_usd.arrays import digest


def stream(seed: int, *names: str) -> np.random.Generator:
    """Return the generator of what `names` name (an augmentation, a parameter, a frame), the same on every machine.

    Adding, leaving out or reordering other things changes none of its numbers.
    """
    return np.random.Generator(np.random.Philox(key=int(digest([seed, *names])[:32], 16)))
