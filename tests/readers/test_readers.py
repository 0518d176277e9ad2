"""What users read pictures with gives back, to the bit, what was rendered: ten pictures, five readers."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from spin_usd.formats.image_file import read_image
from spin_usd.labels.table import NEEDS, PIXEL_LABELS
from spin_usd.picture.make_picture import Stopwatch, make_labels
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.stage.read.stage_reader import StageReader
from tests.conftest import REPOSITORY, speedplus_camera

pytestmark = pytest.mark.slow

SNIPPETS = re.findall(
    r"^```python\n(.*?)^```", (REPOSITORY / "docs" / "reference" / "dataset.md").read_text(), re.MULTILINE | re.DOTALL
)
FULL_SCALE = {np.dtype(np.uint8): 255, np.dtype(np.uint16): 65535}
PICTURES = 10
OF_ONE_CAMERA = {name: label for name, label in PIXEL_LABELS.items() if name not in NEEDS}
EXR_LABELS = [label for label in OF_ONE_CAMERA.values() if label.suffix == ".exr"]


@pytest.fixture(scope="module")
def stage(tmp_path_factory, spin_usd):
    """Ten pictures of Tango at 240 x 150: SPEED+'s eight example poses, and two of them again."""
    folder = tmp_path_factory.mktemp("readers")
    poses = json.loads((REPOSITORY / "stages" / "examples" / "tango_speedplus_poses.json").read_text())
    poses += [{**pose, "filename": f"again{i}.jpg"} for i, pose in enumerate(poses[: PICTURES - len(poses)])]
    (folder / "poses.json").write_text(json.dumps(poses))
    (folder / "camera.json").write_text(json.dumps(speedplus_camera(divide=8)))
    given = ("--poses", folder / "poses.json", "--camera", folder / "camera.json", "--target", "tango")
    spin_usd("author", *given, "--out", folder / "stage")
    return folder / "stage" / "dataset.usda"


@pytest.fixture(scope="module")
def dataset(stage, spin_usd):
    out = stage.parent.parent / "my_dataset"
    spin_usd("render", stage, "--out", out, "--renderer", "raycast", "--labels", "all", "--radiance")
    return out


@pytest.fixture(scope="module")
def rendered(stage, dataset):
    """The arrays by path: labels as they are made, not as they lie in files; images and radiance as we read them."""
    reader, caster, found = StageReader(stage), EmbreeCaster(), {}
    for frame in reader.frames:
        scene = reader.scene(frame, views={"next_frame"})
        for kind, array, _ in make_labels(scene, caster, tuple(OF_ONE_CAMERA), Stopwatch(), caster):
            found[f"{kind}/nominal/{frame.name}"] = array
        for path in (dataset / "image" / "nominal" / f"{frame.name}.png", dataset / "radiance" / "nominal" / f"{frame.name}.exr"):  # fmt: skip  # noqa: E501
            found[str(path.relative_to(dataset).with_suffix(""))] = read_image(path)[0]
    assert len(found) == (len(OF_ONE_CAMERA) + 2) * PICTURES
    return found


def read(python, reader, dataset, out):
    """What `reader` makes of the dataset's files, by path."""
    script = Path(__file__).with_name("read_pictures.py")
    subprocess.run([python, script, reader, dataset, out], check=True, capture_output=True, text=True)
    return {str(path.relative_to(out).with_suffix("")): np.load(path) for path in out.rglob("*.npy")}


@pytest.mark.parametrize("reader", ["opencv", "openimageio", "imageio", "openexr"])
def test_it_reads_what_was_rendered(reader, readers, dataset, rendered, tmp_path) -> None:
    found = read(readers, reader, dataset, tmp_path)
    assert len(found) == PICTURES * (len(EXR_LABELS) + 1 if reader == "openexr" else len(OF_ONE_CAMERA) + 2)
    for path, array in found.items():
        assert array.dtype == rendered[path].dtype, path
        assert array.tobytes() == rendered[path].tobytes(), path


def test_blender_reads_what_was_rendered(dataset, rendered, tmp_path) -> None:
    """As R, G, B and A, a lone channel in each of the first three; of a PNG in the unit range."""
    found = read(sys.executable, "blender", dataset, tmp_path)
    assert len(found) == PICTURES * (len(OF_ONE_CAMERA) + 2)
    for path, array in found.items():
        wanted = rendered[path]
        planes = np.repeat(wanted[..., None], 3, -1) if wanted.ndim == 2 else wanted
        if full_scale := FULL_SCALE.get(planes.dtype):
            array = np.rint(array * full_scale)
        np.testing.assert_array_equal(array[..., : planes.shape[-1]], planes, err_msg=path)


def test_the_loader_in_the_documents_works(readers, dataset, rendered, tmp_path) -> None:
    (loader,) = SNIPPETS
    keep = f"import numpy; numpy.savez({str(tmp_path / 'loaded.npz')!r}, image=image, parts=parts, depth=depth, x=x, y=y, z=z, q=q, t=t)"  # fmt: skip  # noqa: E501
    subprocess.run([readers, "-c", loader + keep], check=True, cwd=dataset.parent)
    loaded = np.load(tmp_path / "loaded.npz")
    image, parts, depth, body = (rendered[f"{kind}/nominal/img000001"] for kind in ("image", "segmentation", "depth", "dense_pose"))  # fmt: skip  # noqa: E501
    wanted = {"image": image, "parts": parts, "depth": depth, **dict(zip("xyz", np.moveaxis(body, -1, 0), strict=True))}
    for name, array in wanted.items():
        np.testing.assert_array_equal(loaded[name], array, err_msg=name)
    pose = json.loads((dataset / "records" / "nominal" / "img000001.json").read_text())["pose"]
    assert (loaded["q"].tolist(), loaded["t"].tolist()) == (pose["q_cam_body"], pose["t_cam_body"])
