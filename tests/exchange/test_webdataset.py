"""WebDataset: samples whole and in order, shards that are the same in every run."""

import json
import tarfile

import pytest

from spin_usd.errors import InputError
from tests.exchange.conftest import clone, contents, write_export

SPLIT = {"split": "train=0.7,validation=0.3", "options": {"pictures": "3"}}


@pytest.fixture(scope="module")
def shards(two_variants, tmp_path_factory):
    out = tmp_path_factory.mktemp("webdataset") / "out"
    write_export(two_variants, "webdataset", out, **SPLIT)
    return out


def members(path):
    with tarfile.open(path) as tar:
        return {name: tar.extractfile(name).read() for name in tar.getnames()}


def test_each_sample_is_a_pictures_files_and_record(shards, two_variants) -> None:
    found: dict[str, bytes] = {}
    for path in sorted(shards.glob("*.tar")):
        found |= members(path)
    assert len(found) == 12 * 7  # image, radiance, three labels, a record and a table of it
    for variant in ("nominal", "noisy_1"):
        key = f"img000002-{variant}"
        record = two_variants / "records" / variant / "img000002.json"
        assert found[f"{key}.record.txt"] == record.read_bytes()
        for kind, file in json.loads(record.read_text())["files"].items():
            suffix = file["path"].rpartition(".")[2]
            assert found[f"{key}.{kind}.{suffix}"] == (two_variants / file["path"]).read_bytes()


def test_a_table_of_a_record_has_the_same_types_in_all_pictures(blanked, tmp_path) -> None:
    """One of them shows nothing of the target."""
    write_export(blanked, "webdataset", tmp_path / "out")
    found = members(tmp_path / "out" / "train-000000.tar")
    nothing, whole = (json.loads(found[f"{name}.json"]) for name in "ab")
    assert types_of(nothing) == types_of(whole)
    assert nothing["targets"][0]["box"]["visible"] == [0, 0, 0, 0]
    (target,) = json.loads(found["b.record.txt"])["targets"]
    assert whole["targets"][0]["keypoints"] == [entry[:2] for entry in target["keypoints"]]
    assert whole["targets"][0]["keypoint_states"] == [entry[2] for entry in target["keypoints"]]


def types_of(value):
    """The types in a document of JSON: of a list one, of whatever it holds."""
    if isinstance(value, dict):
        return {name: types_of(each) for name, each in value.items()}
    if isinstance(value, list):
        (kind,) = {json.dumps(types_of(each)) for each in value}
        return [kind]
    return type(value).__name__


def test_a_sample_is_in_one_piece(shards) -> None:
    for path in shards.glob("*.tar"):
        keys = [name.partition(".")[0] for name in members(path)]
        assert keys == sorted(keys, key=keys.index)


def test_the_index_lists_the_shards_of_a_split(shards) -> None:
    for split, count in (("train", 8), ("validation", 4)):
        index = json.loads((shards / f"{split}.json").read_text())
        assert index["wids_version"] == 1
        assert [shard["url"] for shard in index["shardlist"]] == [
            path.name for path in sorted(shards.glob(f"{split}-*"))
        ]
        sizes = [shard["nsamples"] for shard in index["shardlist"]]
        assert sum(sizes) == count
        assert set(sizes[:-1]) <= {3}
        held = [
            len({name.partition(".")[0] for name in members(shards / shard["url"])}) for shard in index["shardlist"]
        ]
        assert held == sizes


def test_shards_are_the_same_in_every_run(shards, two_variants, tmp_path) -> None:
    write_export(two_variants, "webdataset", tmp_path / "again", **SPLIT)
    assert contents(tmp_path / "again") == contents(shards)
    (tmp_path / "again" / "train-000001.tar").unlink()
    report = write_export(two_variants, "webdataset", tmp_path / "again", **SPLIT)
    assert contents(tmp_path / "again") == contents(shards)
    assert report.made < 4  # one shard, and what is written anew each time


def test_keys_have_no_dots(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "set", [{"frame": "a.b.c"}, {"frame": "a"}])
    write_export(dataset, "webdataset", tmp_path / "out")
    names = members(tmp_path / "out" / "train-000000.tar")
    assert {name.partition(".")[0] for name in names} == {"a%2Eb%2Ec", "a"}


def test_a_shard_of_no_pictures_is_refused(two_variants, tmp_path) -> None:
    with pytest.raises(InputError, match="option pictures='0' is not possible; give how many pictures"):
        write_export(two_variants, "webdataset", tmp_path / "out", options={"pictures": "0"})
