"""The image files of a mesh file's model, beside the layers that name them."""

import re
from collections.abc import Mapping
from pathlib import Path

from spin_usd.scene.source.asset import ImageFile, MeshAsset
from spin_usd.stage.usd.layer_file import writing
from spin_usd.unique_names import UniqueNames

FOLDER = "textures"
NOT_ALLOWED = re.compile(r"[^A-Za-z0-9_-]")  # "<UDIM>", "@" and brackets mean something in asset paths


def asset_paths(asset: MeshAsset) -> Mapping[ImageFile, str]:
    """Return the asset path of each image of `asset`, relative to the target's layers. Equal images share one file."""
    paths: dict[ImageFile, str] = {}
    by_data: dict[bytes, str] = {}
    names = UniqueNames()
    for file in (image.file for material in asset.materials for image in material.images.values()):
        if file.data not in by_data:
            stem, suffix = Path(file.name).stem, Path(file.name).suffix
            by_data[file.data] = f"./{FOLDER}/{names.give(NOT_ALLOWED.sub('_', stem) or 'image', suffix)}"
        paths[file] = by_data[file.data]
    return paths


def write_images(asset: MeshAsset, folder: Path) -> None:
    """Write the images below `folder`. Raises OutputError."""
    for file, path in asset_paths(asset).items():
        target = folder / path
        with writing(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(file.data)
