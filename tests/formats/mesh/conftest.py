"""glTF files made by hand, so that a test says exactly what stands in them."""

import base64
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from PIL import Image

TYPES = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
COORDINATES = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)  # v points down: the image stands upright
FACES = np.array([0, 1, 2, 0, 2, 3], np.uint16)

GltfWriter = Callable[..., Path]


def png(pixels: ArrayLike) -> bytes:
    data = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(data, "PNG")
    return data.getvalue()


def uri(data: bytes) -> str:
    return "data:application/octet-stream;base64," + base64.b64encode(data).decode()


@pytest.fixture
def gltf(tmp_path: Path) -> GltfWriter:
    """Writes a square with `attributes` (array, or (array, True) where normalised) and the JSON `changed`."""

    def write(
        attributes: dict[str, Any] | None = None, indices: ArrayLike | None = FACES, mode: int = 4, **changed: Any
    ) -> Path:
        document: dict[str, Any] = {"buffers": [], "bufferViews": [], "accessors": []}

        def accessor(values: Any) -> int:
            array, normalized = values if isinstance(values, tuple) else (np.asarray(values), False)
            data = np.ascontiguousarray(array).tobytes()
            width = 1 if array.ndim == 1 else array.shape[1]
            index = len(document["buffers"])
            document["buffers"].append({"uri": uri(data), "byteLength": len(data)})
            document["bufferViews"].append({"buffer": index, "byteLength": len(data)})
            document["accessors"].append(
                {
                    "bufferView": index,
                    "componentType": TYPES[array.dtype.name],
                    "count": len(array),
                    "type": "SCALAR" if width == 1 else f"VEC{width}",
                    "normalized": normalized,
                }
            )
            return index

        given = {"POSITION": SQUARE, "TEXCOORD_0": COORDINATES} | (attributes or {})
        primitive: dict[str, Any] = {
            "mode": mode,
            "attributes": {k: accessor(v) for k, v in given.items() if v is not None},
        }
        if indices is not None:
            primitive["indices"] = accessor(indices)
        if "materials" in changed:
            primitive["material"] = 0
        document |= {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "name": "panel"}],
            "meshes": [{"name": "panel", "primitives": [primitive]}],
        }
        path = tmp_path / "model.gltf"
        path.write_text(json.dumps(document | changed))
        return path

    return write
