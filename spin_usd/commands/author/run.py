"""A stage from a pose list or sampled poses, a model and a camera."""

from collections.abc import Sequence
from pathlib import Path

from msgspec import convert

from spin_usd.commands.author.options import AuthorOptions
from spin_usd.commands.author.reports import AuthorReport
from spin_usd.errors import InputError
from spin_usd.options import takes
from spin_usd.processes.ask_child import ask_child
from spin_usd.store.new_folder import nothing_left_of

AUTHOR_PATIENCE_S = 300.0  # it says no word while it reads a model, which may have millions of faces
SOURCES = ("poses", "sample", "count")
ADDITIONS = (
    "keypoints",
    "parts",
    "channels",
    "lidar",
    "range_finder",
    "sun_direction",
    "sun_from_target",
    "keep_transparent",
)
"""Options that are written over the stage when it is there."""


@takes(AuthorOptions)
def author(options: AuthorOptions) -> AuthorReport:
    """Make the layered stage `out`/dataset.usda, in a new folder.

    Raises InputError for what cannot be accepted, StageError and UnsupportedError for a USD target, and OutputError;
    then `out` is not there.
    """
    given = options.as_json()
    given |= {name: _numbers(name, getattr(options, name)) for name in ("sun_direction", "sun_from_target")}
    given |= {"also": _texts(options.also), "occluders": _texts(options.occluder), "variant": _texts(options.variant)}
    given["camera"] = _texts(options.camera) or None
    given["units_per_metre"] = None if options.units_per_metre is None else float(options.units_per_metre)
    call, sources = _source(options)
    left_out = {*ADDITIONS, *SOURCES, "occluder"} - set(sources)
    choices = {name: value for name, value in given.items() if name not in left_out}
    choices["additions"] = {name: given[name] for name in ADDITIONS}
    with nothing_left_of(Path(options.out)):
        reads = f"{options.poses or options.sample} or {options.target}"
        report = ask_child(call, reads=reads, progress=options.progress, within_s=AUTHOR_PATIENCE_S, **choices)
    return convert(report, AuthorReport)


def _source(options: AuthorOptions) -> tuple[str, tuple[str, ...]]:
    """Return the child's call, and the options that say where the pictures come from. Raises InputError."""
    poses, sample = options.poses, options.sample
    if poses is None and sample is None:
        do = "give a pose list as poses, or say what to sample: sample='range=3..10 inside=0.9 count=100'"
        raise InputError("neither poses nor sample is given", do=do)
    if poses is not None and sample is not None:
        raise InputError("poses and sample are given together", do="give one of them")
    if sample is not None:
        return "author_sample", ("sample", "count")
    if options.count is not None:
        raise InputError("count is given without sample", do="choose poses with frames")
    for name in ("target", "camera"):
        if not getattr(options, name):
            raise InputError(f"poses is given without {name}", do=f"give {name} too")
    return "author", ("poses",)


def _texts(given: str | Path | Sequence[str | Path]) -> list[str]:
    return [str(given)] if isinstance(given, str | Path) else [str(each) for each in given]


def _numbers(name: str, given: str | Sequence[float] | None) -> list[float] | None:
    """Return the numbers, also those of "X,Y,Z". Raises InputError that names the argument."""
    if given is None:
        return None
    try:
        return [float(each) for each in (given.split(",") if isinstance(given, str) else given)]
    except ValueError:
        raise InputError(f"{name} {given!r} is not X,Y,Z", do="write for example 0.5,-0.7,-0.5") from None
