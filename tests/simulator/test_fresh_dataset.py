"""`FreshDataset`: what is drawn is developed as if a stage had been authored and rendered so, and never the same."""

import multiprocessing
import pickle
import shutil
import subprocess
import sys

import numpy as np
import psutil
import pytest
from PIL import Image

from spin_usd import Dataset, FreshDataset, SpinError

DRAWN = """schema = "augment-1"
[[augmentation]]
name = "drawn"
[augmentation.sample]
"sun.factor" = { distribution = "log_uniform", low = 0.3, high = 3 }
"exposure.stops" = { distribution = "normal", mean = 0, sigma = 0.5, unit = "stops" }
"optics.psf_sigma" = { distribution = "uniform", low = 0.3, high = 1, unit = "px" }
"""
NOISE = """
"sensor.gain" = { distribution = "fixed", value = 4, unit = "electrons/step" }
"sensor.read_noise" = { distribution = "uniform", low = 5, high = 20, unit = "electrons" }
"""


@pytest.fixture(scope="module")
def spec(tmp_path_factory):
    file = tmp_path_factory.mktemp("spec") / "drawn.toml"
    file.write_text(DRAWN + NOISE)
    return file


@pytest.fixture(scope="module")
def fresh(rendered, spec):
    return FreshDataset(rendered, spec, seed=5)


@pytest.fixture(scope="module")
def clean(spin_usd, small_stage, tmp_path_factory):
    """A stage by a detector without noise, which each appearance has its own of, and its dataset."""
    folder = tmp_path_factory.mktemp("clean")
    poses, camera = (small_stage.parents[1] / name for name in ("poses.json", "camera.json"))
    spin_usd("author", "--poses", poses, "--target", "cubesat", "--frames", "0:3", "--preset", "ideal",
             "--camera", camera, "--out", folder / "stage")  # fmt: skip
    spin_usd("render", folder / "stage", "--out", folder / "dataset", "--renderer", "raycast", "--samples", "1")
    return folder


def image_of(dataset, place):
    return dataset[place].image


def test_an_image_is_that_of_a_stage_authored_so(clean, spin_usd, tmp_path) -> None:
    spec = tmp_path / "fixed.toml"
    spec.write_text("""schema = "augment-1"
[[augmentation]]
name = "fixed"
[augmentation.sample]
"sun.factor" = { distribution = "fixed", value = 0.4 }
"exposure.stops" = { distribution = "fixed", value = 0.7, unit = "stops" }
"optics.psf_sigma" = { distribution = "fixed", value = 0.9, unit = "px" }
"optics.glare" = { distribution = "fixed", value = 0.05 }
"optics.vignetting" = { distribution = "fixed", value = -0.2 }
"sensor.contrast" = { distribution = "fixed", value = 1.1 }
""")
    stage = shutil.copytree(clean / "stage", tmp_path / "stage") / "dataset.usda"
    spin_usd("augment", stage, "--spec", spec)
    spin_usd("render", stage, "--out", tmp_path / "dataset", "--renderer", "raycast", "--samples", "1",
             "--variants", "fixed")  # fmt: skip
    fresh = FreshDataset(clean / "dataset", spec)
    for place, stored in enumerate(Dataset(tmp_path / "dataset")):
        made = fresh[place]
        np.testing.assert_array_equal(made.image, stored.image)
        assert made.drawn.values["sun.factor"] == 0.4
        np.testing.assert_array_equal(made.depth, stored.depth)


def test_the_same_draw_is_the_same_image_and_any_other_another(fresh, rendered, spec) -> None:
    first = [fresh[place].image for place in range(3)]
    again = FreshDataset(rendered, spec, seed=5)
    for place in (2, 0, 1):
        np.testing.assert_array_equal(again[place].image, first[place])
    others = [FreshDataset(rendered, spec, seed=seed, epoch=epoch)[0] for seed, epoch in ((5, 1), (6, 0), (6, 1))]
    values = [tuple(picture.drawn.values.values()) for picture in (again[0], again[1], *others)]
    assert len({*values}) == 5
    assert len({image.tobytes() for image in (*first, *(picture.image for picture in others))}) == 6


def test_its_draws_are_those_of_the_specification(fresh) -> None:
    found = []
    for epoch in range(60):
        fresh.set_epoch(epoch)
        found += [fresh[place].drawn.values for place in range(3)]
    fresh.set_epoch(0)
    factors = np.log([each["sun.factor"] for each in found])
    assert np.log(0.3) <= factors.min() < np.log(0.4)
    assert np.log(2.2) < factors.max() <= np.log(3)
    stops = np.array([each["exposure.stops"] for each in found])
    assert abs(stops.mean()) < 3 * 0.5 / np.sqrt(len(stops))
    assert stops.std() == pytest.approx(0.5, rel=0.2)


