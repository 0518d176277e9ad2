"""A domain's file: one sentence for each mistake; cells and their places."""

import itertools
import shutil
import sys
from typing import Any

import numpy as np
import pytest

import spin_usd
from spin_usd.commands.evidence.coverage import Covered
from spin_usd.commands.evidence.domain import OUTSIDE, UNKNOWN, NumberCells, read_domain
from spin_usd.commands.evidence.fill import FillFrame, fill_of
from spin_usd.errors import InputError
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.specifications.sampling_spec import open_spec
from tests.commands.evidence.conftest import DOMAIN

START = 'schema = "domain-1"\n'
RANGE = START + "[range]\nedges = [1, 2]\n"
MISTAKES = {
    "nothing": ("", "schema"),
    "no dimension": (START, "names no dimension; add a table such as \\[range\\]"),
    "unknown": (START + "[rnge]\nedges = [1, 2]", "there is no dimension 'rnge'; did you mean range"),
    "no order": (START + "[range]\nedges = [1, 3, 2]", "range: has the edges \\[1.0, 3.0, 2.0\\], which do not ascend"),
    "one edge": (START + "[range]\nedges = [1]", "which do not ascend"),
    "low above high": (START + "[range]\nlow = 3\nhigh = 1", "which do not ascend"),
    "endless": (START + "[range]\nedges = [1, inf]", "which do not ascend"),
    "both": (START + "[range]\nedges = [1, 2]\nlow = 1\nhigh = 2", "has neither or both of edges and limits"),
    "neither": (START + "[range]\nbins = 3", "has neither or both of edges and limits"),
    "one limit": (START + "[range]\nlow = 3", "has only one of low and high; give both"),
    "log from 0": (START + '[range]\nlow = 0\nhigh = 1\nspacing = "log"', "has no low above 0"),
    "no bins": (START + "[range]\nlow = 1\nhigh = 2\nbins = 0", "range.bins: 0 is less than the minimum of 1"),
    "text": (START + '[range]\nedges = ["a", 2]', "range.edges.*'a' is not a number"),
    "unknown key": (
        START + "[range]\nedges = [1, 2]\nstep = 1",
        "range: there is no 'step'; choose among edges, low, high,",
    ),
    "below 0": (
        START + "[range]\nedges = [-1, 2]",
        "range has edges that it cannot reach; give numbers from 0 or more",
    ),
    "too far": (START + "[sun]\nedges = [0, 200]", "sun has edges that it cannot reach; give numbers from 0 to 180"),
    "no cells": (START + "[attitude]\ncells = 0", "attitude.cells"),
    "background": (START + '[background]\nvalues = ["plnet"]', "has no value 'plnet'; did you mean planet"),
    "twice": (START + '[background]\nvalues = ["space", "space"]', "names a value twice"),
    "pair": (RANGE.replace("[range]", 'pairs = [["range", "sun"]]\n[range]'), "pairs a dimension 'sun' that it does"),
    "with itself": (RANGE.replace("[range]", 'pairs = [["range", "range"]]\n[range]'), "pairs range with itself"),
    "pictures": (RANGE.replace("[range]", "pictures = 0\n[range]"), "pictures: 0 is less than the minimum of 1"),
    "schema": (RANGE.replace("domain-1", "domain-2"), "schema: 'domain-2' is not one of"),
    "not TOML": ("[range", "TOML"),
}
FRAME = FillFrame(ranges=(1.0, 4.0), principal=(0.5, 0.5))


@pytest.fixture
def domain_of(tmp_path):
    def read(text):
        (tmp_path / "domain.toml").write_text(text)
        return read_domain(tmp_path / "domain.toml")

    return read


@pytest.mark.parametrize("mistake", MISTAKES)
def test_each_mistake_has_its_sentence(mistake, domain_of) -> None:
    text, sentence = MISTAKES[mistake]
    with pytest.raises(InputError, match=sentence) as error:
        domain_of(text)
    assert "\n" not in str(error.value)
    assert "domain.toml" in str(error.value)


def test_a_missing_file_is_named(tmp_path) -> None:
    with pytest.raises(InputError, match=r"none\.toml.*No such file"):
        read_domain(tmp_path / "none.toml")


def test_bins_have_their_lower_edge_and_the_last_both() -> None:
    cells = NumberCells(edges=(1.0, 2.0, 4.0))
    found = cells.places([0.999, 1.0, 1.999, 2.0, 4.0, 4.001, None, np.inf])
    assert found.tolist() == [OUTSIDE, 0, 0, 1, 1, OUTSIDE, UNKNOWN, OUTSIDE]


