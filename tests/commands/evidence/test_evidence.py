"""The evidence as a whole: coverage, the specification that fills holes, dqm-ml-core, and what verifies the set."""

import json
import shutil
from html.parser import HTMLParser

import jsonschema
import msgspec
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from dqm_ml_core import CompletenessProcessor, DiversityProcessor, ProcessorRunner, RepresentativenessProcessor

import spin_usd
from spin_usd.basics.progress import no_progress
from spin_usd.commands.evidence import verification
from spin_usd.commands.evidence.coverage import Covered
from spin_usd.commands.evidence.domain import read_domain
from spin_usd.commands.evidence.picture_table import write_table
from spin_usd.commands.evidence.quality import quality_of
from spin_usd.commands.evidence.record_facts import BODY, DEPTH, FACE
from spin_usd.commands.evidence.report import EvidenceReport
from spin_usd.commands.evidence.verification import reproduced_pictures
from spin_usd.commands.export.run import export
from spin_usd.commands.reproduce.report import Reproduction
from tests.commands.evidence.conftest import rendered_set
from tests.conftest import REPOSITORY
from tests.extremes.judged import FLOATS, U32

HEADINGS = ("Data", "Labels", "Coverage", "Traceability", "Verification")


def of(report, *names):
    return next(each for each in report.coverage if each.dimensions == list(names))


def test_planted_holes_are_found_with_their_bounds(evidence) -> None:
    report, _, _ = evidence
    assert of(report, "range").counts == [16, 0, 0]
    assert [hole.bounds for hole in of(report, "range").holes] == [{"range": [2.0, 3.0]}, {"range": [3.0, 4.0]}]
    assert of(report, "sun").counts == [16, 0]
    assert of(report, "sun").share == 0.5
    assert of(report, "range", "attitude").cells == 9
    assert sum(of(report, "range", "attitude").counts) == 16
    few = [hole.pictures for hole in of(report, "range", "attitude").holes]
    assert few == sorted(few)
    assert max(few) < report.least
    assert report.outside == {}


def test_the_written_specification_closes_the_holes(evidence, sets, domain, tmp_path) -> None:
    """Real pictures, authored from it: together with the set's own all cells have enough, and none lies outside."""
    _, _, fill = evidence
    filled = rendered_set(tmp_path, fill)
    report = spin_usd.evidence(
        sets / "close" / "dataset", also=[filled], domain=domain, out=tmp_path / "out", fill=tmp_path / "none.toml"
    )
    assert report.outside == {}
    assert [each.share for each in report.coverage] == [1.0] * 6
    assert min(min(each.counts) for each in report.coverage) >= 2
    assert not (tmp_path / "none.toml").exists()
    assert len(pq.read_table(tmp_path / "out" / "pictures.parquet")) == report.pictures > 16
    assert len(report.sources.stages) == 2


def test_a_row_holds_what_the_record_states(evidence, sets) -> None:
    _, folder, _ = evidence
    dataset, table = spin_usd.Dataset(sets / "close" / "dataset"), pd.read_parquet(folder / "pictures.parquet")
    frame = dataset.to_dataframe()
    assert table.name.tolist() == frame.frame.tolist()
    np.testing.assert_array_equal(table["range"], frame.range)
    np.testing.assert_array_equal(table.sun, frame.sun)
    np.testing.assert_allclose(np.stack(table.attitude), frame[["from_x", "from_y", "from_z"]], rtol=1e-12)
    assert set(table.background) == {"space"}
    assert (table.signal_to_noise > 1).all()
    assert (table.blur == 0).all()


def test_dqm_ml_reads_the_table_itself_and_has_the_reported_figures(evidence) -> None:
    report, folder, _ = evidence
    frame = pd.read_parquet(folder / "pictures.parquet")
    uniform = {
        "columns": {"input": ["sun_cell"]}, "distribution": "uniform", "mean_std_estimation": "user_provided",
        "distribution_params": [{"column": "sun_cell", "min": -0.5, "max": 1.5}], "histogram": {"bins": 2},
        "metrics": ["chi-square", "grte", "shannon-entropy"], "type": "representativeness",
    }  # fmt: skip
    found = ProcessorRunner().run(
        frame,
        [
            CompletenessProcessor(config={"columns": {"input": ["sun"]}, "type": "completeness"}),
            RepresentativenessProcessor(config=uniform),
            DiversityProcessor(config={"columns": {"input": ["sun_cell"]}, "type": "diversity"}),
        ],
    )
    figures = report.quality["sun"]
    assert {name: found[name] for name in figures} == figures
    assert figures["completeness_sun"] == 1.0
    assert figures["sun_cell_richness"] == 1.0  # of two cells
    assert figures["sun_cell_chi-square_statistic"] == 16.0  # (16 - 8)^2 / 8, twice
    assert report.quality_by == "2.0.1"


