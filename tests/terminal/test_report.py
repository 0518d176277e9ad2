"""What --json prints. Wherever a test asks for it, the fixture spin_usd holds it to its schema."""

import json

import pytest
from jsonschema import Draft202012Validator

from spin_usd.basics.resources import schemas

REPORTS = sorted(schemas().glob("*-report-1.schema.json"))


def test_a_machine_is_not_well_where_a_line_has_a_remedy(spin_usd) -> None:
    """Whatever else this one lacks, it has no such folder."""
    report = json.loads(spin_usd("doctor", "--folder", "no such folder", "--json", code=1).stdout)
    assert not report["well"]
    assert {line["subject"]: line["remedy"] for line in report["lines"]}["disk"] == "choose a folder that exists"


def test_progress_goes_to_standard_error(spin_usd, small_stage) -> None:
    planned = spin_usd("plan", small_stage, "--json")
    assert "planning: picture 8 of 8" in planned.stderr.splitlines()
    assert planned.stdout.count("\n") == 1


def test_an_error_is_a_sentence_on_standard_error_alone(spin_usd) -> None:
    refused = spin_usd("check", "no such path", "--json", code=2)
    assert refused.stdout == ""
    assert refused.stderr == "spin-usd: no such path: does not exist; check the path\n"


@pytest.mark.parametrize("file", REPORTS, ids=lambda file: file.name.partition(".")[0])
def test_a_schema_allows_nothing_that_it_does_not_explain(file) -> None:
    schema = json.loads(file.read_text())
    Draft202012Validator.check_schema(schema)
    assert schema["properties"]["schema"] == {"const": file.name.partition(".")[0]}
    assert schema["additionalProperties"] is False
    assert set(schema["required"]) <= set(schema["properties"])
