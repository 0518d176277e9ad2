"""Name, version and licence of each package in a bundle, as its own metadata state them."""

import platform
from importlib.metadata import distributions
from pathlib import Path


def of(root: Path) -> dict[str, dict[str, str]]:
    """Return them by name; the texts lie in each package's folder *.dist-info."""
    found = {"Python": {"version": platform.python_version(), "licence": "PSF-2.0"}}
    for package in distributions(path=[str(root / "lib" / "python3.13" / "site-packages")]):
        data = package.metadata
        kinds = [kind.split(" :: ")[-1] for kind in data.get_all("Classifier") or [] if kind.startswith("License ::")]
        text = data.get("License-Expression") or "; ".join(kinds) or (data.get("License") or "").split("\n")[0]
        found[data["Name"]] = {"version": package.version, "licence": text}
    return dict(sorted(found.items()))
