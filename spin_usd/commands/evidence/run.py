"""Gather the evidence that a dataset covers an operational domain, and that its labels and pictures are right."""

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path

from msgspec import UNSET, structs

from spin_usd.basics.extras import EXTRAS
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.check.run import check_folder, is_foreign
from spin_usd.commands.evidence.coverage import Covered
from spin_usd.commands.evidence.domain import UNKNOWN, Domain, read_domain
from spin_usd.commands.evidence.fill import FillFrame, fill_of
from spin_usd.commands.evidence.foreign_rows import checked_foreign_set, foreign_rows
from spin_usd.commands.evidence.options import EvidenceOptions
from spin_usd.commands.evidence.page import page_of
from spin_usd.commands.evidence.picture_table import columns_of, measured_rows, write_table
from spin_usd.commands.evidence.quality import quality_of
from spin_usd.commands.evidence.record_facts import RecordFacts
from spin_usd.commands.evidence.report import EvidenceReport, PictureSources
from spin_usd.commands.evidence.verification import calibration_of, gap_figures, reproduced_pictures
from spin_usd.errors import InputError
from spin_usd.files.changes import put
from spin_usd.files.folder import Folder
from spin_usd.labels.table import LABELS
from spin_usd.options import takes
from spin_usd.picture.kinds import IMAGE
from spin_usd.reading.dataset import Dataset
from spin_usd.store.atomic import write_text
from spin_usd.store.dataset_folder import refuse_dataset
from spin_usd.store.hidden_folder import hidden_folder
from spin_usd.store.report_folder import refuse_other_files, write_report

FOREIGN = "bounds of label errors, charts, reproduction and sources need a dataset of spin-usd"
TABLE, REPORT = "pictures.parquet", "evidence.json"


@takes(EvidenceOptions)
def evidence(options: EvidenceOptions) -> EvidenceReport:
    """Show whether a dataset covers an operational domain, how right its labels are, what went into it, and whether its
    pictures come out again: a folder with a page, the same as JSON, and a table of the pictures.

    Raises InputError, StageError, OutputError, and MissingPackageError without the extra [evidence].
    """
    EXTRAS["evidence"].require()
    if Path(options.out).is_file():
        raise InputError("is a file", where=options.out, do="give --out a folder")
    domain, out = read_domain(Path(options.domain)), Path(options.out).absolute()
    if is_foreign(Path(options.dataset)):
        return _of_foreign_set(options, domain, out)
    datasets = [Dataset(path) for path in (options.dataset, *options.also)]
    gap = UNSET if options.gap is None else gap_figures(Path(options.gap))
    _refuse(options, datasets, out)
    covered = Covered(domain, columns_of(measured_rows(datasets, options.workers, progress=options.progress)))
    fill, notes = ("", []) if options.fill is None else fill_of(domain, covered.coverage, _frame(covered, datasets))
    with hidden_folder(out.parent, out.name) as hidden:
        write_table(hidden.folder / TABLE, covered.columns, covered.places)
        report = _report(options, covered, datasets, hidden.folder)
        deviations, written = [*report.deviations, *notes], str(options.fill) if fill else UNSET
        report = structs.replace(report, gap=gap, deviations=deviations, fill=written)
        put(Folder(out), hidden.folder / TABLE, TABLE)
        write_report(out, REPORT, report, page_of(report, domain), work=hidden.folder)
    if fill:
        _write_fill(Path(str(options.fill)).absolute(), fill)
    return report


