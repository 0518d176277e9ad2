"""Tests of the page in a real browser, with real clicks and keys."""

import json
import re
import shlex
import shutil

import numpy as np
import pytest

import spin_usd
from spin_usd.commands.show import run as gallery
from spin_usd.commands.show.columns import Columns
from spin_usd.commands.show.data_file import KEY_LENGTH, DataFile
from spin_usd.commands.show.in_child import STEP_M
from spin_usd.commands.show.picture_keys import PictureKeys
from spin_usd.commands.show.read_records import ReadPicture
from spin_usd.commands.show.run import pictures_of

RAY_M = 1e-6  # what a point is off where the page's ray and ours differ by rounding, with float32's 6e-8 of 10 m
WINDOW = 100  # more tiles than a small laptop shows
PICTURE = "#picture/nominal/img000002"


@pytest.fixture
def picture_page(shown, opened):
    """The page with the picture img000002, nominal, large."""
    return wait_for(opened(shown, PICTURE), "nominal/img000002")


def wait_for(page, picture):
    """Wait until that picture is shown large."""
    page.wait_for_selector(f"[data-shown='{picture}']")
    return page


def tiles(page) -> list[str]:
    """The names of the tiles, in the order of their places."""
    found = page.locator(".tile").evaluate_all(
        "them => them.map(t => [+t.dataset.place, t.getAttribute('aria-label')])"
    )
    return [label for _, label in sorted(found)]


def frames(page) -> list[str]:
    return [label.split(",")[0] for label in tiles(page)]


def under_the_pointer(page) -> dict[str, str]:
    """What the page says is under the pointer."""
    rows = page.locator(".pointer tr").all()
    return {row.locator("th").inner_text(): row.locator("td").inner_text() for row in rows}


def move_to(page, column, row) -> None:
    """Move the pointer to the centre of a pixel of the picture."""
    box = page.locator(".paper").bounding_box()
    zoom = box["width"] / float(page.locator(".drawing").get_attribute("viewBox").split()[2])
    page.mouse.move(box["x"] + (column + 0.5) * zoom, box["y"] + (row + 0.5) * zoom)


def test_the_values_under_the_pointer_are_those_of_the_dataset(pictured, picture_page) -> None:
    page = picture_page
    picture = spin_usd.Dataset(pictured).picture("img000002")
    rows, columns = np.nonzero(picture.depth)
    for place in np.linspace(0, len(rows) - 1, 7).astype(int):
        row, column = int(rows[place]), int(columns[place])
        move_to(page, column, row)
        found = under_the_pointer(page)
        assert found["Pixel"] == f"column {column}, row {row}"
        assert np.float32(found["Depth, m"]) == picture.depth[row, column]
        assert found["Parts"].startswith(picture.parts[int(picture.segmentation[row, column])].name)
        point = np.array(found["Dense pose, m"].split(", "), float)
        assert np.abs(point - picture.dense_pose[row, column]).max() <= STEP_M + RAY_M
        normal = np.array(found["Normals (camera)"].split(", "), np.float32)
        assert (normal == picture.label("normals_cam")[row, column]).all()
    move_to(page, 0, 0)
    assert under_the_pointer(page)["Depth, m"] == "–"


