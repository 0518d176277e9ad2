"""Tests of the tags that a person gives to pictures on the page, and of what chooses the same pictures elsewhere."""

import csv
import json
import re
import shlex
import shutil
from pathlib import Path

import pytest

import spin_usd
from spin_usd.commands.export.plan import selected
from spin_usd.errors import InputError
from spin_usd.options import names_in
from spin_usd.store.json_schema import valid
from spin_usd.store.tags import tagged

EVIL = "<img src=x onerror=alert(1)>"


def with_tags(page) -> dict[str, list[str]]:
    """The tags that tiles show, by what the tiles are called."""
    found = page.locator(".tile").evaluate_all(
        "them => them.map(t => [t.getAttribute('aria-label'),"
        " [...t.querySelectorAll('.badges span')].map(s => s.textContent)])"
    )
    return {label.split(" · ")[0]: tags for label, tags in found if tags}


def add_tag(page, name) -> None:
    page.get_by_label("A new tag").first.fill(name)
    page.get_by_label("A new tag").first.press("Enter")


def saved(page) -> bytes:
    """The tags.json that the page lets a user save."""
    with page.expect_download() as download:
        page.get_by_label("Save tags.json").click()
    assert download.value.suggested_filename == "tags.json"
    return Path(download.value.path()).read_bytes()


def test_pictures_are_marked_by_keys_and_clicks_and_stay_so(shown, opened) -> None:
    page = opened(shown)
    add_tag(page, "blurred")
    add_tag(page, "too dark")
    page.locator(".tile").first.focus()
    page.keyboard.press("2")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("1")
    page.get_by_label("Mark with blurred by clicking").click()
    page.locator(".tile").nth(2).click()
    page.keyboard.press("Escape")
    expected = {
        "img000001, nominal": ["too dark"],
        "img000002, nominal": ["blurred"],
        "img000003, nominal": ["blurred"],
    }
    assert with_tags(page) == expected
    page.locator(".tile").nth(2).click()
    page.wait_for_selector("[data-shown='nominal/img000003']")
    assert page.get_by_label("Tag blurred", exact=True).get_attribute("aria-pressed") == "true"
    page.keyboard.press("1")
    page.get_by_label("Tag too dark", exact=True).click()
    page.keyboard.press("Escape")
    expected["img000003, nominal"] = ["too dark"]
    assert with_tags(page) == expected
    page.reload()
    page.wait_for_selector("body[data-ready]")
    assert with_tags(page) == expected
    page.get_by_label("Only with the tag too dark").check()
    assert page.locator("#count").inner_text() == "2 of 6 pictures"
    page.wait_for_url(re.compile("tag=too"))


def test_tags_go_by_their_file_to_the_dataset_and_to_others(pictured, shown, opened, tmp_path, spin_usd) -> None:
    """What one saves, another loads, `show` shows in the next page, and `export` takes."""
    page = opened(shown)
    add_tag(page, "good")
    page.locator(".tile").first.focus()
    page.keyboard.press("1")
    content = saved(page)
    said = valid(content, "tags-1", tmp_path)
    assert said["tags"] == {"good": ["nominal/img000001"]}
    dataset = shutil.copytree(pictured, tmp_path / "dataset")
    (dataset / "tags.json").write_bytes(content)
    spin_usd("check", dataset)
    spin_usd("show", dataset, "--out", tmp_path / "page", "--workers", 1)
    again = opened(tmp_path / "page")
    assert with_tags(again) == {"img000001, nominal": ["good"]}
    other = json.dumps(said | {"tags": {"best": ["other/img000003"]}}).encode()
    again.get_by_label("A tags.json", exact=True).set_input_files({"name": "a.json", "mimeType": "", "buffer": other})
    again.get_by_text("best").first.wait_for()
    assert with_tags(again) == {"img000001, nominal": ["good"], "img000003, other": ["best"]}
    (dataset / "tags.json").write_bytes(saved(again))
    out = tmp_path / "out"
    spin_usd("export", dataset, "--to", "webdataset", "--out", out, "--tags", "best,good")
    with (out / "pictures.csv").open() as file:
        rows = [(row["frame"], row["variant"]) for row in csv.DictReader(file)]
    assert sorted(rows) == [("img000001", "nominal"), ("img000003", "other")]


def test_tags_that_cannot_be_read_are_refused_before_a_page_is_begun(pictured, tmp_path) -> None:
    dataset = shutil.copytree(pictured, tmp_path / "dataset")
    (dataset / "tags.json").write_text('{"schema": "tags-1", "tags": [1]}')
    with pytest.raises(InputError, match=r"tags\.json: .*write it like"):
        spin_usd.show(dataset, out=tmp_path / "page", workers=1)
    assert not (tmp_path / "page").exists()


