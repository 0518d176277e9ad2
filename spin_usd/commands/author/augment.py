"""`spin-usd augment`: a specification's augmentations as variants of a stage."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spin_usd.basics.progress import Progress
from spin_usd.commands.author.reports import AugmentReport, AugmentStage
from spin_usd.errors import InputError, SpinError
from spin_usd.files.folder import Folder
from spin_usd.sampling.constraints import CONSTRAINTS
from spin_usd.sampling.sample import stream
from spin_usd.scene.environment import BACKGROUND
from spin_usd.specifications.augmentation_spec import (
    AugmentationEntry,
    Specification,
    read_augmentation_spec,
    spec_path,
)
from spin_usd.specifications.background_choice import background_choice
from spin_usd.specifications.sample_pictures import SampledPictures, sample_pictures, samples_for
from spin_usd.specifications.sample_table import SampleEntry
from spin_usd.stage.augment.background import Background, background_of, compose_background
from spin_usd.stage.augment.planet import PLANET, find_planet
from spin_usd.stage.augment.replace_files import FOLDER, set_name
from spin_usd.stage.augment.sampled_values import open_base
from spin_usd.stage.augment.write_augmentations import Augmentation, Source, open_selected, write_augmentations
from spin_usd.stage.author.lights_and_environment import refuse_damaged
from spin_usd.store.file_digests import CHANGED, changed, write_sums
from spin_usd.store.hidden_folder import hidden_folder


def augment_stage(
    *, stage: str | Path, spec: str, out: str | Path | None = None, progress: Progress = lambda *_: None
) -> AugmentReport:
    """Write the variants of the specification `spec`, a name or a file, over `stage`, or as `out` beside it.

    Raises InputError that names the specification, the augmentation and its fault, or a file in the way that an earlier
    run did not write; then nothing is written.
    """
    file, new_root = spec_path(spec), Path(out) if out is not None else None
    _refuse_replacing(Path(stage).parent / FOLDER, set_name(new_root))
    specification = read_augmentation_spec(file)
    made: list[Augmentation] = []
    checked: set[Path] = set()
    for entry in specification.augmentations:
        counted = _Counted(progress, len(made), len(specification.augmentations))
        try:
            made.append(_sampled(Path(stage), specification, entry, file.parent, counted, checked))
        except SpinError as error:
            where = f"{file} augmentation {entry.name}" + (f": {error.where}" if error.where is not None else "")
            raise InputError(error.found, where=where, do=error.do) from None
    source = Source(name=specification.name, sha256=specification.sha256, seed=specification.seed)
    root = _written(Path(stage), new_root, made, source)
    names = tuple(augmentation.name for augmentation in made)
    return AugmentReport(root=str(root), augmentations=names, spec=specification.name)


def augment_requested(request: AugmentStage, progress: Progress) -> AugmentReport:
    """Write the variants of a request."""
    return augment_stage(stage=request.stage, spec=request.spec, out=request.out, progress=progress)


@dataclass(frozen=True)
class _Counted:
    """Reports to `progress` how many pictures of `count` augmentations are sampled; `before` augmentations were
    already."""

    progress: Progress
    before: int
    count: int

    def report(self, pictures: int, done: int, total: int) -> None:
        """Report that `done` of `total` is sampled of this augmentation's `pictures`."""
        sampled = self.before * pictures + pictures * done // total
        self.progress("sampling: picture", sampled, self.count * pictures)


def _written(path: Path, out: Path | None, made: Sequence[Augmentation], source: Source) -> Path:
    """Write the root layer with the augmentations by way of a folder hidden beside it, and return its path."""
    with hidden_folder(path.parent, "augment", beside=(out or path).name) as hidden:
        return write_augmentations(
            path,
            out,
            made,
            source,
            work=hidden.folder,
            trial=hidden.beside,
            list_files=lambda folder: write_sums(folder, beside=[_layer_of(folder).name]),
        )


def _refuse_replacing(layers: Path, name: str) -> None:
    """Raise InputError where the augmentations `name` in the folder `layers`, or the layer beside them that refers to
    them, are not all as an earlier run wrote them: a new run replaces them whole."""
    for node in Folder(layers).special_files((name, f"{name}.usda")):
        raise InputError(f"is a {node.type}, and would be replaced", where=layers / node.name, do="move it elsewhere")
    layer = _layer_of(layers / name)
    for file in changed(layers / name, beside=[layer.name, name]):  # the latter where it is a file
        and_so = ", and take it out of the root layer's subLayers" if file == layer else ""
        raise InputError(CHANGED, where=file, do=f"move it elsewhere{and_so}")


def _layer_of(folder: Path) -> Path:
    """Return the layer that refers to the augmentations in the folder."""
    return folder.with_name(f"{folder.name}.usda")


def _sampled(
    path: Path,
    spec: Specification,
    entry: AugmentationEntry,
    folder: Path,
    counted: _Counted,
    checked: set[Path],
) -> Augmentation:
    """Sample all values of one augmentation; checked: as `_background` has them."""
    stage = open_selected(path, entry.select)
    behind = [sample for sample in entry.sample if sample.parameter == BACKGROUND]
    others = [sample for sample in entry.sample if sample.parameter != BACKGROUND]
    samples_for(others)  # faults of the text are reported before anything is read
    background = _background(stage, behind, spec.seed, entry.name, folder, checked)
    environment = compose_background(stage, background) if background else None
    base, frames, _ = open_base(stage)
    constraints = entry.constraints
    if background and find_planet(base.stage) is None:  # what concerns a planet binds the appearances that have one
        constraints = {name: limit for name, limit in constraints.items() if not CONSTRAINTS[name].needs_planet}
        others = [sample for sample in others if not sample.parameter.startswith(PLANET)]
    values = sample_pictures(
        base,
        SampledPictures(names=frames),
        others,
        seed=spec.seed,
        name=entry.name,
        constraints=constraints,
        progress=lambda done, total: counted.report(len(frames), done, total),
    )
    del environment
    counted.report(len(frames), 1, 1)
    return Augmentation(name=entry.name, selections=entry.select, values=values, background=background)


def _background(
    stage: Any, samples: Sequence[SampleEntry], seed: int, name: str, folder: Path, checked: set[Path]
) -> Background | None:
    """Return the sampled environment or pictures, if any; checked: pictures of other augmentations, to which these are
    added. Raises InputError unless it is a choice of names."""
    for sample in samples:
        distribution = background_choice(sample, folder)
        streams = [stream(seed, name, BACKGROUND)]
        times: Sequence[float] = ()
        if sample.per_frame:
            base, frames, _ = open_base(stage)
            streams, times = [stream(seed, name, BACKGROUND, frame) for frame in frames], base.times
        given = [str(distribution.sample(each)) for each in streams]
        background = background_of(stage, given, folder, times)
        refuse_damaged(sorted({*background.pictures} - checked))
        checked |= {*background.pictures}
        return background
    return None
