"""What `plan` and `render` are asked to make: the options that they share, declared once."""

import inspect
import sys
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any

from spin_usd.cli.effort import setting_of
from spin_usd.cli.options import (
    EffortText,
    Error,
    Frames,
    ImageFormat,
    Labels,
    LabelsOnly,
    MeasuredIn,
    Quality,
    RadianceOption,
    RendererName,
    Samples,
    Seed,
    Stage,
    Variants,
)
from spin_usd.errors import InputError


def with_request(command: Callable[..., None]) -> Callable[..., None]:
    """The command with the options of `_request` in the place of its parameter `request`, which gets what they ask."""
    shared = _by_keyword(inspect.signature(_request))
    parameters: list[inspect.Parameter] = []
    for parameter in _by_keyword(inspect.signature(command, eval_str=True)):
        parameters += shared if parameter.name == "request" else [parameter]

    @wraps(command)
    def with_options(**given: Any) -> None:
        request = _request(**{option.name: given.pop(option.name) for option in shared})
        command(request=request, **given)

    with_options.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]  # typer reads both
    with_options.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return with_options


def show_doubts(doubts: Sequence[str]) -> None:
    """On standard error."""
    for doubt in doubts:
        print(f"note: {doubt}", file=sys.stderr)


def _by_keyword(signature: inspect.Signature) -> list[inspect.Parameter]:
    """Its parameters, which may then stand in any order, with or without a default."""
    return [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in signature.parameters.values()]


def _request(
    stage: Stage,
    frames: Frames = None,
    variants: Variants = "",
    samples: Samples = None,
    effort: EffortText = None,
    quality: Quality = None,
    error: Error = None,
    measured: MeasuredIn = None,
    seed: Seed = None,
    labels: Labels = "default",
    labels_only: LabelsOnly = False,
    renderer: RendererName = None,
    radiance: RadianceOption = False,
    image_format: ImageFormat = "png",
) -> Any:
    """The RenderRequest of these options."""
    from spin_usd.dataset.render.render import RenderRequest

    if labels_only and not radiance:
        _refuse_unlit(quality, error)
    setting, chosen = setting_of(
        stage,
        renderer=renderer,
        measured=None if measured is None else _path(measured),
        samples=samples,
        effort=effort,
        quality=quality,
        error=error,
    )
    return RenderRequest(
        stage=stage,
        frames=frames,
        variants=_names(variants),
        effort=setting.effort,
        chosen=chosen,
        seed=seed,
        renderer=setting.renderer,
        labels=_labels(labels),
        image=not labels_only,
        radiance=radiance,
        image_suffix=f".{image_format}",
    )


def _labels(text: str) -> tuple[str, ...]:
    """The labels that `text` names; "default", "all" and "none" may stand among the names."""
    from spin_usd.labels.table import DEFAULT_LABELS, LABELS

    groups = {"default": DEFAULT_LABELS, "all": tuple(LABELS), "none": ()}
    return tuple(label for name in _names(text) for label in groups.get(name, (name,)))


def _refuse_unlit(quality: str | None, error: str | None) -> None:
    for name, value in {"--quality": quality, "--error": error}.items():
        if value is not None:
            raise InputError(f"{name} is given with --labels-only, which renders no light", do="drop one of them")


def _path(measured: str) -> Path:
    if not measured:
        raise InputError("--measured is empty", do="give a folder or its measure.json")
    return Path(measured)


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())
