"""`check` of a third-party data set: what is asked of it, refused before anything is read, and the report."""

from math import isfinite
from pathlib import Path

from spin_usd.basics.resources import stages
from spin_usd.commands.check.foreign_labels import write_labels
from spin_usd.commands.check.foreign_repair import repaired_copy
from spin_usd.commands.check.foreign_set import CheckedSet, checked_set
from spin_usd.commands.check.options import CheckOptions
from spin_usd.commands.check.report import CheckReport
from spin_usd.commands.check.set_page import write_set_page
from spin_usd.errors import InputError

WRITING = ("report", "repair_to", "labels_to")
FOREIGN = ("layout", "camera", "model", "without_pixels", *WRITING)
WRONG_POSES = ("pose-reading", "unit", "mirrored", "pose-late")
"""Rules whose findings make labels from these poses wrong."""


def refuse_foreign_options(options: CheckOptions) -> None:
    """Raise InputError for an option of third-party data sets with a stage or a dataset of ours."""
    if given := next((name for name in FOREIGN if getattr(options, name)), ""):
        option = f"--{given.replace('_', '-')}"
        raise InputError(f"{option} is for third-party data sets", where=options.path, do=f"leave {option} out")


def check_foreign(path: Path, options: CheckOptions) -> CheckReport:
    """Check the third-party data set in the folder `path`. Raises InputError for one in no known layout, and for
    options that cannot be used on it."""
    _refuse(path, options)
    checked = checked_set(path, options)
    for note in checked.notes:
        options.note(note)
    if options.report is not None:
        write_set_page(path, Path(options.report), checked)
    repaired = None if options.repair_to is None else _repaired(path, Path(options.repair_to), checked, options)
    if options.labels_to is not None:
        options.note(_labels(Path(options.labels_to), checked, options))
    return CheckReport(
        kind="set",
        findings=[each.finding(str(path)) for each in checked.findings],
        layout=checked.layout.name,
        reasons=list(checked.notes),
        repaired=repaired,
    )


def _refuse(path: Path, options: CheckOptions) -> None:
    if options.repair:
        raise InputError("is no dataset of spin-usd, which --repair needs", where=path, do="give --repair-to FOLDER")
    if not (isfinite(options.model_unit) and options.model_unit > 0):
        raise InputError(f"--model-unit is {options.model_unit}", do="give the metres of its unit, such as 0.001")
    if options.labels_to is not None and options.model is None:
        raise InputError("--labels-to needs a model of the target", do="give --model")
    model = options.model
    if model is not None and not Path(model).is_file() and not (stages() / "targets" / str(model)).is_dir():
        raise InputError("is not there", where=model, do="check the path of --model")
    for name in WRITING:
        if (given := getattr(options, name)) is None:
            continue
        out, option = Path(given), f"--{name.replace('_', '-')}"
        if out.resolve().is_relative_to(path.resolve()):
            raise InputError("lies inside the set", where=out, do=f"give {option} a folder elsewhere")
        if out.exists() and not (name == "report" and out.is_dir()):
            raise InputError("exists already", where=out, do=f"give {option} a new folder")


def _repaired(path: Path, out: Path, checked: CheckedSet, options: CheckOptions) -> list[str]:
    repairs = [each.repair for each in checked.findings if each.repair is not None]
    if checked.layout.fields is None or not repairs:
        options.note("no copy was made: no finding can be repaired automatically")
        return []
    return repaired_copy(path, out, checked.layout.fields, repairs, options.progress)


def _labels(out: Path, checked: CheckedSet, options: CheckOptions) -> str:
    wrong = next((each.rule for each in checked.findings if each.rule in WRONG_POSES), "")
    if wrong:
        return f"no labels were made, as they would be wrong: mend {wrong} first"
    return write_labels(out, checked.audited, options)
