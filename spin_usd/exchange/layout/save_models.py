"""The child's part of models: it reads the bodies of a stage, which the supervising process must not open."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from spin_usd.basics.progress import Progress
from spin_usd.errors import UnsupportedError
from spin_usd.exchange.layout.models import Model, SaveModels
from spin_usd.scene.scene import FrameId
from spin_usd.scene.target import Target
from spin_usd.stage.read.stage_reader import StageReader


def save_models(request: SaveModels, progress: Progress) -> list[int]:
    """Save the mesh of each target of the stage as ID.npz in the folder; return the ids. Raises UnsupportedError for a
    target whose shape is not the same in all frames."""
    keys: dict[int, str] = {}
    for frame, number, target in _targets(request.stage, request.frames, progress):
        if number not in keys:
            keys[number] = target.mesh.key
            model = Model.of(target.mesh)
            np.savez(Path(request.folder, f"{number}.npz"), **vars(model))
        if keys[number] != target.mesh.key:
            found = f"{target.name} has another shape in {frame.name} of {frame.variant} than before"
            do = "export pictures of one shape: choose --variants or --frames"
            raise UnsupportedError(found, where=request.stage, do=do)
    return sorted(keys)


def _targets(
    stage: str, frames: Mapping[str, Sequence[str]], progress: Progress
) -> Iterator[tuple[FrameId, int, Target]]:
    """Yield each target in each of the frames, with its id."""
    reader = None
    for done, (variant, names) in enumerate(frames.items()):
        progress("reading the bodies of variant", done, len(frames))
        reader = StageReader(stage, variant=variant, after=reader)
        wanted = set(names)
        for frame in reader.frames:
            if frame.name in wanted:
                yield from (
                    (frame, number, target) for number, target in reader.bodies.targets_at(frame.time_code).items()
                )
