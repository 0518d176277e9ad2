"""Classes number the parts' classes in alphabetic order."""

from dataclasses import replace

import numpy as np

from spin_usd.labels.classes import faults
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.scene.derived.part_classes import class_ids
from tests.cases.labelled import labels_of, picture_of
from tests.cases.scenes import scene, soup, target

NAMES = ("panel", "antenna", "body")


def classed(names):
    """Forty triangles, each a part, of these classes in turn."""
    points, faces, parts = soup(3)
    plain = target(points, faces, parts=parts)
    named = (replace(part, class_name=names[part.id % len(names)]) for part in plain.parts)
    return scene(replace(plain, parts=tuple(named)))


def test_each_pixel_has_the_class_of_its_part() -> None:
    made = classed(NAMES)
    labels = labels_of(made)
    assert class_ids(NAMES) == {"antenna": 1, "body": 2, "panel": 3}
    wanted = [0, *(class_ids(NAMES)[part.class_name] for part in made.target.parts)]
    np.testing.assert_array_equal(labels["classes"], np.array(wanted)[labels["segmentation"]])
    assert set(np.unique(labels["classes"])) == {0, 1, 2, 3}


def test_another_class_is_another_label_of_the_same_geometry() -> None:
    one, same, other = (
        PIXEL_LABELS["classes"].key(classed(names), "geometry", 0) for names in (NAMES, NAMES, NAMES[::-1])
    )
    assert one == same != other
    assert PIXEL_LABELS["segmentation"].key(classed(NAMES), "geometry", 0) == "geometry"


def test_a_wrong_class_is_found() -> None:
    made = classed(NAMES)
    labels = labels_of(made)
    assert list(faults(picture_of(made, labels))) == []
    wrong = np.where(labels["classes"] == 1, 2, labels["classes"])
    assert [fault.code for fault in faults(picture_of(made, labels, classes=wrong))] == ["classes"]
