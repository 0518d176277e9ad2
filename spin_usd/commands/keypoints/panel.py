"""The panels beside the view: controls and messages, and pictures of a dataset with the keypoints drawn into them:
green if visible, hollow if hidden."""

from collections.abc import Callable, Iterator
from html import escape
from typing import Any

import numpy as np
from viser import CameraHandle, GuiEvent

from spin_usd.basics.arrays import Float
from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.keypoints.edits import next_name
from spin_usd.commands.keypoints.guarded_server import GuardedServer
from spin_usd.commands.keypoints.pictures import Pictures, Tile
from spin_usd.commands.keypoints.session import Session
from spin_usd.commands.keypoints.suggestions import SuggestionMethod
from spin_usd.commands.keypoints.target_view import DIRECTIONS, TargetView
from spin_usd.errors import SpinError
from spin_usd.geometry.frames import SYMMETRIES
from spin_usd.geometry.snapping import Snap
from spin_usd.scene.keypoints import Keypoints, KeypointState

NOTHING = "(none)"  # in the list of keypoints, if it is empty
DECIMALS = 6  # of metres, that are shown
AT_ONCE = 4
WIDTH_PX = 400
PICKED = "picked"  # the name of the point that is being picked
COLORS = {True: "#2ea043", False: "#ff5d5d"}  # of a visible keypoint, of a hidden one
SELECTED, PREVIEW = "#3b9bff", "#ff7a00"
LEGEND = "<small>● visible · ○ hidden by the target</small>"


ACCENT = (58, 118, 228)  # on light and on dark
WRONG = "light-dark(#b3261e, #ff8a80)"
THEME = """<style>
:root:root {
    --mantine-font-family: system-ui, sans-serif;
    --mantine-color-dark-0: #e6e9ee;
    --mantine-color-dark-2: #97a1b0;
    --mantine-color-dark-4: #2e333c;
    --mantine-color-dark-5: #262b33;
    --mantine-color-dark-6: #23272e;
    --mantine-color-dark-7: #1c1f25;
    --mantine-color-dark-8: #181b20;
    --mantine-color-dark-9: #14161a;
}
:root:root[data-mantine-color-scheme="light"] {
    --mantine-color-text: #1b1f26;
}
</style>"""
"""The colours of the page of `show`, for viser's."""