def test_pictures_outside_and_unknown_values_count_as_no_cell_of_their_own(tmp_path) -> None:
    """Two of four bins, once each; a picture outside, and one without a value."""
    (tmp_path / "domain.toml").write_text('schema = "domain-1"\n[range]\nlow = 0\nhigh = 4\nbins = 4\n')
    domain = read_domain(tmp_path / "domain.toml")
    columns = {"name": list("abcd"), "variant": ["nominal"] * 4, "range": [0.5, 2.5, 9.0, None]}
    covered = Covered(domain, columns)
    write_table(tmp_path / "pictures.parquet", columns, covered.places)
    figures = quality_of(tmp_path / "pictures.parquet", domain)[0]["range"]
    assert figures["completeness_range"] == 0.75
    assert figures["range_cell_richness"] == 2
    assert figures["range_cell_gini"] == 0.5
    assert figures["range_cell_chi-square_statistic"] == 2.0  # 2 (1 - 0.5)^2 / 0.5 + 2 (0.5)^2 / 0.5


def test_the_files_are_the_report(evidence) -> None:
    report, folder, _ = evidence
    text = (folder / "evidence.json").read_bytes()
    schema = json.loads((REPOSITORY / "schemas" / "evidence-report-1.schema.json").read_text())
    jsonschema.validate(json.loads(text), schema)
    assert msgspec.json.decode(text, type=EvidenceReport) == report


def test_the_report_is_printed_as_json(sets, domain, tmp_path, spin_usd) -> None:
    """The fixture holds the output to its schema."""
    options = ("--domain", domain, "--out", tmp_path / "out", "--reproduce", 0, "--json")
    run = spin_usd("evidence", sets / "far" / "dataset", *options)
    printed = msgspec.json.decode(run.stdout, type=EvidenceReport)
    assert printed == msgspec.json.decode((tmp_path / "out" / "evidence.json").read_bytes(), type=EvidenceReport)


def test_the_page_has_its_headings_and_every_tag_is_closed(evidence) -> None:
    _, folder, _ = evidence
    page = Page()
    page.feed((folder / "index.html").read_text())
    page.close()
    assert tuple(page.headings[: len(HEADINGS)]) == HEADINGS
    assert page.open == []
    assert "scheme:light dark" in (folder / "index.html").read_text()


class Page(HTMLParser):
    """Headings of the second level, and the tags that are still open."""

    ENDLESS = ("!doctype", "meta", "img", "br", "p", "li")

    def __init__(self) -> None:
        super().__init__()
        self.headings: list[str] = []
        self.open: list[str] = []

    def handle_starttag(self, tag, attributes) -> None:
        if tag not in self.ENDLESS:
            self.open.append(tag)

    def handle_endtag(self, tag) -> None:
        if tag not in self.ENDLESS:
            assert self.open.pop() == tag

    def handle_data(self, data) -> None:
        if self.open and self.open[-1] == "h2":
            self.headings.append(data)


def test_pictures_come_out_again_and_check_finds_nothing(evidence) -> None:
    report, _, _ = evidence
    assert len(report.reproduced) == 3
    assert all(each.same for each in report.reproduced)
    assert report.findings == []
    assert not report.wrong


