"""A folder in which hostile inputs are tried, with files beside it that no command may touch."""

import shutil
import stat
from collections.abc import Mapping
from pathlib import Path

from fuzzing.watch import Watch

OUTSIDE = {
    "secret.usda": '#usda 1.0\n(\n    defaultPrim = "Secret"\n)\ndef Cube "Secret"\n{\n}\n',
    "secret.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "secret.mtl": "newmtl red\nKd 1 0 0\n",
    "secret.json": "[]",
    "secret.csv": "u,v,w\n",
    "run.tmp-1": "a",
    "renders/ab/a.b.c.exr": "a",
    "img000001.png": "a",
    "img9.png": "a",
    "nominal/img000001.json": "{}",
}
USERS = "thesis"  # a file of this name is the user's, wherever it lies


class Sandbox:
    """`work`: where commands are called · `outside`: files beside it · `home`, `tmp`: what the environment names."""

    def __init__(self, folder: Path, seeds: Path) -> None:
        """Make the sandbox anew in `folder`; `seeds` has what `take` copies."""
        remove(folder)
        self.folder, self.seeds = folder, seeds
        self.work, self.outside = folder / "work", folder / "outside"
        for each in (self.work, folder / "home", folder / "tmp"):
            each.mkdir(parents=True)
        for name, text in OUTSIDE.items():
            (self.outside / name).parent.mkdir(parents=True, exist_ok=True)
            (self.outside / name).write_text(text)
        shutil.copyfile(seeds / "texture.png", self.outside / "private.png")

    def take(self, name: str, to: str | None = None) -> Path:
        """Copy the seed `name` into `work`."""
        source, copy = self.seeds / name, self.work / (to or name)
        copy.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, copy, symlinks=True)
        else:
            shutil.copyfile(source, copy)
        return copy

    def write(self, name: str, content: str | bytes) -> Path:
        """Write a file into `work`, with the folders above it."""
        path = self.work / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def begin(self) -> None:
        """Begin to watch: what is there now is prepared."""
        self._before = listing(self.folder)
        self._watch = Watch([self.outside, *(folder for folder in self.outside.rglob("*") if folder.is_dir())])

    def end(self) -> None:
        """End the watch: what is there now is what the commands made of it."""
        self._touched = self._watch.end()
        self._after = listing(self.folder)

    def escapes(self) -> list[str]:
        """What was opened, made, changed or deleted outside meanwhile."""
        before, after = (
            {name: seen for name, seen in found.items() if name.startswith("outside/")}
            for found in (self._before, self._after)
        )
        return [*self._touched, *(f"changed: {name}" for name in differences(before, after))]

    def losses(self, commands_own: tuple[str, ...]) -> list[str]:
        """What was there before and is not as it was, but in folders that are the command's own, and what is left over:
        temporary files, and hidden files beside the output."""
        after = self._after
        lost = [
            name
            for name in self._before
            if name.startswith("work/") and self._before[name] != after.get(name) and not _is_own(name, commands_own)
        ]
        left = [name for name in after if name not in self._before and _is_left_over(name)]
        return [*(f"lost: {name}" for name in lost), *(f"left: {name}" for name in left)]


def listing(folder: Path) -> dict[str, str]:
    """By path below `folder`, what it is: a file that was not written since, a link's target, its kind otherwise."""
    return {str(path.relative_to(folder)): _seen(path) for path in sorted(folder.rglob("*"))}


def differences(before: Mapping[str, str], after: Mapping[str, str]) -> list[str]:
    """The names that are in one alone or differ."""
    return sorted(name for name in {*before, *after} if before.get(name) != after.get(name))


def remove(folder: Path) -> None:
    """Remove a folder whatever is in it."""
    if folder.exists():
        shutil.rmtree(folder)


def _seen(path: Path) -> str:
    status = path.lstat()
    if stat.S_ISLNK(status.st_mode):
        return f"link to {path.readlink()}"
    if not stat.S_ISREG(status.st_mode):
        return f"kind {stat.S_IFMT(status.st_mode):o}"
    return f"file {status.st_ino}, {status.st_size} bytes, of {status.st_mtime_ns}"


def _is_own(name: str, commands_own: tuple[str, ...]) -> bool:
    inside = name.removeprefix("work/")
    return USERS not in name and any(inside == own or inside.startswith(f"{own}/") for own in commands_own)


def _is_left_over(name: str) -> bool:
    if name.startswith("tmp/"):
        return True
    parts = name.split("/")
    return len(parts) == 2 and parts[0] == "work" and parts[1].startswith(".")