def test_overlays_lie_where_the_labels_are(pictured, picture_page) -> None:
    """Each letter lays its label over the picture, painted in the pixels where the dataset has it, and blends it."""
    page = picture_page
    picture = spin_usd.Dataset(pictured).picture("img000002")
    for key, kind in {"d": "depth", "p": "segmentation", "o": "dense_pose", "n": "normals_cam", "l": "lit"}.items():
        page.keyboard.press(key)
        canvas = page.locator(f"canvas[data-kind={kind}]")
        found = canvas.evaluate(
            "c => { const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
            " const on = []; for (let i = 3; i < d.length; i += 4) on.push(d[i] > 0);"
            " return [c.offsetLeft, c.offsetTop, c.width, on]; }"
        )
        left, top, width, on = found
        label = picture.label(kind)
        there = (label != 0).any(-1) if label.ndim == 3 else label != 0
        painted = np.zeros_like(there)
        painted[top : top + len(on) // width, left : left + width] = np.reshape(on, (-1, width))
        assert (painted == there).all()
    page.get_by_label("Blend of Depth").fill("0.25")
    assert page.locator("canvas[data-kind=depth]").evaluate("c => c.style.opacity") == "0.25"
    page.keyboard.press("0")
    assert page.locator(".areas canvas").count() == 0


def test_what_is_drawn_is_what_the_record_says(pictured, picture_page) -> None:
    page = picture_page
    picture = spin_usd.Dataset(pictured).picture("img000002")
    (target,) = picture.targets
    for key in "bcka":
        page.keyboard.press(key)
    x, y, wide, tall = (float(page.locator(".box.visible").get_attribute(it)) for it in ("x", "y", "width", "height"))
    assert [x, y, x + wide, y + tall] == target.box_visible.tolist()
    assert page.locator(".cuboid").count() == 12
    for place, (pixel, state) in enumerate(zip(target.keypoints, target.keypoint_states, strict=True)):
        mark = page.locator(".keypoint").nth(place)
        assert [float(mark.get_attribute("cx")), float(mark.get_attribute("cy"))] == pixel.tolist()
        assert state in mark.get_attribute("class").split()
    origin = page.locator("[data-drawn=axes] line").first
    found = [float(origin.get_attribute("x1")), float(origin.get_attribute("y1"))]
    assert found == pytest.approx(picture.camera.project(picture.t_cam_body).tolist(), abs=1e-9)


HOLD = """name => {
  const request = requestData;
  requestData = async (file) => {
    if (file === name) await new Promise((resolve) => { globalThis.release = resolve; });
    return request(file);
  };
}"""


@pytest.fixture
def held(pictured, shown, opened, tmp_path, monkeypatch):
    """The page with a file for each record, at img000002; and a function that lets it wait for the record or the labels
    of img000001 until it calls `release`."""
    monkeypatch.setattr(gallery, "PER_FILE", 1)
    monkeypatch.setattr(gallery, "PER_FILE", 1)
    folder = shutil.copytree(shown, tmp_path / "page")
    spin_usd.show(pictured, out=folder, workers=1)
    page = wait_for(opened(folder, PICTURE), "nominal/img000002")
    row = spin_usd.Dataset(pictured).names.index(("img000001", "nominal"))
    record = page.evaluate(f"() => loadData('index.js').then(({{ header }}) => header.records[{row}])")
    labels = "({ header }) => header.pictures[0].files.labels"

    def hold(what):
        name = record if what == "record" else page.evaluate(f"() => loadData('{record}').then({labels})")
        page.evaluate(HOLD, name)

    return page, hold


def go_to(page, picture) -> None:
    page.evaluate("picture => { location.hash = `picture/${picture}`; }", picture)


def settle(page) -> None:
    """Wait until the page has done with all that came."""
    page.evaluate("() => Promise.all(loaded.values())")
    page.wait_for_timeout(100)


def test_a_record_that_comes_late_changes_nothing_of_the_picture_that_is_shown(held) -> None:
    page, hold = held
    before = page.locator(".paper img").get_attribute("src")
    hold("record")
    go_to(page, "nominal/img000001")
    go_to(page, "nominal/img000002")
    wait_for(page, "nominal/img000002")
    page.evaluate("() => release()")
    settle(page)
    assert page.locator(".paper img").get_attribute("src") == before
    assert page.locator("#side h2").inner_text() == "img000002"


def test_until_the_labels_come_nothing_of_another_picture_lies_over_the_image(pictured, held) -> None:
    page, hold = held
    row, column = np.argwhere(spin_usd.Dataset(pictured).picture("img000002").depth)[0]
    page.keyboard.press("d")
    hold("labels")
    go_to(page, "nominal/img000001")
    page.get_by_role("heading", name="img000001").wait_for()
    assert page.get_by_alt_text("img000001 of nominal").is_visible()
    assert page.locator(".areas canvas").count() == 0
    move_to(page, column, row)
    assert "Depth, m" not in under_the_pointer(page)
    page.evaluate("() => release()")
    wait_for(page, "nominal/img000001")
    assert page.locator(".areas canvas").count() == 1


def test_keys_lead_through_pictures_and_variants(shown, opened) -> None:
    page = opened(shown)
    page.locator(".tile").first.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    wait_for(page, "nominal/img000002")
    page.keyboard.press("ArrowRight")
    wait_for(page, "nominal/img000003")
    page.keyboard.press("ArrowDown")
    wait_for(page, "other/img000003")
    page.get_by_label("Variant of this frame").fill("0")
    wait_for(page, "nominal/img000003")
    page.keyboard.press("Escape")
    assert page.locator("#grid").is_visible()
    assert page.locator(".tile:focus").get_attribute("aria-label").startswith("img000003, nominal")
    page.keyboard.press("?")
    assert page.get_by_role("dialog").is_visible()
    assert "Dense pose" in page.get_by_role("dialog").inner_text()
    page.keyboard.press("Escape")
    page.keyboard.press("s")
    assert page.locator("#distributions").is_visible()


def test_filters_and_sorting_choose_the_pictures(pictured, shown, opened) -> None:
    dataset = spin_usd.Dataset(pictured)
    page = opened(shown)
    assert len(tiles(page)) == 6
    page.get_by_label("other", exact=True).uncheck()
    ranges = {picture.frame: picture.targets[0].range for picture in dataset.of_variant("nominal")}
    assert sorted(frames(page)) == sorted(ranges)
    page.get_by_label("Sort by").select_option(label="Range")
    page.get_by_label("Sort in descending order").click()
    assert frames(page) == sorted(ranges, key=ranges.get, reverse=True)
    limit = sorted(ranges.values())[1] + 1e-3
    page.get_by_label("Greatest Range").fill(str(limit))
    page.get_by_label("Greatest Range").press("Enter")
    assert set(frames(page)) == {frame for frame, value in ranges.items() if value <= limit}
    assert page.locator("#count").inner_text() == "2 of 6 pictures"
    page.get_by_role("button", name="Show all").click()
    assert len(tiles(page)) == 6


def address(page) -> str:
    return str(page.evaluate("() => location.hash"))


def test_the_address_holds_filter_sorting_and_picture(pictured, shown, opened) -> None:
    """A page that is opened at another's address shows the same, and so does one that is loaded again."""
    ranges = {picture.frame: picture.targets[0].range for picture in spin_usd.Dataset(pictured).of_variant("nominal")}
    page = opened(shown)
    page.get_by_label("other", exact=True).uncheck()
    page.get_by_label("Sort by").select_option(label="Range")
    page.get_by_label("Sort in descending order").click()
    page.get_by_label("Least Range").fill(str(sorted(ranges.values())[0] + 1e-3))
    page.get_by_label("Least Range").press("Enter")
    page.locator(".tile").last.focus()
    page.keyboard.press("ArrowLeft")
    expected = sorted(ranges, key=ranges.get, reverse=True)[:2]
    page.wait_for_url(re.compile(re.escape(f"#pictures/nominal/{expected[0]}?in:range@1=")))
    again = opened(shown, address(page))
    again.reload()
    again.wait_for_selector("body[data-ready]")
    assert frames(again) == frames(page) == expected
    assert again.get_by_label("Least Range").input_value() == page.get_by_label("Least Range").input_value()
    assert not again.get_by_label("other", exact=True).is_checked()
    assert again.get_by_label("Sort by").input_value() == "range@1"
    assert again.locator(".tile:focus").get_attribute("aria-label").startswith(expected[0])
    again.keyboard.press("Enter")
    wait_for(again, f"nominal/{expected[0]}")
    assert again.locator(".place").inner_text() == "1 of 2 shown"


def test_the_back_button_undoes_filters_and_leads_back_to_the_grid(shown, opened) -> None:
    page = opened(shown)
    page.get_by_label("other", exact=True).uncheck()
    page.get_by_label("Part of the frame's name").press_sequentially("img000002")
    page.locator(".tile").click()
    wait_for(page, "nominal/img000002")
    counts = [page.locator("#count").inner_text()]
    page.go_back()
    page.locator("#grid").wait_for()
    for _ in range(2):
        page.go_back()
        page.wait_for_function("before => document.querySelector('#count').textContent !== before", arg=counts[-1])
        counts.append(page.locator("#count").inner_text())
    assert counts == ["1 of 6 pictures", "3 of 6 pictures", "6 pictures"]
    assert page.get_by_label("other", exact=True).is_checked()
    assert page.get_by_label("Part of the frame's name").input_value() == ""


@pytest.mark.parametrize(
    "fragment",
    ["#picture/nominal/nothing", "#%", "#pictures?in:range@1=x..&is:nothing=1&sort=constructor", "#a?b?c", "#?%="],
)
def test_an_address_that_says_nothing_shows_all(shown, opened, fragment) -> None:
    assert len(tiles(opened(shown, fragment))) == 6


def test_values_of_records_stand_in_the_address(pictured, shown, opened) -> None:
    page = opened(shown, "#pictures?in:targets[0].pixels.visible=..1&is:variant=other")
    assert page.get_by_label("Greatest targets[0].pixels.visible").input_value() == "1"
    assert not page.get_by_label("nominal", exact=True).is_checked()
    assert tiles(page) == []


def test_digests_are_nothing_to_sort_by(shown, opened) -> None:
    offered = opened(shown).locator("#sort option").evaluate_all("them => them.map(({ value }) => value)")
    assert "targets[0].pixels.visible" in offered
    assert not [name for name in offered if name.startswith("provenance.keys")]


def test_what_few_sort_by_and_what_never_differs_is_folded(shown, opened) -> None:
    page = opened(shown)
    names = "them => them.map(({ value }) => value)"
    offered = page.locator("#sort option").evaluate_all(names)
    assert not [name for name in offered if name.endswith("]") or name.startswith(("provenance.", "visible@"))]
    assert not page.get_by_label("Least Visible fraction").count()
    page.get_by_label("Sort by").select_option(label=page.locator("#sort option").last.inner_text())
    assert "pose.t_cam_body[2]" in page.locator("#sort option").evaluate_all(names)
    assert page.get_by_label("Sort by").input_value() == ""
    again = opened(shown, "#pictures?sort=pose.t_cam_body[2]")
    assert again.get_by_label("Sort by").input_value() == "pose.t_cam_body[2]"


def test_all_that_is_used_most_can_be_reached_without_scrolling(shown, opened) -> None:
    page = wait_for(opened(shown, PICTURE, size=(1440, 900)), "nominal/img000002")
    used = [*page.locator("#side header button, .overlays input, .variants input").all(), page.locator(".pointer")]
    assert all(each.bounding_box()["y"] + each.bounding_box()["height"] < 900 for each in used)


def test_tiles_are_cropped_to_the_target(pictured, shown, opened) -> None:
    page = opened(shown)
    page.get_by_label("Crop to target").check()
    source = page.locator(".tile img").first.get_attribute("src")
    assert source.endswith("_target.jpg")
    assert (shown / source).is_file()
    (target,) = spin_usd.Dataset(pictured).picture("img000001").targets
    x0, y0, x1, y1 = target.box_visible
    width, height = page.locator(".tile img").first.evaluate(
        "i => i.decode().then(() => [i.naturalWidth, i.naturalHeight])"
    )
    assert width == pytest.approx(1.25 * max(x1 - x0, (y1 - y0) * 240 / 150), abs=1)
    assert width / height == pytest.approx(240 / 150, abs=0.05)


def test_depth_has_a_scale(pictured, picture_page) -> None:
    page = picture_page
    assert not page.get_by_label("Scale of Depth").count()
    page.keyboard.press("d")
    depth = spin_usd.Dataset(pictured).picture("img000002").depth
    seen = depth[depth > 0].astype(float)
    ends = page.get_by_label("Scale of Depth").locator("span").all_inner_texts()
    found = [float(end.removesuffix(" m")) for end in ends]
    assert found == pytest.approx([seen.min(), (seen.min() + seen.max()) / 2, seen.max()], rel=1e-3)


def test_any_value_of_the_records_is_a_filter(pictured, shown, opened) -> None:
    page = opened(shown)
    adder = page.get_by_label("A value of the records to filter by")
    adder.fill("targets[0].pixels.visible")
    adder.press("Enter")
    least = page.get_by_label("Least targets[0].pixels.visible")
    counts = {p.frame: p.targets[0].pixels_visible for p in spin_usd.Dataset(pictured)}
    least.fill(str(max(counts.values())))
    least.press("Enter")
    assert set(frames(page)) == {max(counts, key=counts.get)}


def test_a_range_dragged_to_the_edges_leaves_out_no_picture(shown, opened) -> None:
    page = opened(shown)
    box = page.get_by_label("Histogram of Range").bounding_box()
    page.mouse.move(box["x"] + 1e-3, box["y"] + 5)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 5)
    page.mouse.move(box["x"] + box["width"] + 20, box["y"] + 5)
    assert page.get_by_label("Greatest Range").input_value() == ""
    page.mouse.up()
    assert len(tiles(page)) == 6


