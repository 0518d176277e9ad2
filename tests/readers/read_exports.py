"""Reads exports with other people's software, as its users do, and none of our code.

python read_exports.py READER EXPORT OUT: into the file OUT, JSON, what the reader made of the folder EXPORT.
"""

import contextlib
import hashlib
import io
import json
import sys
from pathlib import Path

import numpy as np


def coco(export):
    """What pycocotools makes of the masks, and the average precision of the ground truth against itself."""
    from pycocotools import mask
    from pycocotools.coco import COCO

    truth = COCO(str(export / "annotations" / "train.json"))
    found = [
        {
            "file_name": truth.imgs[said["image_id"]]["file_name"],
            "category": truth.cats[said["category_id"]]["name"],
            "pixels": np.flatnonzero(truth.annToMask(said)).tolist(),
            "area": int(mask.area(truth.annToRLE(said))),
            "bbox": mask.toBbox(truth.annToRLE(said)).tolist(),
            "said": {name: said[name] for name in ("area", "bbox")},
        }
        for said in truth.anns.values()
    ]
    results = {"bbox": "bbox", "segm": "segmentation", "keypoints": "keypoints"}
    return {"annotations": found, "precision": {kind: precision(truth, kind, name) for kind, name in results.items()}}


def precision(truth, kind, name):
    """The average precision of the ground truth, taken for a detection, by what its annotations have of that name."""
    from pycocotools.cocoeval import COCOeval

    result = {"score": 1.0}
    results = [result | {key: said[key] for key in ("image_id", "category_id", name)} for said in truth.anns.values()]
    evaluation = COCOeval(truth, truth.loadRes(results), kind)
    if kind == "keypoints":  # it has those of people only
        evaluation.params.kpt_oks_sigmas = np.full(len(results[0][name]) // 3, 0.05)
    evaluation.evaluate()
    evaluation.accumulate()
    evaluation.summarize()
    return float(evaluation.stats[0])


def webdataset(export):
    """Each sample's key, and digests of its files by their endings, in the order of the index."""
    import webdataset

    index = json.loads((export / "train.json").read_text())
    urls = [str(export / shard["url"]) for shard in index["shardlist"]]
    return [
        [
            sample["__key__"],
            {name: hashlib.sha256(data).hexdigest() for name, data in sample.items() if not name.startswith("__")},
        ]
        for sample in webdataset.WebDataset(urls, shardshuffle=False)
    ]


def datasets(export):
    """The rows of the table that Hugging Face's datasets makes of the shards: what is JSON, and the images' sizes."""
    import datasets

    datasets.disable_progress_bars()
    shards = sorted(str(path) for path in export.glob("train-*.tar"))
    rows = datasets.load_dataset("webdataset", data_files=shards, split="train", cache_dir=str(export.parent / "cache"))
    return [row["json"] | {"size": row["image.png"].size, "record": row["record.txt"]} for row in rows]


def parquet(export):
    """The rows that Hugging Face's datasets makes of the folder, by its card, and of a shard, by the table's own
    metadata: images as Pillow opens them, by size, sum and what they are called."""
    import datasets

    datasets.disable_progress_bars()
    shard = next((export / "data").glob("train-00000-*"))
    cache = str(export.parent / "cache")
    folder = datasets.load_dataset(str(export), cache_dir=cache)
    alone = datasets.load_dataset("parquet", data_files=str(shard), split="train", cache_dir=cache)
    assert alone.features == folder["train"].features
    return {split: [{name: opened(value) for name, value in row.items()} for row in folder[split]] for split in folder}


def opened(value):
    """Of an image its size and the sum of its pixels, anything else as it is."""
    return [*value.size, int(np.asarray(value).astype(int).sum())] if hasattr(value, "getpixel") else value


def video(export):
    """The frames that OpenCV 4 decodes, blue, green and red, and how many a second there are."""
    import cv2

    file = cv2.VideoCapture(str(export / "nominal.mp4"))
    frames = []
    while (frame := file.read()[1]) is not None:
        frames.append(frame.tolist())
    return {"fps": file.get(cv2.CAP_PROP_FPS), "frames": frames}


def croissant(export):
    """What mlcroissant gives of each picture: its texts and numbers, and the sum of its image's pixels."""
    import mlcroissant

    found = []
    for row in mlcroissant.Dataset(str(export / "croissant.json")).records("pictures"):
        said = {name.removeprefix("pictures/"): value for name, value in row.items()}
        pixels = np.asarray(said.pop("image_content"))
        texts = {name: value.decode() for name, value in said.items() if isinstance(value, bytes)}
        numbers = {name: float(value) for name, value in said.items() if name not in texts}
        found.append({"texts": texts, "numbers": numbers, "shape": pixels.shape, "sum": int(pixels[..., 0].sum())})
    return found


def speedplus(export):
    """Where OpenCV projects the points that are given it, and the pixels of image and mask that it reads."""
    import cv2

    camera = json.loads((export / "camera.json").read_text())
    points = np.array(json.loads((export / "points.json").read_text()))
    found = {}
    for entry in json.loads((export / "synthetic" / "train.json").read_text()):
        w, *xyz = entry["q_vbs2tango_true"]
        vector = 2 * np.arctan2(np.linalg.norm(xyz), w) * np.array(xyz) / np.linalg.norm(xyz)
        place, matrix, lens = entry["r_Vo2To_vbs_true"], camera["cameraMatrix"], camera["distCoeffs"]
        seen, _ = cv2.projectPoints(points, vector, np.array(place), np.array(matrix), np.array(lens))
        stem = entry["filename"].removesuffix(".jpg")
        image = cv2.imread(str(export / "synthetic" / "images" / entry["filename"]), cv2.IMREAD_UNCHANGED)
        mask = cv2.imread(str(export / "synthetic" / "masks" / f"{stem}.png"), cv2.IMREAD_UNCHANGED)
        found[stem] = {"pixels": seen[:, 0].tolist(), "image": image.shape, "mask": np.flatnonzero(mask).tolist()}
    return found


def spark(export):
    """What pandas reads in the table of 2021, and the depth image that OpenCV does, in millimetres."""
    import cv2
    import pandas

    table = pandas.read_csv(export / "train_labels.csv")
    rows = table.to_dict("records")
    for row in rows:
        depth = cv2.imread(str(export / "train_depth" / row["class"] / row["depth"]), cv2.IMREAD_UNCHANGED)
        row["millimetres"] = int(depth.max())
        row["read"] = cv2.imread(str(export / "train_rgb" / row["class"] / row["image"])) is not None
    return rows


def colmap(export):
    """What pycolmap reads of the model, how far its projections of the points are from their pixels, and how far off
    it puts points that it triangulates from the pixels and the poses alone, and their pixels; all at most."""
    import pycolmap

    model = pycolmap.Reconstruction(str(export / "sparse" / "0"))
    images = {
        image.name: {
            "pose": image.cam_from_world().matrix().tolist(),
            "camera": [image.camera.model.name, image.camera.width, image.camera.height, *image.camera.params],
            "points": len(image.points2D),
            "mask": (export / "masks" / f"{image.name}.png").is_file(),
        }
        for image in model.images.values()
    }
    projected, triangulated, apart = [], [], []
    for point in model.points3D.values():
        seen = [model.images[each.image_id] for each in point.track.elements]
        pixels = [image.points2D[each.point2D_idx].xy for image, each in zip(seen, point.track.elements, strict=True)]
        projected += [distance(image.project_point(point.xyz), xy) for image, xy in zip(seen, pixels, strict=True)]
        if len(seen) > 1:
            poses, cameras = [image.cam_from_world() for image in seen], [image.camera for image in seen]
            place = pycolmap.estimate_triangulation(np.array(pixels), poses, cameras)["xyz"]
            triangulated += [distance(image.project_point(place), xy) for image, xy in zip(seen, pixels, strict=True)]
            apart.append(distance(place, point.xyz))
    found = {"images": images, "observations": len(projected), "projected": max(projected)}
    return found | {"triangulated": max(triangulated), "apart": max(apart), "tracks": len(apart)}


def kitti(export):
    """What pykitti reads of a recording: its pictures' sizes, the baseline and the points in the image."""
    import pykitti

    read = pykitti.raw(str(export), "nominal", "0001")
    points = read.get_velo(0)
    homogeneous = np.column_stack([points[:, :3], np.ones(len(points))])
    u, v, w = read.calib.P_rect_20 @ read.calib.T_cam0_velo @ homogeneous.T
    return {
        "pictures": len(read),
        "sizes": [image.size for pair in read.rgb for image in pair],
        "baseline": float(read.calib.b_rgb),
        "pixels": np.stack([u / w, v / w], -1).tolist(),
    }


def distance(one, other):
    return float(np.linalg.norm(one - other))


READERS = {
    reader.__name__: reader
    for reader in (coco, webdataset, datasets, croissant, speedplus, spark, colmap, parquet, video, kitti)
}


def main(reader, export, out) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        found = READERS[reader](Path(export))
    Path(out).write_text(json.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
