"""Try models that others made: author, check and render each in one picture, and tell the outcome of each in a table.

    tools/try_files FILE_OR_FOLDER ... --out DIR [--blender]

The bounds of what was authored stand beside those of the source, which another library reads: pxr itself for USD,
trimesh for other formats. With --blender the picture stands beside that of Blender's own importer, by the same camera
and Sun (DIR/beside/*.png), and so do its bounds. A file that was tried before is not tried again while DIR/outcomes is
kept.
"""

import argparse
import json
import sys
from pathlib import Path

from real_files.attempt import Attempt, tried
from real_files.source import SUFFIXES
from real_files.table import table
from rich.progress import track


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", type=Path, nargs="+", metavar="FILE_OR_FOLDER")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR")
    parser.add_argument("--renderer", choices=("blender", "raycast"), default="raycast")
    parser.add_argument("--blender", action="store_true", help="compare with Blender's own importer")
    parser.add_argument(
        "--command", default="spin-usd", help="the spin-usd to try, for example that of another version"
    )
    options = parser.parse_args()
    files = [(file, root) for root in options.models for file in model_files(root)]
    outcomes = []
    for file, root in track(files, description="files"):
        name = file.name if file == root else str(file.relative_to(root.parent))
        attempt = Attempt(
            file=file,
            folder=options.out / "work" / name.replace("/", "__"),
            command=options.command,
            renderer="blender" if options.blender else options.renderer,
            compare=options.blender,
        )
        outcomes.append({"file": name, **kept(options.out / "outcomes" / f"{name.replace('/', '__')}.json", attempt)})
    text = table(outcomes)
    (options.out / "table.md").write_text(text)
    print(text)


def model_files(root: Path) -> list[Path]:
    """The model files at or below `root`, in order of their names."""
    return [root] if root.is_file() else sorted(f for f in root.rglob("*") if f.suffix.lower() in SUFFIXES)


def kept(outcome_file: Path, attempt: Attempt) -> dict[str, object]:
    """The outcome in `outcome_file`, which is made where it is not there yet."""
    if not outcome_file.is_file():
        outcome_file.parent.mkdir(parents=True, exist_ok=True)
        outcome_file.write_text(json.dumps(tried(attempt), indent=1))
    found: dict[str, object] = json.loads(outcome_file.read_text())
    return found


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    main()