def test_the_seed_decides_which_pictures_are_made_again(sets, monkeypatch) -> None:
    made = Reproduction(files=(), versions={"numpy": ("1", "2")}, devices=("cpu", "cpu"))
    monkeypatch.setattr(verification, "reproduce_picture", lambda *_, **__: made)
    datasets = [spin_usd.Dataset(sets / name / "dataset") for name in ("close", "far")]

    def chosen(seed, count=3):
        return [each.frame for each in reproduced_pictures(datasets, count, seed, progress=no_progress)]

    assert chosen(0) == chosen(0)
    assert len({tuple(chosen(seed)) for seed in range(5)}) == 5
    assert len(chosen(0, count=100)) == 32
    (one,) = reproduced_pictures(datasets, 1, 0, progress=no_progress)
    assert one.versions == {"numpy": ["1", "2"]}


def test_a_changed_picture_is_found_and_the_command_ends_with_findings(sets, domain, tmp_path, spin_usd) -> None:
    shutil.copytree(sets / "far" / "dataset", tmp_path / "set")
    changed, other, *_ = sorted((tmp_path / "set" / "depth" / "nominal").iterdir())
    changed.write_bytes(other.read_bytes())
    options = ("--domain", domain, "--out", tmp_path / "out", "--reproduce", 16)
    run = spin_usd("evidence", tmp_path / "set", *options, code=1)
    assert "made again: 15 of 16" in run.stdout
    report = json.loads((tmp_path / "out" / "evidence.json").read_text())
    assert report["findings"]
    different = [each["different"] for each in report["reproduced"] if not each["same"]]
    assert different == [[str(changed.relative_to(tmp_path / "set"))]]


def test_sources_are_those_of_the_records(evidence, sets) -> None:
    report, _, _ = evidence
    record = spin_usd.Dataset(sets / "close" / "dataset")[0].recorded
    assert report.sources.stages == [record.provenance.stage.hash]
    assert report.sources.files == {name: [sha256] for name, sha256 in record.provenance.stage.files.items()}
    assert report.sources.licences["usd-core"]
    assert report.sources.renderers == {"raycast": 16}


def test_bounds_of_labels_are_the_figures_of_the_page(evidence) -> None:
    """The largest bounds in tools/figures/extremes.json, times this set's range and radius."""
    report, folder, _ = evidence
    rows = [row for row in json.loads((REPOSITORY / "tools/figures/extremes.json").read_text()) if "depth" in row]
    depth, body = (max(row[name]["bound"] for row in rows) for name in ("depth", "body"))
    assert pytest.approx(DEPTH, rel=1e-3) == depth
    assert pytest.approx(BODY, rel=1e-3) == body
    assert pytest.approx(FLOATS * U32, rel=1e-2) == FACE
    farthest = pd.read_parquet(folder / "pictures.parquet")["range"].max()
    assert depth * farthest < report.labels["depth"].bound < depth * (farthest + 0.2)  # the CubeSat's radius more
    assert 0 < report.labels["segmentation"].bound < 1e-3  # pixels
    assert set(report.labels) == {"pose", "depth", "segmentation"}


def test_figures_of_gap_are_repeated(sets, domain, tmp_path) -> None:
    dataset = sets / "close" / "dataset"
    gap = spin_usd.gap(
        dataset / "image" / "nominal", sets / "close" / "stage", out=tmp_path / "gap", renderer="raycast", samples=4
    )
    report = spin_usd.evidence(dataset, domain=domain, out=tmp_path / "out", reproduce=0, gap=tmp_path / "gap")
    assert report.gap["correlation"]["ours"] == gap.summary["correlation"].ours
    assert "Gap to real pictures" in (tmp_path / "out" / "index.html").read_text()


def test_a_data_set_of_others_is_covered_as_our_dataset_of_the_same_pictures_is(sets, domain, tmp_path) -> None:
    """Cells of range and attitude are those of the records; what the set lacks is told."""
    dataset = sets / "close" / "dataset"
    export(dataset, to="bop", out=tmp_path / "theirs", option=["rectify=yes"])
    ours = spin_usd.evidence(dataset, domain=domain, out=tmp_path / "a", reproduce=0)
    theirs = spin_usd.evidence(tmp_path / "theirs", domain=domain, out=tmp_path / "b")
    counts = [{tuple(each.dimensions): each.counts for each in report.coverage} for report in (ours, theirs)]
    known = [names for names in counts[0] if set(names) <= {"range", "attitude"}]
    assert known
    assert all(counts[0][names] == counts[1][names] for names in known)
    assert any(text.startswith("bounds of label errors") for text in theirs.deviations)
