"""Nothing outside is read, written or deleted, whatever a dataset, a stage or a target names."""

import json
import shutil

import pytest

from tests.hostile.conftest import RECORD, slow

ELSEWHERE = ["{users}/secret.usda", "../users/secret.usda"]
HEAD = '#usda 1.0\n(\n    defaultPrim = "A"\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n'
TEXTURED = """def Xform "A"
{
    def Cube "Box" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        rel material:binding = </A/M>
    }
    def Material "M"
    {
        token outputs:surface.connect = </A/M/S.outputs:surface>
        def Shader "S"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </A/M/T.outputs:rgb>
            token outputs:surface
        }
        def Shader "T"
        {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @PATH@
            float3 outputs:rgb
        }
    }
}
"""
TARGETS = {
    "reference": 'def "A" (prepend references = @PATH@)\n{\n}\n',
    "payload": 'def "A" (prepend payload = @PATH@)\n{\n}\n',
    "sublayer": "",
    "texture": TEXTURED,
}


def test_links_in_a_dataset_are_not_followed_when_temporary_files_are_removed(place, spin_usd) -> None:
    before = place.contents()
    (place.dataset / "x").mkdir()
    (place.dataset / "x" / "y").symlink_to(place.users)
    spin_usd(*place.render(), cwd=place.folder)
    assert place.contents() == before
    assert (place.users / "run.tmp-1").is_dir()


def test_pruning_follows_no_link(place, spin_usd) -> None:
    before = place.contents()
    (place.dataset / "image" / "old").symlink_to(place.users)
    old = place.dataset / "records" / "old" / "img9.json"
    old.parent.mkdir()
    old.write_text((place.dataset / RECORD).read_text().replace("nominal/img000001", "old/img9"))
    spin_usd(*place.render(), "--prune", cwd=place.folder, code=2)
    assert place.contents() == before


def test_a_cache_elsewhere_is_not_written_or_swept(place, spin_usd) -> None:
    (place.users / "renders" / "ab").mkdir(parents=True)
    (place.users / "renders" / "ab" / "a.b.c.exr").touch()
    before = place.contents()
    shutil.rmtree(place.dataset / "cache")
    (place.dataset / "cache").symlink_to(place.users)
    (place.dataset / RECORD).unlink()
    spin_usd(*place.render(), cwd=place.folder, code=2)
    assert place.contents() == before


@pytest.mark.parametrize("name", ["image", slow("records"), slow(".lock")])
def test_pictures_records_and_locks_elsewhere_are_not_written(place, spin_usd, name) -> None:
    before = place.contents()
    if name == ".lock":
        (place.dataset / name).unlink(missing_ok=True)
        (place.dataset / name).symlink_to(place.users / "new")
    else:
        shutil.rmtree(place.dataset / name)
        (place.dataset / name).symlink_to(place.users)
    spin_usd(*place.render(), cwd=place.folder, code=2)
    assert place.contents() == before
    found = spin_usd("check", "ds", cwd=place.folder, code=1)
    assert f"{name}: is a link" in found.stdout + found.stderr


@pytest.mark.parametrize("path", ELSEWHERE)
@pytest.mark.parametrize("kind", TARGETS)
def test_a_target_takes_no_file_from_outside_its_folder(place, child, kind, path) -> None:
    from spin_usd.commands.author.reports import AUTHOR
    from spin_usd.errors import SpinError

    path = path.replace("{users}", str(place.users))
    if kind == "texture":
        path = path.replace("secret.usda", "img9.png")
    text = HEAD.replace("(\n", f"(\n    subLayers = [@{path}@]\n", 1) if kind == "sublayer" else HEAD + TARGETS[kind]
    (place.folder / "t.usda").write_text(text.replace("PATH", path))
    request = {
        "poses": str(place.folder / "poses.json"),
        "camera": str(place.folder / "camera.json"),
        "target": str(place.folder / "t.usda"),
        "out": str(place.folder / "out"),
        "root": str(place.folder),  # else the folder around it is the model's too
        "units_per_metre": 1.0,
        "any_size": True,
    }
    with pytest.raises(SpinError) as refused:
        child.call(AUTHOR, request)
    assert refused.value.exit_code == 2
    assert not (place.folder / "out").exists()


@pytest.mark.parametrize(
    "root", ["../st/dataset.usda", *map(slow, ("{stage}/dataset.usda", "a" * 5000, "stage/a\0b.usda"))], ids=ascii
)
def test_a_stage_that_a_dataset_names_elsewhere_is_not_opened(place, spin_usd, root) -> None:
    root = root.replace("{stage}", str(place.stage))
    place.change("dataset.json", lambda document: document["stage"].update(root=root))
    place.change(RECORD, lambda record: record["provenance"]["stage"].update(root=root))
    found = spin_usd("check", "ds", cwd=place.folder, code=1)
    assert "does not match" in found.stdout + found.stderr or "stage.root" in found.stdout + found.stderr
    spin_usd("reproduce", "ds", "img000001", cwd=place.folder, code=2)


@pytest.mark.parametrize("name", ["/etc/passwd", slow("../../users/img9.png"), slow("a" * 5000)])
def test_files_that_a_record_names_elsewhere_are_not_hashed(place, spin_usd, name) -> None:
    place.change(RECORD, lambda record: record["provenance"]["stage"].update(files={name: "0" * 64}))
    found = spin_usd("check", "ds", cwd=place.folder, code=1)
    assert "root:" not in found.stdout
    spin_usd("reproduce", "ds", "img000001", cwd=place.folder, code=2)


@pytest.mark.parametrize("frame", ["../nominal/img000001", "{users}/img000001", "a" * 5000, "", ".", "img000001\0"])
def test_a_frame_or_variant_is_a_name_and_no_path(place, spin_usd, frame) -> None:
    frame = frame.replace("{users}", str(place.users))
    for arguments in ((frame,), ("img000001", "--variant", frame)):
        refused = spin_usd("reproduce", "ds", *arguments, cwd=place.folder, code=2)
        assert "Traceback" not in refused.stderr


@pytest.mark.slow
def test_a_digest_does_not_tell_what_an_outside_file_holds(place, spin_usd) -> None:
    """The same answer whether or not the guess is right."""
    from spin_usd.files.sha256 import sha256_of

    said = []
    for guess in ("0" * 64, sha256_of(place.users / "img9.png")):
        files = {"../../users/img9.png": guess}
        place.change(RECORD, lambda record, files=files: record["provenance"]["stage"].update(files=files))
        done = spin_usd("check", "ds", cwd=place.folder, code=1)
        said.append(json.dumps(done.stdout).replace(guess, ""))
    assert said[0] == said[1]
