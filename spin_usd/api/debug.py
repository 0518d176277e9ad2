"""A picture's scene as a .blend."""

from pathlib import Path

from spin_usd.api.checked import checked
from spin_usd.api.effort import setting_of
from spin_usd.dataset.debug.debug import DebugFile, write_debug_file
from spin_usd.dataset.process.open_renderer import DEFAULT_RENDERER
from spin_usd.dataset.store.stage_path import existing_stage
from spin_usd.progress import Progress, ignore
from spin_usd.scene.model import NOMINAL


@checked
def debug(
    stage: str | Path,
    frame: str,
    *,
    variant: str = NOMINAL,
    out: str | Path | None = None,
    samples: int | None = None,
    effort: str | None = None,
    quality: str | None = None,
    seed: int | None = None,
    on_progress: Progress | None = None,
) -> DebugFile:
    """Write the scene of a picture as a .blend, which Blender opens and renders to the picture before the detector.

    Args:
        stage: a stage's root layer, or the folder of its dataset.usda.
        frame: the frame's name, or its number from 0.
        variant: the variant of the frame.
        out: the new file; FRAME_VARIANT.blend in the current folder if not given.
        samples, effort, quality, seed: as for `render`.
        on_progress: called with what is counted, how many are done and how many there are.

    Raises InputError where the stage has no such frame or the file exists, StageError, UnsupportedError without
    Blender.
    """
    root = existing_stage(Path(stage))
    setting, _ = setting_of(
        root, renderer=DEFAULT_RENDERER, measured=None, samples=samples, effort=effort, quality=quality, error=None
    )
    file = None if out is None else Path(out)
    progress = ignore if on_progress is None else on_progress
    return write_debug_file(root, frame, variant=variant, out=file, effort=setting.effort, seed=seed, progress=progress)
