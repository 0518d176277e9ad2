"""Pack pictures, to be learned from on another machine, without dataset, USD and Blender: `tools/train/pack --help`.

A pack is one file, NumPy's .npz: each picture's grey image, camera and pose, and the target's keypoints. Images are
black where no crop goes. The baseline learns the same from it, to the last digit.
"""

import argparse
import json
import math
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from train.heatmaps import SHIFT, ZOOM
from train.pictures import PACK, PictureSet, PosedPicture, crop_of, keypoint_pixels, read_sets


def write_pack(path: Path, pictures: PictureSet) -> None:
    every, points = pictures.pictures, pictures.points
    arrays: dict[str, Any] = {f"image{place}": _seen(each, points) for place, each in enumerate(every)} | {
        "points": points,
        "names": np.array([each.name for each in every]),
        "cameras": np.array([json.dumps(asdict(each.camera)) for each in every]),
        "poses": np.stack([each.T_cam_body for each in every]),
    }
    new = path.with_suffix(".new")
    with new.open("wb") as file:
        np.savez_compressed(file, **arrays)
    os.replace(new, path)


def _seen(picture: PosedPicture, points: Float) -> NDArray[np.uint8]:
    """Return the image, black where no crop goes, however far off its box."""
    crop = crop_of(keypoint_pixels(picture, points))
    image, beyond = picture.image(), math.ceil(crop.side * (ZOOM / 2 + SHIFT)) + 2  # 2: crops are of whole pixels
    rows, columns = (slice(max(0, at - beyond), max(0, at + crop.side + beyond)) for at in (crop.y, crop.x))
    seen = np.zeros_like(image)
    seen[rows, columns] = image[rows, columns]
    return seen


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pictures", type=Path, nargs="+", help="folders of datasets, or DOMAIN/NAME.json of SPEED+")
    parser.add_argument("pack", type=Path, metavar=f"FILE{PACK}")
    parser.add_argument("--frames", metavar="A:B:STEP", help="some of the frames")
    parser.add_argument("--appearances", type=int, metavar="N", help="variants of each frame; all if not given")
    parser.add_argument("--keypoints", type=Path, metavar="FILE", help="JSON list of points, of a set that has none")
    given = parser.parse_args()
    of = read_sets(given.pictures, frames=given.frames, appearances=given.appearances, keypoints=given.keypoints)
    write_pack(given.pack, of)
    print(f"{given.pack}: {len(of.pictures)} pictures")


if __name__ == "__main__":
    main()
