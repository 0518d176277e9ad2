"""A page of a score: its table, plots of the errors, and the worst pictures with both poses drawn in."""

import base64
from collections.abc import Iterator, Sequence
from html import escape
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.browser.report_page import figure_of, head, table
from spin_usd.commands.score.matching import Matched
from spin_usd.commands.score.report import ScoredErrors, ScoreReport
from spin_usd.commands.score.truth import Truth
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.reading.picture import Picture
from spin_usd.scoring.pose_errors import PoseErrors
from spin_usd.store.hidden_folder import hidden_folder
from spin_usd.store.report_folder import write_report

WIDTH = 480  # of a picture on the page
TRUE, PREDICTED = (0, 200, 0), (0, 0, 255)  # as OpenCV has colours: B, G, R
EDGES = [pair for pair in combinations(range(8), 2) if (pair[0] ^ pair[1]).bit_count() == 1]
MORE_STYLE = "figure{display:inline-block;margin:.5em}img{max-width:100%}"


def write_page(out: Path, report: ScoreReport, errors: PoseErrors, truth: Truth, found: Matched) -> None:
    """Write index.html, which needs no other file, and score.json into the folder `out`. Raises OutputError."""
    title = f"<h1>Score of {escape(report.predictions)}</h1><p>against {escape(report.truth)}</p>"
    notes = "".join(f"<p>{escape(note)}</p>" for note in report.notes)
    start = (head("Score", MORE_STYLE), title, notes, _table(report), _plots(errors))
    page = "\n".join((*start, *_worst(report, truth, found)))
    with hidden_folder(out.parent, out.name) as hidden:
        write_report(out, "score.json", report, page, work=hidden.folder)


def _table(report: ScoreReport) -> str:
    heads = ("pictures", "count", "SPEED", "SPEED+", "position, median, m", "p90", "attitude, median, °", "p90")
    groups = ((f"{each.by} {each.group}", each) for each in report.groups)
    return table(heads, (_row(name, each) for name, each in (("all", report.all), *groups)))


def _row(name: str, errors: ScoredErrors) -> tuple[str, ...]:
    position, attitude = errors.position_m, errors.attitude_deg
    numbers = (errors.scores["speed"], errors.scores["speedplus"], position["median"], position["p90"])
    return (name, str(errors.pictures), *(f"{n:.4g}" for n in (*numbers, attitude["median"], attitude["p90"])))


def _plots(errors: PoseErrors) -> str:
    """Return an SVG: which share of the pictures is below an error, and the errors over the distance."""
    degrees = np.degrees(errors.attitude)

    def draw(figure: Any) -> None:
        for column, (values, name) in enumerate(((errors.position, "position, m"), (degrees, "attitude, degrees"))):
            above, below = figure.add_subplot(2, 2, 1 + column), figure.add_subplot(2, 2, 3 + column)
            ordered = np.sort(np.maximum(values, 1e-9))
            above.plot(ordered, np.arange(1, len(ordered) + 1) / len(ordered))
            above.set(xscale="log", ylim=(0, 1), xlabel=f"error of {name}", ylabel="share of pictures below")
            below.plot(errors.range, np.maximum(values, 1e-9), ".", markersize=3)
            below.set(yscale="log", xlabel="range, m", ylabel=f"error of {name}")

    return figure_of((10, 5), draw)


def _worst(report: ScoreReport, truth: Truth, found: Matched) -> Iterator[str]:
    """Yield the worst pictures of a dataset, with the target's true box (green) and predicted box (red)."""
    if truth.dataset is None:
        return
    yield "<h2>The worst pictures</h2><p>The target's box where it is (green) and where it was predicted (red).</p>"
    row_of = {place: row for row, place in enumerate(found.places)}
    for each in report.worst:
        picture = truth.dataset.picture(each.picture, each.variant)
        row = row_of[truth.names.index((each.picture, each.variant))]
        said = f"{each.picture} of {each.variant}: {each.position_m:.3g} m, {each.attitude_deg:.3g}°"
        shown = base64.b64encode(_drawn(picture, truth, found.q[row], found.t[row])).decode()
        image = f'<img alt="" src="data:image/jpeg;base64,{shown}">'
        yield f"<figure>{image}<figcaption>{escape(said)}</figcaption></figure>"


def _drawn(picture: Picture, truth: Truth, q: Float, t: Float) -> bytes:
    """Return the picture as a JPEG, WIDTH wide, with both boxes; of a dataset without images on black."""
    import cv2  # not above: it is slow to load

    camera = picture.camera
    image = picture.image if "image" in picture.files else np.zeros((camera.height, camera.width), np.uint8)
    factor = WIDTH / camera.width
    small = cv2.resize(image, (WIDTH, max(1, round(camera.height * factor))), interpolation=cv2.INTER_AREA)
    drawn = cv2.cvtColor(small, cv2.COLOR_GRAY2BGR if small.ndim == 2 else cv2.COLOR_RGB2BGR)
    target = picture.targets[(truth.target or 1) - 1]
    corners = np.array([[x, y, z] for x in target.box[:, 0] for y in target.box[:, 1] for z in target.box[:, 2]])
    for rotation, position, colour in (
        (target.T_cam_body[:3, :3], target.t_cam_body, TRUE),
        (matrix_from_quaternion(q), t, PREDICTED),
    ):
        _draw_box(drawn, camera.project(corners @ rotation.T + position) * factor, colour)
    return bytes(cv2.imencode(".jpg", drawn)[1])


def _draw_box(image: NDArray[Any], pixels: Float, colour: Sequence[int]) -> None:
    """Draw the edges whose two ends the lens sees."""
    import cv2

    limit = 8 * WIDTH  # OpenCV's lines end at 16 bits
    for one, other in EDGES:
        ends = pixels[[one, other]]
        if np.isfinite(ends).all() and (np.abs(ends) < limit).all():
            start, end = np.rint(ends).astype(int).tolist()
            cv2.line(image, start, end, colour, 1, cv2.LINE_AA)