def test_a_crop_is_the_whole_cropped(clean, tmp_path) -> None:
    spec = tmp_path / "drawn.toml"
    spec.write_text(DRAWN)
    fresh = FreshDataset(clean / "dataset", spec)
    small = fresh.crop(size=48)
    for whole, crop in zip(fresh, small, strict=True):
        wanted = crop.window.cut(whole.image, 0, smooth=True)
        np.testing.assert_array_equal(crop.image, wanted)
        np.testing.assert_array_equal(crop.depth, whole.crop(size=48).depth)


def test_noise_of_a_crop_is_that_of_its_detector(fresh, rendered, spec) -> None:
    dark = []
    crops = FreshDataset(rendered, spec, seed=5).crop(size=64)
    for epoch in range(20):
        crops.set_epoch(epoch)
        picture = crops[0]
        background = picture.image[picture.depth == 0]
        dark.append((picture.drawn.values["sensor.read_noise"], float((background > 0).mean())))
    noisy, clean = (np.mean([share for noise, share in dark if (noise > 12.5) is more]) for more in (True, False))
    assert noisy > clean


@pytest.fixture(scope="module")
def photographs(clean):
    """A folder of photographs, which are noise of a mean of their own."""
    (clean / "photos").mkdir()
    for number in range(1, 4):
        noise = np.random.default_rng(number).integers(0, 80 * number, (200, 300, 3), dtype=np.uint8)
        Image.fromarray(noise).save(clean / "photos" / f"{number}.png")
    return clean / "photos"


def test_a_photograph_is_that_of_a_stage_authored_so(clean, photographs, spin_usd, tmp_path) -> None:
    spec, behind = photographs.parent / "behind.toml", "photos/2.png"
    sampled = f'[augmentation.sample]\n"background" = {{ distribution = "fixed", value = "{behind}" }}\n'
    spec.write_text(f'schema = "augment-1"\n[[augmentation]]\nname = "behind"\n{sampled}')
    stage = shutil.copytree(clean / "stage", tmp_path / "stage")
    spin_usd("augment", stage, "--spec", spec)
    spin_usd("render", stage, "--out", tmp_path / "dataset", "--renderer", "raycast", "--samples", "1",
             "--variants", "behind")  # fmt: skip
    fresh = FreshDataset(clean / "dataset", spec)
    for place, stored in enumerate(Dataset(tmp_path / "dataset")):
        np.testing.assert_array_equal(fresh[place].image, stored.image)
        assert fresh[place].drawn.values == {"background": behind}
        assert (stored.image[stored.segmentation == 0] > 0).any()


def test_photographs_are_drawn_for_each_picture_and_epoch(clean, photographs, tmp_path) -> None:
    spec = photographs.parent / "photos.toml"
    sampled = '"background" = { distribution = "choice", folder = "photos" }'
    spec.write_text(f'schema = "augment-1"\n[[augmentation]]\nname = "p"\n[augmentation.sample]\n{sampled}\n')
    fresh = FreshDataset(clean / "dataset", spec, seed=2)
    shown: dict[str, list[float]] = {}
    for epoch in range(4):
        fresh.set_epoch(epoch)
        for place in range(3):
            picture = fresh[place]
            mean = picture.image[picture.segmentation == 0].mean()
            shown.setdefault(picture.drawn.values["background"], []).append(mean)
    assert shown.keys() == {f"photos/{number}.png" for number in range(1, 4)}
    first, second, third = (shown[name] for name in sorted(shown))
    assert max(first) < min(second) < max(second) < min(third)
    spec.write_text(spec.read_text().replace('folder = "photos"', 'values = ["earth"]'))
    with pytest.raises(SpinError, match="background: earth needs a new render"):
        assert FreshDataset(clean / "dataset", spec)[0].image.any()


TOWARDS = {1: [0.3, -0.4, -0.8], 2: [-0.8, 0.1, -0.5], 3: [0.1, 0.9, -0.3]}  # by the Sun's number
EACH = """"sun.factor" = { distribution = "uniform", low = 0.2, high = 0.2, per = "frame" }"""