def _of_foreign_set(options: EvidenceOptions, domain: Domain, out: Path) -> EvidenceReport:
    """Gather the evidence of a data set of somebody else: coverage and findings, without what only our records have."""
    if options.fill is not None:
        raise InputError("is for datasets of spin-usd", where="--fill", do="leave it out: the report lists the holes")
    gap = UNSET if options.gap is None else gap_figures(Path(options.gap))
    refuse_other_files(out, REPORT, [TABLE])
    checked = checked_foreign_set(options)
    covered = Covered(domain, columns_of(foreign_rows(checked.audited)))
    with hidden_folder(out.parent, out.name) as hidden:
        write_table(hidden.folder / TABLE, covered.columns, covered.places)
        figures, version = quality_of(hidden.folder / TABLE, domain)
        report = EvidenceReport(
            datasets=[str(options.dataset)],
            title=domain.title,
            pictures=len(covered.names),
            least=domain.pictures,
            coverage=covered.coverage,
            outside=covered.outside,
            quality=figures,
            quality_by=version,
            labels={},
            calibration={},
            reproduced=[],
            findings=[finding.finding(str(options.dataset)) for finding in checked.findings],
            sources=PictureSources(stages=[], files={}, versions={}, licences={}, renderers={}),
            gap=gap,
            deviations=[*checked.notes, *_unknown(covered), FOREIGN],
        )
        put(Folder(out), hidden.folder / TABLE, TABLE)
        write_report(out, REPORT, report, page_of(report, domain), work=hidden.folder)
    return report


def _report(options: EvidenceOptions, covered: Covered, datasets: Sequence[Dataset], work: Path) -> EvidenceReport:
    """Return the report, but for gap and fill; the table of pictures is in the folder `work`."""
    facts, first = RecordFacts(chain.from_iterable(datasets)), datasets[0][0]
    checks = [check_folder(dataset.root, progress=options.progress) for dataset in datasets]
    figures, version = quality_of(work / TABLE, covered.domain)
    return EvidenceReport(
        datasets=[str(path) for path in (options.dataset, *options.also)],
        title=covered.domain.title,
        pictures=len(covered.names),
        least=covered.domain.pictures,
        coverage=covered.coverage,
        outside=covered.outside,
        quality=figures,
        quality_by=version,
        labels=facts.label_bounds,
        calibration=calibration_of(first, work) if IMAGE in first.files else {},
        reproduced=[*reproduced_pictures(datasets, options.reproduce, options.seed, progress=options.progress)],
        findings=[finding for check in checks for finding in check.findings],
        sources=facts.sources,
        deviations=[*_deviations(covered, facts)],
    )


def _refuse(options: EvidenceOptions, datasets: Sequence[Dataset], out: Path) -> None:
    """Raise InputError for a dataset without pictures, and where the evidence cannot be written."""
    roots = [dataset.root.resolve() for dataset in datasets]
    if twice := next((root for root in roots if roots.count(root) > 1), None):
        raise InputError("is given twice", where=twice, do="leave it out of --also")
    for dataset in datasets:
        if not len(dataset):
            raise InputError("holds no picture", where=dataset.root, do="render some first")
        refuse_dataset(out, dataset.root)
    refuse_other_files(out, REPORT, [TABLE])
    if options.fill is not None:
        path = Path(options.fill).absolute()
        if path.exists() or not path.parent.is_dir():
            found = "exists already" if path.exists() else "has no folder to be written to"
            raise InputError(found, where=options.fill, do="give --fill another name")


def _frame(covered: Covered, datasets: Sequence[Dataset]) -> FillFrame:
    camera = datasets[0][0].camera
    ranges = [each for each in covered.columns["range"] if each is not None]
    principal = (camera.cx / camera.width, camera.cy / camera.height)
    return FillFrame(ranges=(min(ranges), max(ranges)), principal=principal)


def _write_fill(path: Path, text: str) -> None:
    with hidden_folder(path.parent, path.name) as hidden:
        write_text(Folder(path.parent), path.name, text, work=hidden.folder)


def _deviations(covered: Covered, facts: RecordFacts) -> Iterator[str]:
    """Yield a sentence on each known limit of the evidence."""
    yield from _unknown(covered)
    if covered.domain.signal_to_noise is not None:
        yield "signal_to_noise is measured in the image of each picture"
    if labels := facts.without_bound(LABELS):
        yield f"no bound of its errors is known for {', '.join(labels)}"
    yield "licences of models, layers and textures are not recorded: state them where you publish the set"
    yield "camera and detector are measured around the principal point, as they are in the first picture's variant"


def _unknown(covered: Covered) -> Iterator[str]:
    """Yield a sentence on each dimension that pictures have no value in."""
    for name, found in covered.places.items():
        if count := int((found == UNKNOWN).sum()):
            yield f"{name} is unknown of {pluralise(count, 'picture')}"
