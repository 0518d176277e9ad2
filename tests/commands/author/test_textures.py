"""A textured mesh file through `author` and back: what is looked up on the stage is what trimesh sees in the file."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual.color import uv_to_color

from spin_usd.basics.arrays import Float
from spin_usd.commands.author.in_child import author_stage
from spin_usd.scene.derived.lookup import values_at
from spin_usd.scene.material import PRESENCE, Material
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.texture import Color, Primvar, Texture
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader

POSES = [{"filename": "img000000.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 5]}]
BLOCK, BLOCKS = 16, 4  # texels
EDGE = 1.5 / BLOCK  # trimesh's texels are up to one off ours: points so near a block's edge are left out
FLOAT32 = 1e-6
PICTURE = (
    np.random.default_rng(2).integers(0, 255, (BLOCKS, BLOCKS, 4)).astype(np.uint8).repeat(BLOCK, 0).repeat(BLOCK, 1)
)
UV = np.array([[0.1, 0.15], [0.95, 0.1], [0.9, 0.8], [0.2, 0.9]])
CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
FACES = [[0, 1, 2], [0, 2, 3]]


def square(**material: Any) -> trimesh.Trimesh:
    paint = trimesh.visual.material.PBRMaterial(name="paint", **material)
    points = [[x, y, 0] for x, y in CORNERS]
    return trimesh.Trimesh(points, FACES, process=False, visual=trimesh.visual.TextureVisuals(uv=UV, material=paint))


def authored(tmp_path: Path, model: Path, units: float | None = None) -> tuple[Mesh, Material]:
    """The mesh and the one material of the model, read after the model itself was removed."""
    (tmp_path / "poses.json").write_text(json.dumps(POSES))
    report = author_stage(
        poses=tmp_path / "poses.json", target=model, camera="speedplus", out=tmp_path / "stage", units_per_metre=units
    )
    assert check_stage(report.root) == ()
    shutil.rmtree(model.parent)
    reader = StageReader(report.root)
    target = reader.scene(reader.frames[0]).bodies[0].target
    (material,) = target.materials
    return target.mesh, material


def looked_up(value: float | Color | Texture | Primvar, mesh: Mesh) -> tuple[Float, Float]:
    """(values (N, C), uv (N, 2) by which the file's reader finds them) at points all over, off the blocks' edges."""
    weights = np.random.default_rng(4).dirichlet((1, 1, 1), 400)
    face = np.arange(400, dtype=np.int32) % 2
    corners = mesh.points[mesh.faces[face]]
    at_corner = UV[(corners[:, :, None, :2] == CORNERS).all(-1).argmax(-1)]
    uv = np.einsum("nk,nkc->nc", weights, at_corner)
    inside = (np.abs(uv * BLOCKS - np.round(uv * BLOCKS)) > EDGE).all(1)
    assert inside.sum() > 100
    return values_at(value, mesh, face[inside], weights[inside]), uv[inside]


def linear(encoded: Float) -> Float:
    """IEC 61966-2-1."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """The folder of the model."""
    (tmp_path / "model").mkdir()
    return tmp_path / "model"


def test_a_glb_keeps_all_its_textures(tmp_path: Path, model: Path) -> None:
    picture = Image.fromarray(PICTURE)
    mesh = square(
        baseColorTexture=picture, metallicRoughnessTexture=picture.convert("RGB"), normalTexture=picture.convert("RGB"),
        emissiveTexture=picture.convert("RGB"), emissiveFactor=[1.0, 0.5, 0.25],
        metallicFactor=0.5, roughnessFactor=0.75, alphaMode="MASK", alphaCutoff=0.25,
    )  # fmt: skip
    mesh.export(model / "square.glb")
    read, material = authored(tmp_path, model / "square.glb")
    _, uv = looked_up(1.0, read)
    texels = uv_to_color(uv, picture) / 255
    expected = {
        "diffuse_color": linear(texels[:, :3]),
        "opacity": texels[:, 3:],
        "roughness": texels[:, 1:2] * 0.75,
        "metallic": texels[:, 2:3] * 0.5,
        "emissive_color": linear(texels[:, :3]) * (1, 0.5, 0.25),
        "normal": texels[:, :3] * 2 - 1,
    }
    for name, values in expected.items():
        found, _ = looked_up(getattr(material, name), read)
        assert np.allclose(found, values, rtol=0, atol=FLOAT32), name
    assert material.opacity_threshold == 0.25


def test_an_obj_keeps_its_textures(tmp_path: Path, model: Path) -> None:
    picture = Image.fromarray(PICTURE)
    picture.save(model / "wood.png")
    corners = "".join(f"v {x} {y} 0\nvt {u} {v}\n" for (x, y), (u, v) in zip(CORNERS, UV.tolist(), strict=True))
    (model / "square.obj").write_text(f"mtllib a.mtl\n{corners}usemtl paint\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")
    (model / "a.mtl").write_text("newmtl paint\nKd 0.5 1 0.25\nmap_Kd -s 2 1 -o 0.25 0.5 wood.png\nmap_d wood.png\n")
    read, material = authored(tmp_path, model / "square.obj", 1)
    opacity, uv = looked_up(material.opacity, read)
    assert np.allclose(opacity, uv_to_color(uv, picture)[:, 3:] / 255, rtol=0, atol=FLOAT32)
    moved = (uv * (2, 1) + (0.25, 0.5)) % 1
    inside = (np.abs(moved * BLOCKS - np.round(moved * BLOCKS)) > EDGE).all(1)
    color, _ = looked_up(material.diffuse_color, read)
    texels = linear(uv_to_color(moved, picture)[:, :3] / 255) * (0.5, 1, 0.25)
    assert inside.sum() > 100
    assert np.allclose(color[inside], texels[inside], rtol=0, atol=FLOAT32)


def test_blended_alpha_is_a_share_of_presence(tmp_path: Path, model: Path) -> None:
    square(baseColorTexture=Image.fromarray(PICTURE), alphaMode="BLEND").export(model / "square.glb")
    _, material = authored(tmp_path, model / "square.glb")
    assert material.opacity_mode == PRESENCE
    assert isinstance(material.opacity, Texture)


def test_a_plys_colours_are_interpolated_between_its_vertices(tmp_path: Path, model: Path) -> None:
    mesh = square()
    colors = np.array([[255, 0, 0, 255], [0, 128, 0, 255], [0, 0, 64, 255], [9, 99, 199, 255]], np.uint8)
    mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=colors)
    mesh.export(model / "square.ply")
    read, material = authored(tmp_path, model / "square.ply", 1)
    assert isinstance(material.diffuse_color, Primvar)
    found = values_at(material.diffuse_color, read, np.array([0, 1], np.int32), np.array([[0.25, 0.5, 0.25]] * 2))
    at_corner = linear(colors[FACES, :3] / 255)
    assert np.allclose(found, np.einsum("k,fkc->fc", [0.25, 0.5, 0.25], at_corner), rtol=0, atol=FLOAT32)