class Panel:
    """The panel of a session. Data are escaped: names may come from a stranger's file."""

    def __init__(self, server: GuardedServer, session: Session, view: TargetView) -> None:
        self._gui, self._session, self._view = server.gui, session, view
        self._shown: tuple[Keypoints, str | None] | None = None
        self._gui.configure_theme(show_logo=False, show_share_button=False, brand_color=ACCENT)
        self._gui.main_panel.dock_right()
        self._gui.add_html(THEME)
        self._state = self._gui.add_html("")
        views = self._gui.add_button_group("Look from", list(DIRECTIONS))
        views.on_click(lambda event: view.look_from(_camera(event), event.target.value))
        tabs = self._gui.add_tab_group()
        with tabs.add_tab("Pick"):
            self._add_picking()
        with tabs.add_tab("Keypoints"):
            self._add_keypoints()
        with tabs.add_tab("Suggest"):
            self._add_suggestions()
        self._undo = self._button("Undo", session.undo)
        self._redo = self._button("Redo", session.redo)
        self._add_hotkeys()

    def refresh(self) -> None:
        """Show the current session."""
        session = self._session
        self._state.content = self._state_html()
        picked, some = session.pick is not None, session.selected is not None
        self._preview.content = self._preview_html()
        self._add.disabled = self._close.disabled = not picked
        self._move.disabled = not (picked and some)
        names = session.keypoints.names
        if self._shown != (session.keypoints, session.selected):  # else the user's typing would be lost
            self._shown = session.keypoints, session.selected
            self._list.options = names or (NOTHING,)
            self._list.value = session.selected or NOTHING
            self._new_name.value = next_name(session.keypoints)
            self._show_selected()
        for button in (self._change, self._delete, self._copy):
            button.disabled = not some
        self._clear.disabled = not names
        self._add_all.disabled = self._forget.disabled = not len(session.suggested)
        self._undo.disabled, self._redo.disabled = not session.history.can_undo, not session.history.can_redo

    def _add_picking(self) -> None:
        gui, session = self._gui, self._session
        self._snap: Any = gui.add_dropdown("Snap to", [snap.value for snap in Snap], initial_value=session.snap.value)
        self._snap.on_update(lambda _: session.do(lambda: self._choose_snap(Snap(self._snap.value))))
        self._preview = gui.add_html("")
        self._new_name: Any = gui.add_text("Name", next_name(session.keypoints))
        self._add = self._button("Add keypoint", lambda: session.add(self._new_name.value.strip()), color="blue")
        self._move = self._button("Move the selected one here", session.move_selected)
        self._close = gui.add_button("Look closely", hint="Bring the view close to the picked point.")
        self._close.on_click(lambda event: self._look_closely(_camera(event)))

    def _add_keypoints(self) -> None:
        gui, session = self._gui, self._session
        self._list: Any = gui.add_dropdown("Selected", [NOTHING])
        self._list.on_update(lambda event: self._select(event))
        self._name: Any = gui.add_text("Name", "")
        self._place: Any = gui.add_vector3("x, y, z (m)", (0.0, 0.0, 0.0), step=1e-6)
        self._change = self._button("Apply name and place", self._apply)
        self._delete = self._button("Delete", session.delete_selected)
        self._symmetry = gui.add_dropdown("Symmetry", list(SYMMETRIES))
        self._copy = self._button("Add symmetric copy", lambda: session.copy_selected(self._symmetry.value))
        self._clear = self._button("Delete all", session.delete_all)

    def _add_suggestions(self) -> None:
        gui, session = self._gui, self._session
        self._method: Any = gui.add_dropdown("Points", [method.value for method in SuggestionMethod])
        self._count: Any = gui.add_number("How many", 8, min=1, max=100, step=1)
        self._seed: Any = gui.add_number("Seed", 0, min=0, step=1, hint="The same seed suggests the same points.")
        self._button("Suggest", self._suggest)
        self._add_all = self._button("Add all suggestions", session.add_suggestions)
        self._forget = self._button("Hide suggestions", session.forget_suggestions)

    def _suggest(self) -> str:
        method = SuggestionMethod(self._method.value)
        return self._session.suggest(method, int(self._count.value), int(self._seed.value))

    def _add_hotkeys(self) -> None:
        session = self._session
        add = self._gui.add_command("Add keypoint", hotkey="A")
        add.on_trigger(lambda _: session.do(lambda: session.add(self._new_name.value.strip())))
        undo = self._gui.add_command("Undo", hotkey="Z", modifier="cmd/ctrl")
        undo.on_trigger(lambda _: session.do(session.undo))
        redo = self._gui.add_command("Redo", hotkey="Z", modifier="cmd/ctrl+shift")
        redo.on_trigger(lambda _: session.do(session.redo))

    def _button(self, label: str, action: Callable[[], str], **looks: Any) -> Any:
        button = self._gui.add_button(label, **looks)
        button.on_click(lambda _: self._session.do(action))
        return button

    def _choose_snap(self, snap: Snap) -> None:
        self._session.snap = snap

    def _select(self, event: Any) -> None:
        """Select the user's choice in the list; the tool's own changes there are selected already."""
        name = self._list.value
        if event.client is not None and name in self._session.keypoints.names:
            self._session.do(lambda: self._session.select(name))

    def _apply(self) -> str:
        session = self._session
        typed, point = np.array(self._place.value, np.float64), self._selected_point()
        same = np.abs(typed - np.round(point, DECIMALS)) < 10.0**-DECIMALS / 2
        return session.change_selected(self._name.value.strip(), np.where(same, point, typed))

    def _look_closely(self, camera: Any) -> None:
        if (pick := self._session.pick) is not None:
            self._view.look_closely(camera, pick.places[Snap.SURFACE])

    def _selected_point(self) -> Float:
        keypoints, name = self._session.keypoints, self._session.selected
        point: Float = keypoints.points[keypoints.names.index(name)] if name else np.zeros(3)
        return point

    def _show_selected(self) -> None:
        self._name.value = self._session.selected or ""
        x, y, z = (round(float(each), DECIMALS) for each in self._selected_point())
        self._place.value = (x, y, z)
        self._name.disabled = self._place.disabled = self._session.selected is None

    def _state_html(self) -> str:
        session = self._session
        said = f"<b style='color:{WRONG}'>{escape(session.status.text)}</b>" if session.status.refused else ""
        said = said or escape(session.status.text)
        count = pluralise(len(session.keypoints.names), "keypoint")
        if session.unsaved:
            where = f"<b style='color:{WRONG}'>NOT saved: {escape(session.unsaved)}</b>"
        else:
            where = f"saved in {escape(session.saved_in)}"
        return f"<div style='padding:0 1em 0.5em'>{said}<br><small>{count}, {where}</small></div>"

    def _preview_html(self) -> str:
        session = self._session
        point = session.preview
        if point is None or session.pick is None:
            text = "Click on the target. The orange marker shows where the point would go; then add it."
        else:
            apart = float(np.linalg.norm(point - session.pick.places[Snap.SURFACE]))
            text = f"<b>{place_text(point)}</b><br>{session.snap.value}, {1000 * apart:.3g} mm from the click"
        return f"<div style='padding:0 1em'><small>{text}</small></div>"


def _camera(event: GuiEvent[Any]) -> CameraHandle:
    """Return the camera of the client where something was pressed."""
    assert event.client is not None
    return event.client.camera


def place_text(point: Float) -> str:
    """Return the point (3,) for people, metres."""
    return ", ".join(f"{each:.{DECIMALS}f}" for each in point + 0.0) + " m"


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
        """Draw the current keypoints, and the point that is being picked."""
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
