"""Measure what the settings of a render cost, and how large their errors are."""

from collections.abc import Callable
from pathlib import Path

from spin_usd.accuracy.measurement import Measurement
from spin_usd.api.checked import checked
from spin_usd.dataset.measure import measure as measuring
from spin_usd.dataset.measure.campaign import MeasureRequest
from spin_usd.dataset.store.measurement_file import folder_of
from spin_usd.dataset.store.stage_path import existing_stage, root_layer
from spin_usd.progress import Progress, ignore
from spin_usd.scene.model import NOMINAL


@checked
def measure(
    stage: str | Path,
    *,
    out: str | Path | None = None,
    frames: str | None = None,
    count: int = 3,
    variant: str = NOMINAL,
    seeds: int = 3,
    max_samples: int = 64,
    reference_share: float = 0.1,
    reference_samples: int = 4096,
    workers: int = 1,
    on_progress: Progress | None = None,
    on_note: Callable[[str], None] | None = None,
) -> Measurement:
    """Measure what settings of a render cost and how far they are off, on a few pictures of a stage; needs Blender.

    Writes measure.json, measure.md and measure.svg. Run again with another `count`, `seeds` or the like, it replaces
    the figures, and renders only what is missing. Another stage or variant takes another `out`.

    Args:
        stage: a stage's root layer, or the folder of its dataset.usda.
        out: the folder to write to; "measured" beside the stage if not given.
        frames: some of the frames, "A:B:STEP" as Python slices.
        count: measure so many of them, 1 to 100, small to large.
        variant: the name of the variant to measure.
        seeds: renders of each setting, 2 to 64.
        max_samples: light samples per pixel of a setting, at the most.
        reference_share: of the smallest error squared, the most that the reference's may be.
        reference_samples: the most that the reference may take.
        workers: processes that share the cores; 1 for truest times.
        on_progress: called with what is counted, how many are done and how many there are.
        on_note: called, before anything is rendered, with a sentence on what the measurement will not serve for.

    Raises InputError, OutputError, UnsupportedError where Blender is not installed, and RenderError where no picture
    could be measured.
    """
    root = root_layer(Path(stage))
    request = MeasureRequest(
        stage=root,
        frames=frames,
        count=count,
        variant=variant,
        seeds=seeds,
        max_samples=max_samples,
        reference_share=reference_share,
        reference_samples=reference_samples,
    )
    existing_stage(Path(stage))
    folder = folder_of(root) if out is None else Path(out)
    return measuring.measure(
        request, folder, workers=workers, progress=ignore if on_progress is None else on_progress, on_note=on_note
    )
