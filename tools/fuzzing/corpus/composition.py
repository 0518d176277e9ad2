"""Classes: cycles, bombs that multiply or are huge, and deep nesting."""

import gzip
import io
import struct
import tarfile
import zlib
from collections.abc import Callable, Iterator
from functools import partial

from fuzzing.corpus.calls import author, check, dataset, inputs, reads_dataset, reads_stage, trial
from fuzzing.mutation.mutants import seal
from fuzzing.running.ended import Command, call
from fuzzing.sandbox import Sandbox
from fuzzing.seeds import zipped
from fuzzing.trial import Trial

GIB = 1 << 30
BOX = 'def Cube "Box"\n'
HEAD = '#usda 1.0\n(\n    defaultPrim = "A"\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n'
# What is said of the prim Box in the one-file stage.
CYCLES = {
    "reference to itself": "prepend references = @./stage.usda@",
    "reference to an ancestor": "prepend references = </World>",
    "payload of itself": "prepend payload = @./stage.usda@",
    "inherits itself": "prepend inherits = </World/Target/Box>",
    "inherits an ancestor": "prepend inherits = </World/Target>",
    "specializes itself": "prepend specializes = </World/Target/Box>",
    "reference around two layers": "prepend references = @./other.usda@",
    "clips of itself": "clips = { dictionary default = { asset[] assetPaths = [@./stage.usda@] } }",
    "instance of an ancestor": "instanceable = true\n prepend references = </World/Target>",
}
# What stands in place of a line of it.
LOOPS = {
    "sublayer of itself": ('    upAxis = "Z"\n', '    upAxis = "Z"\n    subLayers = [@./stage.usda@]\n'),
    "sublayers around two layers": ('    upAxis = "Z"\n', '    upAxis = "Z"\n    subLayers = [@./other.usda@]\n'),
    "shader connected to itself": ("Paint/Image.outputs:rgb>", "Paint/Surface.outputs:surface>"),
    "coordinates connected to themselves": ("Paint/Place.outputs:result>", "Paint/Image.inputs:st>"),
    "material connected to itself": ("Paint/Surface.outputs:surface>", "Paint.outputs:surface>"),
    "binding to itself": (
        "rel material:binding = </World/Target/Paint>",
        "rel material:binding = </World/Target/Body>",
    ),
    "camera is the settings": ("rel camera = </World/Camera>", "rel camera = </Render/Settings.camera>"),
    "inverse op alone": ('["xformOp:rotateXYZ"]', '["!invert!xformOp:rotateXYZ", "xformOp:rotateXYZ"]'),
}


def cycles() -> Iterator[Trial]:
    """What refers to itself."""
    for name, said in CYCLES.items():
        yield trial("cycles", name, partial(_changed, (BOX, f'def Cube "Box" (\n{said}\n)\n')))
        yield trial("cycles", f"{name} in a target", partial(_target_cycle, said))
    for name, change in LOOPS.items():
        yield trial("cycles", name, partial(_changed, change))
    for name, nodes in {"itself": [0], "a parent": [1]}.items():
        yield trial("cycles", f"glTF node that is a child of {name}", partial(_gltf_nodes, nodes))


def bombs() -> Iterator[Trial]:
    """What is small and grows, and what is huge."""
    for name, prepare in BOMBS.items():
        yield trial("bombs", name, prepare, alone=True)


