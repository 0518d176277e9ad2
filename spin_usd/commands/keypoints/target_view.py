"""The 3D view: the target, the keypoints on it, and the point that is being picked.

Everything is shown around the target's centre in units of its radius; only the display is in single precision, and no
point is computed from it.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from viser import CameraHandle, ClientHandle

from spin_usd.basics.arrays import Float
from spin_usd.commands.keypoints.guarded_server import GuardedServer
from spin_usd.commands.keypoints.session import Session
from spin_usd.commands.keypoints.shown_target import Pick, ShownTarget
from spin_usd.geometry.snapping import Snap
from spin_usd.geometry.triangles import unit_vectors
from spin_usd.scene.derived.srgb import encode

Rgb = tuple[int, int, int]
POINT, SELECTED, PREVIEW, SUGGESTED = (46, 160, 67), (9, 105, 218), (255, 122, 0), (190, 80, 200)
AXES: tuple[tuple[str, Rgb], ...] = (("x", (214, 48, 49)), ("y", (46, 160, 67)), ("z", (9, 105, 218)))
BACKDROP = ((96, 106, 122), (52, 58, 69))  # its colours at the top and the bottom
FOV = np.radians(40.0)  # vertical
DISTANCE = 3.2  # of the camera from the target's centre, in radii: the whole target is in view
CLOSE = 0.15  # of the camera from a point that is looked at closely
MARKER = 0.008  # size of a marker, of the camera's distance
RESIZED = 1.2  # by so much a marker's size may be off
MAX_COLORS = 24  # meshes of one colour each that are shown; the rest is in their mean
DIRECTIONS: Mapping[str, tuple[int, int, int]] = {
    "+x": (1, 0, 0),
    "-x": (-1, 0, 0),
    "+y": (0, 1, 0),
    "-y": (0, -1, 0),
    "+z": (0, 0, 1),
    "-z": (0, 0, -1),
    "oblique": (2, -3, 2),
}
"""Where the camera stands in each view, in body axes, by its name."""


class TargetView:
    """A session's target and points in the browser, as a scene of viser."""

    def __init__(self, server: GuardedServer, session: Session) -> None:
        self._server, self._session = server, session
        self._centre, self._radius = session.target.mesh.centre, session.target.mesh.radius
        self._labels: list[Any] = []
        self._show_target(session.target)
        self._points = self._cloud("/points")
        self._picked = server.scene.add_line_segments(
            "/picked", np.zeros((1, 2, 3), np.float32), PREVIEW, thickness=2.0, thickness_units="screen", visible=False
        )
        server.scene.configure_default_lights(cast_shadow=False)
        server.scene.set_background_image(_backdrop(), format="png")
        server.initial_camera.fov = FOV
        server.initial_camera.position = self.eye("oblique")
        server.initial_camera.look_at = (0.0, 0.0, 0.0)
        server.scene.on_click()(self._on_click)
        server.on_client_connect(self._on_connect)

    def refresh(self) -> None:
        """Show the current points."""
        session = self._session
        marked = list(self._marked())
        self._points.visible = bool(marked)
        if marked:
            self._points.points = self._shown(np.array([point for point, _, _ in marked]))
            self._points.colors = np.array([color for _, color, _ in marked], np.uint8)
        for label in self._labels:
            label.remove()
        self._labels = [
            self._server.scene.add_label(f"/labels/{number}", text, position=self._shown(point), anchor="bottom-left")
            for number, (point, _, text) in enumerate(marked)
            if text
        ]
        self._picked.visible = session.pick is not None
        if session.pick is not None:
            self._picked.points = self._shown(_around(session.pick, session.pick.places[session.snap]))

    def look_from(self, camera: CameraHandle, direction: str) -> None:
        """Let a client's `camera` look at all of the target from `direction`, one of DIRECTIONS."""
        self._look(camera, np.zeros(3), self.eye(direction))

    def look_closely(self, camera: CameraHandle, point: Float) -> None:
        """Let a client's `camera` look at the body's `point` (3,) closely, from the side where it is."""
        at = self._shown(point).astype(np.float64)
        back = unit_vectors(camera.position - at)
        self._look(camera, at, at + CLOSE * back)

    @staticmethod
    def eye(direction: str) -> Float:
        """Return where the camera stands (3,) for a view, in the view's own units."""
        return DISTANCE * unit_vectors(np.array(DIRECTIONS[direction], np.float64))

    def _look(self, camera: CameraHandle, at: Float, eye: Float) -> None:
        along = unit_vectors(at - eye)
        up = np.array([0.0, 1, 0] if abs(along[2]) > 0.99 else [0.0, 0, 1])
        with camera.client.atomic():
            camera.up_direction = up
            camera.position = eye
            camera.look_at = at

    def _on_click(self, event: Any) -> None:
        origin, direction = (np.array(each, np.float64) for each in (event.ray_origin, event.ray_direction))
        body = origin * self._radius + self._centre
        self._session.do(lambda: self._session.click(body, unit_vectors(direction)))

    def _on_connect(self, client: ClientHandle) -> None:
        client.camera.on_update(self._on_camera)

    def _on_camera(self, camera: CameraHandle) -> None:
        """Keep the markers about as large on the screen, from near and far."""
        size = MARKER * float(np.linalg.norm(camera.position - camera.look_at))
        if not 1 / RESIZED < size / self._points.point_size < RESIZED:
            self._points.point_size = size

    def _marked(self) -> Iterator[tuple[Float, Rgb, str]]:
        """Yield the points that are shown, each with its colour and its label."""
        session = self._session
        for point in session.suggested:
            yield point, SUGGESTED, ""
        for name, point in zip(session.keypoints.names, session.keypoints.points, strict=True):
            yield point, SELECTED if name == session.selected else POINT, name
        if session.preview is not None:
            yield session.preview, PREVIEW, ""

    def _shown(self, points: Float) -> NDArray[np.float32]:
        """Return the body's points (..., 3) in the view's axes and units."""
        return ((points - self._centre) / self._radius).astype(np.float32)

    def _show_target(self, target: ShownTarget) -> None:
        points = self._shown(target.mesh.points)
        for number, (faces, color) in enumerate(_by_color(target)):
            self._server.scene.add_mesh_simple(
                f"/target/{number}",
                points,
                faces,
                color=color,
                flat_shading=True,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
        origin = self._shown(np.zeros(3))
        for number, (axis, color) in enumerate(AXES):
            end = origin + 1.25 * np.eye(3, dtype=np.float32)[number]
            line = np.array([[origin, end]], np.float32)
            name = f"/axes/{axis}"
            self._server.scene.add_line_segments(name, line, color, thickness=1.5, thickness_units="screen")
            self._server.scene.add_label(f"{name}/name", axis, position=end)

    def _cloud(self, name: str) -> Any:
        return self._server.scene.add_point_cloud(
            name,
            np.zeros((1, 3), np.float32),
            POINT,
            point_size=MARKER * DISTANCE,
            point_shape="circle",
            precision="float32",
            visible=False,
        )


def _backdrop() -> NDArray[np.uint8]:
    """Return the background, from which white foil and dark panels both stand out."""
    return np.linspace(*BACKDROP, 64).round().astype(np.uint8)[:, None].repeat(2, axis=1)


def _around(pick: Pick, place: Float) -> Float:
    """Return the lines (N, 2, 3) that are shown of a pick: the facet's edges, and from where it was met to `place`."""
    return np.concatenate([pick.facet.edges, [[pick.places[Snap.SURFACE], place]]])


def _by_color(target: ShownTarget) -> Iterator[tuple[NDArray[np.int32], Rgb]]:
    """Yield the faces (n, 3) of each colour, in screen colours: the most common ones separately, the others in their
    mean."""
    codes = np.rint(255 * encode(np.clip(target.colors, 0, 1))).astype(np.uint8)
    colors, color_of, counts = np.unique(codes, axis=0, return_inverse=True, return_counts=True)
    own = np.argsort(-counts, kind="stable")[:MAX_COLORS]
    for number in own:
        yield target.mesh.faces[color_of == number], _rgb(colors[number])
    rest = ~np.isin(color_of, own)
    if rest.any():
        yield target.mesh.faces[rest], _rgb(codes[rest].mean(0))


def _rgb(color: NDArray[Any]) -> Rgb:
    red, green, blue = (int(each) for each in color)
    return red, green, blue
