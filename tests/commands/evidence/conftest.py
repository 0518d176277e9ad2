"""A set with planted holes: no picture between 2 and 3 m, none with the Sun more than 40 degrees off the camera."""

import json

import pytest

import spin_usd
from tests.conftest import speedplus_camera

DOMAIN = """schema = "domain-1"
title = "Approach"
pictures = 2
pairs = [["range", "attitude"]]
[range]
low = 1
high = 4
bins = 3
[sun]
edges = [0, 40, 80]
[attitude]
cells = 3
[visible]
edges = [0.9, 1]
[background]
values = ["space"]
"""
CLOSE, FAR = "range=1.1..1.9", "range=3.1..3.9"
LIT = "sun.direction=0,0,-1:20 inside=1"


@pytest.fixture(scope="session")
def domain(tmp_path_factory):
    """The file of the domain."""
    file = tmp_path_factory.mktemp("domain") / "domain.toml"
    file.write_text(DOMAIN)
    return file


def rendered_set(folder, sample):
    """Author and render the pictures of a sampling specification; the dataset's folder."""
    (folder / "camera.json").write_text(json.dumps(speedplus_camera(divide=8)))
    made = spin_usd.author(sample=sample, target="cubesat", camera=folder / "camera.json", out=folder / "stage")
    spin_usd.render(made.root, out=folder / "dataset", renderer="raycast", samples=4, labels="segmentation,depth")
    return folder / "dataset"


@pytest.fixture(scope="session")
def sets(library):
    """The folder of that set: `close/dataset`, and a smaller one of the far pictures, `far/dataset`."""

    def make(folder) -> None:
        for name, text, count in (("close", CLOSE, 16), ("far", FAR, 16)):
            (folder / name).mkdir()
            rendered_set(folder / name, f"{text} {LIT} count={count}")

    return library.folder("evidence", make)


@pytest.fixture(scope="session")
def evidence(sets, domain, tmp_path_factory):
    """The evidence of the close pictures: its report, its folder, and the specification for the holes."""
    out = tmp_path_factory.mktemp("evidence")
    report = spin_usd.evidence(sets / "close" / "dataset", domain=domain, out=out / "report", fill=out / "fill.toml")
    return report, out / "report", out / "fill.toml"
