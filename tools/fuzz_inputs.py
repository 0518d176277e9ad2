"""The good files that tools/fuzz starts from, most of which spin_usd itself makes, and how mutants differ from them."""

import hashlib
import io
import json
import random
import re
import shutil
import struct
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO
import trimesh

from spin_usd.resources import stages

POSES: list[dict[str, Any]] = [
    {"filename": "img000001.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 5]},
]
STREAM_2 = "filename,sequence,Tx,Ty,Tz,Qx,Qy,Qz,Qw\na.png,1,0,0,5,0,0,0,1\nb.png,1,0,0,6,0.6,0,0,0.8\n"
URSO_POSES = "x,y,z,q1,q2,q3,q4\n5,0,0,0,0,0,1\n6,0.1,0,0.6,0,0,0.8\n"
CAMERA: dict[str, Any] = {
    "Nu": 64,
    "Nv": 48,
    "ppx": 5.86e-6,
    "ppy": 5.86e-6,
    "fx": 0.000586,
    "fy": 0.000586,
    "cameraMatrix": [[100, 0, 32], [0, 100, 24], [0, 0, 1]],
    "distCoeffs": [-0.1, 0.01, 0.001, 0.001, 0],
}
BOX_OBJ = """mtllib box.mtl
o body
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
vt 0 0
vt 1 0
vt 0 1
vn 0 0 1
usemtl red
f 1/1/1 2/2/1 3/3/1
f 1/1 2/2 4/3
o wing
usemtl blue
s 1
f 2/1 3/2 4/3
f -4/1 -2/2 -1/3
"""
BOX_MTL = """newmtl red
Kd 0.8 0.1 0.1
Ks 0.5 0.5 0.5
Ns 50
d 1
map_Kd -s 1 1 1 texture.png
newmtl blue
Kd 0.1 0.1 0.8
Pr 0.3
Pm 1
illum 2
map_Bump -bm 0.5 texture.png
"""
BOX_DAE = """<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1" name="metre"/><up_axis>Z_UP</up_axis></asset>
<library_images><image id="picture"><init_from>texture.png</init_from></image></library_images>
<library_effects><effect id="effect"><profile_COMMON>
<newparam sid="surface"><surface type="2D"><init_from>picture</init_from></surface></newparam>
<newparam sid="sampler"><sampler2D><source>surface</source></sampler2D></newparam>
<technique sid="t"><phong><diffuse><texture texture="sampler" texcoord="UV"/></diffuse>
<shininess><float>20</float></shininess><transparency><float>0.5</float></transparency></phong></technique>
</profile_COMMON></effect></library_effects>
<library_materials><material id="foil" name="foil"><instance_effect url="#effect"/></material></library_materials>
<library_geometries><geometry id="panel" name="panel"><mesh>
<source id="points"><float_array id="points-a" count="12">0 0 0 1 0 0 1 1 0 0 1 1</float_array><technique_common>
<accessor source="#points-a" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<source id="st"><float_array id="st-a" count="4">0 0 1 1</float_array><technique_common>
<accessor source="#st-a" count="2" stride="2"><param name="S" type="float"/><param name="T" type="float"/></accessor>
</technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#points"/></vertices>
<polylist material="m" count="2"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#st" offset="1" set="0"/><vcount>3 3</vcount><p>0 0 1 1 2 0 0 0 2 1 3 1</p>
</polylist></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node name="wing"><translate>1 2 3</translate><rotate>0 0 1 45</rotate>
<instance_geometry url="#panel"><bind_material><technique_common><instance_material symbol="m" target="#foil">
<bind_vertex_input semantic="UV" input_semantic="TEXCOORD" input_set="0"/></instance_material></technique_common>
</bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene></COLLADA>
"""
TEXTS = {
    "poses.json": json.dumps(POSES),
    "camera.json": json.dumps(CAMERA),
    "box.obj": BOX_OBJ,
    "box.mtl": BOX_MTL,
    "box.dae": BOX_DAE,
    "keypoints.json": '{"corner": [0, 0, 0], "tip": [1, 0, 0]}',
    "keypoints.csv": "name,x,y,z\na,0,0,0\nb,1,0,0\n",
    "parts.json": '[{"pattern": "*wing*", "part": "wing", "class": "panel"}]',
    "parts.csv": "pattern,part,class\n*wing*,wing,panel\n",
    "stream2.csv": STREAM_2,
    "urso/train_poses_gt.csv": URSO_POSES,
    "urso/train_images.csv": "a/0.png\na/1.png\n",
}
BUNDLED = {
    "lidar.toml": "lidars/flash.toml",
    "spec.toml": "augmentations/relight.toml",
    "sample.toml": "examples/speed.toml",
    "cubesat.usda": "targets/cubesat/cubesat.usda",
}
IMAGES = ("png", "jpg", "bmp", "tif", "exr", "hdr")
EXPORTS = {
    **dict.fromkeys(("speedplus", "coco", "webdataset", "croissant", "nerfstudio", "colmap", "parquet"), ()),
    "bop": ("--option", "rectify=yes"),
}
LABELS = "default,instance,nocs,lidar,lidar_ply"  # a file of each kind that is read
RAYCAST = ("--renderer", "raycast", "--workers", "1")
INSIDE = 0.5  # of mutants of archives whose archive is whole
SEALED = 0.7  # of mutants of datasets whose digests agree
# Flattens the stage and a bundled target into one layer each: as text, in binary and packed.
FLATTEN = """
import os
from pxr import Sdf, Usd, UsdUtils
for name, source in (("stage", "st/dataset.usda"), ("target", "cubesat.usda")):
    text = Usd.Stage.Open(source).Flatten().ExportToString()
    open(f"{name}.usda", "w").write(text.replace(os.getcwd() + "/", "./"))
    Sdf.Layer.FindOrOpen(f"{name}.usda").Export(f"{name}.usdc")
    assert UsdUtils.CreateNewUsdzPackage(f"{name}.usdc", f"{name}.usdz")
"""

NUMBERS = (
    b"nan", b"NaN", b"inf", b"-inf", b"Infinity", b"1e308", b"-1e308", b"1e400", b"1e-320", b"5e-324", b"0", b"-0.0",
    b"-1", b"1", b"2", b"255", b"256", b"65535", b"65536", b"2147483647", b"2147483648", b"-2147483648", b"4294967295",
    b"4294967296", b"9223372036854775807", b"9223372036854775808", b"-9223372036854775808", b"18446744073709551616",
    b"1e38", b"3.5e38", b"1e-45", b"0.1", b"1.0000001", b"99999999", b"1e999999999", b"0x10", b"1_000", b"1e", b"--1",
    b"9" * 400, b"null", b"true", b'"1"', b"[]", b"{}", b"()", b"(1, 2)", b"None",
)  # fmt: skip
_REALS = (float("nan"), float("inf"), -float("inf"), 1e38, 1e-40, -1.0)
BINARY_NUMBERS: tuple[tuple[str, float], ...] = (
    *((order + kind, value) for order in "<>" for kind in "hiq" for value in (-1, 0, 1, 0x7FFF, -0x8000)),
    *((order + kind, value) for order in "<>" for kind in "iq" for value in (0x7FFFFFFF, -0x80000000, 1 << 20)),
    *((order + kind, value) for order in "<>" for kind in "fd" for value in _REALS),
)
"""Formats of `struct`, with a number for each."""
WORDS = (
    # paths
    b"../../outside/secret.usda", b"../outside/private.png", b"../outside/secret.mtl", b"/etc/passwd", b"/dev/zero",
    b"file:///etc/passwd", b"http://127.0.0.1:9/a.usda", b"..", b".", b"", b"a" * 5000, b"a\\b", b"a.<UDIM>.png",
    b"C:\\a.usda", b"./a\x00b.usda", b"anon:0x1", b"a.usdz[b.usda]", b"${HOME}/a.usda", b"~/a.usda", b"stage.usda",
    # text
    b"\xff\xfe", b"\xef\xbb\xbf", b"\xc3\x28", b"\xed\xa0\x80", "\u202e".encode(), b"\x1b[31m", b"\r\n", b"\x00",
    "\U0001f680".encode(), b"%s%n", b"'", b'"', b"@", b"\\", b"\\u0000", b"\\ud800", b"`id`", b"$(id)", b"<!--",
    # USD
    b"def", b"over", b"class", b"Mesh", b"Xform", b"Camera", b"Scope", b"PointInstancer", b"DistantLight", b"DomeLight",
    b"Sphere", b"BasisCurves", b"timeSamples", b"variantSet", b"references", b"payload", b"inherits", b"specializes",
    b"subLayers", b"clips", b"instanceable = true", b"token", b"string", b"double", b"float", b"int", b"int64", b"bool",
    b"asset", b"matrix4d", b"quath", b"quatf", b"half", b"double3[]", b"opaque", b"dkuble", b"rel", b"uniform",
    b"custom", b"None", b"delete", b"</World/Target>", b"</>", b"<>", b"nameChildren", b"interpolation", b"primvars:st",
    b"xformOp:transform", b"!invert!xformOp:translate", b"!resetXformStack!", b"faceVarying", b"leftHanded",
    # tables and JSON
    b"null", b"true", b"[]", b"{}", b"[[]]", b'{"a": 1, "a": 2}', b"/*", b"# ", b"nominal", b"record-1", b"dataset-1",
    b"schema", b"sha256", b"path", b"img000001", b"image/nominal/img000001.png", b"a.a.a", b"[[a]]", b"'''", b'"""',
    # models
    b"f 1 1 1", b"f 99 1 2", b"f -9 -1 -2", b"v 1 2", b"v nan nan nan", b"usemtl none", b"mtllib /etc/passwd",
    b"element face 99999999", b"property list uchar int vertex_indices", b"property list int64 double x", b"end_header",
    b"format binary_big_endian 1.0", b"endsolid", b"facet normal", b"KHR_draco_mesh_compression",
    b"EXT_meshopt_compression", b"KHR_texture_transform", b"sparse", b"extensionsRequired",
    b"data:image/png;base64,AAAA", b"map_Kd -s nan 1 1 ../outside/private.png", b"newmtl red", b"Tr 2",
    b"Kd 1e308 -1 nan",
)  # fmt: skip

Mutator = Callable[[bytes, random.Random], bytes]
NUMBER = re.compile(rb"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")
TOKEN = re.compile(rb"[A-Za-z_][\w:.]*")
QUOTED = re.compile(rb'"[^"\n]*"|@[^@\n]*@')
LONGEST = 1 << 22  # bytes that a mutant may grow to


def flip_bits(data: bytes, rng: random.Random) -> bytes:
    """One to eight bits turned."""
    changed = bytearray(data)
    for _ in range(rng.randint(1, 8)):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def set_bytes(data: bytes, rng: random.Random) -> bytes:
    """A run of bytes that are all 0, all 255, or random."""
    at, length = _block(data, rng, 32)
    fill = rng.choice((b"\0" * length, b"\xff" * length, rng.randbytes(length)))
    return data[:at] + fill + data[at + length :]


def truncate(data: bytes, rng: random.Random) -> bytes:
    """The beginning alone."""
    return data[: rng.randrange(len(data))]


def delete_block(data: bytes, rng: random.Random) -> bytes:
    """Without some bytes."""
    at, length = _block(data, rng, max(1, len(data) // 4))
    return data[:at] + data[at + length :]


def copy_block(data: bytes, rng: random.Random) -> bytes:
    """Some bytes again, elsewhere, once or many times."""
    at, length = _block(data, rng, max(1, len(data) // 4))
    to, times = rng.randrange(len(data)), rng.choice((1, 1, 2, 50))
    return data[:to] + data[at : at + length] * times + data[to:]


def copy_line(data: bytes, rng: random.Random) -> bytes:
    """A line of text in place of another, or before it."""
    lines = data.splitlines(keepends=True)
    to = rng.randrange(len(lines))
    lines[to : to + rng.randint(0, 1)] = [rng.choice(lines)]
    return b"".join(lines)


def delete_lines(data: bytes, rng: random.Random) -> bytes:
    """Without some lines of text."""
    lines = data.splitlines(keepends=True)
    at = rng.randrange(len(lines))
    del lines[at : at + rng.randint(1, 5)]
    return b"".join(lines)


def replace_number(data: bytes, rng: random.Random) -> bytes:
    """A number in the text by an extreme one."""
    return _replaced(data, NUMBER, rng, lambda _: rng.choice(NUMBERS))


def replace_token(data: bytes, rng: random.Random) -> bytes:
    """A word in the text by a word of the formats, or by another of its own."""
    own = TOKEN.findall(data)
    return _replaced(data, TOKEN, rng, lambda _: rng.choice(own if own and rng.random() < 0.5 else WORDS))


def replace_quoted(data: bytes, rng: random.Random) -> bytes:
    """A text in quotes, or a path, by a hostile one."""
    return _replaced(data, QUOTED, rng, lambda old: old[:1] + rng.choice(WORDS) + old[-1:])


def insert_word(data: bytes, rng: random.Random) -> bytes:
    """A word of the formats somewhere."""
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice(WORDS) + data[at:]


def nest(data: bytes, rng: random.Random) -> bytes:
    """Brackets that open, many times."""
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice((b"[", b"{", b"(", b'{"a":', b"<")) * rng.choice((3, 300, 30000)) + data[at:]


def replace_binary_number(data: bytes, rng: random.Random) -> bytes:
    """Two, four or eight bytes by an extreme number."""
    kind, value = rng.choice(BINARY_NUMBERS)
    new = struct.pack(kind, value)
    at = rng.randrange(max(1, len(data) - len(new)))
    if rng.random() < 0.5:
        at -= at % 4
    return data[:at] + new + data[at + len(new) :]


ANY: tuple[Mutator, ...] = (flip_bits, set_bytes, truncate, delete_block, copy_block, replace_binary_number)
TEXT: tuple[Mutator, ...] = (
    *ANY[:5],
    copy_line,
    delete_lines,
    replace_number,
    replace_number,
    replace_number,
    replace_token,
    replace_token,
    replace_quoted,
    insert_word,
    nest,
)


def mutated(data: bytes, rng: random.Random) -> bytes:
    """`data` after one to four changes; those of text for text."""
    mutators = TEXT if _is_text(data) else ANY
    for _ in range(rng.choice((1, 1, 1, 2, 3, 4))):
        if not data:
            break
        data = rng.choice(mutators)(data, rng)[:LONGEST]
    return data


def _block(data: bytes, rng: random.Random, longest: int) -> tuple[int, int]:
    length = min(rng.randint(1, longest), len(data))
    return rng.randrange(len(data) - length + 1), length


def _replaced(data: bytes, pattern: re.Pattern[bytes], rng: random.Random, new: Callable[[bytes], bytes]) -> bytes:
    """With one place that the pattern finds replaced; all equal ones now and then."""
    found = list(pattern.finditer(data))
    if not found:
        return data
    one = rng.choice(found)
    word = new(one.group())
    if rng.random() < 0.1:
        return data.replace(one.group(), word)
    return data[: one.start()] + word + data[one.end() :]


def _is_text(data: bytes) -> bool:
    return b"\0" not in data[:4096] and sum(byte >= 128 for byte in data[:4096]) < 64


def of_zip(data: bytes, rng: random.Random, change: Mutator) -> bytes:
    """A zip file, as npz and usdz are, with one member changed; stored, and aligned as usdz wants it."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {info.filename: archive.read(info) for info in archive.infolist()}
    chosen = rng.choice(sorted(members))
    members[chosen] = change(members[chosen], rng)
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name, content in members.items():
            info = zipfile.ZipInfo(name)
            end = file.tell() + 30 + len(name) + 4
            padding = -end % 64  # usdz wants its members aligned so
            info.extra = struct.pack("<HH", 0x1986, padding) + b"\0" * padding
            archive.writestr(info, content)
    return file.getvalue()


def of_png(data: bytes, rng: random.Random, change: Mutator) -> bytes:
    """A PNG with one chunk changed, and the sum of it right."""
    chunks, at = [], 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        chunks.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    if not chunks:
        return change(data, rng)
    chosen = rng.randrange(len(chunks))
    kind, content = chunks[chosen]
    chunks[chosen] = (kind, change(content or b"\0", rng))
    return data[:8] + b"".join(
        struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        for kind, content in chunks
    )


def of_glb(data: bytes, rng: random.Random, change: Mutator) -> bytes:
    """A binary glTF with its document changed, and the lengths right."""
    (length,) = struct.unpack_from("<I", data, 12)
    document = change(data[20 : 20 + length], rng)
    document += b" " * (-len(document) % 4)
    rest = data[20 + length :]
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(document) + len(rest))
    return head + struct.pack("<I4s", len(document), b"JSON") + document + rest


WHOLE = {".usdz": of_zip, ".npz": of_zip, ".png": of_png, ".glb": of_glb}
"""By suffix, how a mutant is made that is a whole archive."""


@dataclass(frozen=True, kw_only=True)
class Subject:
    """A format that is mutated.

    group: of formats that the table counts together · files: below the seeds, one of which is mutated (a pattern) ·
    takes: what else is copied · commands: one of them is called; {file} is the mutated file · sealed: the dataset's
    digests are right again.
    """

    name: str
    group: str
    files: tuple[str, ...]
    commands: tuple[tuple[str, ...], ...]
    takes: tuple[str, ...]
    sealed: bool = False


INPUTS = ("poses.json", "camera.json", "box.obj", "box.mtl", "texture.png", "cubesat.usda")


def author(**options: str) -> tuple[str, ...]:
    """The arguments of `author` from the usual inputs, or those of the options."""
    usual = {"poses": "poses.json", "camera": "camera.json", "target": "box.obj", "out": "out", "root": "."}
    chosen = {**usual, "units_per_metre": "1", **options}
    if "sample" in chosen:
        del chosen["poses"]
    words = (word for name, value in chosen.items() for word in (f"--{name.replace('_', '-')}", value))
    return ("author", "--any-size", *words)


def _of_author(group: str, name: str, *files: str, folder: str | None = None, option: str | None = None) -> Subject:
    """What `author` reads, by the option of that name; of a folder, when `folder` is what the option names."""
    more = {"count": "2"} if option == "sample" else {}
    commands = (author(**({option: folder or "{file}"} if option else {}), **more),)
    takes = (*INPUTS, *([folder] if folder else []))
    return Subject(name=name, group=group, files=files, takes=takes, commands=commands)


def _of_stage(name: str, *files: str, takes: tuple[str, ...] = (), stage: str = "{file}") -> Subject:
    commands = (("check", stage), ("plan", stage, "--renderer", "raycast"), ("render", stage, *RAYCAST, "--out", "out"))
    return Subject(name=name, group="stages and layers", files=files, takes=takes, commands=commands)


def _of_dataset(group: str, name: str, *files: str, sealed: bool = False) -> Subject:
    commands = (
        ("check", "ds"),
        ("export", "ds", "--to", "coco", "--out", "out"),
        ("reproduce", "ds", "img000001"),
        ("render", "st", *RAYCAST, "--labels", LABELS, "--out", "ds"),
    )
    return Subject(name=name, group=group, files=files, takes=("ds", "st"), commands=commands, sealed=sealed)


def _subjects() -> Iterator[Subject]:
    for suffix in ("usda", "usdc", "usdz"):
        yield _of_stage(suffix, f"stage.{suffix}", takes=("st",))
        yield _of_author("models", f"target {suffix}", f"target.{suffix}", option="target")
    yield _of_stage("layers", "st/**/*.usd[ac]", takes=("st",), stage="st")
    for suffix in ("obj", "ply", "stl", "gltf", "glb", "dae"):
        yield _of_author("models", suffix, f"box*.{suffix}", option="target")
    yield _of_author("models", "mtl", "box.mtl")
    for suffix in IMAGES:
        folder = f"textured_{suffix}"
        yield Subject(
            name=f"texture {suffix}",
            group="textures",
            files=(f"{folder}/texture.{suffix}",),
            takes=(*INPUTS, folder),
            commands=(author(target=f"{folder}/box.obj"),),
        )
    for suffix in ("png", "jpg", "exr"):  # the others are authored as these
        of_stage = _of_stage(f"authored {suffix}", f"st_{suffix}/**/texture.{suffix}", takes=(f"st_{suffix}",))
        yield replace(of_stage, group="textures", commands=(("check", f"st_{suffix}"),))
    pose_lists: tuple[tuple[str, str, str | None], ...] = (
        ("speedplus", "poses.json", None),
        ("record", "ds/records/nominal/img000001.json", None),
        ("stream2", "stream2.csv", None),
        ("urso", "urso/*.csv", "urso"),
        ("bop", "exports/bop/train/000000/scene_gt.json", None),
        ("coco", "exports/coco/annotations/*.json", None),
        ("webdataset", "exports/webdataset/*.tar", None),
        ("croissant", "exports/croissant/records.csv", None),
        ("nerfstudio", "exports/nerfstudio/transforms.json", None),
        ("colmap", "exports/colmap/sparse/0/images.txt", None),
        ("parquet", "exports/parquet/data/*.parquet", None),
    )
    for name, file, parent in pose_lists:
        yield _of_author("pose lists", f"poses {name}", file, folder=parent, option="poses")
    for name in ("camera", "lights", "environment"):
        yield _of_author("stages and layers", f"{name} layer", f"st/layers/{name}.usda", option=name)
    for name in ("camera", "keypoints", "parts", "lidar", "sample"):
        yield _of_author("tables, specifications", name, f"{name}.*", option=name)
    yield Subject(
        name="spec",
        group="tables, specifications",
        files=("spec.toml",),
        takes=("st",),
        commands=(("augment", "st", "--spec", "{file}"),),
    )
    documents = "documents, stages of datasets"
    yield _of_dataset(documents, "dataset.json", "ds/dataset.json")
    yield _of_dataset(documents, "records", "ds/records/nominal/*.json")
    yield _of_dataset(documents, "measured.json", "ds/cache/measured.json")
    yield _of_dataset(documents, "dataset stage", "ds/stage/**/*.usd*", "ds/stage/SHA256SUMS", sealed=True)
    yield _of_dataset("files of pictures", "cache", "ds/cache/**/*.exr", "ds/cache/**/*.png")
    for suffix in ("exr", "png", "npz", "ply"):
        yield _of_dataset("files of pictures", f"label {suffix}", f"ds/*/nominal/*.{suffix}", sealed=True)


SUBJECTS = tuple(_subjects())


def make_seeds(folder: Path) -> None:
    """Make the good files in the folder `folder`.

    `st`, an authored stage · `ds`, its dataset · `stage.*` and `target.*` as one file · models, textures and stages
    that show them, tables, and an export for each format of pose lists.
    """
    for name, text in TEXTS.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    for name, source in BUNDLED.items():
        shutil.copyfile(stages() / source, folder / name)
    texture = np.random.default_rng(0).integers(0, 256, (8, 8, 3)).astype(np.uint8)
    for suffix in IMAGES:
        textured = folder / f"textured_{suffix}"
        textured.mkdir()
        OpenImageIO.ImageBuf(texture).write(str(textured / f"texture.{suffix}"))
        (textured / "box.obj").write_text(BOX_OBJ)
        (textured / "box.mtl").write_text(BOX_MTL.replace("texture.png", f"texture.{suffix}"))
        _call(folder, *author(target=f"{textured.name}/box.obj", out=f"st_{suffix}"))
    shutil.copyfile(folder / "textured_png" / "texture.png", folder / "texture.png")
    box = trimesh.creation.box()
    for name in ("box.stl", "box.ply", "box.glb"):
        box.export(folder / name)
    (folder / "box_ascii.stl").write_text(trimesh.exchange.stl.export_stl_ascii(box))
    (folder / "box_ascii.ply").write_bytes(trimesh.exchange.ply.export_ply(box, encoding="ascii"))
    export_gltf: Any = trimesh.exchange.gltf.export_gltf
    (folder / "box.gltf").write_bytes(export_gltf(box, embed_buffers=True)["model.gltf"])
    _call(
        folder,
        *author(keypoints="keypoints.json", parts="parts.json", lidar="lidar.toml", augment="spec.toml", out="st"),
    )
    _call(folder, "render", "st", *RAYCAST, "--labels", LABELS, "--out", "ds")
    for name, options in EXPORTS.items():
        _call(folder, "export", "ds", "--to", name, *options, "--out", f"exports/{name}")
    subprocess.run([sys.executable, "-c", FLATTEN], cwd=folder, check=True, capture_output=True)


def _call(folder: Path, *arguments: str) -> None:
    """Raises SystemExit where a good input is refused."""
    command = [sys.executable, "-P", "-m", "spin_usd.command_line", *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"the good input is refused: {' '.join(arguments)}: {done.stderr[-1000:]}")


def mutate(subject: Subject, seeds: Path, work: Path, chance: str, change: Mutator = mutated) -> tuple[str, ...]:
    """Put what a mutant needs into the folder `work`, with one file changed; returns the arguments of its command.

    The same text `chance` gives the same mutant.
    """
    rng = random.Random(chance)
    source = rng.choice(sorted(path for pattern in subject.files for path in seeds.glob(pattern) if path.is_file()))
    for name in subject.takes:
        copy = shutil.copytree if (seeds / name).is_dir() else shutil.copyfile
        copy(seeds / name, work / name)
    file, data = work / source.relative_to(seeds), source.read_bytes()
    file.parent.mkdir(parents=True, exist_ok=True)
    whole = WHOLE.get(file.suffix)
    file.unlink(missing_ok=True)
    file.write_bytes(whole(data, rng, change) if whole and rng.random() < INSIDE else change(data, rng))
    if subject.sealed and rng.random() < SEALED:
        seal(work / "ds")
    return tuple(word.replace("{file}", str(file.relative_to(work))) for word in rng.choice(subject.commands))


def seal(dataset: Path) -> None:
    """Make the digests of pictures' files and of the stage's right, as whoever wrote the dataset can."""

    def digest(file: Path) -> str:
        return hashlib.sha256(file.read_bytes()).hexdigest()

    for record_file in dataset.glob("records/*/*.json"):
        record = json.loads(record_file.read_text())
        for entry in record["files"].values():
            entry["sha256"] = digest(dataset / entry["path"])
        files = record["provenance"]["stage"]["files"]
        files.update({name: digest(dataset / "stage" / name) for name in files})
        record_file.write_text(json.dumps(record, indent=1))