def appearance(name, towards):
    """An augmentation by Suns in these directions, as strong in each picture."""
    fixed = '"{}" = {{ distribution = "fixed", value = {} }}\n'
    suns = [fixed.format(f"sun.{i}.direction" if i > 1 else "sun.direction", v) for i, v in enumerate(towards, 1)]
    return f'[[augmentation]]\nname = "{name}"\n[augmentation.sample]\n{EACH}\n{"".join(suns)}'


@pytest.fixture(scope="module")
def suns(clean, spin_usd):
    """A dataset of three Suns in one render, and of each in one of its own."""
    alone = "".join(appearance(f"sun{number}", [direction]) for number, direction in TOWARDS.items())
    spec = clean / "suns.toml"
    spec.write_text(f'schema = "augment-1"\n{appearance("three", TOWARDS.values())}{alone}')
    shutil.copytree(clean / "stage", clean / "of_suns")
    spin_usd("augment", clean / "of_suns", "--spec", spec)
    spin_usd("render", clean / "of_suns", "--out", clean / "suns", "--renderer", "raycast", "--variants",
             "three,sun1,sun2,sun3", "--samples", "16")  # fmt: skip
    assert spin_usd("check", clean / "suns").returncode == 0
    return clean / "suns"


def of_variant(dataset, variant):
    return [picture.image for picture in dataset if picture.variant == variant]


def drawn_by(folder, values):
    spec = folder / "drawn.toml"
    lines = "".join(f'"{name}" = {{ distribution = "fixed", value = {value} }}\n' for name, value in values.items())
    spec.write_text(f'schema = "augment-1"\n[[augmentation]]\nname = "drawn"\n[augmentation.sample]\n{lines}')
    return spec


def test_of_several_suns_in_one_render_one_shines(suns, tmp_path) -> None:
    stored = Dataset(suns)
    for number in TOWARDS:
        fresh = FreshDataset(suns, drawn_by(tmp_path, {"sun.shining": number}))
        alone = np.array(of_variant(stored, f"sun{number}"), np.float64)
        chosen = np.array(of_variant(fresh, "three"), np.float64)
        assert alone.mean() > 1
        assert np.abs(chosen.mean((1, 2)) / alone.mean((1, 2)) - 1).max() < 0.01
        assert (np.abs(chosen - alone) > 8).mean() < 0.01  # samples lie elsewhere in edges
    with pytest.raises(SpinError, match="the stage has no Sun 4"):
        assert FreshDataset(suns, drawn_by(tmp_path, {"sun.shining": 4}))[0].image.any()


def test_suns_of_one_render_mix_as_light_does(suns, tmp_path) -> None:
    def images(**factors):
        named = {f"sun.{name[1:]}.factor": value for name, value in factors.items()}
        return of_variant(FreshDataset(suns, drawn_by(tmp_path, named)), "three")

    np.testing.assert_array_equal(images(s1=1, s2=1, s3=1), of_variant(Dataset(suns), "three"))
    shining = FreshDataset(suns, drawn_by(tmp_path, {"sun.shining": 2}))
    np.testing.assert_array_equal(images(s1=0, s3=0), of_variant(shining, "three"))
    fills = FreshDataset(suns, drawn_by(tmp_path, {"sun.factor": 0.5}))
    np.testing.assert_array_equal(images(s1=0.5, s2=0.5, s3=0.5), of_variant(fills, "three"))


def test_parts_of_it_are_fresh_too(fresh, rendered, spec) -> None:
    part, _ = fresh.split(0.5, 0.5, seed=1)
    assert isinstance(part, FreshDataset)
    frame = part[0].frame
    np.testing.assert_array_equal(part[0].image, fresh.picture(frame).image)
    again = FreshDataset(Dataset(rendered).split(0.5, 0.5, seed=1)[0], spec, seed=5, labels=["image"])
    assert again.names == part.names
    np.testing.assert_array_equal(again[0].image, part[0].image)
    batch = fresh.collate([*fresh.crop(size=32)])
    assert batch["image"].shape == (3, 32, 32)


@pytest.mark.children
def test_other_processes_give_the_same_images_also_after_kills(rendered, spec) -> None:
    fresh = FreshDataset(rendered, spec, seed=5)
    first = [fresh[place].image for place in range(3)]
    children = psutil.Process().children()
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        np.testing.assert_array_equal(pool.starmap(image_of, [(fresh, place) for place in range(3)]), first)
    for child in children:
        child.kill()
    np.testing.assert_array_equal([pickle.loads(pickle.dumps(fresh))[1].image, fresh[2].image], first[1:])