def test_a_missing_file_is_named_and_the_page_goes_on(shown, opened, tmp_path) -> None:
    from playwright.sync_api import expect

    folder = shutil.copytree(shown, tmp_path / "page")
    page = opened(folder, complete=False)
    name = "targets[0].pixels.visible"
    column = page.evaluate(
        f"() => loadData('index.js').then(({{ header }}) => header.columns.find((each) => each.name === '{name}').file)"
    )
    (folder / column).unlink()
    adder = page.get_by_label("A value of the records to filter by")
    for _ in range(2):
        adder.fill(name)
        adder.press("Enter")
        expect(page.locator("#trouble")).to_contain_text(f"{column} is missing")
        page.get_by_label("Sort by").select_option(label="Range")
        expect(page.locator("#trouble")).to_be_empty()
    page.get_by_label("Sort by").select_option(name)
    expect(page.locator("#trouble")).to_contain_text(f"{column} is missing")


def test_it_says_what_made_the_picture_and_makes_it_again(pictured, shown, opened) -> None:
    """The command as a shell reads it: the folder has a space in its name."""
    page = wait_for(opened(shown, "#picture/nominal/img000001"), "nominal/img000001")
    words = shlex.split(page.locator(".command code").inner_text())
    assert words == ["spin-usd", "reproduce", str(pictured), "img000001"]
    page.get_by_text(re.compile("Layers")).click()
    assert "dataset.usda" in page.locator(".layers").inner_text()