def test_logarithmic_bins_are_equal_ratios() -> None:
    limits = np.array(NumberCells(low=1, high=1000, bins=3, spacing="log").limits)
    np.testing.assert_allclose(limits[1:] / limits[:-1], 10)


def test_each_picture_is_counted_once_in_each_dimension_and_pair(domain_of) -> None:
    """Random rows, against a count by loops."""
    domain, rng = domain_of(DOMAIN.replace('"attitude"]]', '"sun"]]')), np.random.default_rng(0)
    count = 300
    columns = {
        "range": rng.uniform(0, 5, count).tolist(),
        "sun": [None if value > 90 else value for value in rng.uniform(0, 100, count).tolist()],
        "attitude": [tuple(v / np.linalg.norm(v)) for v in rng.normal(size=(count, 3))],
        "visible": rng.uniform(0.8, 1, count).tolist(),
        "background": rng.choice(["space", "planet"], count).tolist(),
    }
    columns |= {"name": [str(row) for row in range(count)], "variant": ["nominal"] * count}
    covered = Covered(domain, columns)
    found = {" ".join(each.dimensions): each for each in covered.coverage}
    bins = [(low, high) for low, high in itertools.pairwise((1, 2, 3, 4))]
    wanted = [sum(low <= value < high for value in columns["range"]) for low, high in bins]
    assert found["range"].counts == wanted
    both = list(zip(columns["range"], columns["sun"], strict=True))
    joint = [
        sum(s is not None and low <= r < high and start <= s < end for r, s in both)
        for (low, high), (start, end) in itertools.product(bins, ((0, 40), (40, 80)))
    ]
    assert found["range sun"].counts == joint
    assert found["sun"].unknown == sum(value is None for value in columns["sun"])
    beyond = [f"nominal/{row}" for row in range(count) if not 1 <= columns["range"][row] <= 4]
    assert [name for name, where in covered.outside.items() if "range" in where] == beyond


def test_every_hole_of_an_empty_domain_has_its_part_and_what_cannot_be_filled_is_told(domain_of, tmp_path) -> None:
    domain = domain_of(DOMAIN + "[roll]\nlow = 0\nhigh = 360\nbins = 4\n[blur]\nedges = [0, 1]\n")
    nothing: dict[str, list[object]] = {name: [] for name in domain.dimensions}
    coverage = Covered(domain, nothing).coverage
    text, notes = fill_of(domain, coverage, FRAME)
    (tmp_path / "fill.toml").write_text(text)
    spec = open_spec(tmp_path / "fill.toml")
    assert [part.count for part in spec.parts] == [2] * (3 + 2 + 3 + 4 + 1 + 9)
    assert [note.partition(":")[0] for note in notes] == [
        "1 hole in background cannot be filled",
        "1 hole in blur cannot be filled",
    ]


def test_a_specification_has_a_thousand_holes_at_most_and_tells_of_the_rest(domain_of, tmp_path) -> None:
    domain = domain_of(START + "[range]\nlow = 1\nhigh = 2\nbins = 1003")
    text, notes = fill_of(domain, Covered(domain, {"range": []}).coverage, FRAME)
    assert text.count("[[part]]") == 1000
    assert notes == ["3 holes left for another specification: one fills 1000 at most"]


def test_a_target_that_is_cut_off_is_not_paired_with_directions(domain_of) -> None:
    domain = domain_of(START + 'pairs = [["visible", "sun"]]\n[visible]\nedges = [0, 1]\n[sun]\nedges = [0, 90]')
    _, (note,) = fill_of(domain, Covered(domain, {"visible": [], "sun": []}).coverage, FRAME)
    assert note.startswith("1 hole in visible and sun cannot be filled: a target that is partly outside the picture")


def test_a_hole_gets_the_pictures_that_it_lacks(domain_of, tmp_path) -> None:
    domain = domain_of(START + "pictures = 3\n[range]\nlow = 0\nhigh = 3\nbins = 3")
    text, _ = fill_of(domain, Covered(domain, {"range": [0.5, 0.6, 2.5, 2.5, 2.5]}).coverage, FRAME)
    (tmp_path / "fill.toml").write_text(text)
    parts: list[Any] = [*open_spec(tmp_path / "fill.toml").parts]
    assert [part.count for part in parts] == [3, 1]
    spans = [(part.law.position.range.low, part.law.position.range.high) for part in parts]
    assert spans == [(1.05, 1.95), (0.05, 0.95)]


