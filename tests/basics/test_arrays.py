"""Frozen arrays and content digests."""

import hashlib
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spin_usd.basics.arrays import digest, finite, frozen
from spin_usd.errors import GeometryError

ARRAYS = hnp.arrays(st.sampled_from([np.uint8, np.int32, np.float64]), hnp.array_shapes(max_dims=3, max_side=3))


def test_frozen_cannot_be_written() -> None:
    with pytest.raises(ValueError, match="read-only"):
        frozen([1.0, 2])[0] = 3


@pytest.mark.parametrize("make", [lambda a: a, lambda a: a[:], lambda a: a.reshape(2, 2)])
def test_nobody_else_can_write_to_a_frozen_array(make) -> None:
    mine = np.arange(4.0)
    kept = frozen(make(mine))
    mine[:] = -1
    assert kept.min() == 0


def test_frozen_does_not_copy_what_is_frozen() -> None:
    first = frozen([1.0, 2])
    assert frozen(first) is first


@given(ARRAYS)
def test_frozen_keeps_shape_and_values(array) -> None:
    kept = frozen(array, array.dtype)
    assert kept.shape == array.shape
    np.testing.assert_array_equal(kept, array)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_finite_refuses_what_is_not(bad) -> None:
    with pytest.raises(GeometryError, match="points holds NaN or infinity"):
        finite([[0, 0, bad]], (None, 3), "points")


@pytest.mark.parametrize("shape", [(3,), (2, 2), (1, 2, 3)])
def test_finite_refuses_other_shapes(shape) -> None:
    with pytest.raises(GeometryError, match="expected"):
        finite(np.zeros(shape), (None, 3), "points")


@given(ARRAYS)
def test_digest_does_not_depend_on_memory_layout(array) -> None:
    assert digest(np.asfortranarray(array)) == digest(array)
    assert digest(np.repeat(array, 2, axis=0)[::2]) == digest(array)


@given(ARRAYS)
def test_digest_does_not_depend_on_byte_order(array) -> None:
    assert digest(array.astype(array.dtype.newbyteorder(">"))) == digest(array)


@given(ARRAYS, st.data())
def test_digest_changes_with_any_value(array, data) -> None:
    other = array.copy()
    i = data.draw(st.integers(0, array.size - 1))
    other.flat[i] = data.draw(hnp.from_dtype(array.dtype))
    same = other.tobytes() == array.tobytes()
    assert (digest(other) == digest(array)) == same


@given(st.lists(st.integers(0, 255), min_size=2, max_size=6), st.data())
def test_digest_tells_splits_apart(values, data) -> None:
    """The same bytes as one array, as two, and cut elsewhere are four different things."""
    whole = np.array(values, np.uint8)
    cuts = [(whole[:i], whole[i:]) for i in range(len(values) + 1)]
    digests = [digest(whole), *(digest(*cut) for cut in cuts)]
    assert len(set(digests)) == len(digests)


def test_digest_tells_kinds_and_shapes_apart() -> None:
    zeros = np.zeros(4, np.uint8)
    items = [zeros, zeros.astype(np.int8), zeros.reshape(2, 2), zeros.view(np.float32), np.array(0.0), np.zeros(1)]
    items += [0, 0.0, "0", [0], None, [[0], 0], [0, [0]]]
    assert len({digest(item) for item in items}) == len(items)


def test_digest_refuses_nan_in_json() -> None:
    with pytest.raises(ValueError, match="JSON"):
        digest([float("nan")])


def test_digest_is_the_same_on_every_machine() -> None:
    """Spelled out in bytes: a change would disown every dataset made before."""
    expected = hashlib.sha256()
    for part in (b"<f8(2, 3)", struct.pack("<6d", *range(6)), b"json", b'{"a":[0.5,"x"],"b":1}'):
        sizes = {b"<f8(2, 3)": (9, 48), b"json": (4, 21)}
        if part in sizes:
            head, body = sizes[part]
            expected.update(struct.pack("<Q", head) + part + struct.pack("<Q", body))
        else:
            expected.update(part)
    assert digest(np.arange(6.0).reshape(2, 3), {"b": 1, "a": [0.5, "x"]}) == expected.hexdigest()
