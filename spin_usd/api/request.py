"""Turn the arguments of `plan` and `render` into one request."""

from collections.abc import Sequence
from pathlib import Path

from spin_usd.api.effort import setting_of
from spin_usd.dataset.render.request import RenderRequest
from spin_usd.dataset.store.stage_path import existing_stage, root_layer
from spin_usd.errors import InputError
from spin_usd.labels.table import CLOUD_LABELS, DEFAULT_LABELS, PIXEL_LABELS


def render_request(
    stage: str | Path,
    *,
    frames: str | None,
    variants: str | Sequence[str],
    samples: int | None,
    effort: str | None,
    quality: str | None,
    error: str | float | None,
    measured: str | Path | None,
    seed: int | None,
    labels: str | Sequence[str],
    labels_only: bool,
    renderer: str | None,
    device: str,
    radiance: bool,
    image_format: str,
) -> RenderRequest:
    """Make the request for pictures of `stage`. Raises InputError for what does not go together or is not there."""
    root = root_layer(Path(stage))
    if labels_only and not radiance:
        _refuse_unlit(quality, error)
    setting, chosen = setting_of(
        root,
        renderer=renderer,
        measured=None if measured is None else Path(measured),
        samples=samples,
        effort=effort,
        quality=quality,
        error=None if error is None else str(error),
    )
    request = RenderRequest(
        stage=root,
        frames=frames,
        variants=names_in(variants),
        effort=setting.effort,
        chosen=chosen,
        seed=seed,
        renderer=setting.renderer,
        device=device,
        labels=_label_names(labels),
        offered=tuple(CLOUD_LABELS) if "all" in names_in(labels) else (),
        image=not labels_only,
        radiance=radiance,
        image_suffix=f".{image_format}",
    )
    existing_stage(Path(stage))
    return request


def _label_names(given: str | Sequence[str]) -> tuple[str, ...]:
    """Return the labels that are named; "default", "all", which leaves out those that not every stage has, and
    "none" may stand among the names."""
    groups = {"default": DEFAULT_LABELS, "all": tuple(PIXEL_LABELS), "none": ()}
    return tuple(label for name in names_in(given) for label in groups.get(name, (name,)))


def _refuse_unlit(quality: str | None, error: str | float | None) -> None:
    for name, value in {"quality": quality, "error": error}.items():
        if value is not None:
            raise InputError(f"{name} is given with labels_only, which renders no light", do="drop one of them")


def names_in(given: str | Sequence[str]) -> tuple[str, ...]:
    """Names, from a list of them or from text with commas between."""
    names = given.split(",") if isinstance(given, str) else given
    return tuple(name.strip() for name in names if name.strip())
