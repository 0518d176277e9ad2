"""Where a path, a text or a number can stand in a file that is read: each writes the file, and says what reads it."""

import json
from collections.abc import Callable, Iterable
from typing import Any

from fuzzing.corpus.calls import author, dataset, inputs, reads_dataset, reads_stage
from fuzzing.mutation.mutants import seal
from fuzzing.running.ended import Command, call
from fuzzing.sandbox import Sandbox

Host = Callable[[Sandbox, str], Iterable[Command]]
Encode = Callable[[str], bytes]


def in_stage(old: str, new: str) -> Host:
    """In place of `old` in the one-file stage; {} in `new` is the text."""

    def prepare(sandbox: Sandbox, text: str) -> list[Command]:
        sandbox.take("texture.png")
        stage = (sandbox.seeds / "stage.usda").read_text()
        assert old in stage, old
        sandbox.write("stage.usda", stage.replace(old, new.replace("{}", text), 1))
        return reads_stage("stage.usda")

    return prepare


def in_target(old: str, new: str) -> Host:
    """In place of `old` in a target of USD."""

    def prepare(sandbox: Sandbox, text: str) -> list[Command]:
        inputs(sandbox)
        target = (sandbox.seeds / "target.usda").read_text()
        assert old in target, old
        sandbox.write("target.usda", target.replace(old, new.replace("{}", text), 1))
        return [author("--target", "target.usda")]

    return prepare


def in_text(name: str, old: str, new: str, *options: str) -> Host:
    """In place of `old` in the input `name` of `author`, which reads it by `options`."""

    def prepare(sandbox: Sandbox, text: str) -> list[Command]:
        inputs(sandbox)
        content = (sandbox.seeds / name).read_text()
        assert old in content, (old, name)
        sandbox.write(name, content.replace(old, new.replace("{}", text), 1))
        return [author(*options)]

    return prepare


def in_json(name: str, keys: tuple[str | int, ...], *options: str) -> Host:
    """The value at `keys` in a JSON input of `author`; the text is JSON, or what no JSON is."""

    def prepare(sandbox: Sandbox, text: str) -> list[Command]:
        inputs(sandbox)
        sandbox.write(name, _with((sandbox.seeds / name).read_text(), keys, text))
        return [author(*options)]

    return prepare


def in_dataset(name: str, keys: tuple[str | int, ...]) -> Host:
    """The value at `keys` in a JSON file of a dataset."""

    def prepare(sandbox: Sandbox, text: str) -> list[Command]:
        dataset(sandbox)
        sandbox.write(f"ds/{name}", _with((sandbox.seeds / "ds" / name).read_text(), keys, text))
        return reads_dataset()

    return prepare


def in_dataset_stage(old: str, new: str, name: str = "dataset.usda") -> Host:
    """In place of `old` in a layer of the stage in a dataset, whose digests are right."""

    def prepare(sandbox: Sandbox, text: str) -> list[Command]:
        dataset(sandbox)
        layer = (sandbox.seeds / "ds" / "stage" / name).read_text()
        sandbox.write(f"ds/stage/{name}", layer.replace(old, new.replace("{}", text), 1))
        seal(sandbox.work / "ds")
        return reads_dataset()

    return prepare


def in_spec(old: str, new: str) -> Host:
    """In place of `old` in a specification of augmentations."""

    def prepare(sandbox: Sandbox, text: str) -> list[Command]:
        sandbox.take("st")
        spec = (sandbox.seeds / "spec.toml").read_text()
        assert old in spec, old
        sandbox.write("spec.toml", spec.replace(old, new.replace("{}", text), 1))
        return [call("augment", "st", "--spec", "spec.toml")]

    return prepare


def in_sample(old: str, new: str) -> Host:
    """In place of `old` in a specification of samples."""

    def prepare(sandbox: Sandbox, text: str) -> list[Command]:
        inputs(sandbox)
        sample = (sandbox.seeds / "sample.toml").read_text()
        assert old in sample, old
        sandbox.write("sample.toml", sample.replace(old, new.replace("{}", text), 1))
        return [author("--sample", "sample.toml")]

    return prepare


MARK = "\u2402mark\u2402"


def _with(document: str, keys: tuple[str | int, ...], text: str) -> str:
    """The document with `text`, as it stands, in place of the value at `keys`."""
    value: Any = json.loads(document)
    place = value
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = MARK
    return json.dumps(value, indent=1, ensure_ascii=False).replace(f'"{MARK}"', text)
