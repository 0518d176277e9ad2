"""Where the layers and schemas that travel with the package lie: in a wheel, or at a checkout's top level."""

from pathlib import Path

from spin_usd.errors import InputError

PACKAGE = Path(__file__).resolve().parent


def stages() -> Path:
    """The folder of hand-written layers: targets, cameras, environments, augmentations, examples."""
    return _folder("stages")


def schemas() -> Path:
    """The folder of JSON Schemas and of the codeless USD schema (in `spin`)."""
    return _folder("schemas")


def _folder(name: str) -> Path:
    for folder in (PACKAGE / "data" / name, PACKAGE.parent / name):
        if folder.is_dir():
            return folder
    raise InputError(f"the installation lacks its folder '{name}'", where=PACKAGE, do="install spin_usd again")
