"""The card of an export: README.md, which says what it holds in which conventions, and a contact sheet."""

from array import array
from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from spin_usd.arrays import Float
from spin_usd.commands.export.plan import ExportPlan
from spin_usd.exchange.layout.exported_dataset import Entry
from spin_usd.exchange.layout.index_file import write_text_file
from spin_usd.exchange.layout.layout import MadeFile
from spin_usd.geometry.camera import Camera
from spin_usd.store.contact_sheet import draw_contact_sheet, spread

CARD, SHEET = "README.md", "contact_sheet.jpg"
SHOWN = 8  # pictures on the contact sheet
CAMERAS = 20  # at most that are listed
PIXELS = (
    "Here (0, 0) is the corner of the image, so the first pixel's centre is (0.5, 0.5). Functions that put (0, 0) at "
    "the first pixel's centre need cx - 0.5 and cy - 0.5."
)
BANDS, SECTORS = 6, 12  # of equal heights and azimuths: cells of equal area
ROWS = {
    "range": "range of the target, m",
    "turn": "rotation from body axes to camera axes, degrees",
    "sun": "Sun to camera as seen from the target, degrees",
    "visible": "visible fraction of the target",
}


def card_files(plan: ExportPlan) -> Iterator[MadeFile]:
    """Yield the card's files."""
    dataset = plan.exported.dataset
    pictures = [dataset.picture(entry.frame, entry.variant) for entry in _shown(plan)]
    yield MadeFile(path=SHEET, write=partial(draw_contact_sheet, pictures))
    yield MadeFile(path=CARD, write=write_text_file(card_text(plan)))


def _shown(plan: ExportPlan) -> list[Entry]:
    entries = plan.exported.entries
    return [entries[place] for place in spread(len(entries), SHOWN)]


def card_text(plan: ExportPlan) -> str:
    """Return the card in Markdown."""
    exported, described = plan.exported, plan.described
    left_out = f" {plan.left_out} more show nothing of it, and are left out." if plan.left_out else ""
    options = ", ".join(f"{name}={value}" for name, value in exported.options.items()) or "none"
    blocks = (
        f"# {exported.target}, {len(exported)} pictures as {plan.format.name}",
        f"Synthetic pictures of the spacecraft {exported.target}, {plan.format.holds}, made with spin_usd "
        f"{described['spin_usd']}.{left_out}",
        f"![Some of the pictures and their labels]({SHEET})",
        "## Pictures",
        _tally(plan),
        "All variants of a pose are in one split. The split is drawn from the seed "
        f"{described['seed']}, with the shares {_shares(plan)}.",
        "## Statistics",
        statistics_table(plan.survey.columns),
        views(plan.survey.columns),
        "## Conventions",
        "\n".join(f"- {sentence}" for sentence in plan.layout.conventions),
        "## Camera",
        _cameras(plan),
        PIXELS,
        "## Origin",
        f"Options of the format: {options}. `export.json` has the digest of the records that this was made from.",
        "## Licence",
        "Not stated: the owner of the pictures writes it here.",
    )
    return "\n\n".join(blocks) + "\n"


def _shares(plan: ExportPlan) -> str:
    return ", ".join(f"{name} {share:g}" for name, share in plan.described["splits"].items())


def _tally(plan: ExportPlan) -> str:
    variants = list(dict.fromkeys(entry.variant for entry in plan.exported.entries))
    rows = [
        f"| {split} | {variant} | {plan.survey.tally[split, variant]} |"
        for split in plan.exported.splits
        for variant in variants
    ]
    return "\n".join(("| split | variant | pictures |", "| --- | --- | --- |", *rows))


def _cameras(plan: ExportPlan) -> str:
    cameras = plan.survey.cameras
    rows = [f"| {_camera(camera)} | {first} |" for camera, first in list(cameras.items())[:CAMERAS]]
    more = [f"\nand {len(cameras) - CAMERAS} more."] if len(cameras) > CAMERAS else []
    head = ("| width | height | fx | fy | cx | cy | k1, k2, p1, p2, k3 | first in |", "| --- " * 8 + "|")
    return "\n".join((*head, *rows, *more))


def _camera(camera: Camera) -> str:
    numbers = (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
    return " | ".join((*map(str, numbers), ", ".join(map(str, camera.distortion)) if camera.distorted else "none"))


def statistics_table(columns: "Mapping[str, array[float]]") -> str:
    """Return a table in Markdown of least, median, mean and greatest of each column that has numbers."""
    lines = ["| | least | median | mean | greatest |", "| --- | --- | --- | --- | --- |", *_rows(columns)]
    return "\n".join(lines)


def _rows(columns: "Mapping[str, array[float]]") -> Iterator[str]:
    for name, words in ROWS.items():
        numbers = known(columns[name])
        if len(numbers):
            shown = (numbers.min(), np.median(numbers), numbers.mean(), numbers.max())
            yield f"| {words} | {' | '.join(f'{number:.4g}' for number in shown)} |"


def views(columns: "Mapping[str, array[float]]") -> str:
    """Say from how many directions the target is seen, of cells of equal area around it."""
    azimuth, height = np.array(columns["azimuth"]), np.array(columns["height"])
    band = np.clip((height + 1) / 2 * BANDS, 0, BANDS - 1).astype(int)
    sector = np.clip((azimuth + 180) / 360 * SECTORS, 0, SECTORS - 1).astype(int)
    seen = len(np.unique(band * SECTORS + sector))
    return f"The camera sees the target from {seen} of {BANDS * SECTORS} cells of equal area around it."


def known(column: "array[float]") -> Float:
    """Return the numbers of a column that are not NaN."""
    numbers = np.array(column)
    found: Float = numbers[~np.isnan(numbers)]
    return found
