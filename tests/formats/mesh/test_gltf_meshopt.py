"""meshopt's streams, compressed by its own library (npm meshoptimizer 1.x), and what they were made of."""

import base64

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.formats.mesh.gltf_meshopt import Compressed, decoded_view
from spin_usd.formats.mesh.mesh_file import read_mesh_file

STEP = {"oct8": 0.02, "oct16": 1e-3, "quat": 1e-3, "exp": 1e-4}  # what the filters' few bits leave of numbers up to 1

CASES = {  # what the extension says of the view, its compressed bytes, and those before (floats before a filter)
    "pos5": (
        {"count": 5, "byteStride": 12, "mode": "ATTRIBUTES", "filter": "NONE"},
        (
            "oAE/wAAARp3c2gE/wAAAWjnsMgE/wAAAG/+GegE4AAAABQE/wAAA93NVtAE/wAAAFW09kgEPwAAAsKJwASmAAAABP8AAAJG4"
            "QhUBP8AAADsXUjoBP8AAAK2uepMBIIAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA/YwDP1fWIzw+1KM8"
        ),
        "/YwDP1fWIzw+1KM8ILn1PNvLIz31tkw90Zx1PaGUez5RqqM9PxK4PXZ1zD1y0+A9rCv1PdC+BD5n8JY+",
    ),
    "u16_37": (
        {"count": 37, "byteStride": 8, "mode": "ATTRIBUTES", "filter": "NONE"},
        (
            "oB8AGBgYGBgYGBgYGDdoGBgYGIxbGE1+ECAYGBgYGBgYGP/AAAAYGBgYGAUAAAPAVFM8/wAAfX7DxE1QHwAYGBgYGBgYGBgY"
            "GBgYGCQMGBgYGBgYGBgYGBgYGBgY/8AAABgYGBgYBQAAAAOFwAgAAIYfAN4MGBgYGBgYGNP7GBgYGBgYGBgYGBgYGBgYcaIY"
            "GBj/wAAAGBgYGBgFPAAPAJkFeHcAIAPAx8gfABgYGBgYGBgYGBgYGBgYGBgYGBgYGBgYGBgYGBgYGBj/wAAAGBgYGL4UACAA"
            "AADAAAAaAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAADAKlQCQA="
        ),
        (
            "AAADAKlQCQAMAA8AGAMVABgAGwAeACEAJAAnACoALQAwADMANgA5ADwAPwBCAEUASABLAE4AUQBUAFcAWgBdAGAAYwBmAGkA"
            "bABvAHIAdQB4AHsACDyBAFwqhwCKAI0AkACTAJYAmQCcAJ8AogClAKgAqwCuALEAtAC9vboAvQDAAMMAxgDJAAbBzwDSANUA"
            "2ADbAN4A4QDkAOcA6gDtAL2e8wD2APkA/AD/AAIBBQEE2QsBDgERARQBFwEaAR0BIAEjASYBKQEsAS8BMgE1ATgBOwE+AUEB"
            "RAFHAQWdTQFQAVMBVgFZAVwBXwFiAWUBaAFrAW4BcQF0AXcBegF9AYABgwGGAYkBjAGPAZIBlQGYAZsBngGhAaQBpwGqAa0B"
            "sAGzAbYBDA4="
        ),
    ),
    "grid": (
        {"count": 54, "byteStride": 4, "mode": "TRIANGLES", "filter": "NONE"},
        "4f4eEA4QDo4eFA4TDo4eEw4TDg8IAHaHVmd4qYZliWiYAWkAAA==",
        (
            "AAAAAAEAAAAEAAAAAQAAAAUAAAAEAAAAAQAAAAIAAAAFAAAAAgAAAAYAAAAFAAAAAgAAAAMAAAAGAAAAAwAAAAcAAAAGAAAA"
            "BAAAAAUAAAAIAAAABQAAAAkAAAAIAAAABQAAAAYAAAAJAAAABgAAAAoAAAAJAAAABgAAAAcAAAAKAAAABwAAAAsAAAAKAAAA"
            "CAAAAAkAAAAMAAAACQAAAA0AAAAMAAAACQAAAAoAAAANAAAACgAAAA4AAAANAAAACgAAAAsAAAAOAAAACwAAAA8AAAAOAAAA"
        ),
    ),
    "random16": (
        {"count": 60, "byteStride": 2, "mode": "TRIANGLES", "filter": "NONE"},
        (
            "4f///////////////////////////1q4A90B/+oCpQKIBP8IlQbAAf+cAXEx/5cCsAHMBP8IlwPqAf83hwGuAf+TAdQDpwX/"
            "J5oEtwP/ggLgApUC/4UCtQLUBv/zAbICA//PBfgEnwX/hAaxAy360QIK/7gF9QWSBf8wogGxAv8t8QNk/8wCJvYC//sD5wGI"
            "AQB2h1ZneKmGZYlomAFpAAA="
        ),
        (
            "LQAJAZoATwG8AMABxAE5AJkA5wCuAJUACQBhAIcBiwG/ADQBGAHUACsB4QDLAXcAYwBwAZQAFQHFAToBtwAcAMYBTAHlAeMB"
            "ewC3AWcA6QEQAfkAUABVAMYBsQE2AH8BlwHoAU8BOAE/AHEAFwEqAeUB5wBzALcA"
        ),
    ),
    "seq": (
        {"count": 60, "byteStride": 4, "mode": "INDICES", "filter": "NONE"},
        (
            "0bUBpAi1A5gCiQHEAxCLBKoJuQVUYvcGzgH5CxH4AtsCb1RNNIEFpgNO6wLEAesCxAmVAbYI9wi8CMEJfAbDBq4BT8gBpQVb"
            "4gwUtQZTescBYcgNnwJbog2bBuAGTNELigLHC74BAAAAAA=="
        ),
        (
            "LQAAAAkBAACaAAAATwEAALwAAADAAQAAxAEAADkAAACZAAAA5wAAAK4AAACVAAAACQAAAGEAAACHAQAAiwEAAL8AAAA0AQAA"
            "GAEAANQAAAArAQAA4QAAAMsBAAB3AAAAYwAAAHABAACUAAAAFQEAAMUBAAA6AQAAtwAAABwAAADGAQAATAEAAOUBAADjAQAA"
            "ewAAALcBAABnAAAA6QEAABABAAD5AAAAUAAAAFUAAADGAQAAsQEAADYAAAB/AQAAlwEAAOgBAABPAQAAOAEAAD8AAABxAAAA"
            "FwEAACoBAADlAQAA5wAAAHMAAAC3AAAA"
        ),
    ),
    "oct8": (
        {"count": 5, "byteStride": 4, "mode": "ATTRIBUTES", "filter": "OCTAHEDRAL"},
        "oAE/wAAAyekrEAE/wAAAUxNqOwAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA5CfwA=",
        (
            "PY4wPsBVTT+2XxI/AAAAAJX5cr+QG4Q+4d44PgAAAADP0SM/ukIxPiOqPz8AAAAAZi3BPj2dWD9rt8A+AAAAAOslAj+gpP8+"
            "tpszPwAAAAA="
        ),
    ),
    "oct16": (
        {"count": 5, "byteStride": 8, "mode": "ATTRIBUTES", "filter": "OCTAHEDRAL"},
        "oAE/wAAAt4HH/AE/gAAACxIDAT/AAACuzLA2ATfAAAAFCAMAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA5AAmBP8HAAA=",
        (
            "PY4wPsBVTT+2XxI/AAAAAJX5cr+QG4Q+4d44PgAAAADP0SM/ukIxPiOqPz8AAAAAZi3BPj2dWD9rt8A+AAAAAOslAj+gpP8+"
            "tpszPwAAAAA="
        ),
    ),
    "quat": (
        {"count": 5, "byteStride": 8, "mode": "ATTRIBUTES", "filter": "QUATERNION"},
        (
            "oAE/wAAAM5EdRwE/wAAABAoFEgE/wAAAkQlL0AE9wAAADRQPAT/AAAATD2raAS/AAAARBgkBP4AAAAYFBAAAAAAAAAAAAAAA"
            "AAAAAAAAAAAAAAAAAADb+R8CzAT8Bw=="
        ),
        (
            "CyUzP58bC79FM0A+NxrZPmE+wL5An7y+glwCP/RgLj8BXE6/ftcpvau3A78hL5Q+3G/TPparwrsVpmE/hJpqvvDkDT9YzrG+"
            "7HL/vryMET8="
        ),
    ),
    "exp": (
        {"count": 5, "byteStride": 16, "mode": "ATTRIBUTES", "filter": "EXPONENTIAL"},
        (
            "oAE/wAAAcptkxgE/wAAAj8ofEAEYAAAAAAE/wAAAXN0mYwE/wAAARQlWLQAAAT/AAAATulhfAT/AAAAxSC0oAAAAAAAAAAAA"
            "AAAAAAAAAAAAAAAAAAkLAPJVMwDymCQA8gAAAPI="
        ),
        (
            "PY4wPsBVTT+2XxI/AAAAAJX5cr+QG4Q+4d44PgAAAADP0SM/ukIxPiOqPz8AAAAAZi3BPj2dWD9rt8A+AAAAAOslAj+gpP8+"
            "tpszPwAAAAA="
        ),
    ),
}