@pytest.mark.children
def test_pytorchs_loader_takes_it(rendered, spec) -> None:
    data = pytest.importorskip("torch.utils.data")
    fresh = FreshDataset(rendered, spec, seed=5).crop(size=32)
    loader = data.DataLoader(fresh, batch_size=3, num_workers=2, collate_fn=fresh.collate, persistent_workers=True)
    for epoch in range(3):
        fresh.set_epoch(epoch)
        (batch,) = loader
        again = FreshDataset(rendered, spec, seed=5, epoch=epoch).crop(size=32)
        np.testing.assert_array_equal(batch["image"], [picture.image for picture in again])


@pytest.mark.parametrize(
    ("sample", "said"),
    [
        ('"sun.direction" = { distribution = "directions" }', "sun.direction: needs a new render"),
        ('"material.*.roughness" = { distribution = "fixed", value = 0.5 }', "roughness: needs a new render"),
        ('"earth.visible" = { distribution = "fixed", value = true }', "earth.visible: needs a new render"),
        ('"sun.angle" = { distribution = "fixed", value = 1, unit = "deg" }', "sun.angle: needs a new render"),
        ('"sun.factor" = { distribution = "fixed", value = -1 }', "-1"),
    ],
)
def test_what_would_take_a_new_render_is_refused(rendered, tmp_path, sample, said) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text(DRAWN.partition("[augmentation.sample]")[0] + f"[augmentation.sample]\n{sample}\n")
    with pytest.raises(SpinError, match=said):
        assert FreshDataset(rendered, spec)[0].image.any()


def test_what_a_selection_changes_of_the_render_is_refused(rendered, tmp_path) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text(DRAWN.replace('name = "drawn"', 'name = "drawn"\nselect = { materials = "plain" }'))
    with pytest.raises(SpinError, match="changes more of img000001 than"):
        assert FreshDataset(rendered, spec)[0].image.any()


def test_a_dataset_without_its_renders_is_refused(rendered, spec, tmp_path) -> None:
    bare = shutil.copytree(rendered, tmp_path / "bare", ignore=shutil.ignore_patterns("renders"))
    with pytest.raises(SpinError, match="contains no render of img000001 of nominal"):
        assert FreshDataset(bare, spec)[0].image.any()
    with pytest.raises(SpinError, match="there is no epoch -1"):
        FreshDataset(rendered, spec).set_epoch(-1)


def answer(fresh, places, answers) -> None:
    """Answer each place with the epoch and the drawn values of its picture, until there is no place."""
    while (place := places.get()) is not None:
        answers.put((fresh[place].epoch, fresh[place].drawn.values))


@pytest.mark.children
@pytest.mark.parametrize(
    "method", ["spawn", *(pytest.param(each, marks=pytest.mark.slow) for each in ("fork", "forkserver"))]
)
def test_workers_that_outlive_an_epoch_draw_the_next_one(rendered, spec, method) -> None:
    context = multiprocessing.get_context(method)
    places, answers = context.SimpleQueue(), context.SimpleQueue()
    fresh = FreshDataset(rendered, spec, seed=5, epoch=3)
    worker = context.Process(target=answer, args=(fresh, places, answers), daemon=True)
    worker.start()
    for epoch in (3, 0, 2**40):
        fresh.set_epoch(epoch)
        places.put(1)
        again = FreshDataset(rendered, spec, seed=5, epoch=epoch)
        assert answers.get() == (epoch, again[1].drawn.values)
    places.put(None)
    worker.join()
    assert worker.exitcode == 0


def test_parts_and_copies_here_have_epochs_of_their_own(fresh) -> None:
    copies = [fresh[:2], fresh.crop(size=32), fresh.split(0.5, 0.5)[0], pickle.loads(pickle.dumps(fresh))]
    fresh.set_epoch(7)
    assert {each[0].epoch for each in copies} == {0}
    assert fresh[:2][0].epoch == fresh.crop(size=32)[0].epoch == 7
    fresh.set_epoch(0)


def test_a_copy_whose_sender_is_gone_has_its_epoch(rendered, spec, tmp_path) -> None:
    program = (
        "import pickle, sys; from spin_usd import FreshDataset;"
        "fresh = FreshDataset(*sys.argv[1:3], epoch=4); open(sys.argv[3], 'wb').write(pickle.dumps(fresh))"
    )
    subprocess.run([sys.executable, "-c", program, rendered, spec, tmp_path / "fresh"], check=True)
    fresh = pickle.loads((tmp_path / "fresh").read_bytes())
    assert fresh[0].epoch == 4
    fresh.set_epoch(5)
    assert fresh[0].epoch == 5
