"""The formats that are mutated: a good file of each, what goes with it, and the commands that read it."""

from dataclasses import dataclass
from pathlib import Path

from fuzzing.seeds import LABELS, author_arguments

CHECK_STAGE = ("check", "{file}")
PLAN = ("plan", "{file}", "--renderer", "raycast")
RENDER = ("render", "{file}", "--renderer", "raycast", "--workers", "1", "--out", "out")
CHECK, EXPORT, REPRODUCE = (
    ("check", "ds"),
    ("export", "ds", "--to", "coco", "--out", "out"),
    ("reproduce", "ds", "img000001"),
)
RESUME = ("render", "st", "--renderer", "raycast", "--workers", "1", "--labels", LABELS, "--out", "ds")
INPUTS = ("poses.json", "camera.json", "box.obj", "box.mtl", "texture.png")


@dataclass(frozen=True, kw_only=True)
class Subject:
    """name: the format · files: below the seeds, one of which is mutated (a pattern) · takes: what else is copied ·
    commands: one of them is called; {file} is the mutated file · sealed: the dataset's digests are right again."""

    name: str
    files: tuple[str, ...]
    commands: tuple[tuple[str, ...], ...]
    takes: tuple[str, ...] = ()
    sealed: bool = False

    def found(self, seeds: Path) -> list[Path]:
        """Its good files."""
        return sorted(path for pattern in self.files for path in seeds.glob(pattern) if path.is_file())


def _in_stage(name: str, *files: str) -> Subject:
    return Subject(
        name=name, files=files, takes=("st",), commands=(("check", "st"), ("plan", "st"), (*RESUME[:-1], "out"))
    )


def _model(name: str, *files: str) -> Subject:
    return Subject(name=name, files=files, takes=INPUTS, commands=(author_arguments("--target", "{file}"),))


def _texture(suffix: str) -> Subject:
    return Subject(name=f"texture {suffix}", files=(f"texture.{suffix}",), takes=INPUTS, commands=(CHECK_STAGE,))


def _poses(name: str, file: str, folder: str | None = None) -> Subject:
    """A pose list that is one file, or one of those of a folder."""
    commands = (author_arguments("--poses", folder or "{file}"),)
    return Subject(
        name=f"poses {name}", files=(file,), takes=(*INPUTS, *([folder] if folder else [])), commands=commands
    )


def _table(name: str, option: str, *files: str) -> Subject:
    return Subject(name=name, files=files, takes=INPUTS, commands=(author_arguments(option, "{file}"),))


def _in_dataset(name: str, *files: str, sealed: bool = False) -> Subject:
    commands = (CHECK, CHECK, EXPORT, REPRODUCE, RESUME)
    return Subject(name=name, files=files, takes=("ds", "st"), commands=commands, sealed=sealed)


SUBJECTS = (
    Subject(name="usda", files=("stage.usda",), takes=("texture.png",), commands=(CHECK_STAGE, PLAN, RENDER)),
    Subject(name="usdc", files=("stage.usdc",), takes=("texture.png",), commands=(CHECK_STAGE, PLAN, RENDER)),
    Subject(name="usdz", files=("stage.usdz",), commands=(CHECK_STAGE, PLAN)),
    _in_stage("layers", "st/**/*.usda"),
    _in_stage("crate layers", "st/**/*.usdc"),
    _model("target usda", "target.usda"),
    _model("target usdc", "target.usdc"),
    _model("target usdz", "target.usdz"),
    _model("obj", "box.obj"),
    Subject(name="mtl", files=("box.mtl",), takes=INPUTS, commands=(author_arguments(),)),
    _model("ply", "box.ply", "box_ascii.ply"),
    _model("stl", "box.stl", "box_ascii.stl"),
    _model("gltf", "box.gltf"),
    _model("glb", "box.glb"),
    *map(_texture, ("png", "jpg", "exr", "hdr", "bmp", "tif")),
    _poses("speedplus", "poses.json"),
    _poses("record", "ds/records/nominal/img000001.json"),
    _poses("stream2", "stream2.csv"),
    _poses("urso", "urso/*.csv", "urso"),
    _poses("bop", "exports/bop/train/000000/scene_gt.json"),
    _poses("coco", "exports/coco/annotations/*.json"),
    _poses("webdataset", "exports/webdataset/*.tar"),
    _poses("croissant", "exports/croissant/records.csv"),
    _table("camera", "--camera", "camera.json"),
    _table("camera layer", "--camera", "st/layers/camera.usda"),
    _table("lights layer", "--lights", "st/layers/lights.usda"),
    _table("environment layer", "--environment", "st/layers/environment.usda"),
    _table("keypoints", "--keypoints", "keypoints.*"),
    _table("parts", "--parts", "parts.*"),
    _table("lidar", "--lidar", "lidar.toml"),
    _table("sample", "--sample", "sample.toml"),
    Subject(name="spec", files=("spec.toml",), takes=("st",), commands=(("augment", "st", "--spec", "{file}"),)),
    _in_dataset("dataset.json", "ds/dataset.json"),
    _in_dataset("records", "ds/records/nominal/*.json"),
    _in_dataset("measured.json", "ds/cache/measured.json"),
    _in_dataset("dataset stage", "ds/stage/**/*.usd*", "ds/stage/SHA256SUMS", sealed=True),
    _in_dataset("cache", "ds/cache/**/*.exr", "ds/cache/**/*.png"),
    _in_dataset("label exr", "ds/*/nominal/*.exr", sealed=True),
    _in_dataset("label png", "ds/*/nominal/*.png", sealed=True),
    _in_dataset("label npz", "ds/*/nominal/*.npz", sealed=True),
    _in_dataset("label ply", "ds/*/nominal/*.ply", sealed=True),
)
