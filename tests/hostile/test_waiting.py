"""Nothing is waited for that does not come, and nothing is read without a bound."""

import os
import subprocess
import sys

import pytest

from tests.hostile.conftest import RECORD, slow
from tests.hostile.test_outside import HEAD

pytestmark = [pytest.mark.children, pytest.mark.timeout(60)]
CACHED = "cache/depth"  # the first file below it


def pipe_at(place, name):
    path = next((place.dataset / name).rglob("*.exr")) if name == CACHED else place.dataset / name
    path.unlink()
    os.mkfifo(path)


@pytest.mark.parametrize(
    "name", [RECORD, "dataset.json", slow("cache/measured.json"), slow(CACHED), slow("stage/dataset.usda")]
)
def test_a_pipe_in_a_dataset_is_refused_by_render(place, spin_usd, name) -> None:
    pipe_at(place, name)
    if name == CACHED:
        (place.dataset / RECORD).unlink()
    spin_usd(*place.render(), cwd=place.folder, code=2)


@pytest.mark.parametrize("name", [RECORD, slow("cache/measured.json"), slow(CACHED)])
def test_a_pipe_in_a_dataset_is_a_finding(place, spin_usd, name) -> None:
    pipe_at(place, name)
    found = spin_usd("check", "ds", cwd=place.folder, code=1)
    assert "is a pipe" in found.stdout + found.stderr


def test_a_pipe_in_the_cache_does_not_hold_up_a_plan(place, spin_usd) -> None:
    pipe_at(place, "cache/measured.json")
    spin_usd("plan", "st", "--renderer", "raycast", "--out", "ds", cwd=place.folder, code=2)


@pytest.mark.parametrize(
    ("option", "name"),
    [
        *(("--poses", "p.json"), ("--target", "t.obj"), slow("--lights", "l.usda"), slow("--camera", "c.json")),
        *(slow("--target", "t.usda"), slow("--keypoints", "k.csv"), slow("--parts", "p.toml")),
        *(slow("--lidar", "l.toml"), slow("--augment", "a.toml")),
    ],
)
def test_a_pipe_as_an_input_of_author_is_refused_at_once(place, spin_usd, option, name) -> None:
    os.mkfifo(place.folder / name)
    refused = spin_usd(*place.author(option, name), cwd=place.folder, code=2)
    assert name in refused.stderr
    assert not [p for p in place.folder.iterdir() if p.name.startswith(".")]


@pytest.mark.parametrize(
    ("option", "device"),
    [
        ("--poses", "/dev/urandom"),
        ("--camera", "/dev/zero"),
        slow("--poses", "/dev/zero"),
        slow("--camera", "/dev/urandom"),
    ],
)
def test_an_endless_device_as_an_input_of_author_is_refused_at_once(place, spin_usd, option, device) -> None:
    (place.folder / "d.json").symlink_to(device)
    assert "d.json" in spin_usd(*place.author(option, "d.json"), cwd=place.folder, code=2).stderr


def test_a_target_that_refers_to_a_pipe_is_refused(place, spin_usd) -> None:
    os.mkfifo(place.folder / "p.usda")
    (place.folder / "t.usda").write_text(HEAD + 'def "A" (prepend references = @./p.usda@)\n{\n}\n')
    assert "p.usda" in spin_usd(*place.author("--target", "t.usda"), cwd=place.folder, code=2).stderr


def doubling():
    """2.6 kB of references that double thirty times."""
    prims = (
        f'def "D{i}"\n{{\ndef "A" (references = </D{i + 1}>)\n{{\n}}\ndef "B" (references = </D{i + 1}>)\n{{\n}}\n}}\n'
        for i in range(30)
    )
    return HEAD + 'def "A" (references = </D0>)\n{\n}\n' + "".join(prims) + 'def Cube "D30"\n{\n}\n'


def test_a_model_of_8_gib_is_refused_before_it_is_read(place, spin_usd) -> None:
    (place.folder / "a.glb").write_bytes(b"glTF")
    os.truncate(place.folder / "a.glb", 1 << 33)
    assert "a.glb" in spin_usd(*place.author("--target", "a.glb"), cwd=place.folder, code=2).stderr


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_doubling_references_in_a_target_end_and_leave_nothing(place, spin_usd) -> None:
    (place.folder / "t.usda").write_text(doubling())
    spin_usd(*place.author("--target", "t.usda"), cwd=place.folder, code=2)
    assert not (place.folder / "out").exists()
    assert not [p for p in place.folder.iterdir() if p.name.startswith(".")]


def test_a_specification_of_50000_dots_is_refused(place, spin_usd) -> None:
    (place.folder / "deep.toml").write_text("a" + ".a" * 50_000 + " = 1\n")
    refused = spin_usd("augment", "st", "--spec", "deep.toml", cwd=place.folder, code=2)
    assert "deep.toml" in refused.stderr


def groups(place):
    """30,000 groups of a face each."""
    faces = "".join(f"g g{i}\nf 1 2 3\n" for i in range(30_000))
    (place.folder / "groups.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n" + faces)
    return place.author("--target", "groups.obj")


def sparse(place):
    """A layer of a gibibyte that takes no room on the disk."""
    (place.folder / "sparse.usda").write_text("#usda 1.0\n")
    os.truncate(place.folder / "sparse.usda", 1 << 30)
    return ("check", "sparse.usda")


def variants(place):
    """10,000 variants in a set."""
    many = "".join(f'"v{i}" {{\n}}\n' for i in range(10_000))
    shown = 'def Xform "A" (\nvariants = { string look = "v0" }\nprepend variantSets = "look"\n)\n{\n'
    shown += 'variantSet "look" = {\n'
    (place.folder / "variants.usda").write_text(HEAD + shown + many + "}\n}\n")
    return ("check", "variants.usda")


def instances(place):
    """A million instances."""
    count = 1_000_000
    indices, positions = (", ".join([each] * count) for each in ("0", "(0, 0, 0)"))
    (place.folder / "instances.usda").write_text(
        HEAD + 'def Xform "A"\n{\ndef PointInstancer "I"\n{\n'
        f"int[] protoIndices = [{indices}]\npoint3f[] positions = [{positions}]\n"
        'rel prototypes = </A/I/P>\ndef Sphere "P"\n{\n}\n}\n}\n'
    )
    return place.author("--target", "instances.usda")


@pytest.mark.slow
@pytest.mark.timeout(120)
@pytest.mark.parametrize("input_of", [groups, sparse, variants, instances])
def test_large_inputs_end_within_their_time(place, spin_usd, input_of) -> None:
    """Each took longer than 20 s once. What they end with is their own affair, but no defect."""
    done = subprocess.run(
        [sys.executable, "-m", "spin_usd.command_line", *input_of(place)],
        cwd=place.folder,
        capture_output=True,
        text=True,
    )
    assert done.returncode in (0, 1, 2), done.stderr
