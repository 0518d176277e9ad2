"""`spin-usd score --shape`: known errors are reported, in any attitude and size; hostile files get a sentence."""

import json
import shutil

import jsonschema
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import spin_usd as package
from spin_usd.errors import InputError
from spin_usd.formats.image_file import read_image, write_image
from tests.conftest import REPOSITORY

RESIDUE = 2e-3  # percent of the diameter that an alignment may leave


@pytest.fixture(scope="module")
def exports(rendered, tmp_path_factory):
    """Exports of the CubeSat with poses, and without."""
    folder = tmp_path_factory.mktemp("exports")
    package.export(rendered, to="unknown_target", out=folder / "posed")
    package.export(rendered, to="unknown_target", out=folder / "unposed", option=["poses=no", "masks=no"])
    return folder


@pytest.fixture(scope="module")
def truth(exports):
    return exports / "posed" / "truth"


def shifted(truth, by, out):
    mesh = trimesh.load_mesh(truth / "mesh.ply", process=False)
    mesh.apply_translation(by)
    mesh.export(out)
    return out


def test_the_truth_scores_nothing_and_by_its_schema(truth) -> None:
    report = package.score(shape=truth / "mesh.ply", truth=truth)
    assert report.alignment.mode == "none"
    assert report.chamfer_percent == pytest.approx(0, abs=RESIDUE)
    assert report.f_score == report.precision == report.recall == 1
    assert np.sum([part.points for part in report.parts]) == 100_000
    import msgspec

    rules = json.loads((REPOSITORY / "schemas" / "shape-report-1.schema.json").read_text())
    jsonschema.validate(msgspec.to_builtins(report), rules)


def test_a_shift_is_at_most_what_is_reported_and_scipys_points_agree(truth, tmp_path) -> None:
    by = np.array([0.004, 0, 0])
    report = package.score(shape=shifted(truth, by, tmp_path / "moved.ply"), truth=truth)
    assert 0 < report.accuracy_m < 0.004
    from scipy.spatial import KDTree

    mesh = trimesh.load_mesh(truth / "mesh.ply", process=False)
    rng = np.random.default_rng(0)
    dense = mesh.triangles[rng.choice(len(mesh.faces), 400_000, p=mesh.area_faces / mesh.area)]
    dense = (rng.dirichlet((1, 1, 1), len(dense))[:, :, None] * dense).sum(1)
    apart = KDTree(dense).query(dense[:20_000] + by)[0]
    assert report.accuracy_m == pytest.approx(apart.mean(), abs=2e-4)  # half the distance between its points


@pytest.mark.slow
def test_a_similarity_changes_no_score(exports, truth, tmp_path) -> None:
    changed = trimesh.load_mesh(truth / "mesh.ply", process=False)
    changed.vertices *= (1.0, 1.05, 0.97)  # an imperfect reconstruction
    changed.export(tmp_path / "one.ply")
    matrix = np.eye(4)
    matrix[:3, :3] = 7.3 * Rotation.random(random_state=8).as_matrix()
    matrix[:3, 3] = 1, -20, 3
    changed.apply_transform(matrix).export(tmp_path / "other.ply")
    one, other = (
        package.score(shape=tmp_path / name, truth=exports / "unposed" / "truth") for name in ("one.ply", "other.ply")
    )
    assert one.alignment.mode == other.alignment.mode == "similarity"
    assert other.chamfer_percent == pytest.approx(one.chamfer_percent, abs=0.02)
    assert other.alignment.scale * 7.3 == pytest.approx(one.alignment.scale, rel=1e-3)


@pytest.mark.slow
def test_views_are_compared_within_masks(exports, truth, tmp_path) -> None:
    posed = exports / "posed"
    shutil.copytree(posed / "images", tmp_path / "same")
    report = package.score(shape=truth / "points.ply", truth=truth, views=tmp_path / "same")
    assert report.views.ssim == pytest.approx(1)
    assert report.views.pictures == 3
    assert "psnr" not in json.loads(package_json(report))["views"]
    (tmp_path / "off").mkdir()
    first = next(iter(sorted((posed / "images").iterdir())))
    image, channels = read_image(first)
    write_image(tmp_path / "off" / f"{first.stem}.png", np.where(image > 127, image - 8, image + 8).astype(np.uint8),
                channels=channels)  # fmt: skip
    off = package.score(shape=truth / "points.ply", truth=exports / "unposed" / "truth", align="none",
                        views=tmp_path / "off")  # fmt: skip
    assert off.views.pictures == 1
    assert off.views.psnr == pytest.approx(20 * np.log10(255 / 8))


def package_json(report) -> bytes:
    import msgspec

    return msgspec.json.encode(report)


@pytest.mark.parametrize(
    ("text", "align"),
    [
        pytest.param("f 1 2 3\n", "none", marks=pytest.mark.slow),  # so far from a surface the nearest takes long
        pytest.param("f 1 2 3\n", "similarity", marks=pytest.mark.slow),
        ("", "rigid"),
    ],
)
def test_a_triangle_and_three_points_are_scored(truth, tmp_path, text, align) -> None:
    (tmp_path / "small.obj").write_text(f"v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\n{text}")
    report = package.score(shape=tmp_path / "small.obj", truth=truth, align=align)
    assert np.isfinite(report.chamfer_m)
    assert report.chamfer_m > 0


@pytest.mark.parametrize(
    ("asked", "found"),
    [
        ({"shape": "ghost.ply"}, "is not there"),
        ({"shape": "dot.obj", "align": "rigid"}, "has no extent to align by"),
        ({"shape": "dot.obj", "align": "sideways"}, "align is 'sideways'"),
        ({"shape": "dot.obj", "target": "tango"}, "options of predicted poses"),
        ({}, "neither predictions nor a shape"),
        ({"predictions": "poses.csv", "align": "none"}, "without a shape"),
        ({"predictions": "poses.csv", "shape": "dot.obj"}, "predictions and a shape together"),
        ({"shape": "dot.obj", "views": "."}, "has no view of a picture"),
        ({"shape": "dot.obj", "views": "small"}, r"is 5 x 4 pixels, and its picture 240 x 150"),
        ({"shape": "dot.obj", "views": "deep"}, "does not have 8 bits"),
        ({"shape": "dot.obj", "truth": "."}, r"has no truth\.json"),
    ],
)
def test_wrong_questions_are_refused(truth, tmp_path, monkeypatch, asked, found) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dot.obj").write_text("v 1 1 1\nv 1 1 1\n")
    name = json.loads((truth / "truth.json").read_text())["pictures"][0]["name"]
    for folder, dtype in (("small", np.uint8), ("deep", np.uint16)):
        (tmp_path / folder).mkdir()
        write_image(tmp_path / folder / f"{name}.png", np.zeros((4, 5), dtype), channels=("Y",))
    with pytest.raises(InputError, match=found):
        package.score(**{"truth": truth} | asked)


def test_the_command_prints_a_table(spin_usd, truth) -> None:
    said = spin_usd("score", "--shape", truth / "points.ply", "--truth", truth).stdout
    assert "Chamfer, F-score" in said
    assert "completeness of" in said
