"""Classes: links that lead elsewhere, and pipes, sockets, devices and folders where files should be."""

import os
import shutil
import socket
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from fuzzing.corpus.calls import author, check, dataset, inputs, reads_dataset, reads_stage, render, resume, trial
from fuzzing.running.ended import Command, call
from fuzzing.sandbox import Sandbox
from fuzzing.trial import Trial

CACHED = "cache/depth"  # stands for the first file below it


def links() -> Iterator[Trial]:
    """Links within datasets and stages, to folders and files outside."""
    for name in ("image", "records", "cache", "stage", "depth", "records/nominal", "image/nominal", ".work"):
        yield trial("links", f"{name} of a dataset, to a folder", partial(_linked_folder, name))
    for name in ("dataset.json", "records/nominal/img000001.json", "image/nominal/img000001.png", ".lock", CACHED,
                 "cache/measured.json", "stage/dataset.usda", "stage/SHA256SUMS", ".work", "README.md"):  # fmt: skip
        yield trial("links", f"{name} of a dataset, to a file", partial(_linked_file, name))
    for name in ("dataset.usda", "layers/camera.usda", "layers", "targets"):
        yield trial("links", f"{name} of a stage", partial(_linked_in_stage, name))
    yield trial("links", "a folder of temporary names below", _linked_below)
    yield trial("links", "a link to itself", partial(_dangling, "dataset.json"))
    yield trial("links", "a dangling lock", partial(_dangling, ".lock"))
    yield trial("links", "prune what a record lists elsewhere", _prune)
    yield trial("links", "the cache, with old renders there", _old_renders)
    yield trial("links", "--out of author", partial(_linked_out, author()))
    yield trial("links", "--out of render", partial(_linked_out, render()))
    yield trial("links", "x.tmp-y to a folder", _temporary_link)
    yield trial("links", "texture of a model", partial(_linked_input, "texture.png", "private.png"))


def special_files() -> Iterator[Trial]:
    """What is no file, in place of each file that is read."""
    for kind, make in KINDS.items():
        for place, (options, name) in PLACES.items():
            yield trial("special files", f"{kind} as {place}", partial(_input, make, name, options), alone=True)
        for name in IN_DATASET:
            yield trial("special files", f"{kind} as {name}", partial(_in_dataset, make, name), alone=True)
        for name in ("dataset.usda", "layers/camera.usda", "layers/poses.usdc"):
            yield trial("special files", f"{kind} as {name} of a stage", partial(_in_stage, make, name), alone=True)


def _fifo(path: Path) -> None:
    os.mkfifo(path)


def _socket(path: Path) -> None:
    with tempfile.TemporaryDirectory() as short, socket.socket(socket.AF_UNIX) as listening:
        listening.bind(f"{short}/s")
        Path(short, "s").rename(path)


def _folder(path: Path) -> None:
    path.mkdir()


def _link_to(target: str) -> Callable[[Path], None]:
    return lambda path: path.symlink_to(target)


KINDS: dict[str, Callable[[Path], None]] = {
    "pipe": _fifo,
    "socket": _socket,
    "folder": _folder,
    "link to /dev/zero": _link_to("/dev/zero"),
    "link to /dev/urandom": _link_to("/dev/urandom"),
    "link to a terminal": _link_to("/dev/tty"),
}
PLACES: dict[str, tuple[tuple[str, ...], str]] = {
    "poses": ((), "poses.json"),
    "camera": ((), "camera.json"),
    "model": ((), "box.obj"),
    "material library": ((), "box.mtl"),
    "texture": ((), "texture.png"),
    "target": (("--target", "target.usda"), "target.usda"),
    "package": (("--target", "target.usdz"), "target.usdz"),
    "gltf": (("--target", "box.glb"), "box.glb"),
    "keypoints": (("--keypoints", "keypoints.csv"), "keypoints.csv"),
    "parts": (("--parts", "parts.json"), "parts.json"),
    "lidar": (("--lidar", "lidar.toml"), "lidar.toml"),
    "specification": (("--augment", "spec.toml"), "spec.toml"),
    "lights": (("--lights", "lights.usda"), "lights.usda"),
}


