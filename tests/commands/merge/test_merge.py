"""Shards made apart and merged are the dataset of a single run; what does not belong together is refused."""

import json
import os
import shutil

import pytest

import spin_usd as package
from spin_usd.commands.check.dataset import dataset_findings, shard_findings
from spin_usd.commands.merge.run import merge_datasets
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.planning.cost import read_measured
from spin_usd.store.cache import MEASURED
from spin_usd.store.dataset_folder import Store
from spin_usd.store.names import SHARDS, event_record_of, events_of
from spin_usd.store.tags import read_tags
from tests.cases.events import make_events, put_events
from tests.cases.records import record_files
from tests.commands.merge.folder import content

NAME = "records/nominal/img000001.json"


def quiet(*_) -> None:
    pass


@pytest.fixture(scope="module")
def made(make, tmp_path_factory):
    """The folders of three shards."""
    folder = tmp_path_factory.mktemp("shards")
    return [_made(make, folder / str(number), f"{number}/3") for number in range(3)]


def _made(make, out, shard, **options):
    make(out, shard, **options)
    return out


@pytest.fixture
def shards(made, tmp_path):
    """Their copies, the test's own; links among a shard's files stay links."""
    return [_copied(shard, tmp_path / "apart" / shard.name) for shard in made]


def _copied(shard, to):
    known: dict[tuple[int, int], str] = {}

    def link_or_copy(source, target):
        found = os.stat(source)
        key = found.st_dev, found.st_ino
        if key in known:
            os.link(known[key], target)
        else:
            known[key] = shutil.copyfile(source, target)

    return shutil.copytree(shard, to, copy_function=link_or_copy)


def some_record(shard):
    return record_files(shard)[0]


@pytest.mark.parametrize("copy", [False, True])
def test_merged_shards_are_the_bytes_of_one_run(whole, made, tmp_path, copy) -> None:
    out = tmp_path / "merged"
    before = [content(shard) for shard in made]
    report = merge_datasets(made, out, copy=copy, progress=quiet)
    assert (report.pictures, report.added, report.kept, report.missing) == (12, 12, 0, {})
    assert content(out) == whole
    assert [content(shard) for shard in made] == before
    measured = [read_measured(Folder(shard), MEASURED).taken["stage"] for shard in made]
    assert read_measured(Folder(out), MEASURED).taken["stage"] == pytest.approx(sum(measured))
    linked = (out / NAME).samefile(next(shard / NAME for shard in made if (shard / NAME).exists()))
    assert linked is not copy


def test_labels_that_variants_share_are_shared_in_a_copy_too(made, tmp_path) -> None:
    merge_datasets(made, tmp_path / "merged", copy=True, progress=quiet)
    depth = tmp_path / "merged" / "depth"
    assert (depth / "nominal" / "img000002.exr").samefile(depth / "dim_1" / "img000002.exr")


def test_a_merged_dataset_is_whole_to_check_and_to_render(made, make, tmp_path, spin_usd) -> None:
    merge_datasets(made, tmp_path / "merged", progress=quiet)
    found = json.loads(spin_usd("check", tmp_path / "merged", "--json").stdout)["findings"]
    assert {finding["code"] for finding in found} <= {"target-small", "nearly-black"}  # tiny pictures, in poor light
    assert make(tmp_path / "merged").made == 0


def test_it_says_which_shard_is_missing_and_takes_it_later(whole, made, tmp_path, spin_usd) -> None:
    out = tmp_path / "merged"
    done = spin_usd("merge", made[0], made[2], "--out", out, code=1)
    assert "missing: 4 pictures of shard 1/3" in done.stderr
    assert (out / SHARDS).read_bytes() == (made[0] / SHARDS).read_bytes()
    (finding,) = (each for each in dataset_findings(out, progress=quiet) if each.code == "shards")
    expected = (SHARDS, "missing: 4 pictures of shard 1/3", "warning")
    assert (finding.where, finding.message, finding.severity) == expected
    report = package.merge(made[1], out=out)
    assert (report.added, report.kept, report.missing) == (4, 8, {})
    assert content(out) == whole
    assert list(shard_findings(Store(root=out))) == []
    assert package.merge(made, out=out).added == 0


def test_a_picture_is_missing_once_whatever_the_partitions(make, made, tmp_path) -> None:
    """Shards of three and of two, which have pictures in common."""
    half = _made(make, tmp_path / "half", "0/2")
    report = merge_datasets([made[0], half], tmp_path / "merged", progress=quiet)
    assert sum(report.missing.values()) == 12 - report.pictures


@pytest.mark.parametrize("given", [["", "--out", "m"], ["a", "--out", ""]])
def test_an_empty_path_is_not_the_current_folder(spin_usd, given) -> None:
    assert "is ''; make it a path" in spin_usd("merge", *given, code=2).stderr
    with pytest.raises(InputError, match=r"out is ''; make it a path"):
        package.merge("a", out="")


