import csv
import errno
import gzip
import io
import json
import logging
import lzma
import struct
import tomllib
import warnings
import zipfile
import zlib

import cv2
import numpy as np
import pytest
from pxr import Tf, Usd

from spin_usd.basics.faults import decoding, expected, reading
from spin_usd.errors import InputError, OutputError

FILE = "/data/poses.json"


def _singular() -> None:
    np.linalg.solve(np.zeros((2, 2)), np.ones(2))


PARSERS = {
    "text": lambda: b"\xff".decode(),
    "nesting": lambda: json.loads("[" * 200_000),
    "json": lambda: json.loads("{"),
    "toml": lambda: tomllib.loads("="),
    "numbers": _singular,
    "a number": lambda: float(10**400),
    "opencv": lambda: cv2.Rodrigues(np.zeros(5)),
    "usd": lambda: Usd.Stage.Open("/no/such/stage.usda"),
    "a table": lambda: list(csv.reader(["a" * 200_000])),
    "memory": lambda: bytes(1 << 62),
    "head of an array": lambda: np.lib.format.read_array(io.BytesIO(b"\x93NUMPY\x01\x00\x10\x00{'descr': '<f4, \n")),
    "zip file": lambda: zipfile.ZipFile(io.BytesIO(b"PK")),
    "packed by zlib": lambda: zlib.decompress(b"x"),
    "packed by lzma": lambda: lzma.decompress(b"\xfd7zXZ\x00" + bytes(20)),
    "cut short": lambda: gzip.decompress(b"\x1f\x8b\x08" + bytes(8)),
    "numbers of a record": lambda: struct.unpack("<q", b"1234"),
}


@pytest.mark.parametrize("name", PARSERS)
def test_what_a_parser_raises_is_the_fault_of_its_input(name) -> None:
    with pytest.raises(InputError, match=FILE), reading(FILE):
        PARSERS[name]()


def test_the_classes_of_usd_are_named_as_usd_names_them() -> None:
    assert f"{Tf.ErrorException.__module__}.{Tf.ErrorException.__qualname__}" == "pxr.Tf.ErrorException"


@pytest.mark.parametrize("fault", [KeyError("x"), TypeError("x"), ZeroDivisionError(), ValueError("x"), OSError("x")])
def test_a_defect_of_ours_stays_one(fault) -> None:
    assert expected(fault) is None
    with pytest.raises(type(fault)), reading(FILE):
        raise fault


@pytest.mark.parametrize("fault", [NotImplementedError("zip file version 11.1"), KeyError("x"), OSError("x")])
def test_whatever_a_decoder_raises_is_the_fault_of_its_bytes(fault) -> None:
    with pytest.raises(InputError, match=FILE), decoding(FILE):
        raise fault


def test_what_the_system_refuses_is_no_fault_of_bytes() -> None:
    with pytest.raises(OutputError, match="disk"), decoding(FILE):
        raise OSError(errno.EIO, "Input/output error")


def test_an_error_that_says_where_keeps_it() -> None:
    with pytest.raises(InputError, match=r"^other: is wrong$"), reading(FILE):
        raise InputError("is wrong", where="other")


def test_what_the_system_refuses_is_said_with_the_file_and_the_remedy(tmp_path) -> None:
    with pytest.raises(OutputError, match=r"aaa: .*File name too long; give a shorter"), reading(None):
        (tmp_path / ("a" * 300 + "aaa")).stat()
    assert "ulimit -n" in str(expected(OSError(errno.EMFILE, "")))


def test_what_a_library_warns_of_and_logs_while_it_decodes_is_not_printed(capfd: pytest.CaptureFixture[str]) -> None:
    with decoding(FILE):
        warnings.warn("odd", RuntimeWarning, stacklevel=1)
        for name in ("trimesh", "trimesh.base", "PIL.Image"):
            logging.getLogger(name).warning("odd")
    assert capfd.readouterr() == ("", "")
