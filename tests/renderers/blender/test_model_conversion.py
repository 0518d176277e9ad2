"""What a model in Blender lacks or loses: images of other machines, textures without a file, edges without faces."""

import bpy
import numpy as np
import pytest

from spin_usd.renderers.blender.model_conversion import _as_rendered, _without_images_from_elsewhere
from tests.cases.png import png


@pytest.fixture(autouse=True)
def _empty() -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)


@pytest.mark.parametrize("named", [r"C:\art\RAL 9010.png", "//textures/RAL 9010.png", "/home/me/RAL 9010.png"])
def test_an_image_beside_the_model_stands_for_the_path_of_another_machine(tmp_path, named) -> None:
    (tmp_path / "RAL 9010.png").write_bytes(png(np.zeros((2, 2, 3)), color=2))
    image = bpy.data.images.load(str(tmp_path / "RAL 9010.png"))
    image.filepath = named
    assert list(_without_images_from_elsewhere(tmp_path, tmp_path)) == []
    assert image.filepath == str(tmp_path / "RAL 9010.png")


@pytest.mark.parametrize("named", ["", "folder"])
def test_a_texture_that_names_no_file_is_left_out_as_such(tmp_path, named) -> None:
    (tmp_path / "a.png").write_bytes(png(np.zeros((2, 2, 3)), color=2))
    image = bpy.data.images.load(str(tmp_path / "a.png"))
    image.filepath = f"{tmp_path}/" if named else ""
    assert list(_without_images_from_elsewhere(tmp_path, tmp_path)) == [
        "a texture of the model names no file, and was left out"
    ]
    assert not bpy.data.images


@pytest.mark.parametrize(("edges", "noted"), [([(0, 3)], 1), ([], 0)])
def test_edges_without_faces_are_noted(edges, noted) -> None:
    mesh = bpy.data.meshes.new("wire")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0), (3, 3, 0)], edges, [(0, 1, 2)])
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("wire", mesh))
    assert list(_as_rendered()) == ["the edges of 'wire' that have no faces were left out"] * noted
