"""The panel with pictures of a dataset, and the keypoints drawn into them: green where visible, hollow where hidden."""

from collections.abc import Iterator
from html import escape
from typing import Any

import numpy as np

from spin_usd.commands.keypoints.guarded_server import GuardedServer
from spin_usd.commands.keypoints.pictures import Pictures, Tile
from spin_usd.commands.keypoints.session import Session
from spin_usd.errors import SpinError
from spin_usd.scene.keypoints import Keypoints, KeypointState

AT_ONCE = 4
WIDTH_PX = 400
PICKED = "picked"  # what the point is called that is being picked
COLORS = {True: "#2ea043", False: "#ff5d5d"}  # of a visible keypoint, of a hidden one
SELECTED, PREVIEW = "#3b9bff", "#ff7a00"
LEGEND = "<small>● visible · ○ hidden by the target</small>"


class PicturesPanel:
    """The panel of a session that shows some of the pictures at once."""

    def __init__(self, server: GuardedServer, session: Session, pictures: Pictures) -> None:
        self._session, self._pictures = session, pictures
        panel = server.gui.add_panel()
        with panel.add_tab("Pictures"):
            last = max(len(pictures) - AT_ONCE, 0)
            self._first: Any = server.gui.add_slider("From picture", 0, max(last, 1), 1, 0, disabled=not last)
            self._first.on_update(lambda _: self._slide())
            server.gui.add_html(f"<div style='padding:0 1em'>{LEGEND}</div>")
            self._tiles = [server.gui.add_html("") for _ in range(min(AT_ONCE, len(pictures)))]
        panel.dock_left()
        panel.set_width(WIDTH_PX)

    def refresh(self) -> None:
        """Draw the keypoints as they are now, and the point that is being picked."""
        session = self._session
        keypoints = session.keypoints
        if session.preview is not None:
            names, points = (*keypoints.names, PICKED), np.concatenate([keypoints.points, session.preview[None]])
            keypoints = Keypoints(names=names, points=points)
        for place, shown in enumerate(self._tiles):
            shown.content = self._picture_html(int(self._first.value) + place, keypoints)

    def _slide(self) -> None:
        """Draw the pictures that the slider means, unless it was moved on while another drawing went on."""
        first = self._first.value
        with self._session.lock:
            if self._first.value == first:
                self.refresh()

    def _picture_html(self, number: int, keypoints: Keypoints) -> str:
        try:
            tile = self._pictures.tile(number)
            drawn = "".join(self._marks(number, tile, keypoints))
        except SpinError as refused:
            return f"<div style='padding:0 1em'><small>{escape(str(refused))}</small></div>"
        box = tile.region
        return (
            f"<div style='padding:0 1em 0.5em'><small>{escape(tile.title)}</small>"
            f"<svg viewBox='{box.x0} {box.y0} {box.width} {box.height}' style='display:block;width:100%'>"
            f"<image href='data:image/jpeg;base64,{tile.jpeg}' x='{box.x0}' y='{box.y0}' width='{box.width}' "
            f"height='{box.height}'/>{drawn}</svg></div>"
        )

    def _marks(self, number: int, tile: Tile, keypoints: Keypoints) -> Iterator[str]:
        """Yield a ring or a disc, and the name, of each keypoint that the frame has."""
        pixels, states = self._pictures.places(number, keypoints)
        px = tile.region.width / WIDTH_PX  # of the picture, in one of the panel
        for name, (x, y), state in zip(keypoints.names, pixels, states, strict=False):
            if state in (KeypointState.OUTSIDE, KeypointState.BEHIND):
                continue
            visible = state is KeypointState.VISIBLE
            color = {self._session.selected: SELECTED, PICKED: PREVIEW}.get(name, COLORS[visible])
            fill = color if visible else "none"
            yield (
                f"<circle cx='{x:.2f}' cy='{y:.2f}' r='{4 * px:.2f}' fill='{fill}' stroke='{color}' "
                f"stroke-width='{1.5 * px:.2f}'/>"
                f"<text x='{x + 7 * px:.2f}' y='{y + 4 * px:.2f}' font-size='{11 * px:.2f}' fill='{color}' "
                f"stroke='black' stroke-width='{2.5 * px:.2f}' paint-order='stroke'>{escape(name)}</text>"
            )