def said(name: str) -> Compressed:
    """What the extension of a case says."""
    values = CASES[name][0]
    return Compressed(
        count=values["count"],
        stride=values["byteStride"],
        mode=values["mode"],
        filter=values.get("filter", "NONE"),
    )


def decoded(name: str) -> tuple[bytes, bytes]:
    _, data, raw = CASES[name]
    return decoded_view(said(name), base64.b64decode(data)), base64.b64decode(raw)


@pytest.mark.parametrize("name", ["pos5", "u16_37", "seq"])
def test_attributes_and_indices_come_back(name: str) -> None:
    found, raw = decoded(name)
    assert found == raw


@pytest.mark.parametrize("name", ["grid", "random16"])
def test_triangles_come_back_in_order(name: str) -> None:
    """Each may begin at another of its corners: the encoder turns them."""
    kind = f"<u{CASES[name][0]['byteStride']}"
    found, raw = (np.frombuffer(data, kind).reshape(-1, 3) for data in decoded(name))
    for ours, theirs in zip(found, raw, strict=True):
        assert any(np.array_equal(np.roll(ours, turn), theirs) for turn in range(3))


@pytest.mark.parametrize("name", STEP)
def test_filtered_numbers_come_back_within_a_step(name: str) -> None:
    found, raw = decoded(name)
    kind = {4: "<i1", 8: "<i2", 16: "<f4"}[CASES[name][0]["byteStride"]]
    numbers, wanted = np.frombuffer(found, kind).reshape(-1, 4), np.frombuffer(raw, "<f4").reshape(-1, 4)
    values = numbers if kind == "<f4" else numbers / np.iinfo(kind).max
    off = np.abs(values - wanted)[:, : 3 if name.startswith("oct") else 4]
    other = np.abs(values + wanted) if name == "quat" else off  # q and -q are the same rotation
    assert np.minimum(off, other[:, : off.shape[1]]).max() < STEP[name]


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("kept", [1, 0.3, 0.7])
def test_cut_streams_raise_and_nothing_worse(name: str, kept: float) -> None:
    _, data, _ = CASES[name]
    whole = base64.b64decode(data)
    with pytest.raises((ValueError, IndexError)):
        decoded_view(said(name), b"\0" + whole[1 : int(kept * len(whole)) - 1])


def test_mini_files_are_read(shared) -> None:
    """By the extension's own words: three instances, and a skin whose node does not move it."""
    mini = shared / "data" / "mini"
    skinned = read_mesh_file(mini / "skin_is_3_m_not_2.glb")
    points = np.concatenate([part.points for part in skinned.parts])
    np.testing.assert_allclose(np.ptp(points, axis=0).max(), 3, rtol=1e-6)
    assert any(
        "roughnessFactor is -0.13, and 0 was taken" in n
        for n in read_mesh_file(mini / "roughness_below_zero.glb").notes
    )
    with pytest.raises(InputError):
        read_mesh_file(mini / "no_such_file.glb")
