"""The radiance that an earlier run left: where it still holds, the picture is developed anew without a render."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from spin_usd.dataset.picture import RADIANCE, RADIANCE_CHANNELS
from spin_usd.dataset.store import Store, sha256_of
from spin_usd.errors import InputError
from spin_usd.formats.image_file import read_image
from spin_usd.scene.keys import RenderSettings, radiance_key
from spin_usd.scene.model import Scene
from spin_usd.scene.passes import Radiance


def recorded_radiance(
    store: Store,
    record: Mapping[str, Any],
    path: str | None,
    scene: Scene,
    settings: RenderSettings,
    versions: Mapping[str, str],
) -> Radiance | None:
    """What rendering `scene` would give again, from the radiance file at `path` of its old `record` (record-1).

    None where there is no file, where anything that decides it has changed (its key, or the software), and where it is
    not the one that the record describes.
    """
    if path is None:
        return None
    provenance, file = record["provenance"], store.root / path
    if provenance["keys"]["radiance"] != radiance_key(scene, settings) or provenance["versions"] != versions:
        return None
    if not file.is_file() or sha256_of(file) != record["files"][RADIANCE]["sha256"]:
        return None
    try:
        rgba, channels = read_image(file)
    except InputError:
        return None
    if channels != RADIANCE_CHANNELS or rgba.shape[:2] != scene.camera.frame.shape or rgba.dtype != np.float32:
        return None
    region = scene.picture_region
    return Radiance.of(region, np.ascontiguousarray(rgba[region.slices]))