def test_both_datasets_have_their_plots(shown, opened) -> None:
    page = opened(shown, "#distributions")
    titles = page.locator(".card h2").all_inner_texts()
    assert titles == ["Range", "Sun angle", "Attitude", "Brightness", "Position in the frame", "Visible fraction"]
    assert page.locator(".plot .own").count() == page.locator(".plot .other").count() == 4
    assert page.locator("canvas.density").count() == 6


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_is_as_light_as_the_system_until_it_is_switched(shown, opened, scheme) -> None:
    page = opened(shown, color_scheme=scheme)
    brightness = "() => getComputedStyle(document.body).backgroundColor.match(/\\d+/)[0] > 128"
    assert page.evaluate(brightness) == (scheme == "light")
    page.keyboard.press("x")
    assert page.evaluate(brightness) == (scheme == "dark")


def test_a_damaged_picture_is_marked_and_the_others_work(pictured, opened, tmp_path, spin_usd) -> None:
    dataset = shutil.copytree(pictured, tmp_path / "dataset")
    (dataset / "records" / "other" / "img000001.json").write_text("{}")
    for variant in ("nominal", "other"):
        (dataset / "depth" / variant / "img000002.exr").write_bytes(b"nonsense")
    done = spin_usd("show", dataset, "--out", tmp_path / "page", "--workers", 1, code=1)
    assert "6 pictures, 3 damaged" in done.stdout
    named = re.findall(r"^damaged: (\S+): ", done.stderr, re.MULTILINE)
    assert set(named) == {"nominal/img000002", "other/img000002", "other/img000001"}
    assert "damaged: nominal/img000002: depth/nominal/img000002.exr: cannot be read" in done.stderr
    page = opened(tmp_path / "page")
    assert page.locator(".tile.damaged").count() == 3
    page.get_by_label("Damaged only").check()
    assert len(tiles(page)) == 3
    page.get_by_role("button", name=re.compile("img000001")).click()
    wait_for(page, "other/img000001")
    assert "is not a record of a picture" in page.get_by_role("alert").inner_text()
    page.keyboard.press("ArrowUp")
    wait_for(page, "nominal/img000001")
    assert not page.get_by_role("alert").is_visible()


