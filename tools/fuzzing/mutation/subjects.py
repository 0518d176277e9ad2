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
STAGE_COMMANDS = (CHECK_STAGE, PLAN, RENDER)
INPUTS = ("poses.json", "camera.json", "box.obj", "box.mtl", "texture.png")
STAGES, MODELS, TEXTURES, POSE_LISTS = "stages and layers", "models", "textures", "pose lists"
TABLES, DATASETS, LABEL_FILES = "tables, specifications", "documents, stages of datasets", "files of pictures"
Commands = tuple[tuple[str, ...], ...]


@dataclass(frozen=True, kw_only=True)
class Subject:
    """name: the format · group: of formats that the table counts together · files: below the seeds, one of which is
    mutated (a pattern) · takes: what else is copied · commands: one of them is called; {file} is the mutated file ·
    sealed: the dataset's digests are right again."""

    name: str
    group: str
    files: tuple[str, ...]
    commands: Commands
    takes: tuple[str, ...] = ()
    sealed: bool = False

    def found(self, seeds: Path) -> list[Path]:
        """Its good files."""
        return sorted(path for pattern in self.files for path in seeds.glob(pattern) if path.is_file())


def _one_file(name: str, takes: tuple[str, ...] = ("texture.png",), commands: Commands = STAGE_COMMANDS) -> Subject:
    """A stage in one file."""
    return Subject(name=name, group=STAGES, files=(f"stage.{name}",), takes=takes, commands=commands)


def _in_stage(name: str, *files: str) -> Subject:
    commands = (("check", "st"), ("plan", "st"), (*RESUME[:-1], "out"))
    return Subject(name=name, group=STAGES, files=files, takes=("st",), commands=commands)


def _model(name: str, *files: str) -> Subject:
    commands = (author_arguments("--target", "{file}"),)
    return Subject(name=name, group=MODELS, files=files, takes=INPUTS, commands=commands)


def _texture(suffix: str) -> Subject:
    files, name = (f"texture.{suffix}",), f"texture {suffix}"
    return Subject(name=name, group=TEXTURES, files=files, takes=INPUTS, commands=(CHECK_STAGE,))


def _poses(name: str, file: str, folder: str | None = None) -> Subject:
    """A pose list that is one file, or one of those of a folder."""
    commands = (author_arguments("--poses", folder or "{file}"),)
    takes = (*INPUTS, *([folder] if folder else []))
    return Subject(name=f"poses {name}", group=POSE_LISTS, files=(file,), takes=takes, commands=commands)


def _layer(name: str) -> Subject:
    """A layer that is given to `author` by an option of its name."""
    commands = (author_arguments(f"--{name}", "{file}"),)
    files = (f"st/layers/{name}.usda",)
    return Subject(name=f"{name} layer", group=STAGES, files=files, takes=INPUTS, commands=commands)


def _table(name: str) -> Subject:
    """A table or specification that is given to `author` by an option of its name."""
    commands = (author_arguments(f"--{name}", "{file}"),)
    return Subject(name=name, group=TABLES, files=(f"{name}.*",), takes=INPUTS, commands=commands)


def _in_dataset(name: str, *files: str, group: str = DATASETS, sealed: bool = False) -> Subject:
    commands = (CHECK, CHECK, EXPORT, REPRODUCE, RESUME)
    return Subject(name=name, group=group, files=files, takes=("ds", "st"), commands=commands, sealed=sealed)


def _label(suffix: str) -> Subject:
    return _in_dataset(f"label {suffix}", f"ds/*/nominal/*.{suffix}", group=LABEL_FILES, sealed=True)


SUBJECTS = (
    _one_file("usda"),
    _one_file("usdc"),
    _one_file("usdz", takes=(), commands=STAGE_COMMANDS[:2]),
    _in_stage("layers", "st/**/*.usda"),
    _in_stage("crate layers", "st/**/*.usdc"),
    _model("target usda", "target.usda"),
    _model("target usdc", "target.usdc"),
    _model("target usdz", "target.usdz"),
    _model("obj", "box.obj"),
    Subject(name="mtl", group=MODELS, files=("box.mtl",), takes=INPUTS, commands=(author_arguments(),)),
    _model("ply", "box.ply", "box_ascii.ply"),
    _model("stl", "box.stl", "box_ascii.stl"),
    _model("gltf", "box.gltf"),
    _model("glb", "box.glb"),
    _model("dae", "box.dae"),
    *map(_texture, ("png", "jpg", "exr", "hdr", "bmp", "tif")),
    _poses("speedplus", "poses.json"),
    _poses("record", "ds/records/nominal/img000001.json"),
    _poses("stream2", "stream2.csv"),
    _poses("urso", "urso/*.csv", "urso"),
    _poses("bop", "exports/bop/train/000000/scene_gt.json"),
    _poses("coco", "exports/coco/annotations/*.json"),
    _poses("webdataset", "exports/webdataset/*.tar"),
    _poses("croissant", "exports/croissant/records.csv"),
    *map(_layer, ("camera", "lights", "environment")),
    *map(_table, ("camera", "keypoints", "parts", "lidar", "sample")),
    Subject(
        name="spec",
        group=TABLES,
        files=("spec.toml",),
        takes=("st",),
        commands=(("augment", "st", "--spec", "{file}"),),
    ),
    _in_dataset("dataset.json", "ds/dataset.json"),
    _in_dataset("records", "ds/records/nominal/*.json"),
    _in_dataset("measured.json", "ds/cache/measured.json"),
    _in_dataset("dataset stage", "ds/stage/**/*.usd*", "ds/stage/SHA256SUMS", sealed=True),
    _in_dataset("cache", "ds/cache/**/*.exr", "ds/cache/**/*.png"),
    *map(_label, ("exr", "png", "npz", "ply")),
)
