"""What describes an asset names no file: its identifier is what it is called where it came from."""

import pytest
from pxr import Sdf

from spin_usd.errors import StageError
from spin_usd.stage.check.check_stage import layer_findings
from spin_usd.stage.composition.copy_stage import copy_stage
from spin_usd.stage.composition.files import files_of
from spin_usd.stage.composition.open_stage import open_stage

DESCRIBED = """#usda 1.0
(
    customLayerData = {{
        asset from = @{name}@
    }}
)
def Xform "W" (
    assetInfo = {{
        asset identifier = @{name}@
        asset[] payloadAssetDependencies = [@{name}@]
    }}
    customData = {{
        asset source = @{name}@
    }}
)
{{
    {opened}
}}
"""
ANYWHERE = ["W/W.usda", "/studio/W.usda", "../../W.usda", "https://studio.example/W.usda"]


def written(tmp_path, name, opened=""):
    path = tmp_path / "models" / "craft.usda"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(DESCRIBED.format(name=name, opened=opened))
    return path


@pytest.mark.parametrize("name", ANYWHERE)
def test_a_description_names_no_file(tmp_path, name) -> None:
    path = written(tmp_path, name)
    assert files_of(path).missing == ()
    copied = copy_stage(path, tmp_path / "copy")
    stage = open_stage(copied)
    assert "path-not-anchored" not in {finding.code for finding in layer_findings(stage)}


@pytest.mark.parametrize("name", ANYWHERE)
def test_nor_does_it_in_a_package(tmp_path, name) -> None:
    writer = Sdf.ZipFileWriter.CreateNew(str(tmp_path / "craft.usdz"))
    writer.AddFile(str(written(tmp_path, name)), "craft.usda")
    assert writer.Save()
    assert open_stage(tmp_path / "craft.usdz").GetPrimAtPath("/W")


@pytest.mark.parametrize(
    "opened", ["asset texture = @{}@", "asset[] textures = [@{}@]", "asset texture.timeSamples = {{0: @{}@}}"]
)
def test_what_is_opened_under_the_same_name_still_is_looked_up(tmp_path, opened) -> None:
    assert files_of(written(tmp_path, "W/W.usda", opened.format("W/W.usda"))).missing
    with pytest.raises(StageError, match="the absolute path"):
        files_of(written(tmp_path, "/studio/W.usda", opened.format("/studio/W.usda")))
