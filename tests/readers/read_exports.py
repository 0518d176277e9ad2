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


READERS = {reader.__name__: reader for reader in (coco, webdataset)}


def main(reader, export, out) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        found = READERS[reader](Path(export))
    Path(out).write_text(json.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
