"""One small dataset in every layout that `check` reads as others have it, and the camera where a layout has none."""

import json
import shutil
from dataclasses import dataclass, field

CAMERA = {
    "Nu": 240, "Nv": 150, "ppx": 1e-5, "ppy": 1e-5, "fx": 0.0037, "fy": 0.0037, "ccx": 120, "ccy": 75,
    "cameraMatrix": [[370, 0, 120], [0, 370, 75], [0, 0, 1]], "distCoeffs": [0, 0, 0, 0, 0],
}  # fmt: skip
"""Without distortion, which some layouts cannot describe."""
SAMPLE = "range=4..10 inside=1 sun.direction=0,0,-1:70"
COUNT = 24


@dataclass(frozen=True)
class Exported:
    """How an export is made."""

    to: str
    read_as: str
    splits: str = "train=0.7,val=0.3"
    options: dict[str, str] = field(default_factory=dict)
    needs_camera: bool = False
    """Whether the layout has no camera of these pictures."""


LAYOUTS = {
    "speedplus": Exported("speedplus", "speedplus", "train=0.7,validation=0.3"),
    "speed": Exported("speed", "speed", "train=0.7,validation=0.3"),
    "shirt": Exported("shirt", "shirt", "roe1=1"),
    "spark stream 2": Exported("spark", "spark", options={"layout": "stream2"}, needs_camera=True),
    "spark 2021": Exported("spark", "spark", "train=0.7,validate=0.3", {"layout": "2021"}),
    "spark 2022": Exported("spark", "spark", options={"layout": "2022-stream1"}),
    "spark 2024": Exported("spark", "spark", options={"layout": "2024-stream1"}),
    "urso": Exported("urso", "urso", needs_camera=True),
    "coco": Exported("coco", "coco", needs_camera=True),
    "yolo detect": Exported("yolo", "yolo", needs_camera=True),
    "yolo pose": Exported("yolo", "yolo", options={"task": "pose"}, needs_camera=True),
    "yolo segment": Exported("yolo", "yolo", options={"task": "segment"}, needs_camera=True),
    "bop": Exported("bop", "bop"),
    "swisscube": Exported("swisscube", "swisscube", "training=0.7,validation=0.3"),
    "kitti": Exported("kitti", "kitti", "train=1"),
}
QUATERNIONS = ("speedplus", "speed", "shirt", "spark stream 2", "urso", "coco", "yolo detect", "yolo pose",
               "yolo segment")  # fmt: skip
MATRICES = ("bop", "swisscube")
POSED = (*QUATERNIONS, *MATRICES)
BOXED = ("spark 2021", "spark 2022", "spark 2024", "coco", "yolo detect", "yolo pose", "bop")
MASKED = ("speedplus", "spark 2024", "bop", "swisscube")
"""Layouts with masks as images."""
KEYPOINTS = ("coco", "yolo pose")


class ForeignSets:
    """The dataset and its exports, each made once a run."""

    def __init__(self, library, spin_usd) -> None:
        self._library, self._run = library, spin_usd

    @property
    def dataset(self):
        """The folder of the dataset of COUNT pictures."""
        return self._library.folder("annotated", self._render) / "dataset"

    @property
    def camera(self):
        """The calibration of its camera."""
        return self.dataset.parent / "camera.json"

    def _render(self, folder) -> None:
        (folder / "camera.json").write_text(json.dumps(CAMERA))
        self._run("author", "--sample", SAMPLE, "--count", COUNT, "--target", "microsat", "--channels", "rgb",
                  "--camera", folder / "camera.json", "--any-size", "--out", folder / "stage")  # fmt: skip
        self._run("render", folder / "stage", "--renderer", "raycast", "--workers", 1,
                  "--out", folder / "dataset")  # fmt: skip

    def export(self, name):
        """Return the folder of the export in the layout `name` of LAYOUTS; nobody may change it."""
        dataset = self.dataset
        return self._library.folder(f"annotated {name}", lambda made: self._export(dataset, name, made)) / "set"

    def _export(self, dataset, name, folder) -> None:
        layout = LAYOUTS[name]
        options = [word for pair in layout.options.items() for word in ("--option", "=".join(pair))]
        self._run("export", dataset, "--to", layout.to, "--split", layout.splits, *options, "--copy",
                  "--out", folder / "set")  # fmt: skip

    def copy(self, name, to):
        """Copy the export to the folder `to`, to be changed, and return it."""
        return shutil.copytree(self.export(name), to)

    def options(self, name):
        """Return the keywords of `check` that the layout needs."""
        return {"camera": self.camera} if LAYOUTS[name].needs_camera else {}
