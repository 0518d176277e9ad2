"""Class: paths that lead elsewhere, in every place that names a file."""

import json
from collections.abc import Iterator
from functools import partial

from fuzzing.corpus import hosts
from fuzzing.corpus.calls import author, dataset, inputs, trial
from fuzzing.running.ended import Command, call
from fuzzing.sandbox import Sandbox
from fuzzing.trial import Trial

KIND = "paths"
# By name; {outside} is the folder of the canaries, and the name of one of them follows where a place wants its kind.
PATHS = {
    "absolute": "{outside}/{secret}",
    "climbing": "../outside/{secret}",
    "climbing from within": "./layers/../../outside/{secret}",
    "file scheme": "file://{outside}/{secret}",
    "http": "http://127.0.0.1:9/{secret}",
    "other scheme": "anon:0x1:{secret}",
    "variable": "$HOME/../outside/{secret}",
    "home": "~/../outside/{secret}",
    "5,000 letters": "a" * 5000,
    "5,000 folders": "a/" * 2500 + "b",
    "backslashes": "..\\outside\\{secret}",
    "tiles": "../outside/<UDIM>.png",
    "a package": "../outside/a.usdz[{secret}]",
    "a folder": ".",
    "root": "/",
    "NUL": "a\\u0000b",
    "percent": "%2e%2e/outside/{secret}",
    "device": "/dev/zero",
    "process": "/proc/self/environ",
}
IN_STAGE = {
    "sublayer": hosts.in_stage('    upAxis = "Z"\n', '    upAxis = "Z"\n    subLayers = [@{}@]\n'),
    "texture": hosts.in_stage("@./texture.png@", "@{}@"),
    "reference": hosts.in_stage('def Cube "Box"\n', 'def Cube "Box" (prepend references = @{}@)\n'),
}
IN_TARGET = {
    "reference of a target": hosts.in_target(
        'def Cylinder "Antenna"\n', 'def Cylinder "Antenna" (prepend references = @{}@)\n'
    ),
    "payload of a target": hosts.in_target(
        'def Cylinder "Antenna"\n', 'def Cylinder "Antenna" (prepend payload = @{}@)\n'
    ),
}
IN_MODELS = {
    "mtllib": hosts.in_text("box.obj", "mtllib box.mtl", "mtllib {}"),
    "map_Kd": hosts.in_text("box.mtl", "map_Kd -s 1 1 1 texture.png", "map_Kd {}"),
}
IN_DATASET = {
    "stage.root": hosts.in_dataset("dataset.json", ("stage", "root")),
    "record's stage.root": hosts.in_dataset("records/nominal/img000001.json", ("provenance", "stage", "root")),
    "record's file": hosts.in_dataset("records/nominal/img000001.json", ("files", "image", "path")),
    "record's frame": hosts.in_dataset("records/nominal/img000001.json", ("frame",)),
}
SECRETS = {"texture": "private.png", "map_Kd": "private.png", "mtllib": "secret.mtl", "record's file": "img9.png"}
FRAMES = {
    "climbing": "../outside/img000001",
    "absolute": "/etc/passwd",
    "letters": "a" * 5000,
    "NUL": "a\\0b",
    "empty": "",
}


def paths() -> Iterator[Trial]:
    """Each path in each place."""
    for places, quoted in ((IN_STAGE | IN_TARGET | IN_MODELS, False), (IN_DATASET, True)):
        for place, host in places.items():
            for name, path in PATHS.items():
                secret = SECRETS.get(place, "secret.usda")
                yield trial(KIND, f"{place}: {name}", partial(_prepare, host, path, secret, quoted))
    for name, path in PATHS.items():
        yield trial(KIND, f"record's stage.files: {name}", partial(_stage_files, path))
    for name, frame in FRAMES.items():
        yield trial(KIND, f"FRAME: {name}", partial(_reproduce, ("reproduce", "ds", frame)))
        yield trial(
            KIND, f"--variant: {name}", partial(_reproduce, ("reproduce", "ds", "img000001", "--variant", frame))
        )
    yield trial(KIND, "file uri in glTF", _gltf_uri)


def _prepare(host: hosts.Host, path: str, secret: str, quoted: bool, sandbox: Sandbox) -> list[Command]:
    text = _text(path, secret, sandbox)
    return list(host(sandbox, f'"{text}"' if quoted else text))


def _text(path: str, secret: str, sandbox: Sandbox) -> str:
    return path.replace("{outside}", str(sandbox.outside)).replace("{secret}", secret)


def _stage_files(path: str, sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    record_file = sandbox.work / "ds" / "records" / "nominal" / "img000001.json"
    record = json.loads(record_file.read_text())
    record["provenance"]["stage"]["files"] = {_text(path, "secret.usda", sandbox): "0" * 64}
    record_file.write_text(json.dumps(record))
    return [call("check", "ds"), call("reproduce", "ds", "img000001")]


def _reproduce(arguments: tuple[str, ...], sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    return [call(*arguments)]


def _gltf_uri(sandbox: Sandbox) -> list[Command]:
    document = json.loads((sandbox.seeds / "box.gltf").read_text())
    document["images"] = [{"uri": f"{sandbox.outside}/private.png"}]
    inputs(sandbox)
    sandbox.write("box.gltf", json.dumps(document))
    return [author("--target", "box.gltf")]
