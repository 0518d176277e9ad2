"""A dataset's own files: each thing that is wrong has one finding, and hides no other."""

import re
import shutil
from pathlib import Path

import pytest

from spin_usd.basics.progress import no_progress
from spin_usd.commands.check.dataset import cache_findings, dataset_findings, sums_findings
from spin_usd.commands.check.digests import MAKE_AGAIN, provenance_findings
from spin_usd.commands.check.inventory import Inventory
from spin_usd.commands.check.strays import stray_findings
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.store.cache import uses
from spin_usd.store.dataset_folder import Store
from spin_usd.store.read_documents import read_dataset_json, read_record
from spin_usd.store.stage_layers import STAGE_SUMS, refuse_changed_stage
from tests.cases.records import record_files

PICTURE = "nominal/img000001"


@pytest.fixture
def dataset(rendered, tmp_path):
    return shutil.copytree(rendered, tmp_path / "dataset")


def found(dataset):
    return [(each.code, each.where) for each in dataset_findings(dataset, progress=no_progress)]


def inventory_of(dataset, unread=()):
    """What `check` knows when it has seen all records but those that are `unread`."""
    present = {path.relative_to(dataset).as_posix() for path in dataset.rglob("*") if path.is_file()}
    description = read_dataset_json(Folder(dataset))
    inventory = Inventory(root=dataset, description=description, present=present, unread=set(unread))
    for path in record_files(dataset):
        name = path.relative_to(dataset).as_posix()
        if name not in inventory.unread:
            record = read_record(Folder(dataset), name)
            inventory.files.update(file.path for file in record.files.values())
            inventory.uses |= uses(record)
            list(provenance_findings(name, record.variant, record.provenance.stage, inventory))
    return inventory


def test_one_unusable_file_hides_nothing_and_is_one_finding(dataset) -> None:
    """dataset.json, a record, the stage and a link, with a damaged image beside them."""
    image = dataset / f"image/{PICTURE}.png"
    image.write_bytes(image.read_bytes()[:-1] + b"?")
    (dataset / "dataset.json").write_text('{"schema": "dataset-1"}')
    (dataset / "records/nominal/img000002.json").write_text("{")
    shutil.rmtree(dataset / "stage")
    linked = dataset / "depth/nominal/img000003.exr"
    linked.unlink()
    linked.symlink_to(image)
    assert found(dataset) == [
        ("link", "depth/nominal/img000003.exr"),
        ("description", "dataset.json"),
        ("stage", "stage"),
        ("sha256", f"image/{PICTURE}.png"),
        ("record", "records/nominal/img000002.json"),
    ]


def test_what_repair_leaves_is_not_said_to_be_repaired(dataset) -> None:
    (dataset / "outside").mkdir()
    for name in ("image", "dataset.json"):
        place = dataset / name
        place.rename(dataset / "outside" / name)
        place.symlink_to(dataset / "outside" / name)
    told = list(dataset_findings(dataset, progress=no_progress))
    assert {each.where for each in told} >= {"image", "dataset.json"}
    assert not [each for each in told if MAKE_AGAIN in each.message]


def lines(dataset):
    return (dataset / STAGE_SUMS).read_text().splitlines()


SUMS = {
    "junk": lambda lines: ["junk"],
    "empty": lambda lines: [],
    "half a line more": lambda lines: [*lines, lines[0][:20]],
    "another digest": lambda lines: [
        f"{'0' * 64}{line[64:]}" if line.endswith("dataset.usda") else line for line in lines
    ],
}


@pytest.mark.parametrize("name", SUMS)
def test_a_damaged_list_of_the_stages_files_is_named_and_not_a_layer(dataset, name) -> None:
    """By check, and by whoever would replace the stage."""
    store = Store(root=dataset)
    assert list(sums_findings(store, inventory_of(dataset))) == []
    (dataset / STAGE_SUMS).write_text("\n".join(SUMS[name](lines(dataset))) + "\n")
    (finding,) = sums_findings(store, inventory_of(dataset))
    assert (finding.code, finding.where) == ("sums", STAGE_SUMS)
    assert (MAKE_AGAIN in finding.message) == (name not in ("junk", "empty"))  # nobody vouches for other looks' layers
    with pytest.raises(InputError, match=r"SHA256SUMS: does not match .* run spin-usd check --repair"):
        refuse_changed_stage(store, "is altered", do="")
    refuse_changed_stage(store, "is altered", do="", new=dataset / "stage")


def test_a_layer_that_nobody_vouches_for_is_named_itself(dataset) -> None:
    used = {layer for layer, _ in inventory_of(dataset).layers}
    names = (path.relative_to(dataset).as_posix() for path in sorted((dataset / "stage").rglob("*.usda")))
    other = next(name for name in names if name not in used)
    (dataset / other).write_text("#usda 1.0\n")
    (finding,) = sums_findings(Store(root=dataset), inventory_of(dataset))
    assert finding.where == other
    with pytest.raises(InputError, match=f"{Path(other).name}: is altered"):
        refuse_changed_stage(Store(root=dataset), "is altered", do="")


def test_files_of_a_record_that_cannot_be_used_are_not_called_stray(dataset) -> None:
    """Nor is what they may use of the cache; of a lost record its files are one finding."""
    record = f"records/{PICTURE}.json"
    assert list(stray_findings(inventory_of(dataset, unread=[record]))) == []
    assert list(cache_findings(Store(root=dataset), inventory_of(dataset, unread=[record]))) == []
    (dataset / record).unlink()
    (dataset / "image/notes.txt").write_text("mine")
    lost, notes = stray_findings(inventory_of(dataset))
    assert (lost.where, notes.where) == (f"dense_pose/{PICTURE}.exr", "image/notes.txt")
    assert re.match(r"is not in any record, nor are \d other files of that picture; if it is", lost.message)
    assert notes.message.startswith("is not in any record; move it elsewhere")


def test_a_damaged_render_in_the_cache_is_said_to_be_repaired(dataset) -> None:
    """One that no picture uses is not."""
    entry = sorted((dataset / "cache/renders").rglob("*.exr"))[0]
    entry.write_bytes(b"junk")
    inventory = inventory_of(dataset)
    (finding,) = cache_findings(Store(root=dataset), inventory)
    assert finding.message == f"is damaged; {MAKE_AGAIN}"
    inventory.uses.clear()
    messages = [each.message for each in cache_findings(Store(root=dataset), inventory)]
    assert messages.count("is damaged, and no picture uses it; remove it") == 1
    assert "no picture uses it; the next full render that makes a picture removes it" in messages
