"""The page on a data set of somebody else: findings, the reasons for its layout, and its worst pictures, drawn."""

from collections.abc import Iterator
from html import escape
from pathlib import Path

import numpy as np

from spin_usd.audit.picture_measures import DrawPicture
from spin_usd.audit.posed_targets import AuditedPicture
from spin_usd.audit.set_finding import SetFinding
from spin_usd.browser.report_page import head, table
from spin_usd.commands.check.calls import DRAW_PICTURE
from spin_usd.commands.check.foreign_set import CheckedSet, picture_files
from spin_usd.commands.check.rules import RULES
from spin_usd.errors import OutputError, SpinError
from spin_usd.processes.deaths import READING_TRIES
from spin_usd.processes.executor import done_in_order
from spin_usd.processes.task import Task
from spin_usd.scene.finding import ERROR

DRAWN, LISTED = 4, 12  # pictures of a finding: drawn, and named
PLAIN = 6  # pictures of the set where nothing is wrong
STYLE = """h2{margin-top:2em}.error{color:light-dark(#b11,#f88)}.warning{color:light-dark(#950,#fb6)}
section{break-inside:avoid}figure{display:inline-block;margin:.3em;max-width:420px;vertical-align:top}
figure img{display:block;max-width:100%}figcaption{font-size:12px;overflow-wrap:anywhere}"""
LEGEND = (
    "Outlines of masks are yellow, boxes light blue, keypoints pink; a pose's axes are red (x), green (y) and blue (z) "
    "from the body's origin."
)


def write_set_page(root: Path, out: Path, checked: CheckedSet) -> None:
    """Write index.html, which needs no other file, to the folder `out`. Raises OutputError."""
    drawn = _drawn(root, checked)
    text = "\n".join((head(f"Check of {root.name}", STYLE), *_page(root, checked, drawn)))
    try:
        out.mkdir(parents=True, exist_ok=True)
        (out / "index.html").write_text(text, encoding="utf-8", errors="replace")
    except OSError as error:
        raise OutputError(f"cannot be written ({error.strerror})", where=out, do="choose another folder") from None


def _page(root: Path, checked: CheckedSet, drawn: dict[str, str]) -> Iterator[str]:
    audited = checked.audited
    read = sum(picture.measures is not None for picture in audited.pictures)
    errors = sum(each.severity == ERROR for each in checked.findings)
    yield f"<h1>{escape(root.name)}: {errors} errors, {len(checked.findings) - errors} warnings</h1>"
    yield f"<p>{len(audited.pictures)} pictures as {escape(checked.layout.name)}, of which {read} were opened.</p><ul>"
    yield from (f"<li>{escape(note)}</li>" for note in checked.notes)
    yield f"</ul><p>{LEGEND}</p>"
    if checked.findings:
        rows = [(each.rule, each.severity, str(len(each.pictures) or 1), each.message) for each in checked.findings]
        yield table(("rule", "severity", "pictures", "finding"), rows)
    for finding in checked.findings:
        yield from _section(finding, drawn)
    if not checked.findings:
        yield "<h2>Nothing was found</h2>" + "".join(_figure(name, jpeg) for name, jpeg in drawn.items())


def _section(finding: SetFinding, drawn: dict[str, str]) -> Iterator[str]:
    meaning = RULES[finding.rule].meaning
    count = f", {len(finding.pictures)} of {finding.of} pictures" if finding.of else ""
    yield f'<section><h2 class="{finding.severity}">{escape(finding.rule)}{count}</h2><p>{escape(meaning)}</p>'
    yield f"<p><b>{escape(finding.message)}</b>{f' ({escape(finding.where)})' if finding.where else ''}</p>"
    yield f"<p>To do: {escape(finding.remedy)}.</p>"
    named = ", ".join(map(escape, finding.pictures[:LISTED]))
    yield f"<p>{named}{', ...' if len(finding.pictures) > LISTED else ''}</p>" if named else ""
    yield from (_figure(name, drawn[name]) for name in finding.pictures[:DRAWN] if drawn.get(name))
    yield "</section>"


def _figure(name: str, jpeg: str) -> str:
    image = f'<img alt="" src="data:image/jpeg;base64,{jpeg}">' if jpeg else ""
    return f"<figure>{image}<figcaption>{escape(name)}</figcaption></figure>"


def _drawn(root: Path, checked: CheckedSet) -> dict[str, str]:
    """Return the drawings, JPEG in base64, of the pictures that the page shows, by their names."""
    known = {picture.name: picture for picture in checked.audited.pictures if picture.labels.exists}
    names = [name for finding in checked.findings for name in finding.pictures[:DRAWN]]
    names = names if checked.findings else list(known)[:: max(1, len(known) // PLAIN)][:PLAIN]
    shown = [name for name in dict.fromkeys(names) if name in known]
    tasks = [
        Task(call=DRAW_PICTURE, request=_request(root, checked, known[name]), tries=READING_TRIES) for name in shown
    ]
    done = done_in_order(tasks, 1)
    return {
        name: "" if isinstance(task.failure, SpinError) else task.result for name, task in zip(shown, done, strict=True)
    }


def _request(root: Path, checked: CheckedSet, picture: AuditedPicture) -> DrawPicture:
    labels = checked.audited.labels
    points = [
        point[:2].tolist()
        for target in picture.labels.targets
        if target.keypoints is not None
        for point in target.keypoints
        if point[2] > 0 and np.isfinite(point).all()
    ]
    files = picture_files(labels, picture.labels)
    return DrawPicture(folder=str(root), picture=files, keypoints=points, lossy_masks=labels.masks_are_lossy)