def nesting() -> Iterator[Trial]:
    """Brackets and folders without end."""
    for depth in (300, 5000, 200_000):
        for name, file in {"poses": "poses.json", "camera": "camera.json", "keypoints": "keypoints.json"}.items():
            for bracket in ("[", '{"a":'):
                yield trial("nesting", f"{depth} x {bracket} as {name}", partial(_nested_input, file, bracket * depth))
        for name in ("dataset.json", "records/nominal/img000001.json", "cache/measured.json"):
            yield trial("nesting", f"{depth} x [ as {name}", partial(_nested_in_dataset, name, "[" * depth))
        for option, name in {
            "--augment": "spec.toml",
            "--lidar": "lidar.toml",
            "--keypoints": "keypoints.toml",
        }.items():
            yield trial("nesting", f"{depth} x [ in {name}", partial(_nested_toml, option, name, "a = " + "[" * depth))
            yield trial(
                "nesting", f"{depth} dots in {name}", partial(_nested_toml, option, name, "a" + ".a" * depth + " = 1")
            )
        yield trial("nesting", f"{depth} prims", partial(_nested_prims, depth, False), alone=True)
        yield trial("nesting", f"{depth} prims in a target", partial(_nested_prims, depth, True), alone=True)
        yield trial("nesting", f"{depth} brackets in a layer", partial(_nested_brackets, depth), alone=True)
        yield trial("nesting", f"{depth} dictionaries in a layer", partial(_nested_dictionaries, depth), alone=True)


def _changed(change: tuple[str, str], sandbox: Sandbox) -> list[Command]:
    sandbox.take("texture.png")
    stage = (sandbox.seeds / "stage.usda").read_text()
    assert change[0] in stage, change
    sandbox.write("stage.usda", stage.replace(*change))
    head = '#usda 1.0\n(\n    subLayers = [@./stage.usda@]\n    defaultPrim = "A"\n)\n'
    sandbox.write("other.usda", head + 'def "A" (prepend references = @./stage.usda@)\n{\n}\n')
    return reads_stage("stage.usda")


