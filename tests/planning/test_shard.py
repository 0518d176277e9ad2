"""Shards deal all frames out, equal in number and alike in cost; a manifest knows what is missing, and of which."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.errors import InputError
from spin_usd.planning.shard import Manifest, Shard, missing_pictures, read_manifest, remove_manifest, write_manifest
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import SHARDS

MANIFEST = Manifest(count=2, variants=("nominal", "dim_1"), frames=("a", "b", "c"))
FRAMES_A_SHARD = 600
UNEQUAL = 1.1  # docs/concepts/decisions.md: the longest shard may take a tenth more than the mean
names = st.lists(st.text(st.characters(codec="ascii"), min_size=1), unique=True, max_size=40)


def shards(count):
    return [Shard(number=number, count=count) for number in range(count)]


@given(names, st.integers(1, 12))
def test_every_frame_is_in_one_shard_and_shards_are_equal_in_number(frames, count) -> None:
    own = [shard.own(frames) for shard in shards(count)]
    assert sorted(place for places in own for place in places) == list(range(len(frames)))
    assert all(places == sorted(places) for places in own)
    assert max(map(len, own)) - min(map(len, own)) <= 1


@given(names, st.integers(1, 12), st.randoms())
def test_a_frame_is_of_the_same_shard_wherever_it_stands_in_the_stage(frames, count, random) -> None:
    shuffled = random.sample(frames, len(frames))
    for shard in shards(count):
        assert {frames[place] for place in shard.own(frames)} == {shuffled[place] for place in shard.own(shuffled)}


@pytest.mark.parametrize("count", [2, 16, pytest.param(100, marks=pytest.mark.slow)])
def test_shards_of_an_approach_cost_alike(count) -> None:
    """A target that comes nearer, of which the last picture shows twenty-five times as many pixels as the first."""
    total = count * FRAMES_A_SHARD
    frames = [f"img{place:06d}" for place in range(total)]
    costs = [(1 + 4 * place / total) ** 2 for place in range(total)]
    longest = max(sum(costs[place] for place in shard.own(frames)) for shard in shards(count))
    assert longest < UNEQUAL * sum(costs) / count


@given(names, st.integers(1, 12), st.data())
def test_a_missing_picture_is_of_the_shard_that_makes_its_frame(frames, count, data) -> None:
    manifest = Manifest(count=count, variants=("nominal", "dim_1"), frames=tuple(frames))
    pictures = {(frame, variant) for frame in frames for variant in manifest.variants}
    there = data.draw(st.sets(st.sampled_from(sorted(pictures)))) if pictures else set()
    missing = manifest.missing(there)
    assert missing.keys() == pictures - there
    assert all(frame in [frames[place] for place in shard.own(frames)] for (frame, _), shard in missing.items())


def test_a_manifest_is_read_as_it_was_written(tmp_path) -> None:
    store = Store(root=tmp_path)
    write_manifest(store, MANIFEST, work=tmp_path)
    assert read_manifest(store) == MANIFEST
    assert len(missing_pictures(store)) == 6
    remove_manifest(store)
    assert not list(tmp_path.iterdir())
    assert missing_pictures(store) == {}


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        "[" * 100_000,
        '{"count": "x", "variants": [], "frames": []}',
        '{"count": 0, "variants": [], "frames": []}',
        '{"count": 1, "variants": [], "frames": [1]}',
        '{"count": 1, "variants": [], "frames": "a"}',
    ],
)
def test_what_is_not_a_manifest_is_neither_read_nor_replaced(tmp_path, text) -> None:
    (tmp_path / SHARDS).write_text(text)
    assert read_manifest(Store(root=tmp_path)) is None
    with pytest.raises(InputError, match=r"shards\.json: is not the manifest of shards"):
        write_manifest(Store(root=tmp_path), MANIFEST, work=tmp_path)
    remove_manifest(Store(root=tmp_path))
    assert (tmp_path / SHARDS).read_text() == text


@pytest.mark.parametrize("text", ["", "1", "3/3", "-1/3", "0/0", "0/1000000", "1/2/3", "a/b", "0 / 3", "٠/٣"])
def test_what_is_no_shard_is_refused(text) -> None:
    with pytest.raises(InputError, match="there is no shard"):
        Shard.parse(text)
