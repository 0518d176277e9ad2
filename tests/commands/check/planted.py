"""A copy of a set in which faults are planted, in its own terms: poses, boxes, keypoints, cameras and images.

Poses are edited as the numbers that the layout has: a quaternion, scalar first here wherever the layout has it, or the
nine numbers of a matrix, and a position, in the camera's axes of OpenCV here.
"""

import csv
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from spin_usd.geometry.rotation import matrix_from_quaternion
from tests.cases.foreign_sets import CAMERA

SIZE = np.array([CAMERA["Nu"], CAMERA["Nv"]], np.float64)
EVERY = 6  # one of so many is changed where only some are
LABELS = re.compile("mask|depth|contact_sheet")
JSON_POSES = ("train.json", "validation.json", "roe1.json", "poses.json")
KEYS = (("q_vbs2tango_true", "r_Vo2To_vbs_true"), ("q_vbs2tango", "r_Vo2To_vbs_true"), ("cam_R_m2c", "cam_t_m2c"),
        ("q_cam_body", "t_cam_body"))  # fmt: skip
TABLES = (("Qx", "Qy", "Qz", "Qw", "Tx", "Ty", "Tz"), ("q1", "q2", "q3", "q4", "x", "y", "z"))
T_URSO = np.array([[0.0, 0, 1], [1, 0, 0], [0, -1, 0]])
BOX_COLUMNS = {"bbox": ("[{}, {}, {}, {}]", [1, 0, 3, 2]), "Bounding box": ("({}, {}, {}, {})", [0, 1, 2, 3])}