IN_DATASET = (
    "dataset.json",
    "records/nominal/img000001.json",
    "cache/measured.json",
    CACHED,
    "cache",
    "image",
    "image/nominal/img000001.png",
    "depth/nominal/img000001.exr",
    "stage/dataset.usda",
    ".lock",
)


def _input(make: Callable[[Path], None], name: str, options: tuple[str, ...], sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    (sandbox.work / name).unlink(missing_ok=True)
    make(sandbox.work / name)
    return [author(*options)]


def _in_dataset(make: Callable[[Path], None], name: str, sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    make(_free(sandbox.work / "ds", name))
    return reads_dataset()[:3]


def _in_stage(make: Callable[[Path], None], name: str, sandbox: Sandbox) -> list[Command]:
    sandbox.take("st")
    make(_free(sandbox.work / "st", name))
    return reads_stage("st")


def _free(root: Path, name: str) -> Path:
    """The path of `name`, with nothing there."""
    path = next((root / name).rglob("*.*")) if name == CACHED else root / name
    shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    return path


def _linked_folder(name: str, sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    _free(sandbox.work / "ds", name).symlink_to(sandbox.outside)
    return reads_dataset()


def _linked_file(name: str, sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    _free(sandbox.work / "ds", name).symlink_to(sandbox.outside / "img9.png")
    return reads_dataset()


def _linked_in_stage(name: str, sandbox: Sandbox) -> list[Command]:
    sandbox.take("st")
    moved = sandbox.outside / name
    moved.parent.mkdir(exist_ok=True)
    shutil.move(sandbox.work / "st" / name, moved)
    (sandbox.work / "st" / name).symlink_to(moved)
    if name == "dataset.usda":  # the user's own path, which is followed: what it names is not there
        shutil.copyfile(moved, sandbox.work / "st" / "other.usda")
        (sandbox.work / "st" / "layers" / "lights.usda").unlink()
        (sandbox.work / "st" / "layers" / "lights.usda").symlink_to(sandbox.outside / "secret.usda")
        return reads_stage("st/other.usda")
    return reads_stage("st")


def _linked_below(sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    (sandbox.work / "ds" / "x").mkdir()
    (sandbox.work / "ds" / "x" / "y").symlink_to(sandbox.outside)
    return [resume(), check("ds")]


def _dangling(name: str, sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    place = _free(sandbox.work / "ds", name)
    place.symlink_to(name if name == "dataset.json" else sandbox.outside / "new")
    return reads_dataset()


def _prune(sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    record = (sandbox.work / "ds" / "records" / "nominal" / "img000001.json").read_text()
    (sandbox.work / "ds" / "image" / "old").symlink_to(sandbox.outside)
    sandbox.write(
        "ds/records/old/img9.json", record.replace("nominal/img000001", "old/img9").replace('"nominal"', '"old"')
    )
    return [render("st", "ds", "--prune"), check("ds")]


def _old_renders(sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    _free(sandbox.work / "ds", "cache").symlink_to(sandbox.outside)
    shutil.rmtree(sandbox.work / "ds" / "image")
    return [resume(), check("ds")]


def _linked_out(command: Command, sandbox: Sandbox) -> list[Command]:
    """A link as --out is the user's own; what is there already is not theirs to change."""
    inputs(sandbox)
    sandbox.take("st")
    sandbox.write("real/thesis.txt", "precious")
    (sandbox.work / "out").symlink_to("real")
    return [command]


def _temporary_link(sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    (sandbox.work / "ds" / "x.tmp-y").symlink_to(sandbox.outside)
    (sandbox.work / "ds" / "stage.tmp-old").symlink_to(sandbox.outside)
    return [resume(), resume(), check("ds")]


def _linked_input(name: str, secret: str, sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    (sandbox.work / name).unlink()
    (sandbox.work / name).symlink_to(sandbox.outside / secret)
    return [call(*author().arguments)]
