"""What the page of spin-usd show costs: seconds to write it and to open it in Chromium, and its size.

The page of a dataset, or of pictures made for it, is opened as it is, and with an index that repeats its pictures to
many. Seconds to open are the browser's, medians, from the start of loading; disks' caches are warm.
"""

import argparse
import base64
import json
import os
import shutil
import statistics
import tempfile
import zlib
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Browser

import spin_usd
from spin_usd.commands.show.data_file import DataFile
from spin_usd.commands.show.gallery_folder import INDEX, PAGE
from tests.cases.chromium import headless_chromium

POSES = "range=3..20 inside=0.9 sun.direction=0,0,-1:80 count={}"
UNTIL = """new Promise((resolve) => {
  const begun = BEGUN;
  const look = () => (THERE ? resolve((performance.now() - begun) / 1000) : requestAnimationFrame(look));
  look();
})"""
IMAGES = "[...document.querySelectorAll('.tile img')].slice(0, 5)"
FIRST_ROW = UNTIL.replace("BEGUN", "0").replace(
    "THERE", f"{IMAGES}.length && {IMAGES}.every((image) => image.complete && image.naturalWidth)"
)
OVERLAY = UNTIL.replace("BEGUN", "globalThis.clicked").replace("THERE", "document.querySelector('.areas canvas')")
FILTER = """() => {
  const begun = performance.now();
  const input = document.querySelector("input[aria-label='Least Range']");
  input.value = "10";
  input.dispatchEvent(new Event("change"));
  return (performance.now() - begun) / 1000;
}"""


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--dataset", type=Path, metavar="DIR", help="one that is there, instead of pictures made for it"
    )
    parser.add_argument("--pictures", type=int, default=1000, metavar="N", help="to make: raycast, camera of SPEED+")
    parser.add_argument("--many", type=int, default=60_000, metavar="N", help="pictures in the index that repeats them")
    parser.add_argument("--times", type=int, default=5, metavar="N", help="how often each page is opened")


def measure(options: argparse.Namespace) -> dict[str, Any]:
    """Return the figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        dataset = options.dataset or made(folder, 20 if options.quick else options.pictures)
        page = folder / "page"
        report = spin_usd.show(dataset, out=page)
        again = spin_usd.show(dataset, out=page)
        sizes = bytes_of(page)
        many = repeated(page, folder / "many", options.many)
        with headless_chromium() as browser:
            times = 1 if options.quick else options.times
            seconds = {
                str(report.pictures): opened(browser, page, times),
                str(options.many): opened(browser, many, times),
            }
    return {
        "pictures": report.pictures,
        "write_s": report.seconds,
        "write_again_s": again.seconds,
        "bytes": sizes,
        "open_s": seconds,
    }


def made(folder: Path, pictures: int) -> Path:
    """Make a dataset of so many pictures at 1920 x 1200."""
    spin_usd.author(sample=POSES.format(pictures), target="tango", camera="speedplus", out=folder / "stage")
    spin_usd.render(folder / "stage", out=folder / "dataset", renderer="raycast", samples=1)
    return folder / "dataset"


def bytes_of(page: Path) -> dict[str, int]:
    """Return how many bytes the files directly in each folder, and below it, have."""
    found: Counter[str] = Counter()
    for path in page.rglob("*.*"):
        found[path.relative_to(page).parts[0] if path.parent != page else "index"] += path.stat().st_size
    return dict(found)


def repeated(page: Path, folder: Path, count: int) -> Path:
    """Make a page in `folder` that has the same pictures again and again, `count` in all."""
    shutil.copytree(page, folder, copy_function=os.link)
    text = (page / INDEX).read_text().split('"')[3]
    content = zlib.decompress(base64.b64decode(text))
    length = int.from_bytes(content[:4], "little")
    header = json.loads(content[4 : 4 + length])
    arrays = {}
    for name, place in header.pop("arrays").items():
        start = 4 + length + place["offset"]
        array = np.frombuffer(content, place["dtype"], place["length"], start)
        arrays[name] = np.resize(array, count * (8 if name == "image" else 1))
    arrays["frame"] = np.arange(count, dtype=np.uint32)
    whole = header["records"][: max(header["count"] // header["per_file"], 1)]
    header |= {
        "count": count,
        "frames": [f"img{number:06}" for number in range(count)],
        "records": [whole[place % len(whole)] for place in range(count // header["per_file"] + 1)],
    }
    (folder / INDEX).unlink()
    (folder / INDEX).write_bytes(DataFile(header, arrays).script("index"))
    return folder


def opened(browser: Browser, folder: Path, times: int) -> dict[str, float]:
    """Return seconds, medians of so many fresh pages: to the first row, from a click to an overlay, and to filter."""
    found = [_opened(browser, folder) for _ in range(times)]
    return {name: statistics.median(each[name] for each in found) for name in found[0]}


def _opened(browser: Browser, folder: Path) -> dict[str, float]:
    page = browser.new_page(viewport={"width": 1366, "height": 768})
    page.goto((folder / PAGE).as_uri(), wait_until="commit")
    seconds = {"first row": page.evaluate(FIRST_ROW)}
    page.evaluate("addEventListener('pointerdown', () => { globalThis.clicked = performance.now(); }, true)")
    page.locator(".tile").nth(3).click()
    page.keyboard.press("d")
    seconds["overlay"] = page.evaluate(OVERLAY)
    page.keyboard.press("Escape")
    seconds["filter"] = page.evaluate(FILTER)
    page.close()
    return seconds


def table(figures: dict[str, Any]) -> str:
    """Return the figures as a table for people."""
    megabytes = {name: size / 1e6 for name, size in figures["bytes"].items()}
    lines = [
        f"{figures['pictures']} pictures: written in {figures['write_s']:.1f} s, again in "
        f"{figures['write_again_s']:.1f} s; {sum(megabytes.values()):.1f} MB",
        "",
        "| in the folder | MB |",
        "| --- | --- |",
        *(f"| {name} | {size:.2f} |" for name, size in sorted(megabytes.items())),
        "",
        "| pictures | first row, s | click to overlay, s | filter, s |",
        "| --- | --- | --- | --- |",
    ]
    for count, seconds in figures["open_s"].items():
        lines.append(f"| {count} | " + " | ".join(f"{each:.3f}" for each in seconds.values()) + " |")
    return "\n".join(lines)
