"""Every command of README.md and docs, run as a reader would run it, and every link of every document."""

import itertools
import json
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.core import TyperGroup

import spin_usd as package
from spin_usd.command_line import app
from tests.conftest import REPOSITORY

pytestmark = pytest.mark.children


README, DOCS = REPOSITORY / "README.md", REPOSITORY / "docs"
NOTEBOOK = DOCS / "how-to" / "notebook.ipynb"
PACKAGE = REPOSITORY / "spin_usd"
GUIDES = [README, *sorted(DOCS.rglob("*.md"))]
DOCUMENTS = [*sorted(REPOSITORY.glob("*.md")), *GUIDES[1:], *sorted((REPOSITORY / "stages").rglob("*.md"))]
TOOLS = ("tools/bundle", "tools/demo", "tools/test", "tools/environment")
SHELL = ("source",)
READ_ELSEWHERE = DOCS / "reference" / "dataset.md"
"""Its Python is for another version of OpenCV: tests/readers runs it."""
FOLDERS = ("cameras", "presets", "environments")
SERVING = {"keypoints"}
"""Commands that go on until they are stopped."""
MADE_STAGES = {"author-a-stage.md": ["lightbox_stage"], "poses.md": ["sampled", "likeness"]}


def blocks(document, language):
    return re.findall(rf"^```{language}\n(.*?)^```", document.read_text(), re.MULTILINE | re.DOTALL)


def commands(document):
    """Its command lines, in their order, without comments."""
    return [step for language, step in steps(document) if language == "sh"]


def steps(document):
    """Its command lines and its Python, in their order: ("sh", command) or ("python", program).

    Blocks of Python that follow one another are one program."""
    listed: list[tuple[str, str]] = []
    for language, block in re.findall(r"^```(sh|python)\n(.*?)^```", document.read_text(), re.MULTILINE | re.DOTALL):
        if language == "sh":
            lines = [line.partition("#")[0].strip() for line in block.splitlines()]
            listed += [("sh", line) for line in lines if line]
        elif document != READ_ELSEWHERE:
            before = listed.pop()[1] if listed and listed[-1][0] == "python" else ""
            listed.append(("python", f"{before}{block}\n"))
    return listed


def files(document):
    """The files whose text the document gives, by name: "as `NAME`", then a block of it."""
    named = r"[Aa]s `([\w/]+\.(\w+))`[^`]*?^```\2\n(.*?)^```"
    return {name: text for name, _, text in re.findall(named, document.read_text(), re.MULTILINE | re.DOTALL)}


WITH_STEPS = [document for document in GUIDES if steps(document)]


def shown(document):
    return str(document.relative_to(REPOSITORY))


@pytest.mark.parametrize("document", WITH_STEPS, ids=shown)
def test_the_commands_are_ours_and_have_the_options_given(document) -> None:
    command_line = typer.main.get_command(app)
    assert isinstance(command_line, TyperGroup)
    for command in commands(document):
        name, *arguments = shlex.split(command)
        if name in TOOLS:
            assert (REPOSITORY / name).is_file()
        if name in (*TOOLS, *SHELL):
            continue
        assert name == "spin-usd", command
        chosen = command_line.commands[arguments[0]]
        with chosen.make_context(arguments[0], arguments[1:]) as context:
            assert context.params, command


@pytest.mark.slow
@pytest.mark.parametrize("document", WITH_STEPS, ids=shown)
def test_the_commands_and_the_python_work_in_their_order(document, tmp_path, spin_usd) -> None:
    """In a folder that has the checkout's stages, with the files that the document gives."""
    (tmp_path / "stages").symlink_to(REPOSITORY / "stages")
    for name, text in files(document).items():
        (tmp_path / name).write_text(text)
    for language, step in steps(document):
        name, *arguments = shlex.split(step) if language == "sh" else ["python"]
        if name == "python":
            run_python(step, tmp_path)
        elif arguments[:1] and arguments[0] in SERVING:
            serve_and_stop(arguments, tmp_path)
        elif name not in (*TOOLS, *SHELL):
            spin_usd(*arguments, cwd=tmp_path)
    if document.name == "own-augmentation.md":
        check_appearances(tmp_path / "noisy", spin_usd)
    if document.name in MADE_STAGES:
        check_layers([tmp_path / stage for stage in MADE_STAGES[document.name]])


def run_python(code, folder) -> None:
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_notebook_runs_and_holds_no_outputs(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "agg")
    cells = [cell for cell in json.loads(NOTEBOOK.read_text())["cells"] if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] for cell in cells)
    run_python("\n".join("".join(cell["source"]) for cell in cells), tmp_path)