def _target_cycle(said: str, sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    said = (
        said.replace("stage.usda", "target.usda")
        .replace("/World/Target/Box", "/Craft/Antenna")
        .replace("/World/Target", "/Craft")
    )
    target = (sandbox.seeds / "target.usda").read_text().replace('"Antenna"\n', f'"Antenna" (\n{said}\n)\n')
    sandbox.write("target.usda", target.replace("</World>", "</Craft>"))
    return [author("--target", "target.usda")]


def _gltf_nodes(children: list[int], sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    text = (sandbox.seeds / "box.gltf").read_text()
    sandbox.write(
        "box.gltf", text.replace('"translation"', f'"children": {[0] if children == [1] else [1]},\n"translation"')
    )
    return [author("--target", "box.gltf")]


def _doubling(arc: str) -> str:
    """Thirty prims, each twice in the one before it."""
    one = 'def "{}" (ARC = </D{}>)\n{{\n}}\n'.replace("ARC", arc)
    prims = (f'def "D{i}"\n{{\n{one.format("A", i + 1)}{one.format("B", i + 1)}}}\n' for i in range(30))
    return HEAD + 'def "A" (references = </D0>)\n{\n}\n' + "".join(prims) + 'def Cube "D30"\n{\n}\n'


def _stage_of(text: str) -> Callable[[Sandbox], list[Command]]:
    def prepare(sandbox: Sandbox) -> list[Command]:
        sandbox.write("a.usda", text)
        return [check("a.usda")]

    return prepare


def _target_of(text: str) -> Callable[[Sandbox], list[Command]]:
    def prepare(sandbox: Sandbox) -> list[Command]:
        inputs(sandbox)
        sandbox.write("a.usda", text)
        return [author("--target", "a.usda")]

    return prepare


def _sparse(name: str, head: bytes, size: int, *options: str) -> Callable[[Sandbox], list[Command]]:
    """A file of so many bytes that takes no room."""

    def prepare(sandbox: Sandbox) -> list[Command]:
        inputs(sandbox)
        path = sandbox.write(name, head)
        with path.open("r+b") as file:
            file.truncate(size)
        return [author(*options)] if options or name in ("poses.json", "camera.json") else [check(name)]

    return prepare


def _groups(sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    faces = "".join(f"g g{i}\nf 1 2 3\n" for i in range(30_000))
    sandbox.write("box.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + faces)
    return [author()]


def _png(sandbox: Sandbox) -> list[Command]:
    """A PNG of 60,000 x 60,000 pixels in 4 MB."""
    inputs(sandbox)
    packed = zlib.compress(bytes(60_001) * 100, 9) * 10
    chunks = {b"IHDR": struct.pack(">IIBBBBB", 60_000, 60_000, 8, 0, 0, 0, 0), b"IDAT": packed, b"IEND": b""}
    png = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks.items()
    )
    sandbox.write("texture.png", png)
    return [author()]


def _npz(sandbox: Sandbox) -> list[Command]:
    """A gigabyte of zeros, packed, as the points of a LiDAR."""
    dataset(sandbox)
    head = (
        b"\x93NUMPY\x01\x00v\x00"
        + b"{'descr': '<f4', 'fortran_order': False, 'shape': (268435456,), }".ljust(117)
        + b"\n"
    )
    packed = zipped({"points.npy": head + bytes(GIB // 4)})
    for path in (sandbox.work / "ds").glob("lidar/nominal/*.npz"):
        path.write_bytes(packed)
    seal(sandbox.work / "ds")
    return [check("ds")]


def _tar(sandbox: Sandbox) -> list[Command]:
    """A pose list of one record, a quarter of a gigabyte of blanks, in a packed tar file."""
    inputs(sandbox)
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w") as archive:
        info = tarfile.TarInfo("a.json")
        info.size = GIB // 4
        archive.addfile(info, io.BytesIO(b" " * info.size))
    sandbox.write("a.tar", gzip.compress(made.getvalue(), 1))
    return [author("--poses", "a.tar")]


def _usdz(sandbox: Sandbox) -> list[Command]:
    """A package whose members are packed, which USD's are not."""
    inputs(sandbox)
    sandbox.write("a.usdz", zipped({"a.usda": HEAD.encode() + b" " * (GIB // 8)}))
    return [author("--target", "a.usdz"), check("a.usdz")]


def _glb(sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    sandbox.write(
        "a.glb", struct.pack("<4sII", b"glTF", 2, 0xFFFFFFFF) + struct.pack("<I4s", 0xFFFFFFF0, b"JSON") + b"{}"
    )
    return [author("--target", "a.glb")]


def _many(template: str, count: int) -> str:
    return HEAD + 'def "A"\n{\n' + "".join(template.replace("{}", str(i)) for i in range(count)) + "}\n"


def _variants(sandbox: Sandbox) -> list[Command]:
    sandbox.take("texture.png")
    stage = (sandbox.seeds / "stage.usda").read_text()
    many = "".join(f'"v{i}" {{\n}}\n' for i in range(10_000))
    sandbox.write("a.usda", stage.replace('"plain" {\n', many + '"plain" {\n'))
    return reads_stage("a.usda")


def _instances(sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    count = 1_000_000
    target = (sandbox.seeds / "target.usda").read_text()
    for old, one in (
        ("[0, 0]", "0"),
        ("[(0, 0, 0), (0.5, 0.5, 0.5)]", "(0, 0, 0)"),
        ("[(1, 0, 0, 0), (1, 0, 0, 0)]", "(1, 0, 0, 0)"),
        ("[(1, 1, 1), (1, 1, 1)]", "(1, 1, 1)"),
    ):
        target = target.replace(old, "[" + ", ".join([one] * count) + "]")
    sandbox.write("target.usda", target)
    return [author("--target", "target.usda")]


SAMPLES = "".join(f"{i}: 0, " for i in range(1_000_000))
BOMBS: dict[str, Callable[[Sandbox], list[Command]]] = {
    "doubling references in a target": _target_of(_doubling("references")),
    "doubling payloads in a target": _target_of(_doubling("payload")),
    "doubling inherits in a target": _target_of(_doubling("inherits")),
    "doubling references in a stage": _stage_of(_doubling("references")),
    "sparse layer of 1 GiB": _sparse("a.usda", b"#usda 1.0\n", GIB),
    "sparse layer of 3 GiB": _sparse("a.usda", b"#usda 1.0\n", 3 * GIB),
    "sparse binary layer of 1 GiB": _sparse("a.usdc", b"PXR-USDC" + bytes([0, 8, 0]), GIB),
    "sparse package of 1 GiB": _sparse("a.usdz", b"PK\x03\x04", GIB),
    "sparse pose list of 8 GiB": _sparse("poses.json", b"[", 8 * GIB),
    "sparse camera of 8 GiB": _sparse("camera.json", b"{", 8 * GIB),
    "sparse OBJ of 8 GiB": _sparse("a.obj", b"v 0 0 0\n", 8 * GIB, "--target", "a.obj"),
    "sparse PLY of 8 GiB": _sparse("a.ply", b"ply\n", 8 * GIB, "--target", "a.ply"),
    "sparse STL of 8 GiB": _sparse("a.stl", b"x" * 80 + b"\xff\xff\xff\x0f", 8 * GIB, "--target", "a.stl"),
    "sparse GLB of 8 GiB": _sparse("a.glb", b"glTF", 8 * GIB, "--target", "a.glb"),
    "sparse keypoints of 8 GiB": _sparse("a.csv", b"name,x,y,z\n", 8 * GIB, "--keypoints", "a.csv"),
    "OBJ of 30,000 groups": _groups,
    "PNG of 60,000 x 60,000": _png,
    "packed points": _npz,
    "packed tar": _tar,
    "packed package": _usdz,
    "GLB of 4 GiB in 24 bytes": _glb,
    "10,000 variants": _variants,
    "a million instances": _instances,
    "250,000 prims": _stage_of(_many('def "p{}"\n{\n}\n', 250_000)),
    "20,000 sublayers": _stage_of(HEAD.replace(")\n", f"subLayers = [{'@./b.usda@, ' * 20_000}]\n)\n", 1)),
    "a million samples": _stage_of(HEAD + f'def "A"\n{{\ndouble a.timeSamples = {{{SAMPLES}}}\n}}\n'),
    "a name of a megabyte": _stage_of(HEAD + f'def "{"a" * 1_000_000}"\n{{\n}}\n'),
    "a text of 32 MB": _stage_of(HEAD + f'def "A"\n{{\nstring a = "{"a" * (1 << 25)}"\n}}\n'),
}  # fmt: skip


def _nested_input(file: str, text: str, sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    sandbox.write(file, text)
    return [author(*(("--keypoints", file) if file == "keypoints.json" else ()))]


def _nested_in_dataset(name: str, text: str, sandbox: Sandbox) -> list[Command]:
    dataset(sandbox)
    sandbox.write(f"ds/{name}", text)
    return reads_dataset()


def _nested_toml(option: str, name: str, text: str, sandbox: Sandbox) -> list[Command]:
    inputs(sandbox)
    sandbox.write(name, text + "\n")
    return [author(option, name)]


def _nested_prims(depth: int, as_target: bool, sandbox: Sandbox) -> list[Command]:
    text = HEAD + 'def "A"\n{\n' * depth + "}\n" * depth
    return _target_of(text)(sandbox) if as_target else _stage_of(text)(sandbox)


def _nested_brackets(depth: int, sandbox: Sandbox) -> list[Command]:
    return _stage_of(HEAD + 'def "A"\n{\nint[] a = ' + "[" * depth + "]" * depth + "\n}\n")(sandbox)


def _nested_dictionaries(depth: int, sandbox: Sandbox) -> list[Command]:
    inside = "dictionary a = {" * depth + "}" * depth
    sandbox.write("a.usda", HEAD + f'def "A" (\ncustomData = {{{inside}}}\n)\n{{\n}}\n')
    return [check("a.usda"), call("plan", "a.usda")]
