"""Indexes written a row at a time are what a JSON or CSV reader reads, with all digits of every number."""

import csv
import io
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.commands.export.writer import RowText, Writer
from spin_usd.errors import UnsupportedError
from spin_usd.exchange.layout.export_format import MadeFile
from spin_usd.exchange.layout.index_file import csv_line, csv_table, json_list, json_lists, json_object


def written(tmp_path, index, rows):
    (tmp_path / "work").mkdir(exist_ok=True)
    writer = Writer(out=tmp_path, work=tmp_path / "work", indexes={"index": index}, copy=False)
    for section, value in rows:
        writer.add(RowText(path="index", section=section, text=index.text(value)))
    writer.finish()
    writer.close()
    return (tmp_path / "index").read_text()


@pytest.mark.parametrize("rows", [[], [{"a": 1}], [{"a": 0.1}, {"b": [1, 2]}]])
def test_a_list_is_json(tmp_path, rows) -> None:
    assert json.loads(written(tmp_path, json_list(), [("", row) for row in rows])) == rows


@pytest.mark.parametrize("members", [{}, {"0": [1]}, {"0": [1], "1": None}])
def test_an_object_is_json(tmp_path, members) -> None:
    assert json.loads(written(tmp_path, json_object(), [("", row) for row in members.items()])) == members


def test_several_lists_take_rows_in_any_order(tmp_path) -> None:
    index = json_lists({"info": {"year": 1}}, ("images", "annotations", "nothing"))
    rows = [("images", 1), ("annotations", "a"), ("images", 2)]
    found = json.loads(written(tmp_path, index, rows))
    assert found == {"info": {"year": 1}, "images": [1, 2], "annotations": ["a"], "nothing": []}


def test_a_list_without_a_head_is_json(tmp_path) -> None:
    assert json.loads(written(tmp_path, json_lists({}, ("images",)), [("images", 1)])) == {"images": [1]}


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_csv_keeps_every_digit(number) -> None:
    (row,) = csv.reader(io.StringIO(csv_line(("a, b", np.float64(number), 3))))
    assert row[0] == "a, b"
    assert float(row[1]) == number
    assert row[2] == "3"


def test_a_table_has_its_headings_also_without_rows(tmp_path) -> None:
    assert written(tmp_path, csv_table(("x", "y")), []) == "x,y\n"


def test_json_has_no_nan(tmp_path) -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        written(tmp_path, json_list(), [("", float("nan"))])


@pytest.mark.parametrize("path", ["../out", "/etc/x", "a/../../b"])
def test_no_file_leaves_the_folder(tmp_path, path) -> None:
    writer = Writer(out=tmp_path / "out", work=tmp_path / "work", indexes={}, copy=False)
    with pytest.raises(UnsupportedError, match="cannot name the file"):
        writer.write(MadeFile(path=path, write=lambda file: None))
