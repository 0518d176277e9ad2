"""Models that name files beside their own folder: below the folder around it, or --root, and no others."""

import json
from pathlib import Path

import pytest

from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import SpinError
from spin_usd.stage.read.stage_reader import StageReader
from tests.formats.mesh.conftest import png

POSES = [{"filename": "a.jpg", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 10]}]
BODY = '#usda 1.0\n(\ndefaultPrim = "B"\nmetersPerUnit = 1\n)\ndef Cube "B" {}\n'.replace(" {}", "\n{\n}")
CRAFT = """#usda 1.0
(
    defaultPrim = "C"
    metersPerUnit = 1
)
def Xform "C"
{
    def "Part" ( references = @../parts/body.usda@ )
    {
    }
}
"""
OBJ = "mtllib craft.mtl\nusemtl foil\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package as ROS has them: meshes, parts and textures beside one another."""
    for folder in ("package/meshes", "package/parts", "package/textures", "outside"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "poses.json").write_text(json.dumps(POSES))
    (tmp_path / "package/parts/body.usda").write_text(BODY)
    (tmp_path / "outside/body.usda").write_text(BODY)
    (tmp_path / "package/meshes/craft.usda").write_text(CRAFT)
    (tmp_path / "package/meshes/craft.obj").write_text(OBJ)
    (tmp_path / "package/meshes/craft.mtl").write_text("newmtl foil\nmap_Kd ../textures/foil.png\n")
    (tmp_path / "package/textures/foil.png").write_bytes(png([[[200, 150, 20]]]))
    return tmp_path / "package"


def author(package: Path, name: str, **options):
    given = {"poses": package.parent / "poses.json", "out": package.parent / "stage", "camera": "speedplus"}
    return author_stage(target=package / "meshes" / name, **given, **options)


def test_a_package_is_read_whole(package: Path) -> None:
    report = author(package, "craft.usda")
    reader = StageReader(report.root)
    assert reader.scene(reader.frames[0]).bodies[0].target.mesh.size.tolist() == [2, 2, 2]


def test_textures_beside_the_meshes_are_found(package: Path) -> None:
    report = author(package, "craft.obj", units_per_metre=1)
    reader = StageReader(report.root)
    (material,) = reader.scene(reader.frames[0]).bodies[0].target.materials
    assert not isinstance(material.diffuse_color, tuple), "an image"
    assert not [note for note in report.notes if "outside" in note]


def test_what_lies_farther_out_is_refused_unless_root_holds_it(package: Path) -> None:
    craft = package / "meshes" / "craft.usda"
    craft.write_text(CRAFT.replace("../parts", "../../outside"))
    with pytest.raises(SpinError, match=r"lies outside the stage's folder; .*--root FOLDER"):
        author(package, "craft.usda")
    assert author(package, "craft.usda", root=package.parent).frames == 1


def test_root_may_be_narrower_and_must_hold_the_model(package: Path) -> None:
    with pytest.raises(SpinError, match="outside the stage's folder"):
        author(package, "craft.usda", root=package / "meshes")
    with pytest.raises(SpinError, match="is not below --root"):
        author(package, "craft.usda", root=package / "parts")


def test_the_stage_itself_may_not_do_so(package: Path) -> None:
    """Only what is authored from may: a stage that is rendered is a stranger's."""
    with pytest.raises(SpinError, match="outside the stage's folder"):
        StageReader(package / "meshes" / "craft.usda")
