"""Croissant: what its specification asks for, and a table that describes the linked files."""

import csv
import json

import pytest

from spin_usd.exchange.croissant import MEDIA_TYPES
from spin_usd.files.sha256 import sha256_of
from spin_usd.formats.image_file import ENDINGS
from spin_usd.labels.table import LABELS
from tests.exchange.conftest import write_export


@pytest.fixture(scope="module")
def croissant(two_variants, tmp_path_factory):
    out = tmp_path_factory.mktemp("croissant") / "out"
    write_export(two_variants, "croissant", out, split="train=0.5,test=0.5")
    return out


def test_required_properties_are_there(croissant) -> None:
    found = json.loads((croissant / "croissant.json").read_text())
    assert found["conformsTo"] == "http://mlcommons.org/croissant/1.0"
    assert {"@context", "@type", "name", "description", "distribution", "recordSet"} <= set(found)
    assert found["@context"]["recordSet"] == "cr:recordSet"


def test_every_resource_leads_to_files(croissant) -> None:
    found = json.loads((croissant / "croissant.json").read_text())
    for resource in found["distribution"]:
        if resource["@type"] == "cr:FileObject":
            assert resource["sha256"] == sha256_of(croissant / resource["contentUrl"])
        else:
            assert len(list(croissant.glob(resource["includes"]))) == 12
    ids = {resource["@id"] for resource in found["distribution"]}
    sources = [field["source"] for field in found["recordSet"][0]["field"]]
    assert all((source.get("fileObject") or source["fileSet"])["@id"] in ids for source in sources)


def test_every_column_is_described(two_variants, croissant) -> None:
    found = json.loads((croissant / "croissant.json").read_text())
    with (croissant / "records.csv").open() as file:
        rows = list(csv.DictReader(file))
    described = [field["source"]["extract"].get("column") for field in found["recordSet"][0]["field"]]
    assert set(rows[0]) == set(described) - {None}
    record = json.loads((two_variants / "records" / "noisy_1" / "img000002.json").read_text())
    row = next(row for row in rows if row["name"] == "img000002-noisy_1")
    assert [float(row[f"q_{axis}"]) for axis in "wxyz"] == record["pose"]["q_cam_body"]
    assert [float(row[f"t_{axis}"]) for axis in "xyz"] == record["pose"]["t_cam_body"]
    assert float(row["k1"]) == record["camera"]["distortion"][0]
    assert (croissant / "depth" / row["depth"]).samefile(two_variants / record["files"]["depth"]["path"])


def test_every_kind_of_file_has_a_media_type() -> None:
    """An image or a label whose ending has none could not be described."""
    assert {*ENDINGS, *(label.suffix for label in LABELS.values())} <= set(MEDIA_TYPES)
