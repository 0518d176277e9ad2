"""The keypoint tool in a real browser, by real clicks and keys."""

import re
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from spin_usd.commands.keypoints.calls import SaveTarget
from spin_usd.commands.keypoints.in_child import save_target
from spin_usd.commands.keypoints.shown_target import ShownTarget
from spin_usd.commands.keypoints.target_view import CLOSE, FOV, TargetView
from spin_usd.geometry.snapping import Snap
from spin_usd.geometry.triangles import unit_vectors
from spin_usd.reading.dataset import Dataset
from tests.conftest import REPOSITORY

VIEW = {"width": 720, "height": 400}
PATIENCE_MS = 60_000
TRIES = 20  # of a click, until the view has settled

# tango3Dpoints of the SPEED+ baseline, metres, body axes; the view from which each is picked.
OFFICIAL = {
    "top_corner_1": ("+z", (-0.3700, -0.3850, 0.3215)),
    "top_corner_2": ("+z", (-0.3700, 0.3850, 0.3215)),
    "top_corner_3": ("+z", (0.3700, 0.3850, 0.3215)),
    "top_corner_4": ("+z", (0.3700, -0.3850, 0.3215)),
    "bottom_corner_5": ("-z", (-0.3700, -0.2640, 0.0)),
    "bottom_corner_6": ("-z", (-0.3700, 0.3040, 0.0)),
    "bottom_corner_7": ("-z", (0.3700, 0.3040, 0.0)),
    "bottom_corner_8": ("-z", (0.3700, -0.2640, 0.0)),
    "antenna_tip_9": ("-x", (-0.5427, 0.4877, 0.2535)),
    "antenna_tip_10": ("+x", (0.5427, 0.4877, 0.2591)),
    "antenna_tip_11": ("-y", (0.3050, -0.5790, 0.2515)),
}
WITHIN_M = 1e-3
SETTLED_M = 1e-4  # of a place on the surface, when the view is where it should be
NEAR_M, INSIDE_M = 8e-3, 2.5e-4  # beside a corner: of a first click, and of one from close by


@pytest.fixture(scope="module")
def tango(tmp_path_factory):
    """Tango's surface, by which the view is laid out."""
    folder = tmp_path_factory.mktemp("tango")
    read = save_target(SaveTarget(target="tango", folder=str(folder)))
    return ShownTarget.of(read, folder / "target.npz")