def test_a_merge_that_was_stopped_goes_on(whole, made, tmp_path) -> None:
    class StoppedError(Exception):
        pass

    def stop(what, done, total) -> None:
        if (what, done) == ("merging: picture", 7):
            raise StoppedError

    out = tmp_path / "merged"
    with pytest.raises(StoppedError):
        merge_datasets(made, out, progress=stop)
    assert len(list(Store(root=out).records())) == 7
    assert merge_datasets(made, out, progress=quiet).added == 5
    assert content(out) == whole


def test_a_picture_that_shards_contradict_each_other_in_is_refused(made, shards, tmp_path) -> None:
    taken = some_record(made[0])
    name = taken.relative_to(made[0])
    record = json.loads(taken.read_text())
    record["index"] += 1
    (shards[1] / name).write_text(json.dumps(record))
    with pytest.raises(InputError, match=f"{name.name}: contradicts .*/{name.name}"):
        merge_datasets(shards, tmp_path / "merged", progress=quiet)
    assert not (tmp_path / "merged").exists()


def test_a_run_without_a_shard_makes_what_is_missing_and_waits_for_no_shard(whole, make, made, tmp_path) -> None:
    out = tmp_path / "merged"
    merge_datasets(made[:2], out, progress=quiet)
    assert (out / SHARDS).exists()
    assert (make(out).made, content(out)) == (4, whole)


def test_a_label_that_the_next_frame_decides_is_that_of_one_run(make, tmp_path) -> None:
    """The next frame is another shard's."""
    make(tmp_path / "whole", labels=("flow",))
    shards = [_made(make, tmp_path / str(number), f"{number}/2", labels=("flow",)) for number in range(2)]
    merge_datasets(shards, tmp_path / "merged", progress=quiet)
    assert content(tmp_path / "merged") == content(tmp_path / "whole")


def test_variants_that_were_made_apart_are_merged_like_shards(whole, make, tmp_path) -> None:
    apart = [_made(make, tmp_path / name, None, variants=(name,)) for name in ("nominal", "dim_1")]
    merge_datasets(apart, tmp_path / "merged", progress=quiet)
    assert content(tmp_path / "merged") == whole


def test_the_events_of_variants_that_were_made_apart_are_merged(make, tmp_path) -> None:
    apart = {name: _made(make, tmp_path / name, None, variants=(name,)) for name in ("nominal", "dim_1")}
    for seed, (variant, folder) in enumerate(apart.items()):
        put_events(folder, make_events(500, seed=seed), variant=variant)
    for _ in range(2):
        merge_datasets(list(apart.values()), tmp_path / "merged", progress=quiet)
        for variant, folder in apart.items():
            for name in (events_of(variant), event_record_of(variant)):
                assert (tmp_path / "merged" / name).read_bytes() == (folder / name).read_bytes()
    shutil.rmtree(apart["nominal"] / "events")  # whose files are linked
    put_events(apart["nominal"], make_events(500, seed=2))
    with pytest.raises(InputError, match=r"nominal.h5: contradicts .*nominal.h5; remove one of them, with its record"):
        merge_datasets(list(apart.values()), tmp_path / "merged", progress=quiet)


def test_a_shard_without_a_frame_is_merged_like_others(whole, make, tmp_path) -> None:
    """Seven shards of six frames."""
    shards = [_made(make, tmp_path / str(number), f"{number}/7") for number in range(7)]
    merge_datasets(shards, tmp_path / "merged", progress=quiet)
    assert content(tmp_path / "merged") == whole


def test_equal_pictures_in_two_shards_are_one(whole, made, shards, tmp_path) -> None:
    shutil.copytree(made[0] / "records", shards[1] / "records", dirs_exist_ok=True)
    merge_datasets(shards, tmp_path / "merged", progress=quiet)
    assert content(tmp_path / "merged") == whole


def test_the_tags_of_all_are_joined(shards, tmp_path) -> None:
    """Also with those that are there, and again."""
    given = ({"good": ["nominal/a", "nominal/b"]}, {"good": ["nominal/b", "nominal/c"]}, {"bad": ["nominal/a"]})
    for shard, tags in zip(shards, given, strict=True):
        (shard / "tags.json").write_text(json.dumps({"schema": "tags-1", "dataset": shard.name, "tags": tags}))
    merge_datasets(shards[:2], tmp_path / "all", progress=quiet)
    merge_datasets(shards, tmp_path / "all", progress=quiet)
    joined = {"good": ["nominal/a", "nominal/b", "nominal/c"], "bad": ["nominal/a"]}
    assert read_tags(tmp_path / "all" / "tags.json") == joined