class PlantedSet:
    """The set in the folder `root`. `some`: whether only one of EVERY is changed."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self._count = 0

    def _is_turn(self, some: bool) -> bool:
        self._count += 1
        return not some or self._count % EVERY == 4

    def documents(self, pattern: str) -> Iterator[Any]:
        """Yield the JSON documents of the set whose paths match, and write each when the next is asked for."""
        for path in sorted(self.root.rglob("*.json")):
            if re.search(pattern, str(path.relative_to(self.root))):
                document = json.loads(path.read_text())
                yield document
                path.write_text(json.dumps(document))

    def tables(self) -> Iterator[list[dict[str, str]]]:
        """Yield the rows of each CSV table of labels, and write each when the next is asked for."""
        for path in sorted(self.root.glob("*.csv")):
            with path.open() as file:
                rows = list(csv.DictReader(file))
            if path.name == "pictures.csv" or path.name.endswith("_images.csv"):
                continue
            yield rows
            with path.open("w", newline="") as file:
                writer = csv.DictWriter(file, rows[0])
                writer.writeheader()
                writer.writerows(rows)

    def entries(self) -> Iterator[dict[str, Any]]:
        """Yield the JSON objects with a pose, and the pose of each under KEYS."""
        for document in self.documents(rf"(^|/)({'|'.join(JSON_POSES)}|scene_gt\.json)$"):
            if isinstance(document, list):
                yield from document
            elif "images" in document:
                yield from (pose for image in document["images"] for pose in image["poses"])
            else:
                yield from (body for bodies in document.values() for body in bodies)

    def poses(self, change: Callable[[Any, Any], Any], *, some: bool = False, scalar_last: bool = False) -> None:
        """Change poses. scalar_last: write the quaternion with its scalar at the end that is not the layout's."""
        for entry in self.entries():
            q, t = next((keys for keys in KEYS if keys[0] in entry), ("", ""))
            if q and self._is_turn(some):
                rotation, place = change(np.array(entry[q]), np.array(entry[t]))
                entry[q] = (np.roll(rotation, -1) if scalar_last else np.asarray(rotation)).tolist()
                entry[t] = np.asarray(place).tolist()
        for rows in self.tables():
            columns = next((columns for columns in TABLES if columns[0] in rows[0]), ())
            axes = T_URSO if "q1" in columns else np.eye(3)
            for row in rows:
                if columns and self._is_turn(some):
                    values = np.array([float(row[column]) for column in columns])
                    q, t = change(np.roll(values[:4], 1), axes.T @ values[4:])
                    wrong = np.asarray(q) if scalar_last else np.roll(q, -1)
                    row.update(zip(columns, map(repr, [*map(float, wrong), *map(float, axes @ t)]), strict=True))

    def boxes(self, change: Callable[..., Any], *, some: bool = False) -> None:
        """Change boxes: `change` gets x0, y0, x1, y1 and returns four such numbers: pixels, or thousandths of the
        picture's sides where the layout has shares."""
        for document in self.documents("^annotations/"):
            for note in document["annotations"]:
                if self._is_turn(some):
                    note["bbox"] = _sides(change(*_ends(note["bbox"])))
        for document in self.documents("scene_gt_info"):
            for (body,) in document.values():
                if self._is_turn(some):
                    body["bbox_visib"] = _sides(change(*_ends(body["bbox_visib"])))
        for words in self.lines():
            if self._is_turn(some):
                x, y, w, h = np.array(words[1:5], np.float64) * 1000
                x0, y0, x1, y1 = change(x - w / 2, y - h / 2, x + w / 2, y + h / 2)
                shares = np.array([(x0 + x1) / 2, (y0 + y1) / 2, x1 - x0, y1 - y0]) / 1000
                words[1:5] = [f"{each:.9g}" for each in shares]
        for rows in self.tables():
            for column, (form, order) in BOX_COLUMNS.items():
                for row in rows:
                    if column in row and self._is_turn(some):
                        said = np.array([float(each) for each in re.findall(r"[-\d.]+", row[column])])
                        row[column] = form.format(*np.array(change(*said[order]))[order].tolist())

    def keypoints(self, change: Callable[[Any], Any], *, some: bool = False) -> None:
        """Change labelled keypoints: `change` gets (N, 2) pixels and returns as many."""
        for document in self.documents("^annotations/"):
            for note in document["annotations"]:
                if self._is_turn(some):
                    note["keypoints"] = _moved(note["keypoints"], change, 1).tolist()
        for words in self.lines():
            if self._is_turn(some):
                words[5:] = [f"{each:.9g}" for each in _moved([float(word) for word in words[5:]], change, SIZE)]

    def lines(self) -> Iterator[list[str]]:
        """Yield the words of each line of YOLO's labels, and write them when the next is asked for."""
        for path in sorted(self.root.rglob("labels/*/*.txt")):
            words = path.read_text().split()
            yield words
            path.write_text(" ".join(words) + "\n")

    def camera(self, change: Callable[[Any], Any]) -> None:
        """Change the matrix K (3, 3) of each camera."""
        for document in self.documents(r"camera\.json$"):
            for each in (document, *(each for each in document.values() if isinstance(each, dict))):
                for key, shape in (("cameraMatrix", (3, 3)), ("cam_K", (9,))):
                    if key in each:
                        K = np.array(each[key], np.float64).reshape(3, 3)
                        each[key] = change(K).reshape(shape).tolist()

    def image_files(self) -> list[Path]:
        return [path for path in self._pictures() if not LABELS.search(str(path.relative_to(self.root)))]

    def mask_files(self) -> list[Path]:
        return [path for path in self._pictures() if "mask" in path.parent.relative_to(self.root).as_posix()]

    def depth_files(self) -> list[Path]:
        return [path for path in self._pictures() if "depth" in str(path.relative_to(self.root))]

    def _pictures(self) -> list[Path]:
        return sorted(path for path in self.root.rglob("*") if path.suffix in (".png", ".jpg"))

    def pixels(self, files: list[Path], change: Callable[[Any], Any], *, some: bool = False) -> None:
        """Change arrays (H, W) or (H, W, 3) of images, blue first."""
        for path in files:
            if self._is_turn(some):
                cv2.imwrite(str(path), change(cv2.imread(str(path), cv2.IMREAD_UNCHANGED)))


def _ends(box: list[float]) -> list[float]:
    return [box[0], box[1], box[0] + box[2], box[1] + box[3]]


def _sides(box: Any) -> list[float]:
    x0, y0, x1, y1 = map(float, box)
    return [x0, y0, x1 - x0, y1 - y0]


def _moved(values: list[float], change: Callable[[Any], Any], scale: Any) -> Any:
    points = np.array(values, np.float64).reshape(-1, 3)
    there = points[:, 2] > 0
    points[there, :2] = change(points[there, :2] * scale) / scale
    return points.ravel()


def matrix(rotation: Any) -> Any:
    """Return the matrix (3, 3) of a quaternion (4,) or of nine numbers."""
    return rotation.reshape(3, 3) if len(rotation) == 9 else matrix_from_quaternion(rotation / np.linalg.norm(rotation))


def inverse(rotation: Any) -> Any:
    """Return the numbers of the inverse rotation."""
    return rotation.reshape(3, 3).T.ravel() if len(rotation) == 9 else rotation * [1, -1, -1, -1]
