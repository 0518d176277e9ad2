"""Classes: names that break lines, terminals, globs and encodings, and texts in other encodings."""

import json
from collections.abc import Iterator
from functools import partial

from fuzzing.corpus import hosts
from fuzzing.corpus.calls import author, check, dataset, inputs, render, resume, trial
from fuzzing.running.ended import Command, call
from fuzzing.sandbox import Sandbox
from fuzzing.trial import Trial

NAMES = {
    "brackets": "run[1]",
    "braces": "a{b,c}",
    "stars": "a*b?",
    "blanks": " a  b ",
    "quotes": "a'b\"c",
    "percent": "%s%n%d",
    "at": "a@b",
    "hash": "a#b?c=d",
    "non-ASCII": "büro-数据-🛰",
    "line break": "a\nerror: forged",
    "colour": "a\x1b[31mb",
    "bell": "a\x07b",
    "bidi": "a\u202egpj.exe",
    "not UTF-8": "a\udcffb",
    "dollar": "$HOME`id`",
    "backslash": "a\\b",
    "dash": "-rf",
    "tilde": "~root",
    "255 letters": "a" * 255,
    "colon": "c:con",
    "markup": "[bold red]x",
    "tiles": "a.<UDIM>",
}
ENCODINGS: dict[str, hosts.Encode] = {
    "UTF-16": lambda text: text.encode("utf-16"),
    "UTF-32": lambda text: text.encode("utf-32"),
    "BOM": lambda text: text.encode("utf-8-sig"),
    "a byte that is not UTF-8": lambda text: text.encode()[:9] + b"\xff" + text.encode()[9:],
    "an overlong NUL": lambda text: text.encode()[:-2] + b"\xc0\x80" + text.encode()[-2:],
    "a surrogate": lambda text: text.encode()[:-2] + b"\xed\xa0\x80" + text.encode()[-2:],
    "NULs": lambda text: text.encode()[:-2] + b"\0\0" + text.encode()[-2:],
    "Latin-1": lambda text: (text + "# ü").encode("latin-1"),
    "line feeds of old": lambda text: text.replace("\n", "\r").encode(),
    "nothing": lambda text: b"",
    "one byte": lambda text: b"\xff",
    "random": lambda text: bytes(range(256)) * 4,
}
TEXTS: dict[str, tuple[str, ...]] = {
    "poses.json": (),
    "camera.json": (),
    "box.obj": (),
    "box.mtl": (),
    "target.usda": ("--target", "target.usda"),
    "box.gltf": ("--target", "box.gltf"),
    "box_ascii.ply": ("--target", "box_ascii.ply"),
    "box_ascii.stl": ("--target", "box_ascii.stl"),
    "keypoints.csv": ("--keypoints", "keypoints.csv"),
    "keypoints.toml": ("--keypoints", "keypoints.toml"),
    "parts.csv": ("--parts", "parts.csv"),
    "lidar.toml": ("--lidar", "lidar.toml"),
    "spec.toml": ("--augment", "spec.toml"),
    "stream2.csv": ("--poses", "stream2.csv"),
    "urso/train_poses_gt.csv": ("--poses", "urso"),
    "sample.toml": ("--sample", "sample.toml"),
}


def names() -> Iterator[Trial]:
    """Hostile names of folders, files, prims, pictures and augmentations."""
    for name, text in NAMES.items():
        yield trial("names", f"folder of a stage: {name}", partial(_stage_folder, text), alone=True)
        yield trial("names", f"--out: {name}", partial(_out, text), alone=True)
        yield trial("names", f"file in a dataset: {name}", partial(_file_in_dataset, text), alone=True)
        yield trial("names", f"model: {name}", partial(_model, text), alone=True)
        yield trial("names", f"picture: {name}", partial(_picture, text))
        yield trial("names", f"prim: {name}", partial(_prim, text))
        yield trial("names", f"augmentation: {name}", partial(_augmentation, text))


def encodings() -> Iterator[Trial]:
    """Each text in each encoding."""
    for encoding, encode in ENCODINGS.items():
        for file, options in TEXTS.items():
            yield trial("encodings", f"{encoding} in {file}", partial(_encoded_input, file, options, encode))
        for file in ("dataset.json", "records/nominal/img000001.json", "cache/measured.json", "stage/dataset.usda"):
            yield trial("encodings", f"{encoding} in {file}", partial(_encoded_in_dataset, file, encode))
        yield trial("encodings", f"{encoding} in a stage", partial(_encoded_stage, encode))


def _argument(text: str) -> str:
    """As a user must write a path that begins with a dash."""
    return f"./{text}" if text.startswith("-") else text


def _stage_folder(text: str, sandbox: Sandbox) -> list[Command]:
    sandbox.take("st", text)
    return [check(_argument(text)), render(_argument(text))]


def _out(text: str, sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    sandbox.take("st")
    return [author("--out", f"a{text}"[:255]), render("st", f"b{text}"[:255])]


def _file_in_dataset(text: str, sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    sandbox.write(f"ds/image/nominal/{text}", "x")
    sandbox.write(f"ds/{text}", "x")
    (sandbox.work / "ds" / "depth" / text).symlink_to("elsewhere")
    return [check("ds"), resume()]


def _model(text: str, sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    name = f"{text[:240]}.obj"
    sandbox.take("box.obj", name)
    sandbox.take("texture.png", f"{text[:240]}.png")
    sandbox.write("box.mtl", f"newmtl red\nmap_Kd {text[:240]}.png\n".encode(errors="surrogateescape"))
    return [author("--target", _argument(name))]


def _picture(text: str, sandbox: Sandbox) -> list[Command]:
    return list(hosts.in_json("poses.json", (0, "filename"))(sandbox, json.dumps(text)))


def _prim(text: str, sandbox: Sandbox) -> list[Command]:
    sandbox.take("texture.png")
    stage = (sandbox.seeds / "stage.usda").read_bytes()
    sandbox.write("stage.usda", stage.replace(b'"Box"', b'"' + text.encode(errors="surrogateescape") + b'"'))
    return [check("stage.usda"), render("stage.usda")]


def _augmentation(text: str, sandbox: Sandbox) -> list[Command]:
    sandbox.take("st")
    spec = (sandbox.seeds / "spec.toml").read_bytes()
    sandbox.write("spec.toml", spec.replace(b'"noisy"', b"'''" + text.encode(errors="surrogateescape") + b"'''"))
    return [call("augment", "st", "--spec", "spec.toml")]


def _encoded_input(file: str, options: tuple[str, ...], encode: hosts.Encode, sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    if "/" in file:
        sandbox.take(file.partition("/")[0])
    sandbox.write(file, encode((sandbox.seeds / file).read_text()))
    return [author(*options)]


def _encoded_in_dataset(file: str, encode: hosts.Encode, sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    sandbox.write(f"ds/{file}", encode((sandbox.seeds / "ds" / file).read_text()))
    return [check("ds"), resume(), call("reproduce", "ds", "img000001")]


def _encoded_stage(encode: hosts.Encode, sandbox: Sandbox) -> list[Command]:
    sandbox.take("texture.png")
    sandbox.write("stage.usda", encode((sandbox.seeds / "stage.usda").read_text()))
    return [check("stage.usda"), call("plan", "stage.usda")]
