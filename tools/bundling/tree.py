"""The folder that a bundle unpacks to: Python, the packages of a wheel's user, and bin/spin-usd."""

import json
import shutil
import subprocess
from pathlib import Path

LAUNCHER = """#!/bin/sh
here=$(dirname "$(readlink -f "$0")")
exec "$here/python3.13" -m spin_usd "$@"
"""
NOT_OF_PYTHON = (
    *("test", "idlelib", "tkinter", "turtledemo", "ensurepip", "pydoc_data", "config-*", "site-packages"),
    *("_tkinter*", "_curses*", "readline*", "_dbm*", "_gdbm*", "_test*", "xxlimited*"),  # a terminal, a window
)
ASK = "import json, sys, sysconfig; print(json.dumps([sys.base_prefix, sysconfig.get_config_var('INSTSONAME')]))"


def lay_out(root: Path, venv: Path) -> None:
    """Copy the Python that `venv` was made with, and its packages, to `root`."""
    asked = subprocess.run([venv / "bin" / "python", "-c", ASK], check=True, capture_output=True).stdout
    prefix, shared = json.loads(asked)
    (root / "bin").mkdir(parents=True)
    shutil.copy(Path(prefix) / "bin" / "python3.13", root / "bin")
    shared_library = Path(prefix) / "lib" / shared
    if ".so" in shared and shared_library.exists():
        (root / "lib").mkdir()
        shutil.copy(shared_library, root / "lib")
    ignore = shutil.ignore_patterns(*NOT_OF_PYTHON, "__pycache__")
    python = root / "lib" / "python3.13"
    shutil.copytree(Path(prefix) / "lib" / "python3.13", python, ignore=ignore, symlinks=True)
    packages = venv / "lib" / "python3.13" / "site-packages"
    shutil.copytree(packages, python / "site-packages", ignore=shutil.ignore_patterns("__pycache__"), symlinks=True)
    launcher = root / "bin" / "spin-usd"
    launcher.write_text(LAUNCHER)
    launcher.chmod(0o755)
