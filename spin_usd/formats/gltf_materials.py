"""The material factors of a glTF file, exactly.

trimesh rounds base colours to 8 bits, so the numbers are read from the file's own JSON. Source: glTF 2.0, sections
3.9 (materials) and 4.4 (GLB).
"""

import json
import struct
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Color

GLB_MAGIC = b"glTF"


def read_gltf_materials(path: Path) -> tuple[dict[str, Material], bool]:
    """The materials whose names are unique, by name, and whether the file has textures. Raises InputError."""
    try:
        data = path.read_bytes()
        if data[:4] == GLB_MAGIC:
            (length,) = struct.unpack_from("<I", data, 12)
            data = data[20 : 20 + length]
        document = json.loads(data)
        entries = document.get("materials", [])
        names = [entry.get("name") for entry in entries]
        found = {name: _material(e) for name, e in zip(names, entries, strict=True) if name and names.count(name) == 1}
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=path) from None
    except (ValueError, struct.error, AttributeError, TypeError, KeyError) as error:
        raise InputError(f"is not a glTF file ({error})", where=path) from None
    return found, bool(document.get("textures"))


def _material(entry: dict[str, Any]) -> Material:
    factors = entry.get("pbrMetallicRoughness", {})
    red, green, blue, alpha = (float(x) for x in factors.get("baseColorFactor", (1, 1, 1, 1)))
    emissive: Color = tuple(float(x) for x in entry.get("emissiveFactor", (0, 0, 0)))  # type: ignore[assignment]
    return Material(
        path=entry["name"],
        diffuse_color=(red, green, blue),
        emissive_color=emissive,
        metallic=float(factors.get("metallicFactor", 1)),
        roughness=float(factors.get("roughnessFactor", 1)),
        opacity=alpha if entry.get("alphaMode", "OPAQUE") != "OPAQUE" else 1.0,
    )
