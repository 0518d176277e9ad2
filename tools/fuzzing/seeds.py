"""The good files that trials and mutants start from, made by spin_usd itself and by hand."""

import base64
import io
import json
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import OpenImageIO
import trimesh
from fuzzing.running.ended import Command
from fuzzing.running.warm import WarmRunner
from fuzzing.seed_texts import (
    BOX_DAE,
    BOX_MTL,
    BOX_OBJ,
    CAMERA,
    KEYPOINTS,
    LIDAR,
    PARTS,
    POSES,
    SAMPLE,
    SPEC,
    STAGE,
    STREAM_2,
    TARGET,
    URSO_POSES,
)
from PIL import Image

EXPORTS = {"speedplus": (), "coco": (), "webdataset": (), "croissant": (), "bop": ("--option", "rectify=yes")}
LABELS = "default,instance,nocs,lidar,lidar_ply"  # a file of each kind that is read
USUAL = {
    "--poses": "poses.json",
    "--camera": "camera.json",
    "--target": "box.obj",
    "--units-per-metre": "1",
    "--root": ".",  # what lies beside it is outside
    "--out": "out",
}


def author_arguments(*options: str) -> tuple[str, ...]:
    """The arguments of `author` with these options and their values in place of the usual ones, or beside them."""
    chosen = USUAL | dict(zip(options[::2], options[1::2], strict=True))
    if "--sample" in chosen:
        del chosen["--poses"]
    return ("author", "--any-size", *(word for pair in chosen.items() for word in pair))


def make_seeds(folder: Path, warm: WarmRunner) -> None:
    """Make all seeds in the new folder `folder`, which is called `work`.

    `st`, an authored stage · `ds`, its dataset · `stage.usda`, one file · models, textures,
    tables, and an export for each format of pose lists.
    """
    folder.mkdir(parents=True)
    _texts(folder)
    _textures(folder)
    _models(folder)
    _author(warm, folder)
    _call(warm, folder, "render", "st", "--renderer", "raycast", "--labels", LABELS, "--workers", "1", "--out", "ds")
    for name, options in EXPORTS.items():
        _call(warm, folder, "export", "ds", "--to", name, *options, "--out", f"exports/{name}")
    _usd(folder)


def _texts(folder: Path) -> None:
    texts = {
        "poses.json": json.dumps(POSES),
        "camera.json": json.dumps(CAMERA),
        "box.obj": BOX_OBJ,
        "box.mtl": BOX_MTL,
        "box.dae": BOX_DAE,
        "keypoints.json": json.dumps(KEYPOINTS),
        "keypoints.csv": "name,x,y,z\na,0,0,0\nb,1,0,0\n",
        "keypoints.toml": '"a" = [0, 0, 0]\n"b" = [1, 0, 0]\n',
        "parts.json": json.dumps(PARTS),
        "parts.csv": "pattern,part,class\n*wing*,wing,panel\n*body*,body,bus\n",
        "lidar.toml": LIDAR,
        "sample.toml": SAMPLE,
        "spec.toml": SPEC,
        "stream2.csv": STREAM_2,
        "urso/train_poses_gt.csv": URSO_POSES,
        "urso/train_images.csv": "a/0.png\na/1.png\n",
        "stage.usda": STAGE,
        "target.usda": TARGET,
    }
    (folder / "urso").mkdir()
    for name, text in texts.items():
        (folder / name).write_text(text)


def _textures(folder: Path) -> None:
    """One image of 8 x 8 pixels in each format."""
    pixels = np.random.default_rng(0).integers(0, 256, (8, 8, 3)).astype(np.uint8)
    for suffix in ("png", "jpg", "bmp", "tif"):
        Image.fromarray(pixels).save(folder / f"texture.{suffix}")
    for suffix in ("exr", "hdr"):
        linear = OpenImageIO.ImageBuf(np.ascontiguousarray(pixels / np.float32(255)).astype(np.float32))
        linear.write(str(folder / f"texture.{suffix}"))


def _models(folder: Path) -> None:
    """The box in every format but USD."""
    box = trimesh.creation.box()
    for name in ("box.stl", "box.ply"):
        box.export(folder / name)
    (folder / "box_ascii.stl").write_text(trimesh.exchange.stl.export_stl_ascii(box))
    (folder / "box_ascii.ply").write_bytes(trimesh.exchange.ply.export_ply(box, encoding="ascii"))
    document, buffer = _gltf((folder / "texture.png").read_bytes())
    (folder / "box.glb").write_bytes(glb(document, buffer))
    data = base64.b64encode(buffer).decode()
    document["buffers"] = [{"byteLength": len(buffer), "uri": f"data:application/octet-stream;base64,{data}"}]
    (folder / "box.gltf").write_text(json.dumps(document, indent=1))


def _gltf(png: bytes) -> tuple[dict[str, object], bytes]:
    """A textured triangle: the document, and its buffer."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32).tobytes()
    st = np.array([[0, 0], [1, 0], [0, 1]], np.float32).tobytes()
    indices = np.array([0, 1, 2, 0], np.uint16).tobytes()
    buffer, views = b"", []
    for part in (points, st, indices, png + b"\0" * (-len(png) % 4)):
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(part)})
        buffer += part
    document: dict[str, object] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "children": [1]}, {"translation": [0, 0, 0.5], "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"name": "paint", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": 10497}],
        "images": [{"bufferView": 3, "mimeType": "image/png"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": len(buffer)}],
    }
    return document, buffer


def glb(document: object, buffer: bytes) -> bytes:
    """A binary glTF of the document and its buffer."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _author(warm: WarmRunner, folder: Path) -> None:
    more = ("--keypoints", "keypoints.json", "--parts", "parts.json", "--lidar", "lidar.toml", "--augment", "spec.toml")
    _call(warm, folder, *author_arguments(*more, "--out", "st"))


def _usd(folder: Path) -> None:
    """The stage in one binary layer, and the target in one and in a package."""
    script = (
        "from pxr import Sdf, UsdUtils\n"
        "Sdf.Layer.FindOrOpen('stage.usda').Export('stage.usdc')\n"
        "Sdf.Layer.FindOrOpen('target.usda').Export('target.usdc')\n"
        "assert UsdUtils.CreateNewUsdzPackage('target.usdc', 'target.usdz')\n"
        "assert UsdUtils.CreateNewUsdzPackage('stage.usdc', 'stage.usdz')\n"
    )
    subprocess.run([sys.executable, "-c", script], cwd=folder, check=True, capture_output=True)


def _call(warm: WarmRunner, folder: Path, *arguments: str) -> None:
    ended = warm.run(Command(arguments=arguments), folder.parent)
    if ended.code:
        raise SystemExit(f"the good input is refused: {' '.join(arguments)}: {ended.err[-1000:]}")


def zipped(members: dict[str, bytes]) -> bytes:
    """A zip file of these members, compressed."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return file.getvalue()
