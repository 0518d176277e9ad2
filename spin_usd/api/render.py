"""A stage rendered and labelled."""

from collections.abc import Sequence
from pathlib import Path

from spin_usd.api.checked import checked_but_urls
from spin_usd.api.request import render_request
from spin_usd.dataset.render import render as rendering
from spin_usd.dataset.render.report import RenderReport
from spin_usd.dataset.shards.shard import Shard
from spin_usd.files.url import is_url
from spin_usd.progress import Note, Progress, ignore, unsaid
from spin_usd.scene.effort import CPU


@checked_but_urls("out")
def render(
    stage: str | Path,
    *,
    out: str | Path,
    frames: str | None = None,
    variants: str | Sequence[str] = (),
    samples: int | None = None,
    effort: str | None = None,
    quality: str | None = None,
    error: str | float | None = None,
    measured: str | Path | None = None,
    seed: int | None = None,
    labels: str | Sequence[str] = "default",
    labels_only: bool = False,
    renderer: str | None = None,
    device: str = CPU,
    radiance: bool = False,
    image_format: str = "png",
    workers: int | None = None,
    cluster: str | None = None,
    no_cache: bool = False,
    prune: bool = False,
    replace: bool = False,
    verify: bool = False,
    shard: str | None = None,
    picture_timeout: float | None = None,
    on_progress: Progress | None = None,
    on_note: Note | None = None,
) -> RenderReport:
    """Render and label a stage into a dataset. Run again, it makes what is missing.

    Pictures that fail do not raise: the report's `failed` has their names and reasons.

    Args:
        stage: a stage's root layer, or the folder of its dataset.usda.
        out: the dataset's folder, or a URL that fsspec knows, such as "s3://bucket/name".
        frames: some of the frames, "A:B:STEP" as Python slices.
        variants: names, or patterns such as "noisy_*", or "all"; the stage's own selection if not given.
        samples: light samples per pixel, instead of the 16 of quality "standard"; the denoiser stays on.
        effort: all that a picture may cost, such as "samples=16,denoiser=fast".
        quality: "preview", "draft", "standard" or "reference"; "standard" where nothing else is asked for.
        error: the cheapest effort measured within this relative error, or within "auto".
        measured: a measurement for that, instead of the one beside the stage.
        seed: instead of the stage's own.
        labels: names, "default", "all" or "none".
        labels_only: write no image.
        renderer: "blender" or "raycast"; blender by default.
        device: what renders the light: "cpu", "optix", "cuda", "hip", "metal" or "oneapi", or "auto": the best that
            this machine has for the stage. Labels are the CPU's.
        radiance: write linear radiance too.
        image_format: "png" or "jpg".
        workers: worker processes; as many as fit if not given.
        cluster: the address of a Ray cluster to render on: "auto", "HOST:PORT" or "ray://HOST:PORT".
        no_cache: keep no renders for later runs; changes no byte of a picture.
        prune: remove the dataset's pictures that the stage does not have.
        replace: remove all pictures of another stage first.
        verify: read what is there before it is used again, and make damaged pictures anew.
        shard: "I/N": make the pictures of shard I of N alone, I from 0. All shards may write one folder at the same
            time, or each its own, which `merge` puts together.
        picture_timeout: seconds of processor time for one picture, 1 to 604800, of its worker's busiest thread: after
            that it is tried once more, and then has failed; ten times what it is expected to take, and a minute at
            least, if not given.
        on_progress: called with what is counted, how many are done and how many there are.
        on_note: called with what is to be said meanwhile. Ctrl-C lets running pictures be finished, which it says, and
            raises KeyboardInterrupt then; pressed again it raises that at once.

    Raises InputError, StageError and UnsupportedError for what cannot be rendered, and OutputError.
    """
    request = render_request(
        stage,
        frames=frames,
        variants=variants,
        samples=samples,
        effort=effort,
        quality=quality,
        error=error,
        measured=measured,
        seed=seed,
        labels=labels,
        labels_only=labels_only,
        renderer=renderer,
        device=device,
        radiance=radiance,
        image_format=image_format,
    )
    return rendering.render(
        request,
        out if is_url(out) else Path(out),
        workers=workers,
        cluster=cluster,
        keep_cache=not no_cache,
        prune=prune,
        replace=replace,
        verify=verify,
        shard=None if shard is None else Shard.parse(shard),
        picture_timeout=picture_timeout,
        progress=ignore if on_progress is None else on_progress,
        note=unsaid if on_note is None else on_note,
    )
