"""The browser in which pages are tried and measured: a Chromium that the machine has."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager

from playwright.sync_api import Browser, sync_playwright

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")


class NoChromiumError(Exception):
    """There is none on PATH."""


@contextmanager
def headless_chromium() -> Iterator[Browser]:
    """Start one without windows, and end it; a process can have only one at a time. Raises NoChromiumError."""
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        raise NoChromiumError(f"none of {', '.join(PROGRAMS)} is on PATH")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield browser
        browser.close()