def test_tags_that_are_wrongly_written_are_refused_before_anything_is_merged(shards, tmp_path) -> None:
    (shards[1] / "tags.json").write_text('{"schema": "tags-1", "dataset": "mine", "tags": {"good": "nominal/a"}}')
    form = (
        r'write it like {"schema": "tags-1", "dataset": "NAME", "tags": {"good": \["nominal/img000001"\]}}, or save it'
    )
    with pytest.raises(InputError, match=rf"tags\.json: breaks schema tags-1 at \$\.tags\.good: .*; {form}"):
        merge_datasets(shards, tmp_path / "all", progress=quiet)
    assert not (tmp_path / "all" / "dataset.json").exists()


@pytest.mark.parametrize("kind", ["image", "depth"])
def test_a_damaged_file_is_refused(shards, tmp_path, kind) -> None:
    files = sorted((shards[1] / kind).rglob("*.*"))
    files[0].write_bytes(files[0].read_bytes()[:-1] + b"?")
    rest = r"run spin-usd check --repair \S*/apart/1, and merge again: [4-7] of 12 pictures are merged and stay"
    with pytest.raises(InputError, match=f"does not match its record; {rest}"):
        merge_datasets(shards, tmp_path / "merged", progress=quiet)
    assert 4 <= len(list(Store(root=tmp_path / "merged").records())) <= 7


def test_a_damaged_record_is_refused(shards, tmp_path) -> None:
    for text in ("", "[]", "[" * 100_000, '{"files": {"image": {"path": "../../x"}}}'):
        some_record(shards[1]).write_text(text)
        with pytest.raises(InputError, match=r"is not this picture's record; run spin-usd check --repair"):
            merge_datasets(shards, tmp_path / "merged", progress=quiet)


def test_what_was_rendered_otherwise_is_refused(shards, tmp_path) -> None:
    path = some_record(shards[1])
    record = json.loads(path.read_text())
    record["provenance"]["seed"]["dataset"] += 1
    path.write_text(json.dumps(record))
    with pytest.raises(InputError, match="was rendered with another seed than"):
        merge_datasets(shards, tmp_path / "merged", progress=quiet)


@pytest.mark.parametrize("first", [0, 1])
def test_an_option_that_only_some_records_say_is_refused_in_any_order(shards, tmp_path, first) -> None:
    """Records leave out what is as usual."""
    record = some_record(shards[0])
    document = json.loads(record.read_text())
    document["provenance"]["options"] = {"image_format": "jpg"}
    record.write_text(json.dumps(document))
    given = [shards[first], shards[1 - first]]
    with pytest.raises(InputError, match="was rendered with another image_format than"):
        merge_datasets(given, tmp_path / "out", progress=quiet)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [("files", {}, "other kinds of file"), ("frames", 7, "another number of frames"), ("stage", None, "another stage")],
)
def test_datasets_that_differ_are_refused(shards, tmp_path, name, value, words) -> None:
    description = json.loads((shards[1] / "dataset.json").read_text())
    if name == "stage":
        description["stage"]["hashes"]["nominal"] = "0" * 64
    else:
        description[name] = value
    (shards[1] / "dataset.json").write_text(json.dumps(description))
    with pytest.raises(InputError, match=f"has {words} than"):
        merge_datasets(shards, tmp_path / "merged", progress=quiet)


def test_a_stage_that_was_changed_is_refused(shards, tmp_path) -> None:
    layer = shards[1] / "stage" / "dataset.usda"
    layer.write_text(layer.read_text() + "# mine\n")
    with pytest.raises(InputError, match=r"dataset\.usda: is not as spin-usd wrote it"):
        merge_datasets(shards, tmp_path / "merged", progress=quiet)


def test_folders_that_are_no_datasets_or_lie_in_each_other_are_refused(shards, tmp_path) -> None:
    (tmp_path / "empty").mkdir()
    for given, out, words in (
        ([], tmp_path / "m", "nothing to merge"),
        ([tmp_path / "empty"], tmp_path / "m", r"it has no dataset\.json"),
        (shards, shards[0], "is the folder to merge into"),
        (shards, shards[0] / "m", "0/m: one lies inside the other"),
        (shards, tmp_path, "one lies inside the other"),
        ([*shards, shards[0] / "../0"], tmp_path / "m", "0/../0: is given twice"),
    ):
        with pytest.raises(InputError, match=words):
            merge_datasets(given, out, progress=quiet)


def test_a_link_in_a_shard_is_not_followed(shards, tmp_path) -> None:
    secret = tmp_path / "secret.png"
    secret.write_text("mine")
    image = sorted((shards[1] / "image").rglob("*.png"))[0]
    image.unlink()
    image.symlink_to(secret)
    with pytest.raises(InputError, match="link"):
        merge_datasets(shards, tmp_path / "merged", progress=quiet)


@pytest.mark.slow
def test_merged_shards_of_blender_are_the_bytes_of_one_run(make, tmp_path) -> None:
    make(tmp_path / "whole", renderer="blender")
    shards = [_made(make, tmp_path / str(number), f"{number}/3", renderer="blender") for number in range(3)]
    merge_datasets(shards, tmp_path / "merged", progress=quiet)
    assert content(tmp_path / "merged") == content(tmp_path / "whole")
