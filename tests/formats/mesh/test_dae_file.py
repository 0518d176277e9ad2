"""COLLADA, by its own words: units, the order of transforms, instances, kinds of faces, materials. Sizes of 20 real
files agreed with assimp 5.2.5 and pycollada 0.9.3 when this was written."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.formats.mesh.dae_document import unit_of
from spin_usd.formats.mesh.mesh_bounds import mesh_bounds
from spin_usd.formats.mesh.mesh_file import read_mesh_file
from spin_usd.scene.asset import MeshAsset
from spin_usd.scene.material import PRESENCE
from tests.formats.mesh.conftest import png

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
TRIANGLES = '<triangles count="2" material="skin">{inputs}<p>0 0 0 1 0 1 2 0 2 0 0 0 2 0 2 3 0 3</p></triangles>'
INPUTS = (
    '<input semantic="VERTEX" source="#square-vertices" offset="0"/>'
    '<input semantic="NORMAL" source="#up" offset="1"/><input semantic="TEXCOORD" source="#st" offset="2" set="3"/>'
)
BOUND = (
    '<bind_material><technique_common><instance_material symbol="skin" target="#foil">'
    '<bind_vertex_input semantic="UV" input_semantic="TEXCOORD" input_set="3"/>'
    "</instance_material></technique_common></bind_material>"
)
INSTANCE = f'<instance_geometry url="#square">{BOUND}</instance_geometry>'
PHONG = (
    "<emission><color>0 0 0 1</color></emission>"
    '<diffuse><texture texture="sampler" texcoord="UV"/></diffuse>'
    "<specular><color>0.5 0.5 0.5 1</color></specular><shininess><float>48</float></shininess>"
)


def source(name: str, values: np.ndarray, columns: str) -> str:
    params = "".join(f'<param name="{each}" type="float"/>' for each in columns)
    accessor = f'<accessor source="#{name}-a" count="{len(values)}" stride="{len(columns)}">{params}</accessor>'
    numbers = " ".join(map(repr, values.ravel().tolist()))
    array = f'<float_array id="{name}-a" count="{values.size}">{numbers}</float_array>'
    return f'<source id="{name}">{array}<technique_common>{accessor}</technique_common></source>'


def dae(
    folder: Path,
    *,
    nodes: str = f'<node name="left">{INSTANCE}</node>',
    faces: str = TRIANGLES,
    shading: str = f"<phong>{PHONG}</phong>",
    asset: str = '<unit meter="0.01" name="centimetre"/><up_axis>Z_UP</up_axis>',
    library: str = "",
    head: str = "",
) -> Path:
    """A square with a material and a texture, and what else a test says."""
    mesh = (
        source("corners", SQUARE, "XYZ") + source("up", np.array([[0.0, 0, 1]]), "XYZ") + source("st", SQUARE, "STP")
        + '<vertices id="square-vertices"><input semantic="POSITION" source="#corners"/></vertices>'
        + faces.format(inputs=INPUTS)
    )  # fmt: skip
    params = (
        '<newparam sid="surface"><surface type="2D"><init_from>picture</init_from></surface></newparam><newparam '
        'sid="sampler"><sampler2D><source>surface</source><wrap_s>MIRROR</wrap_s></sampler2D></newparam>'
    )
    effect = f'<effect id="e"><profile_COMMON>{params}<technique>{shading}</technique></profile_COMMON></effect>'
    path = folder / "model.dae"
    path.write_text(
        f'<?xml version="1.0"?>{head}<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f"<asset>{asset}</asset>"
        '<library_images><image id="picture"><init_from>my%20foil.png</init_from></image></library_images>'
        f"<library_effects>{effect}</library_effects>"
        '<library_materials><material id="foil" name="Foil"><instance_effect url="#e"/></material></library_materials>'
        f'<library_geometries><geometry id="square" name="panel"><mesh>{mesh}</mesh></geometry></library_geometries>'
        f'{library}<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    )
    (folder / "my foil.png").write_bytes(png(np.full((2, 2, 4), 200)))
    return path


def corners(asset: MeshAsset) -> list[list[list[float]]]:
    return [part.points[part.face_indices].round(12).tolist() for part in asset.parts]


def test_points_are_in_metres_in_the_axes_of_the_file(tmp_path: Path) -> None:
    path = dae(tmp_path)
    (part,) = read_mesh_file(path).parts
    assert part.name == "panel"
    np.testing.assert_allclose(part.points, SQUARE / 100, rtol=1e-15)
    assert np.array_equal(part.normals, np.tile([0, 0, 1], (6, 1)))
    assert np.array_equal(part.primvars["st"], SQUARE[[0, 1, 2, 0, 2, 3], :2])
    np.testing.assert_allclose(read_mesh_file(path, 10).parts[0].points, SQUARE / 10, rtol=1e-15)
    np.testing.assert_allclose(read_mesh_file(dae(tmp_path, asset=""), 1).parts[0].points, SQUARE, rtol=1e-15)
    assert unit_of(dae(tmp_path, asset="")) is None
    assert unit_of(dae(tmp_path)) == 0.01
    assert mesh_bounds(path, None) is None, "trimesh forgets the unit, where it reads the file at all"


@pytest.mark.parametrize("unit", ["0", "-1", "wide", "nan", "inf"])
def test_a_unit_that_is_none_is_refused(tmp_path: Path, unit: str) -> None:
    with pytest.raises(InputError, match=rf"model\.dae: has a unit of '{unit}' metres"):
        read_mesh_file(dae(tmp_path, asset=f'<unit meter="{unit}"/>'))


def test_the_first_transform_of_a_node_is_the_outermost(tmp_path: Path) -> None:
    """Translated after it is turned after it is scaled; below a matrix of rows."""
    node = (
        "<node><matrix>1 0 0 0  0 1 0 0  0 0 1 7  0 0 0 1</matrix><node><translate>10 0 0</translate>"
        f"<rotate>0 0 2 90</rotate><scale>2 1 1</scale>{INSTANCE}</node></node>"
    )
    (part,) = read_mesh_file(dae(tmp_path, nodes=node), 1).parts
    np.testing.assert_allclose(part.points, [(10, 0, 7), (10, 2, 7), (9, 2, 7), (9, 0, 7)], atol=1e-12)
    assert part.normals is not None
    np.testing.assert_allclose(part.normals, np.tile([0, 0, 1], (6, 1)), atol=1e-12)


def test_a_mirrored_face_is_seen_from_its_other_side(tmp_path: Path) -> None:
    (part,) = read_mesh_file(dae(tmp_path, nodes=f"<node><scale>-1 1 1</scale>{INSTANCE}</node>"), 1).parts
    a, b, c = part.points[part.face_indices[:3]]
    assert np.cross(b - a, c - a)[2] > 0
    assert np.array_equal(part.primvars["st"], part.points[part.face_indices][:, :2] * (-1, 1))


def test_instances_are_parts_by_their_nodes_names(tmp_path: Path) -> None:
    library = f'<library_nodes><node id="wing" name="wing">{INSTANCE}</node></library_nodes>'
    shift = "<translate>0 0 {}</translate>"
    nodes = "".join(f'<node>{shift.format(z)}<instance_node url="#wing"/></node>' for z in (1, 2))
    asset = read_mesh_file(dae(tmp_path, nodes=nodes, library=library), 1)
    assert [part.name for part in asset.parts] == ["wing", "wing_1"]
    assert [part.points[0, 2] for part in asset.parts] == [1, 2]
    assert len(asset.materials) == 1


@pytest.mark.parametrize(
    ("faces", "counts"),
    [
        ('<polylist count="1"><vcount>4</vcount>{inputs}<p>0 0 0 1 0 1 2 0 2 3 0 3</p></polylist>', [4]),
        ("<polygons>{inputs}<p>0 0 0 1 0 1 2 0 2 3 0 3</p><p>0 0 0 1 0 1 2 0 2</p></polygons>", [4, 3]),
        ("<tristrips>{inputs}<p>0 0 0 1 0 1 3 0 3 2 0 2</p></tristrips>", [3, 3]),
        ("<trifans>{inputs}<p>0 0 0 1 0 1 2 0 2 3 0 3</p></trifans>", [3, 3]),
    ],
)
def test_each_kind_of_faces_is_read_and_faces_the_viewer(tmp_path: Path, faces: str, counts: list[int]) -> None:
    (part,) = read_mesh_file(dae(tmp_path, faces=faces), 1).parts
    assert part.face_counts.tolist() == counts
    for start in part.face_starts:
        a, b, c = part.points[part.face_indices[start : start + 3]]
        assert np.cross(b - a, c - a)[2] > 0
    assert np.array_equal(part.primvars["st"], part.points[part.face_indices][:, :2])


def test_a_phong_material_with_its_texture(tmp_path: Path) -> None:
    asset = read_mesh_file(dae(tmp_path))
    (material,) = asset.materials
    image = material.images["diffuseColor"]
    assert (image.file.name, image.color_space, image.wrap, image.primvar) == (
        "my foil.png", "sRGB", ("mirror", "repeat"), "st",
    )  # fmt: skip
    assert material.constants.path == "Foil"
    assert material.constants.roughness == pytest.approx((2 / 50) ** 0.25)
    head_on = ((material.constants.ior - 1) / (material.constants.ior + 1)) ** 2  # type: ignore[operator]
    assert head_on == pytest.approx(0.04)
    assert asset.notes == ()


@pytest.mark.parametrize(
    ("said", "opacity"),
    [
        ("<transparency><float>0.25</float></transparency>", 0.25),
        ("<transparent><color>1 1 1 0.5</color></transparent><transparency><float>0.5</float></transparency>", 0.25),
        ('<transparent opaque="RGB_ZERO"><color>0.75 0.75 0.75 1</color></transparent>', 0.25),
        ('<transparent opaque="RGB_ZERO"><color>0 0 0 1</color></transparent>', 1),
        ("<transparency><float>0</float></transparency>", 1),
    ],
)
def test_transparency_is_opacity_by_its_mode(tmp_path: Path, said: str, opacity: float) -> None:
    (material,) = read_mesh_file(dae(tmp_path, shading=f"<lambert>{said}</lambert>")).materials
    assert material.constants.opacity == pytest.approx(opacity, abs=1e-5)
    assert (material.constants.opacity_mode == PRESENCE) == (opacity < 1)


@pytest.mark.parametrize(
    ("tool", "more", "metallic"),
    [
        (
            "Blender 3.6.2 commit date:2023-08-16",
            "<index_of_refraction><float>1.45</float></index_of_refraction>",
            0.75,
        ),
        ("Blender 2.90.1 commit date:2020-09-23", "", 0.0),
        ("FBX COLLADA exporter", "<index_of_refraction><float>1.45</float></index_of_refraction>", 0.0),
    ],
)
def test_what_blender_writes_as_reflectivity_is_metal(tmp_path: Path, tool: str, more: str, metallic: float) -> None:
    """As exports of Blender 3.4 have it: without nodes it is a specular intensity."""
    said = f'<reflectivity><float sid="specular">0.75</float></reflectivity>{more}'
    asset = f'<contributor><authoring_tool>{tool}</authoring_tool></contributor><unit meter="1" name="meter"/>'
    (material,) = read_mesh_file(dae(tmp_path, shading=f"<lambert>{said}</lambert>", asset=asset)).materials
    assert material.constants.metallic == metallic


BOMB = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'


@pytest.mark.parametrize("head", [BOMB, '<!DOCTYPE x SYSTEM "file:///etc/hostname">'])
def test_what_declares_entities_is_refused(tmp_path: Path, head: str) -> None:
    with pytest.raises(InputError, match=r"model\.dae: has a DOCTYPE"):
        read_mesh_file(dae(tmp_path, head=head))


def test_a_node_that_instances_itself_and_what_doubles_without_end_are_refused(tmp_path: Path) -> None:
    library = '<library_nodes><node id="n0"><instance_node url="#n0"/></node></library_nodes>'
    nodes = '<node><instance_node url="#n0"/></node>'
    with pytest.raises(InputError, match="instances itself"):
        read_mesh_file(dae(tmp_path, nodes=nodes, library=library))
    one = '<instance_node url="#n{}"/>'
    twice = "".join(f'<node id="n{n}">{one.format(n + 1) * 2}</node>' for n in range(60))
    with pytest.raises(InputError, match="too many"):
        read_mesh_file(dae(tmp_path, nodes=nodes, library=f"<library_nodes>{twice}</library_nodes>"))


def test_other_xml_and_files_that_are_cut_are_refused(tmp_path: Path) -> None:
    path = dae(tmp_path)
    path.write_text(path.read_text()[:-300])
    with pytest.raises(InputError, match=r"model\.dae: is damaged"):
        read_mesh_file(path)
    path.write_text("<svg/>")
    with pytest.raises(InputError, match="XML of a <svg>"):
        read_mesh_file(path)
    path.write_text("<a>" * 10**5)
    with pytest.raises(InputError, match="nested"):
        read_mesh_file(path)


@pytest.mark.parametrize("step", [pytest.param(1, marks=pytest.mark.slow), 6])
def test_every_change_is_read_or_refused_in_one_sentence(tmp_path: Path, step: int) -> None:
    """Each element left out, twice or with another text, each attribute with another value or none."""
    path = dae(tmp_path)
    tree = ElementTree.parse(path)
    texts = ("", "7", "-1", "0.5 x", "nan", "1e999", "9" * 30, "#square")
    places = [(each, None) for each in tree.iter()] + [(each, name) for each in tree.iter() for name in each.attrib]
    tried = refused = 0

    def attempt() -> int:
        tree.write(path)
        try:
            read_mesh_file(path)
        except InputError:
            return 1
        return 0

    for number, (each, name) in enumerate(places):
        for text in texts[number % step :: step]:
            kept = each.text if name is None else each.attrib[name]
            if name is None:
                each.text = text
            else:
                each.attrib[name] = text
            refused, tried = refused + attempt(), tried + 1
            if name is None:
                each.text = kept
            else:
                each.attrib[name] = str(kept)
    for number, parent in enumerate(tree.iter()):
        for at, child in list(enumerate(parent))[number % step :: step]:
            parent.remove(child)
            refused, tried = refused + attempt(), tried + 1
            parent.insert(at, child)
    assert refused > tried / 10
    assert not attempt()