def serve_and_stop(arguments, folder) -> None:
    """Until it has said where it listens; what it makes as it is stopped is made."""
    command = [Path(sys.executable).with_name("spin-usd"), *arguments, "--port", "0"]
    with subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as server:
        said = next((line for line in server.stderr if "http://" in line), "")
        server.send_signal(signal.SIGINT)
        assert "http://127.0.0.1:" in said
    assert server.returncode == 0


def check_appearances(dataset, spin_usd) -> None:
    """The appearances of one pose differ, and all of them show it."""
    pictures = [path.read_bytes() for path in sorted((dataset / "image").rglob("*.png"))]
    assert len(pictures) == len(set(pictures)) == 4
    found = json.loads(spin_usd("check", dataset, "--json").stdout)["findings"]
    assert not {"nearly-black", "nearly-white", "exposure-end"} & {finding["code"] for finding in found}


def check_layers(stages) -> None:
    """The page of stages lists all layers that lie directly in the folder of layers."""
    page = (DOCS / "concepts" / "stages-and-variants.md").read_text()
    listed = set(re.findall(r"^my_stage/layers/(\S+)", page, re.MULTILINE))
    made = {path.name for stage in stages for path in (stage / "layers").iterdir() if path.is_file()}
    assert made
    assert made <= listed
    assert listed - made <= {
        "keypoints.usda",
        "parts.usda",
        "NAME.usda",
        "NAME_poses.usdc",
        "camera_NAME.usda",
        "model.usda",
        "sampled.usda",
    }


@pytest.mark.slow
def test_the_demo_ends_with_a_contact_sheet(tmp_path) -> None:
    done = subprocess.run(
        [REPOSITORY / "tools" / "demo", "--out", tmp_path / "demo", "--quality", "preview"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "demo" / "contact_sheet.png").is_file()
    assert len(list((tmp_path / "demo" / "dataset" / "image" / "nominal").glob("*.png"))) == 8


@pytest.mark.parametrize("document", DOCUMENTS, ids=shown)
def test_links_lead_to_files_and_headings_that_are_there(document) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", document.read_text()):
        if re.match(r"\w+:", target):
            continue
        path, _, heading = target.partition("#")
        file = document.parent / path if path else document
        assert file.exists(), target
        assert not heading or heading in headings(file), target


@pytest.mark.parametrize("name", ["ARCHITECTURE.md", "docs/concepts/decisions.md"])
def test_the_places_in_the_code_that_a_document_names_are_there(name) -> None:
    named = re.findall(r"`([a-z_]+(?:/[a-z_]+)+(?:\.py)?)/?`", (REPOSITORY / name).read_text())
    assert named
    missing = [place for place in named if not any((root / place).exists() for root in (REPOSITORY, PACKAGE))]
    assert not missing


def headings(file: Path):
    """The anchors that a code host makes of a document's headings."""
    titles = re.findall(r"^#+ (.*)$", file.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("document", ["README.md", "spin_usd/__init__.py"])
def test_all_functions_of_the_package_are_listed(document) -> None:
    listed = max(re.findall(r"(?:`\w+`,\s)+`\w+`\sand\s`\w+`", (REPOSITORY / document).read_text()), key=len)
    assert set(re.findall(r"\w+(?=`)", listed)) == {
        name for name in package.__all__ if name.islower() and name[0] != "_"
    }


def test_schemas_that_documents_name_are_there() -> None:
    named = {name for document in DOCUMENTS for name in re.findall(r"schemas/[\w.-]+\.json", document.read_text())}
    assert named
    assert all((REPOSITORY / name).is_file() for name in named)


def test_the_readme_is_short() -> None:
    assert len(README.read_text().splitlines()) <= 70


def test_every_page_of_docs_is_linked_from_the_first() -> None:
    first = DOCS / "index.md"
    linked = {first, *(DOCS / page for page in re.findall(r"\]\(([\w/-]+\.(?:md|ipynb))\)", first.read_text()))}
    assert linked == {*GUIDES[1:], NOTEBOOK}


def test_what_travels_along_is_named_where_stages_are_authored() -> None:
    text = "".join(
        (DOCS / "how-to" / f"{page}.md").read_text() for page in ("author-a-stage", "own-camera", "own-lights")
    )
    for name in itertools.chain(*map(names, FOLDERS), names("targets", "*/*.usda", where=is_target)):
        assert f"`{name}`" in text, name


def names(folder, pattern="*.usda", where=lambda path: True):
    return {path.stem for path in (REPOSITORY / "stages" / folder).glob(pattern) if where(path)}


def is_target(path):
    return path.stem == path.parent.name
