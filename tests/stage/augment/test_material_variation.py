"""material.NAME.variation: another appearance of the same kind of material, within what the library says of it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Usd

from spin_usd.basics.resources import bundled, stages
from spin_usd.commands.author.augment import augment_stage
from spin_usd.commands.author.in_child import author_stage
from spin_usd.errors import InputError
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Texture
from spin_usd.stage.augment.material_variation import DARKEST
from spin_usd.stage.check.check_stage import check_stage
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.craft import craft_in

POSES = stages() / "examples" / "tango_speedplus_poses.json"
FLOAT32 = 1e-6
OWN_BIAS = 0.19  # of the image of gold_foil's roughness


@pytest.fixture(scope="module")
def authored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("craft")
    given: dict[str, Any] = {"target": craft_in(folder), "materials": "auto"}
    return Path(author_stage(poses=POSES, camera="speedplus", out=folder / "stage", **given).root)


def materials(root: Path, variant: str) -> list[dict[str, Material]]:
    """Those of each picture, by their prims' names."""
    reader = StageReader(root, variant=variant)
    found = (reader.scene(frame).bodies[0].target.materials for frame in reader.frames)
    return [{each.path.rpartition("/")[2]: each for each in picture} for picture in found]


def limits(name: str) -> dict[str, Any]:
    stage = Usd.Stage.Open(str(bundled("material", name)))
    said: dict[str, Any] = stage.GetDefaultPrim().GetCustomData()["spin"]
    return said


def test_a_foil_stays_a_foil_and_cells_stay_cells(authored: Path) -> None:
    augment_stage(stage=authored, spec="random_materials")
    pictures = materials(authored, "random_materials")
    foils = [each["gold_foil"] for each in pictures]
    of_foil = limits("gold_foil")
    colors = np.array(of_foil["colors"])
    for foil in foils:
        assert foil.metallic == 1
        shares = np.array(foil.diffuse_color) / colors
        assert any(np.ptp(share) < 1e-4 and DARKEST - 1e-4 < share.mean() < 1 + 1e-4 for share in shares)
        assert isinstance(foil.roughness, Texture)
        middle = of_foil["middle"] + foil.roughness.bias[0] - OWN_BIAS
        low, high = of_foil["roughness"]
        assert low - FLOAT32 <= middle <= high + FLOAT32
        assert isinstance(foil.normal, Texture)
        low, high = of_foil["scale"]
        size = np.hypot(*foil.normal.coordinates.matrix[:2]) * of_foil["pattern"][0]
        assert 1 / high - FLOAT32 <= size <= 1 / low + FLOAT32
    assert len({foil.key for foil in foils}) == len(pictures)
    assert len({foil.normal.coordinates.matrix for foil in foils}) == len(pictures)
    cells = [each["solar_cell"] for each in pictures]
    assert all(isinstance(each.diffuse_color, Texture) for each in cells)
    assert len({each.diffuse_color.scale for each in cells}) == len(pictures)


@pytest.mark.parametrize("target", ["cubesat", "microsat"])
def test_what_is_drawn_can_be_rendered_whatever_is_drawn(tmp_path: Path, target: str) -> None:
    """Paints too, whose roughness is an image with bright spots."""
    given: dict[str, Any] = {"target": target, "materials": "auto", "augment": "random_materials"}
    root = Path(author_stage(poses=POSES, camera="speedplus", out=tmp_path / "stage", **given).root)
    assert not [finding for finding in check_stage(root) if finding.severity == "error"]


def test_what_is_not_of_the_library_may_be_anything_without_images(authored: Path) -> None:
    augment_stage(stage=authored, spec="random_materials")
    flags = [each["Flag"] for each in materials(authored, "random_materials")]
    assert all(isinstance(each.diffuse_color, tuple) for each in flags)
    assert len({each.diffuse_color for each in flags}) > 3
    assert {each.metallic for each in flags} <= {0.0, 0.5, 1.0}


def specified(folder: Path, name: str, value: float) -> Path:
    path = folder / "spec.toml"
    sample = f'"material.{name}.variation" = {{ distribution = "fixed", value = {value} }}'
    path.write_text(f'schema = "augment-1"\n[[augmentation]]\nname = "v"\n[augmentation.sample]\n{sample}\n')
    return path


def test_one_number_is_one_appearance(authored: Path, tmp_path: Path) -> None:
    found: dict[float, set[str]] = {}
    for value in (0.25, 0.5, 0.25):
        augment_stage(stage=authored, spec=specified(tmp_path, "gold_foil", value))
        first, *others = materials(authored, "v")
        assert all(each["gold_foil"] == first["gold_foil"] for each in others)
        found.setdefault(value, set()).add(first["gold_foil"].key)
    assert [len(keys) for keys in found.values()] == [1, 1]
    assert found[0.25] != found[0.5]


@pytest.mark.parametrize(
    ("name", "value", "says"), [("gold_foil", 1.5, "1.5"), ("gold", 0.5, "no target has a material")]
)
def test_a_wrong_one_is_refused(authored: Path, tmp_path: Path, name: str, value: float, says: str) -> None:
    with pytest.raises(InputError, match=says):
        augment_stage(stage=authored, spec=specified(tmp_path, name, value))
