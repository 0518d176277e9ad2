"""The folders are the architecture: who may import whom, and who may touch files, pxr and bpy (README, DESIGN)."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent / "spin_usd"
MODULES = sorted(path.relative_to(ROOT) for path in ROOT.rglob("*.py") if "data" not in path.relative_to(ROOT).parts)

CORE = {"errors", "arrays", "geometry", "scene"}
SIBLINGS = {"stage", "renderers", "sensor", "labels", "formats", "sampling", "accuracy"}
# What each part of spin_usd may import of spin_usd, besides itself. The siblings meet in scene and in dataset.
MAY_IMPORT = {
    "__init__": set(),
    "errors": set(),
    "resources": {"errors"},
    "sha256": set(),
    "progress": set(),
    "plugin_path": {"errors", "resources"},
    "arrays": {"errors"},
    "geometry": {"errors", "arrays"},
    "scene": {"errors", "arrays", "geometry"},
    "renderers": CORE,
    "sensor": CORE,
    "labels": CORE,
    "sampling": CORE,
    "accuracy": CORE,
    "formats": CORE | {"resources"},
    "stage": CORE | {"resources", "plugin_path", "sha256", "progress"},
    "dataset": CORE | SIBLINGS | {"resources", "plugin_path", "sha256", "progress"},
    "cli": CORE | SIBLINGS | {"resources", "plugin_path", "progress", "dataset"},
}
# The only parts that may import a library that decides much: a folder, or a file in it.
ONLY_IN = {
    "pxr": ("stage",),
    "bpy": ("renderers/blender",),
    "OpenImageIO": ("formats", "stage/composition/images.py", "renderers/blender"),
    "trimesh": ("formats",),
    "plyfile": ("formats",),
    "DracoPy": ("formats",),
    "embreex": ("renderers/raycast/renderer.py",),
    "cv2": ("labels/preview.py", "sensor"),
    "PIL": ("formats",),
    "matplotlib": ("dataset/measure/plot.py",),
    "typer": ("cli",),
    "rich": ("cli",),
    "psutil": ("dataset", "renderers/blender"),
    "subprocess": ("dataset",),
    "tempfile": ("dataset", "stage/composition/images.py", "renderers/blender"),
    "shutil": ("dataset", "stage"),
}
# Alone imports from renderers/blender, when it opens that renderer: it loads bpy.
OPENS_BLENDER = "dataset/process/open_renderer.py"
# Who may read or write files and folders.
FILES_IN = ("formats", "stage", "dataset", "cli", "resources.py", "plugin_path.py", "sha256.py", "renderers/blender")
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
# Formulas read no clock and no hidden chance: times and generators are arguments.
PURE = (
    "errors.py",
    "arrays.py",
    "geometry",
    "scene",
    "sensor",
    "labels",
    "sampling",
    "accuracy",
    "renderers/raycast/renderer.py",
    "renderers/raycast/lambert.py",
    "renderers/camera_shader.py",
    "renderers/downscale.py",
)
IMPURE_MODULES = {"time", "datetime", "random", "secrets", "os", "sys", "socket", "pathlib"}


def within(module, places):
    return any(module.is_relative_to(place) for place in places)


def tree(module):
    return ast.parse((ROOT / module).read_text(), filename=str(module))


def imports(module):
    """Dotted names of all that the module imports, at any depth: inside functions and type-checking blocks too."""
    names = []
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}:{node.lineno}: relative import"
            names += [f"{node.module}.{alias.name}" for alias in node.names if alias.name != "__version__"]
    return names


def part(module):
    return module.parts[0].removesuffix(".py")


def dotted(node):
    """`a.b.c` of an attribute chain, or None."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute) and (owner := dotted(node.value)):
        return f"{owner}.{node.attr}"
    return None


@pytest.mark.parametrize("module", MODULES, ids=str)
def test_imports_go_one_way(module) -> None:
    own = part(module)
    assert own in MAY_IMPORT, f"{own} has no place in the table: add it with what it may import"
    used = {name.split(".")[1] for name in imports(module) if name.startswith("spin_usd.")}
    assert used - {own} <= MAY_IMPORT[own]


@pytest.mark.parametrize("module", MODULES, ids=str)
def test_libraries_stay_in_their_place(module) -> None:
    tops = {name.split(".")[0] for name in imports(module)}
    assert not [name for name in tops if name in ONLY_IN and not within(module, ONLY_IN[name])]


@pytest.mark.parametrize("module", [m for m in MODULES if not within(m, ("renderers/blender", OPENS_BLENDER))], ids=str)
def test_all_else_works_without_blender(module) -> None:
    assert not [name for name in imports(module) if f"{name}.".startswith("spin_usd.renderers.blender.")]


@pytest.mark.parametrize("module", [m for m in MODULES if not within(m, FILES_IN)], ids=str)
def test_only_some_parts_touch_files(module) -> None:
    found = []
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.Call):
            method = node.func.attr if isinstance(node.func, ast.Attribute) else None
            if dotted(node.func) in FILE_CALLS or method in FILE_METHODS:
                found.append(f"{module}:{node.lineno}: {ast.unparse(node)}")
    assert not found


@pytest.mark.parametrize("module", [m for m in MODULES if within(m, PURE)], ids=str)
def test_formulas_read_no_clock_no_chance_no_environment(module) -> None:
    assert not {name.split(".")[0] for name in imports(module)} & IMPURE_MODULES
    chance = [
        n for n in ast.walk(tree(module)) if isinstance(n, ast.Call) and dotted(n.func) == "np.random.default_rng"
    ]
    assert all(call.args for call in chance), "a generator without a seed"


@pytest.mark.parametrize("module", MODULES, ids=str)
def test_no_module_is_a_drawer(module) -> None:
    assert not {"util", "utils", "helper", "helpers", "manager", "common", "misc"} & set(module.with_suffix("").parts)


HELP = "import sys; sys.argv = ['spin-usd', '--help']; from spin_usd.cli.main import run; run()"
REPORT = (
    "import atexit, sys; atexit.register(lambda: print(*sorted({'bpy', 'pxr'} & set(sys.modules)), file=sys.stderr))"
)


@pytest.mark.parametrize("code", ["import spin_usd", "import spin_usd.cli.main", HELP])
def test_starting_loads_neither_pxr_nor_bpy(code) -> None:
    """In a fresh process, also when the program ends by itself."""
    done = subprocess.run([sys.executable, "-c", f"{REPORT}\n{code}"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr.strip() == ""
