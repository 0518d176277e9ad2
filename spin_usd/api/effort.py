"""Work out the renderer's setting from samples, an effort, a quality or an error: the ways to ask for one."""

from dataclasses import replace
from pathlib import Path

from spin_usd.accuracy.measurement import Configuration
from spin_usd.dataset.plan import effort_choice
from spin_usd.dataset.plan.effort_choice import Chosen
from spin_usd.dataset.process.open_renderer import DEFAULT_RENDERER, default_effort, renderer_entry
from spin_usd.dataset.store.measurement_file import measurement_file
from spin_usd.errors import InputError
from spin_usd.scene.effort import Effort, parse_effort


def setting_of(
    stage: Path,
    *,
    renderer: str | None,
    measured: Path | None,
    samples: int | None,
    effort: str | None,
    quality: str | None,
    error: str | None,
) -> tuple[Configuration, Chosen | None]:
    """Return the renderer, blender where none is given, and its effort; and why where it was chosen. Raises InputError
    for ways that do not go together."""
    ways = {"samples": samples, "effort": effort, "quality": quality, "error": error}
    given = [name for name, value in ways.items() if value is not None]
    if len(given) > 1:
        raise InputError(f"{' and '.join(given)} are given together", do="give one of them")
    if measured is not None and error is None:
        raise InputError("measured is given without error", do="give error too")
    renderer = renderer or DEFAULT_RENDERER
    if error is not None:
        effort_choice.error_bound(error)  # a wrong one is told before a measurement is asked for
        return effort_choice.by_error(error, measurement_file(stage, measured), renderer=renderer)
    chosen = None
    usual = default_effort(renderer)
    tried = usual if samples is None else replace(usual, samples=samples)
    if effort is not None:
        tried = parse_effort(_said(effort))
    if quality is not None:
        tried, chosen = effort_choice.by_quality(quality, stage, renderer=renderer)
        _refuse_unheeded(quality, tried, renderer)
    return Configuration(renderer=renderer, effort=tried), chosen


def _said(effort: str) -> str:
    if not effort.strip():
        raise InputError("effort is empty", do="write name=value,..., such as samples=16,denoiser=fast")
    return effort


def _refuse_unheeded(quality: str, effort: Effort, renderer: str) -> None:
    if unused := set(effort.unusual) - renderer_entry(renderer).effort:
        found = f"quality {quality!r} needs {DEFAULT_RENDERER}: {renderer} has no {' and no '.join(sorted(unused))}"
        raise InputError(found, do=f"choose another renderer than {renderer}, or give samples instead")
