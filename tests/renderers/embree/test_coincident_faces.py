"""Coincident faces are reported where they are seen, by their prims and their share of the area."""

import numpy as np
import pytest

from spin_usd.renderers.embree.face_findings import MIN_SHARE, face_findings
from spin_usd.scene.derived.coincidence import GAP
from tests.cases.scenes import box, target

BOX = box()
AREA = 6.0  # of the box of side 1


def reported(*meshes):
    """The findings on the meshes (points, faces) together, each a part of its own."""
    first = np.cumsum([0, *(len(points) for points, _ in meshes)])
    faces = np.concatenate([faces + n for (_, faces), n in zip(meshes, first, strict=False)])
    numbers = np.concatenate([np.full(len(faces), i + 1) for i, (_, faces) in enumerate(meshes)])
    return list(face_findings(target(np.concatenate([points for points, _ in meshes]), faces, parts=numbers)))


def patch(z, half=0.2, winding=1):
    points = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    return points, np.array([[0, 1, 2], [0, 2, 3]])[:, ::winding]


@pytest.mark.parametrize("winding", [1, -1])
@pytest.mark.parametrize("gap", [0.0, 0.5 * GAP])
def test_a_patch_in_a_wall_is_told(gap, winding) -> None:
    """Only the patch's middles lie in the wall's faces; the wall's lie beside the patch, or it would count too."""
    (finding,) = reported(BOX, patch(0.5 + gap, 0.1, winding))
    assert (finding.code, finding.severity, finding.where) == ("faces-coincident", "warning", "/T")
    assert "/T/p1 with /T/p2" in finding.message
    assert f"faces that hold {100 * 0.04 / (AREA + 0.04):.3g} % of its area overlap others" in finding.message


def test_a_patch_before_a_wall_is_fine() -> None:
    assert reported(BOX, patch(0.5 + 3 * GAP)) == []


def test_what_touches_within_is_nobodys_to_see() -> None:
    """Two boxes side by side share a wall; a plate within a closed box lies in another."""
    aside = BOX[0] + np.array([1.0, 0, 0]), BOX[1]
    assert reported(BOX, aside) == []
    assert reported(BOX, patch(0.1), patch(0.1)) == []


def test_a_part_with_itself() -> None:
    points, faces = BOX
    (finding,) = reported((points, np.concatenate([faces, faces])))
    assert "faces that hold 100 % of its area overlap others (/T/p1 with itself)" in finding.message


def test_little_is_not_worth_a_word() -> None:
    half = 0.5 * np.sqrt(0.9 * MIN_SHARE * AREA)
    assert reported(BOX, patch(0.5, half)) == []
    assert reported(BOX, patch(0.5, half * 1.1))


@pytest.mark.slow
def test_the_parts_of_a_real_model_that_share_a_surface(shared, tmp_path, spin_usd) -> None:
    poses = tmp_path / "poses.json"
    poses.write_text('[{"filename": "a.png", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 10]}]')
    model = shared / "data" / "tango" / "tango.obj"
    spin_usd("author", "--poses", poses, "--target", model, "--units-per-metre", 100, "--camera", "speedplus", "--out", tmp_path / "s")  # fmt: skip  # noqa: E501
    done = spin_usd("check", tmp_path / "s" / "dataset.usda")
    assert "faces-coincident" in done.stdout
    assert "Cuerpo41 with /World/Target/Model/Cuerpo42" in done.stdout
