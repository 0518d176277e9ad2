"""How hard to try, of the ways in which it can be said."""

from pathlib import Path
from typing import TYPE_CHECKING

from spin_usd.errors import InputError

if TYPE_CHECKING:
    from spin_usd.dataset.chosen import Chosen
    from spin_usd.measuring.measurement import Setting


def setting_of(
    stage: Path,
    *,
    renderer: str | None,
    measured: Path | None,
    samples: int | None,
    effort: str | None,
    quality: str | None,
    error: str | None,
) -> tuple["Setting", "Chosen | None"]:
    """Renderer and effort, and why where they were chosen: `renderer` is blender where neither it nor the measurement
    says another. Raises InputError for ways that do not go together."""
    from spin_usd.dataset import chosen as choosing
    from spin_usd.dataset.measure.file import measurement_file
    from spin_usd.measuring.measurement import Setting
    from spin_usd.scene.effort import Effort, parse_effort

    ways = {"--samples": samples, "--effort": effort, "--quality": quality, "--error": error}
    given = [name for name, value in ways.items() if value is not None]
    if len(given) > 1:
        raise InputError(f"{' and '.join(given)} are given together", do="give one of them")
    if measured is not None and error is None:
        raise InputError("--measured is given without --error", do="give --error too")
    if error is not None:
        return choosing.by_error(error, measurement_file(stage, measured), renderer=renderer)
    chosen = None
    tried = Effort() if samples is None else Effort(samples=samples)
    if effort is not None:
        tried = parse_effort(effort)
    if quality is not None:
        tried, chosen = choosing.by_quality(quality)
    return Setting(renderer=renderer or "blender", effort=tried), chosen