def test_a_domain_that_is_covered_needs_no_specification(domain_of) -> None:
    domain = domain_of(START + "[range]\nedges = [1, 2]")
    assert fill_of(domain, Covered(domain, {"range": [1.5]}).coverage, FRAME) == ("", [])


def test_the_last_bin_of_the_visible_share_has_whole_targets(domain_of, tmp_path) -> None:
    domain = domain_of(START + "[visible]\nedges = [0.2, 0.6, 1]")
    text, notes = fill_of(domain, Covered(domain, {"visible": []}).coverage, FRAME)
    (tmp_path / "fill.toml").write_text(text)
    inside: list[Any] = [part.law.inside for part in open_spec(tmp_path / "fill.toml").parts]
    assert [(each.least, each.most) for each in inside] == [(0.22, 0.58), (0.62, 1.0)]
    assert notes == []


@pytest.mark.parametrize("cells", [4, 12])
def test_attitudes_for_a_pair_of_attitude_and_roll_have_both(domain_of, tmp_path, cells) -> None:
    """The quaternions of each part, as the rows of pictures would have them."""
    text = f'pairs = [["attitude", "roll"]]\n[attitude]\ncells = {cells}\n[roll]\nedges = [0, 90, 270, 360]\n'
    domain = domain_of(START + text)
    coverage = Covered(domain, {"attitude": [], "roll": []}).coverage
    written, _ = fill_of(domain, coverage, FRAME)
    (tmp_path / "fill.toml").write_text(written)
    pairs = open_spec(tmp_path / "fill.toml").parts[-3 * cells :]
    for part, hole in zip(pairs, coverage[-1].holes, strict=True):
        attitude: Any = part.law.attitude
        for q in attitude.values:
            R = matrix_from_quaternion(np.array(q) / np.linalg.norm(q))
            roll = np.degrees(np.arctan2(R[0, 2], -R[1, 2])) % 360
            places = Covered(domain, {"attitude": [tuple(R.T @ [0, 0, -1])], "roll": [roll]}).places
            assert {name: int(place[0]) for name, place in places.items()} == hole.cells


def test_bad_input_ends_the_command_with_one_sentence(sets, domain, tmp_path, spin_usd) -> None:
    dataset = sets / "close" / "dataset"
    (tmp_path / "empty").mkdir()
    (tmp_path / "taken.toml").write_text("")
    cases = (
        ((dataset, "--domain", tmp_path / "none.toml"), "No such file"),
        ((tmp_path / "empty", "--domain", domain), "has no known layout"),
        ((dataset, "--domain", domain, "--fill", tmp_path / "fill.txt"), "give a name that ends in .toml"),
        ((dataset, "--domain", domain, "--fill", tmp_path / "taken.toml"), "exists already"),
        ((dataset, "--domain", domain, "--fill", tmp_path / "none" / "fill.toml"), "has no folder to be written to"),
        ((dataset, "--domain", domain, "--gap", tmp_path / "empty"), "gap.json"),
    )
    for arguments, sentence in cases:
        run = spin_usd("evidence", *arguments, "--out", tmp_path / "out", code=2)
        assert sentence in run.stderr
        assert len(run.stderr.strip().splitlines()) == 1
    run = spin_usd("evidence", dataset, "--domain", domain, "--out", dataset / "evidence", code=2)
    assert "lies in the dataset" in run.stderr


def test_an_image_that_cannot_be_read_is_named(sets, domain, tmp_path, spin_usd) -> None:
    shutil.copytree(sets / "close" / "dataset", tmp_path / "set")
    image = next((tmp_path / "set" / "image" / "nominal").iterdir())
    image.write_bytes(b"no image")
    run = spin_usd("evidence", tmp_path / "set", "--domain", domain, "--out", tmp_path / "out", code=2)
    assert image.name in run.stderr


def test_a_dataset_without_pictures_is_refused(sets, domain, tmp_path) -> None:
    shutil.copytree(sets / "close" / "dataset", tmp_path / "set")
    shutil.rmtree(tmp_path / "set" / "records")
    with pytest.raises(InputError, match="holds no picture; render some first"):
        spin_usd.evidence(tmp_path / "set", domain=domain, out=tmp_path / "out")


def test_without_the_extra_the_first_thing_is_what_to_install(sets, domain, tmp_path, spin_usd, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "dqm_ml_core", None)
    run = spin_usd("evidence", sets / "close" / "dataset", "--domain", domain, "--out", tmp_path / "out", code=2)
    assert "evidence needs dqm-ml-core, which is not installed; run" in run.stderr
    assert not (tmp_path / "out").exists()