def test_marks_survive_another_file_of_the_dataset(pictured, opened, tmp_path) -> None:
    dataset = shutil.copytree(pictured, tmp_path / "dataset")
    spin_usd.show(dataset, out=tmp_path / "page", workers=1)
    page = opened(tmp_path / "page")
    add_tag(page, "mine")
    page.locator(".tile").first.focus()
    page.keyboard.press("1")
    said = {"schema": "tags-1", "dataset": "dataset", "tags": {"theirs": ["nominal/img000001", "gone/img000009"]}}
    (dataset / "tags.json").write_text(json.dumps(said))
    spin_usd.show(dataset, out=tmp_path / "page", workers=1)
    page.reload()
    page.wait_for_selector("body[data-ready]")
    assert with_tags(page) == {"img000001, nominal": ["theirs", "mine"]}
    page.locator(".tile").first.focus()
    page.keyboard.press("1")
    page.reload()
    page.wait_for_selector("body[data-ready]")
    assert with_tags(page) == {"img000001, nominal": ["mine"]}
    assert json.loads(saved(page))["tags"] == {"theirs": ["gone/img000009"], "mine": ["nominal/img000001"]}


def test_a_tag_is_never_read_as_a_page(shown, opened) -> None:
    page = opened(shown)
    add_tag(page, EVIL)
    page.locator(".tile").first.focus()
    page.keyboard.press("1")
    assert with_tags(page) == {"img000001, nominal": [EVIL]}
    add_tag(page, "a,b")
    assert "without a comma" in page.locator("#trouble").inner_text()
    nonsense = {
        "name": "x.json",
        "mimeType": "",
        "buffer": b'{"schema": "tags-1", "tags": {"a,b": 1, "c": [1, "../x"]}}',
    }
    page.get_by_label("A tags.json", exact=True).set_input_files(nonsense)
    assert page.locator(".tag").count() == 1
    page.get_by_label("A tags.json", exact=True).set_input_files({"name": "y.json", "mimeType": "", "buffer": b"[]"})
    page.get_by_text("y.json holds no tags").wait_for()


NAMES = {
    "": 6,
    "?is:variant=nominal": 3,
    "?in:index=..1": 4,
    "?in:index=1..&is:variant=other": 2,
    "?name=img000003": 2,
    "?tag=some": 3,
}


@pytest.mark.parametrize("query", NAMES)
def test_what_is_copied_chooses_the_same_pictures(pictured, opened, tmp_path, query) -> None:
    """Options of `export`, or what `Dataset.where` takes."""
    dataset = shutil.copytree(pictured, tmp_path / "it's")
    some = ["nominal/img000001", "nominal/img000003", "other/img000002"]
    (dataset / "tags.json").write_text(json.dumps({"schema": "tags-1", "dataset": "", "tags": {"some": some}}))
    spin_usd.show(dataset, out=tmp_path / "page", labels="none", workers=1)
    page = opened(tmp_path / "page", f"#pictures{query}")
    shown = page.locator(".tile").evaluate_all("them => them.map(t => t.getAttribute('aria-label').split(' · ')[0])")
    page.get_by_role("button", name="Copy what chooses").click()
    text = page.locator("#filters code").inner_text()
    if text.startswith("Dataset("):
        found = eval(text, {"Dataset": spin_usd.Dataset}).names
    else:
        words = shlex.split(text)
        options = dict(zip(words[::2], words[1::2], strict=True))
        chosen = selected(
            spin_usd.Dataset(dataset),
            frames=options.get("--frames"),
            variants=names_in(options["--variants"]),
            progress=lambda *_: None,
        )
        found = [(each.frame, each.variant) for each in chosen]
    assert sorted(f"{frame}, {variant}" for frame, variant in found) == sorted(shown)
    assert len(shown) == NAMES[query]


@pytest.mark.parametrize(
    ("tags", "names", "found"),
    [
        (None, ["a"], "is missing: no picture has a tag"),
        ({"a": ["nominal/x"]}, ["b"], "gives no picture the tag 'b'; choose among a"),
        ({"a": []}, ["a"], "gives no picture the tag 'a'; tag pictures"),
    ],
)
def test_what_has_no_tag_is_said_in_a_sentence(tmp_path, tags, names, found) -> None:
    path = tmp_path / "tags.json"
    if tags is not None:
        path.write_text(json.dumps({"schema": "tags-1", "dataset": "d", "tags": tags}))
    with pytest.raises(InputError, match=found):
        tagged(path, names)


def test_an_export_without_its_tags_ends_with_code_2(pictured, tmp_path, spin_usd) -> None:
    told = spin_usd("export", pictured, "--to", "coco", "--out", tmp_path / "out", "--tags", "good", code=2)
    assert "tags.json: is missing: no picture has a tag; save tags.json there" in told.stderr
    lone = tmp_path / "mine.json"
    lone.write_text(json.dumps({"schema": "tags-1", "dataset": "d", "tags": {"good": ["other/img000009"]}}))
    given = ("--tags", "good", "--tags-file", lone)
    told = spin_usd("export", pictured, "--to", "coco", "--out", tmp_path / "out", *given, code=2)
    assert "mine.json: tags no picture of those with good; choose other tags" in told.stderr
    told = spin_usd("export", pictured, "--to", "coco", "--out", tmp_path / "out", *given[2:], code=2)
    assert "tags_file is given without tags" in told.stderr
    assert not (tmp_path / "out").exists()
