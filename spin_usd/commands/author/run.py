"""A stage from a pose list or sampled poses, a model and a camera."""

from pathlib import Path

from spin_usd.commands.author.options import AuthorOptions
from spin_usd.commands.author.reports import AUTHOR, AuthorReport
from spin_usd.errors import InputError
from spin_usd.options import takes
from spin_usd.processes.ask_child import ask_child
from spin_usd.store.new_folder import nothing_left_of

AUTHOR_PATIENCE_S = 300.0  # it is silent while it reads a model, which may have millions of faces


@takes(AuthorOptions)
def author(options: AuthorOptions) -> AuthorReport:
    """Make the layered stage `out`/dataset.usda, in a new folder.

    Raises InputError for invalid input, StageError and UnsupportedError for a USD target, and OutputError; then `out`
    does not exist.
    """
    _refuse_without_pictures(options)
    with nothing_left_of(Path(options.out)):
        reads = f"{options.poses or options.scenario or options.sample} or {options.target}"
        within, writes = AUTHOR_PATIENCE_S, (Path(options.out).parent,)
        return ask_child(
            AUTHOR, options.as_json(), reads=reads, progress=options.progress, within_s=within, writes=writes
        )


def _refuse_without_pictures(options: AuthorOptions) -> None:
    """Raise InputError unless exactly one source of the pictures is given."""
    given = [name for name in ("poses", "sample", "scenario") if getattr(options, name) is not None]
    if not given:
        do = "give a pose list, such as --poses FILE, or a distribution, --sample 'range=3..10 inside=0.9 count=100'"
        raise InputError("neither poses, sample nor scenario is given", do=do)
    if len(given) > 1:
        raise InputError(f"{' and '.join(given)} are given together", do="give one of them")
    if options.sample is not None:
        return
    if options.count is not None:
        raise InputError("count is given without sample", do="choose poses with frames")
    for name in ("target", "camera"):
        if not getattr(options, name):
            raise InputError(f"{given[0]} is given without {name}", do=f"give {name} too")
