"""The published schemas are those of the documents' types, and say all that is in them."""

import json
import runpy

import pytest
from jsonschema import Draft202012Validator

from spin_usd.basics.resources import schemas
from tests.conftest import REPOSITORY

BUILT = dict(runpy.run_path(str(REPOSITORY / "tools" / "build_record_schemas"))["texts"]())
WORDS = {"type", "enum", "const", "$ref", "anyOf", "prefixItems"}


@pytest.mark.parametrize("name", BUILT)
def test_a_schema_is_that_of_its_type(name) -> None:
    assert (schemas() / name).read_text() == BUILT[name], "run tools/build_record_schemas"


@pytest.mark.parametrize("name", BUILT)
def test_a_schema_says_what_each_field_is(name) -> None:
    schema = json.loads(BUILT[name])
    Draft202012Validator.check_schema(schema)
    for part in (schema, *schema.get("$defs", {}).values()):
        for field in part.get("properties", {}).values():
            assert WORDS & field.keys(), field
