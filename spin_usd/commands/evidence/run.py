"""Gather the evidence that a dataset covers an operational domain, and that its labels and pictures are right."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from msgspec import UNSET

from spin_usd.basics.extras import EXTRAS
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.check.run import check_folder
from spin_usd.commands.evidence.calls import PictureRow
from spin_usd.commands.evidence.coverage import coverage_of, outside, places_of
from spin_usd.commands.evidence.domain import UNKNOWN, Domain, Places, read_domain
from spin_usd.commands.evidence.fill import FillFrame, fill_of
from spin_usd.commands.evidence.options import EvidenceOptions
from spin_usd.commands.evidence.page import page_of
from spin_usd.commands.evidence.picture_table import columns_of, measured_rows, write_table
from spin_usd.commands.evidence.quality import quality_of
from spin_usd.commands.evidence.record_facts import RecordFacts
from spin_usd.commands.evidence.report import EvidenceReport
from spin_usd.commands.evidence.verification import calibration_of, gap_figures, reproduced_pictures
from spin_usd.errors import InputError
from spin_usd.files.changes import put
from spin_usd.files.folder import Folder
from spin_usd.labels.table import LABELS
from spin_usd.options import takes
from spin_usd.picture.kinds import IMAGE
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.picture import Picture
from spin_usd.store.atomic import write_text
from spin_usd.store.dataset_folder import refuse_dataset
from spin_usd.store.hidden_folder import hidden_folder
from spin_usd.store.report_folder import refuse_other_files, write_report

TABLE, REPORT = "pictures.parquet", "evidence.json"
FROM_IMAGES = ("signal_to_noise", "background")
BLUR = "blur is that of the recorded motion in the exposure, which pictures show if the stage's camera has a shutter"


@takes(EvidenceOptions)
def evidence(options: EvidenceOptions) -> EvidenceReport:
    """Show whether a dataset covers an operational domain, how right its labels are, what went into it, and whether its
    pictures come out again: a folder with a page, the same as JSON, and a table of the pictures.

    Raises InputError, StageError, OutputError, and MissingPackageError without the extra [evidence].
    """
    EXTRAS["evidence"].require()
    domain, dataset, out = read_domain(Path(options.domain)), Dataset(options.dataset), Path(options.out).absolute()
    gap = UNSET if options.gap is None else gap_figures(Path(options.gap))
    _refuse(options, dataset, out)
    rows = measured_rows(dataset, options.workers, progress=options.progress)
    columns, facts = columns_of(rows), RecordFacts()
    for picture in dataset:
        facts.add(picture)
    places = places_of(domain, columns)
    coverage = coverage_of(domain, places)
    specification, notes = fill_of(domain, coverage, _frame(rows, dataset[0])) if options.fill is not None else ("", [])
    checked = check_folder(dataset.root, progress=options.progress)
    names = [f"{row.variant}/{row.name}" for row in rows]
    with hidden_folder(out.parent, out.name) as hidden:
        write_table(hidden.folder / TABLE, columns, places)
        figures, version = quality_of(hidden.folder / TABLE, domain)
        first = dataset[0]
        report = EvidenceReport(
            dataset=str(options.dataset),
            title=domain.title,
            pictures=len(rows),
            least=domain.pictures,
            coverage=coverage,
            outside=outside(places, names),
            quality=figures,
            quality_by=version,
            labels=facts.label_bounds,
            calibration=calibration_of(first, hidden.folder) if IMAGE in first.files else {},
            reproduced=[*reproduced_pictures(dataset, options.reproduce, options.seed, progress=options.progress)],
            findings=checked.findings,
            sources=facts.sources,
            gap=gap,
            deviations=[*_deviations(domain, places, facts), *notes],
            fill=str(options.fill) if specification else UNSET,
        )
        put(Folder(out), hidden.folder / TABLE, TABLE)
        write_report(out, REPORT, report, page_of(report, domain), work=hidden.folder)
    if options.fill is not None and specification:
        _write_fill(Path(options.fill).absolute(), specification)
    return report


def _refuse(options: EvidenceOptions, dataset: Dataset, out: Path) -> None:
    """Raise InputError for a dataset without pictures, and where the evidence cannot be written."""
    if not len(dataset):
        raise InputError("holds no picture", where=dataset.root, do="render some first")
    refuse_dataset(out, dataset.root)
    refuse_other_files(out, REPORT, [TABLE])
    if options.fill is not None and Path(options.fill).exists():
        raise InputError("exists already", where=options.fill, do="give --fill another name")


def _frame(rows: Sequence[PictureRow], first: Picture) -> FillFrame:
    ranges = [row.range for row in rows if row.range is not None] or [1.0]
    camera = first.camera
    principal = (camera.cx / camera.width, camera.cy / camera.height)
    return FillFrame(ranges=(min(ranges), max(ranges)), principal=principal)


def _write_fill(path: Path, text: str) -> None:
    with hidden_folder(path.parent, path.name) as hidden:
        write_text(Folder(path.parent), path.name, text, work=hidden.folder)


def _deviations(domain: Domain, places: Mapping[str, Places], facts: RecordFacts) -> Iterator[str]:
    """Yield a sentence on each known limit of the evidence."""
    for name, found in places.items():
        if count := int((found == UNKNOWN).sum()):
            yield f"{name} is unknown of {pluralise(count, 'picture')}"
    if measured := [name for name in FROM_IMAGES if name in places]:
        yield f"{' and '.join(measured)} of each picture {'is' if len(measured) == 1 else 'are'} measured in its image"
    if domain.blur is not None:
        yield BLUR
    if labels := facts.without_bound(LABELS):
        yield f"no bound of its errors is known for {', '.join(labels)}"
    yield "licences of models, layers and textures are not recorded: state them where you publish the set"
    yield "camera and detector are measured as they are in the first picture's variant"
