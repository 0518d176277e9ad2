"""The help of a command, with colours if the terminal has them. rich could draw it too, but takes 0.2 s to load."""

import re
import shutil
import sys

import typer

from spin_usd.terminal.lines import has_colours

MAX_WIDTH = 110
"""Columns of the help on a wide terminal."""

_HEADING = re.compile(r"^[A-Z][a-z]+(?: [a-z]+)*:", re.MULTILINE)
_NAME = re.compile(r"^  (?:-{1,2}[a-z][\w-]*(?:, --[\w-]+)*|[a-z][\w-]*(?=  ))", re.MULTILINE)

EXAMPLES = {
    "author": (
        "spin-usd author --poses poses.json --target tango --camera speedplus --out my_stage",
        "spin-usd author --poses poses.json --target craft.glb --camera camera.json --channels rgb "
        "--keypoints keypoints.json --parts parts.csv --out my_stage",
        "spin-usd author --sample 'range=3..10 inside=0.9 count=100' --target tango --camera speedplus --out sampled",
        "spin-usd author --sample speedplus --count 100 --out likeness",
        "spin-usd author --minimal --out by_hand",
    ),
    "keypoints": (
        "spin-usd keypoints tango",
        "spin-usd keypoints craft.glb --out craft_keypoints.usda",
    ),
    "augment": (
        "spin-usd augment my_stage --spec my_stage/noisy.toml",
        "spin-usd augment --list",
    ),
    "plan": (
        "spin-usd plan my_stage",
        "spin-usd plan my_stage --variants 'noisy_*' --quality draft --explain",
    ),
    "render": (
        "spin-usd render my_stage --out my_dataset --frames 0:10",
        "spin-usd render my_stage --out my_dataset --variants all --quality draft",
        "spin-usd render my_stage --out preview --renderer raycast --samples 4",
        "spin-usd render my_stage --out my_dataset --shard 0/3",
    ),
    "merge": ("spin-usd merge shard_0 shard_1 shard_2 --out my_dataset",),
    "check": (
        "spin-usd check my_stage",
        "spin-usd check my_dataset",
        "spin-usd check my_dataset --repair",
    ),
    "show": (
        "spin-usd show my_dataset",
        "spin-usd show my_dataset --out my_page --beside another_dataset",
    ),
    "export": (
        "spin-usd export my_dataset --to speedplus --out my_speedplus --split train=0.8,validation=0.2",
        "spin-usd export --list",
    ),
    "score": (
        "spin-usd score predictions.csv --truth my_dataset",
        "spin-usd score --shape mesh.ply --truth my_task/truth",
        "spin-usd score keypoints.json --truth my_dataset --variants 'noisy_*' --partial --out my_score",
    ),
    "evidence": (
        "spin-usd evidence my_dataset --domain approach.toml --out my_evidence",
        "spin-usd evidence my_dataset --domain approach.toml --fill missing.toml --out my_evidence",
    ),
    "gap": (
        "spin-usd gap real_pictures my_stage --out my_gap",
        "spin-usd gap real_pictures my_stage --poses poses.json --fit light,camera --out my_gap",
    ),
    "diff": ("spin-usd diff my_stage nominal noisy_1",),
    "measure": (
        "spin-usd measure my_stage",
        "spin-usd render my_stage --out my_dataset --error 0.05",
    ),
    "watch": (
        "spin-usd watch my_stage --frame img000001",
        "spin-usd watch my_stage --frame 0 --variant noisy_1 --renderer raycast --terminal",
    ),
    "debug": (
        "spin-usd debug my_stage --frame img000001",
        "spin-usd debug my_stage --frame 0 --variant noisy_1 --effort samples=64 --out inspect.blend",
    ),
    "reproduce": ("spin-usd reproduce my_dataset img000001",),
}


def width() -> int:
    """Return the number of columns of the help; 80 in a pipe."""
    return min(shutil.get_terminal_size().columns, MAX_WIDTH)


def help_text(plain: str) -> str:
    """Return the `plain` text of a help with bold headings, and colours for the names of commands and options."""
    if not has_colours(sys.stdout):
        return plain
    headed = _HEADING.sub(lambda found: typer.style(found[0], bold=True), plain)
    return _NAME.sub(lambda found: typer.style(found[0], fg=typer.colors.CYAN), headed)


def examples_of(command: str) -> str | None:
    """Return the end of the command's help; None for a command without examples."""
    return "\n\n".join(("For example:", *EXAMPLES[command])) if command in EXAMPLES else None