EVIL = "</script><script>document.title='evil'</script><img src=x onerror=\"document.title='evil'\">"


def test_no_text_of_a_dataset_is_read_as_a_page(pictured, opened, tmp_path) -> None:
    dataset = shutil.copytree(pictured, tmp_path / EVIL.replace("/", "").replace("'", ""), copy_function=shutil.copy)
    described = json.loads((dataset / "dataset.json").read_text())
    described["targets"][0]["name"] = EVIL
    described["targets"][0]["keypoints"] = {EVIL: [0, 0, 0], "__proto__": [1, 1, 1]}
    for part in described["parts"].values():
        part["name"] = part["class"] = EVIL
    (dataset / "dataset.json").write_text(json.dumps(described))
    for path in (dataset / "records").rglob("*.json"):
        record = json.loads(path.read_text())
        record |= {"source_file": EVIL, "__proto__": {"polluted": 1}, "\u2028": EVIL}
        record["provenance"]["stage"]["files"] = {EVIL: EVIL}
        record["targets"][0]["name"] = EVIL
        record["targets"][0]["keypoints"] = [[10.0, 10.0, EVIL], [20.0, 20.0, "constructor"]]
        path.write_text(json.dumps(record))
    spin_usd.show(dataset, out=tmp_path / "page", workers=1)
    page = wait_for(opened(tmp_path / "page", PICTURE), "nominal/img000002")
    for key in "dpobkca":
        page.keyboard.press(key)
    page.get_by_text(re.compile("^Record")).click()
    page.get_by_text(re.compile("^Layers")).click()
    assert page.title() == dataset.name
    assert EVIL in page.locator("#side").inner_text()
    assert page.evaluate("() => ({}).polluted === undefined && document.scripts.length") == len(
        list((tmp_path / "page" / "page").glob("*.js"))
    )