@contextmanager
def served(*arguments, cwd):
    """The tool as a process of its own, stopped by Ctrl-C in the end: its address."""
    command = [Path(sys.executable).with_name("spin-usd"), "keypoints", *map(str, arguments), "--port", "0"]
    with subprocess.Popen(command, cwd=cwd, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as server:
        try:
            yield next(found[0] for line in server.stderr if (found := re.search(r"http://\S+", line)))
        finally:
            server.send_signal(signal.SIGINT)
            said = server.communicate(timeout=30)
    assert (server.returncode, said[1]) == (0, "")


@contextmanager
def opened(browser, address):
    """The tool's page in Chromium, when the target is there."""
    with browser.new_page(viewport=VIEW) as page:
        page.set_default_timeout(PATIENCE_MS)
        page.goto(address)
        page.get_by_role("button", name="Add keypoint").wait_for()
        for notice in page.locator(".mantine-Notification-closeButton").all():  # there is no graphics processor
            notice.click()
        yield page


class Looking:
    """A camera of the page at `eye` that looks at `at`, both in the view's own units: its rays and pixels."""

    def __init__(self, page, tango, eye, at) -> None:
        self.box = page.locator("canvas").first.bounding_box()
        self.tango, self.eye = tango, eye
        self.forward = unit_vectors(at - eye)
        up = np.array([0.0, 1, 0] if abs(self.forward[2]) > 0.99 else [0.0, 0, 1])
        self.right = unit_vectors(np.cross(self.forward, up))
        self.down = np.cross(self.forward, self.right)
        self.focal = self.box["height"] / 2 / np.tan(FOV / 2)
        self.middle = np.array([self.box["x"] + self.box["width"] / 2, self.box["y"] + self.box["height"] / 2])

    def pixel(self, point):
        """The pixel that shows the body's `point`."""
        towards = in_view(self.tango, point) - self.eye
        x, y, z = (towards @ axis for axis in (self.right, self.down, self.forward))
        return np.rint(self.middle + self.focal * np.array([x, y]) / z - 0.5)

    def pick(self, pixel):
        """What the ray of a `pixel`, through its centre, picks of the target."""
        x, y = (pixel + 0.5 - self.middle) / self.focal
        along = unit_vectors(self.forward + x * self.right + y * self.down)
        eye = self.eye * self.tango.mesh.radius + self.tango.mesh.centre
        return self.tango.pick(eye, along).places


def in_view(tango, point):
    return (np.array(point) - tango.mesh.centre) / tango.mesh.radius


def picked(page):
    """The point that is shown as picked, None for none."""
    shown = page.get_by_text(re.compile(r"^-?[\d.]+, -?[\d.]+, -?[\d.]+ m$"))
    return np.array([float(each) for each in shown.inner_text()[:-2].split(",")]) if shown.count() else None


def click_until(page, pixel, is_there) -> None:
    """Click there, again until the view has settled and what is picked is as it should be."""
    for _ in range(TRIES):
        page.mouse.click(*pixel)
        page.wait_for_timeout(250)
        point = picked(page)
        if point is not None and is_there(point):
            return
    raise AssertionError(f"{picked(page)} is picked, {page.locator('body').inner_text()[:300]}")


def pick(page, tango, name, view, official) -> None:
    """Pick a point as a person would: from afar, then from close by; and add it."""
    point = np.array(official)
    inwards = unit_vectors(tango.mesh.centre - point)
    page.get_by_role("button", name=view, exact=True).click()
    afar = Looking(page, tango, TargetView.eye(view), np.zeros(3))
    pixel = afar.pixel(point + NEAR_M * inwards)
    expected = afar.pick(pixel)
    click_until(page, pixel, lambda found: np.linalg.norm(found - expected[Snap.VERTEX]) < SETTLED_M)
    page.get_by_role("button", name="Look closely").click()
    at = in_view(tango, expected[Snap.SURFACE])
    close = Looking(page, tango, at + CLOSE * unit_vectors(afar.eye - at), at)
    click_until(page, close.pixel(point + INSIDE_M * inwards), lambda found: np.linalg.norm(found - point) < WITHIN_M)
    field = page.locator(".mantine-Flex-root").filter(has=page.get_by_text("Name", exact=True)).locator("input")
    field.locator("visible=true").fill(name)
    page.get_by_role("button", name="Add keypoint").click()
    page.get_by_text(f"{name} is added.").wait_for()


@pytest.mark.slow
def test_eleven_clicks_on_tango_are_in_the_labels(browser, tango, tmp_path, spin_usd) -> None:
    with served("tango", "--out", "points.usda", cwd=tmp_path) as address, opened(browser, address) as page:
        page.get_by_role("tab", name="Keypoints").click()
        page.get_by_role("button", name="Delete all").click()
        page.get_by_role("tab", name="Pick", exact=True).click()
        for name, (view, official) in OFFICIAL.items():
            pick(page, tango, name, view, official)
        page.reload()  # the state is the server's
        page.get_by_text("11 keypoints, saved in points.usda").wait_for()
    poses = REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json"
    options = ("--target", "tango", "--camera", "speedplus", "--keypoints", tmp_path / "points.usda")
    spin_usd("author", "--poses", poses, *options, "--frames", ":2", "--out", tmp_path / "stage")
    render = ("--renderer", "raycast", "--samples", "1")
    spin_usd("render", tmp_path / "stage", "--out", tmp_path / "made", *render)
    points = np.array([point for _, point in OFFICIAL.values()])
    for picture in Dataset(tmp_path / "made"):
        assert picture.keypoints.names == tuple(OFFICIAL)
        assert np.linalg.norm(picture.keypoints.points - points, axis=1).max() < WITHIN_M
        places = points @ picture.T_cam_body[:3, :3].T + picture.T_cam_body[:3, 3]
        off = np.linalg.norm(picture.targets[0].keypoints - picture.camera.project(places), axis=1)
        assert (off < WITHIN_M * picture.camera.fx / places[:, 2]).all()