def test_of_sixty_thousand_pictures_a_window_of_tiles_is_there(shown, opened, tmp_path) -> None:
    folder = shutil.copytree(shown, tmp_path / "page")
    key = next((folder / "thumbnails").rglob("*.jpg")).stem[:KEY_LENGTH]  # tiles have more to their names
    pictures = [
        ReadPicture(frame=f"img{number:06}", variant="nominal", keys=PictureKeys(image=key)) for number in range(60_000)
    ]
    header, arrays = pictures_of(pictures)
    columns = Columns()
    for number in range(60_000):
        columns.add({"range@1": 5 + number % 997 / 100, "brightness": number / 60_000})
    numbers = {name: column.numbers for name, column in columns.columns()}
    measures = [{"name": name, "title": name, "unit": "", "target": None} for name in numbers]
    shared = {
        "tags": {},
        "dataset": "many",
        "targets": [],
        "parts": {},
        "labels": [],
        "columns": [],
        "records": [],
        "per_file": 64,
    }
    index = DataFile(header | shared | {"measures": measures, "given": "many", "faults": {}}, arrays | numbers)
    (folder / "index.js").write_bytes(index.script("index"))
    page = opened(folder)
    assert page.locator("#count").inner_text() == "60000 pictures"
    assert 0 < page.locator(".tile").count() < WINDOW
    page.locator(".tile").first.focus()
    page.keyboard.press("End")
    assert page.locator(".tile:focus").get_attribute("aria-label").startswith("img059999")
    assert page.locator(".tile").count() < WINDOW
    page.get_by_label("Least brightness").fill("0.99998")
    page.get_by_label("Least brightness").press("Enter")
    assert frames(page) == ["img059999"]
