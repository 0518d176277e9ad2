"""The options of the commands: each is defined once, here or with its command, with type, default, help and limits.

A command's options are a frozen dataclass. Each field is an option of the command line (`terminal.parameters`) and
an argument of the function in `import spin_usd` (`takes`). The command line builds the dataclass and passes it to the
work as a whole (`run_with`). A field without an `Option`, such as `on_progress`, belongs to the function only.
"""

from collections.abc import Callable, Collection, Sequence
from copy import copy
from dataclasses import KW_ONLY, MISSING, Field, dataclass, fields
from functools import wraps
from inspect import Parameter, Signature, cleandoc, signature
from numbers import Integral, Real
from pathlib import Path
from textwrap import wrap
from types import UnionType
from typing import Annotated, Any, ParamSpec, Protocol, Self, TypeVar, cast, get_args, get_origin, get_type_hints

from spin_usd.basics.faults import reading
from spin_usd.basics.progress import Note, Progress, no_note, no_progress
from spin_usd.completions import listed_in
from spin_usd.errors import InputError
from spin_usd.files.url import is_url, refuse_unless_path
from spin_usd.scene.effort import CPU

P = ParamSpec("P")
R = TypeVar("R")
O = TypeVar("O", bound="Options")

WEEK_S = 604800
MAX_WORKERS = 1024  # more than any machine has processors for, and a slip of the hand is caught


@dataclass(frozen=True)
class Option:
    """The description of an option besides its name, type and default.

    metavar: placeholder of the value in the help
    flag: name on the command line, if it differs from the field's
    words: completions for a shell
    at_least, at_most: limits of a number
    url: the path may be a URL
    name_or_path: a name may replace the path
    repeated: a list; the flag is repeated for each entry
    also: a sentence for the function's docstring only
    """

    help: str
    metavar: str = ""
    flag: str = ""
    words: Callable[[str], Collection[str]] | None = None
    at_least: int | None = None
    at_most: int | None = None
    url: bool = False
    name_or_path: bool = False
    repeated: bool = False
    also: str = ""


def flag_of(name: str, option: Option | None = None) -> str:
    """Return how the command line spells the option of that name."""
    return option.flag if option and option.flag else f"--{name.replace('_', '-')}"


class Argument(Option):
    """A positional argument."""


@dataclass(frozen=True)
class Options:
    """The options of a command. Raises InputError for a value that its type does not allow, a number beyond its limits,
    and a path that is empty, or a URL where none may be; numpy's numbers become Python's."""

    def __post_init__(self) -> None:
        hints = get_type_hints(type(self), include_extras=True)
        for field in fields(self):
            value, hint, option = plain(getattr(self, field.name)), *described(hints[field.name])
            object.__setattr__(self, field.name, value)
            _refuse_unless_allowed(field.name, value, hint)
            if {Path, Sequence[Path]} & set(_choices(hint)):
                _refuse_unless_paths(field.name, value, url=bool(option and option.url))
            if option and isinstance(value, int | float):
                _refuse_beyond(field.name, value, option)

    def as_json(self) -> dict[str, Any]:
        """Return the options as JSON values without callbacks; a child process builds the options from them again."""
        hints = get_type_hints(type(self), include_extras=True)
        named = (field.name for field in fields(self) if described(hints[field.name])[1])
        return {name: _as_json(getattr(self, name)) for name in named}


@dataclass(frozen=True, kw_only=True)
class Listening(Options):
    """on_progress: called with the name of the counted things, the number done and the total."""

    on_progress: Progress | None = None

    @property
    def progress(self) -> Progress:
        return no_progress if self.on_progress is None else self.on_progress

    def telling(self, on_progress: Progress) -> Self:
        """Return the options with that listener; the other fields are validated already."""
        return _with_listeners(self, on_progress=on_progress)


@dataclass(frozen=True, kw_only=True)
class ListeningToNotes(Listening):
    """on_note: called with each message of the running work, one sentence."""

    on_note: Note | None = None

    @property
    def note(self) -> Note:
        return no_note if self.on_note is None else self.on_note

    def telling(self, on_progress: Progress, on_note: Note | None = None) -> Self:
        """Return the options with these listeners; the other fields are validated already."""
        return _with_listeners(self, on_progress=on_progress, on_note=on_note)


class PublicFunction(Protocol[P, O, R]):
    """A function that takes the fields of options as arguments; the wrapped function takes the dataclass."""

    __wrapped__: Callable[[O], R]

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R: ...


def takes(options: Callable[P, O]) -> Callable[[Callable[[O], R]], PublicFunction[P, O, R]]:
    """Return a decorator that gives a function the fields of the dataclass `options` as its arguments, and adds their
    descriptions to its docstring."""

    def decorate(function: Callable[[O], R]) -> PublicFunction[P, O, R]:
        hints, own = get_type_hints(options), signature(options).parameters.values()
        parameters = [each.replace(annotation=hints[each.name]) for each in sorted(own, key=_place)]
        arguments = Signature(parameters, return_annotation=get_type_hints(function)["return"])

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            given = arguments.bind(*args, **kwargs)  # a wrong name is a TypeError of the function, as Python has it
            with reading():
                return function(options(*given.args, **given.kwargs))

        call.__signature__ = arguments  # type: ignore[attr-defined]
        call.__annotations__ = {each.name: each.annotation for each in parameters}
        call.__doc__ = _documented(cleandoc(function.__doc__ or ""), options, list(arguments.parameters))
        return cast(PublicFunction[P, O, R], call)

    return decorate


def run_with(function: PublicFunction[P, O, R], options: O) -> R:
    """Run the function with an options object, as commands do."""
    with reading():
        return function.__wrapped__(options)


def described(hint: Any) -> tuple[Any, Option | None]:
    """Return the plain type in a field's type, and its `Option`."""
    if get_origin(hint) is not Annotated:
        return hint, None
    return get_args(hint)[0], next((each for each in get_args(hint)[1:] if isinstance(each, Option)), None)


def required(field: "Field[Any]") -> bool:
    """Return whether a value must be given."""
    return field.default is MISSING and field.default_factory is MISSING


def names_in(given: str | Sequence[str]) -> tuple[str, ...]:
    """Return the names in a list or in comma-separated text."""
    names = given.split(",") if isinstance(given, str) else given
    return tuple(name.strip() for name in names if name.strip())


def refuse_together(**given: object) -> None:
    """Raise InputError if more than one of these options is given, that is, not None."""
    names = [name for name, value in given.items() if value is not None]
    if len(names) > 1:
        raise InputError(f"{' and '.join(names)} are given together", do="give one of them")


def plain(value: object) -> object:
    """Return numpy's numbers and truth values as Python's; anything else unchanged."""
    if type(value).__module__ == "numpy" and getattr(value, "shape", None) == ():
        value = value.item()  # type: ignore[attr-defined]
    return value


def _with_listeners(options: O, **listeners: Callable[..., None] | None) -> O:
    """Return a copy of the options with these listeners, without validating it again."""
    told = copy(options)
    for name, listener in listeners.items():
        object.__setattr__(told, name, listener)
    return told


def _as_json(value: object) -> object:
    if isinstance(value, Path):
        return str(value)
    return [_as_json(each) for each in value] if isinstance(value, Collection) and not isinstance(value, str) else value


_NAMES = {
    str: "text",
    Path: "a path",
    int: "a whole number",
    float: "a number",
    bool: "True or False",
    type(None): "None",
}
_CALLBACKS = {
    "on_progress": "called with the name of the counted things, the number done and the total.",
    "on_note": "called with each message of the running work, one sentence.",
}


def _place(parameter: Parameter) -> int:
    """Return the order of the argument: positional ones first, then required ones, callbacks last."""
    if parameter.name in _CALLBACKS:
        return 3
    return (parameter.kind is Parameter.KEYWORD_ONLY) + (parameter.default is not Parameter.empty)


def _documented(text: str, options: Callable[..., Any], names: Sequence[str]) -> str:
    """Return the docstring with the arguments inserted before its last paragraph, which lists the exceptions."""
    hints, lines = get_type_hints(options, include_extras=True), ["Args:"]
    for name in names:
        option = described(hints[name])[1]
        said = f"{option.help} {option.also}".strip() if option else _CALLBACKS[name]
        lines += wrap(f"{name}: {said}", 110, initial_indent="    ", subsequent_indent="        ")
    body, _, last = text.rpartition("\n\n")
    parts = (body, "\n".join(lines), last) if last.startswith("Raises") else (text, "\n".join(lines))
    return "\n\n".join(parts)


def _refuse_unless_allowed(name: str, value: object, hint: Any) -> None:
    choices = _choices(hint)
    if not any(_is_of(value, choice) for choice in choices):
        raise InputError(f"{name} is {value!r}", do=f"make it {' or '.join(map(_name, choices))}")


def _refuse_unless_paths(name: str, value: object, *, url: bool) -> None:
    """Raise InputError if a path among the values is empty or a URL that is not allowed."""
    for each in value if isinstance(value, Collection) and not isinstance(value, str) else (value,):
        if isinstance(each, str | Path) and not (url and each != "" and is_url(each)):
            refuse_unless_path(each, name)


def _refuse_beyond(name: str, value: float, option: Option) -> None:
    low, high = option.at_least, option.at_most
    if not ((low is None or value >= low) and (high is None or value <= high)):  # so that NaN is refused
        raise InputError(f"{name} is {value}", do=f"make it {low} to {high}" if high else f"make it {low} at least")


def _choices(hint: Any) -> tuple[Any, ...]:
    """Return the types of a union; any other type alone."""
    return get_args(hint) if isinstance(hint, UnionType) else (hint,)


def _is_of(value: object, kind: Any) -> bool:
    """Return whether the value is of that type, a plain one, a sequence or a function. True is not a number."""
    if isinstance(value, bool):
        return kind is bool
    if kind in (int, float):
        return isinstance(value, Integral if kind is int else Real)
    if isinstance(kind, type):
        return isinstance(value, kind)
    if get_origin(kind) is not Sequence:
        return callable(value)
    if isinstance(value, str | bytes) or not isinstance(value, Collection):
        return False
    return all(any(_is_of(each, one) for one in _choices(get_args(kind)[0])) for each in value)


def _name(kind: Any) -> str:
    """Return the name of the type for a sentence."""
    if get_origin(kind) is Sequence:
        return f"a list, each {' or '.join(map(_name, _choices(get_args(kind)[0])))}"
    return _NAMES.get(kind, "a function")


STAGE = "A stage's root layer, or the folder with its dataset.usda."
Stage = Annotated[str | Path, Argument(STAGE)]
Dataset = Annotated[str | Path, Argument("A dataset's folder.")]
Frames = Annotated[str | None, Option("A subset of the frames, as a Python slice that counts from 0.", "A:B:STEP")]
Frame = Annotated[str, Option("A frame's name, such as img000001, or its number, counted from 0.", "FRAME")]
Variant = Annotated[str, Option("The variant of the frame.", "NAME")]
Variants = Annotated[
    str | Sequence[str],
    Option("Names, patterns such as 'noisy_*', or all; the variants that the stage lists if not given.", "NAME,..."),
]
UnitsPerMetre = Annotated[float | None, Option("The model's units per metre: 100 for centimetres.", "X")]
Prim = Annotated[str | None, Option("The prim to use of a USD target; / for all root prims.", "PATH")]
AnySize = Annotated[bool, Option("Accept a model of any size, even one with the camera inside it.")]
Seed = Annotated[int | None, Option("Seed of all random numbers, instead of the stage's own.", "N")]
Workers = Annotated[
    int | None, Option("Worker processes; as many as fit if not given.", "N", at_least=1, at_most=MAX_WORKERS)
]
Quality = Annotated[
    str | None,
    Option(
        "Named settings: preview, draft, standard (the default) or reference.",
        "NAME",
        words=listed_in("spin_usd.scene.effort", "QUALITIES"),
    ),
]
RendererName = Annotated[
    str | None,
    Option(
        "blender (the default) or raycast.",
        "NAME",
        flag="--renderer",
        words=listed_in("spin_usd.processes.open_renderer", "RENDERERS"),
    ),
]


@dataclass(frozen=True)
class ChosenPictures(Options):
    """The chosen pictures of a stage."""

    stage: Stage
    _: KW_ONLY
    frames: Frames = None
    variants: Variants = ()


@dataclass(frozen=True, kw_only=True)
class EffortOptions(Options):
    """The effort for a picture's light, given in one of several ways."""

    samples: Annotated[
        int | None,
        Option("Light samples per pixel, instead of the 16 of quality standard; the denoiser stays on.", "N"),
    ] = None
    effort: Annotated[
        str | None,
        Option(
            "Settings of the renderer, such as samples=16,denoiser=fast; see docs/how-to/speed-against-accuracy.md.",
            "NAME=VALUE,...",
        ),
    ] = None
    quality: Quality = None


@dataclass(frozen=True, kw_only=True)
class ResolvedOptions(EffortOptions, ChosenPictures):
    """Options that change pictures, and whose effects are in the records: effort, seeds, files and the like."""

    error: Annotated[
        str | float | None,
        Option(
            "Use the cheapest settings with a relative error of at most X, such as 0.05, as spin-usd measure found; "
            "auto takes the noise of the stage's own detector.",
            "X",
        ),
    ] = None
    measured: Annotated[
        str | Path | None,
        Option("With --error: the output folder of spin-usd measure; the one beside the stage if not given.", "PATH"),
    ] = None
    seed: Seed = None
    labels: Annotated[
        str | Sequence[str], Option("Labels to write, such as default,range; or all, or none.", "NAME,...")
    ] = "default"
    labels_only: Annotated[bool, Option("Write labels, but no images.")] = False
    renderer: RendererName = None
    device: Annotated[
        str,
        Option(
            "Device that renders the light: cpu, optix, cuda, hip, metal or oneapi; auto for the best available. "
            "Labels always run on the CPU.",
            "NAME",
            words=listed_in("spin_usd.processes.devices", "DEVICES", "auto"),
        ),
    ] = CPU
    radiance: Annotated[bool, Option("Also write linear radiance as EXR.")] = False


@dataclass(frozen=True, kw_only=True)
class PictureOptions(ResolvedOptions):
    """Options that change the pictures of `render` and `plan`. A record contains each of this class, by its name,
    whose value is not the default. Workers get them too."""

    image_format: Annotated[str, Option("png or jpg.", "NAME")] = "png"

    @property
    def recorded(self) -> dict[str, Any]:
        """The options that records contain, by their names."""
        own = [field for field in fields(PictureOptions) if field.name not in _RESOLVED]
        return {field.name: value for field in own if (value := getattr(self, field.name)) != field.default}


_RESOLVED = {field.name for field in fields(ResolvedOptions)}


@dataclass(frozen=True, kw_only=True)
class RunOptions(Options):
    """How `render` runs; these options change no byte of a picture."""

    workers: Workers = None
    cluster: Annotated[
        str | None, Option("Render on a Ray cluster: auto, HOST:PORT, or ray://HOST:PORT.", "ADDRESS")
    ] = None
    no_cache: Annotated[bool, Option("Keep no renders for later runs; changes no byte of a picture.")] = False
    prune: Annotated[bool, Option("Remove pictures from the dataset that are not in the stage.")] = False
    replace: Annotated[
        bool,
        Option(
            "If the dataset was made from another stage, remove all its pictures first; otherwise this is an error."
        ),
    ] = False
    verify: Annotated[
        bool,
        Option(
            "First compare every existing file with its digest, and make damaged pictures again. (check --repair does "
            "the same without the stage.)"
        ),
    ] = False
    shard: Annotated[
        str | None,
        Option(
            "Make part I, counted from 0, of a run in N parts; spin-usd merge joins the parts. See "
            "docs/how-to/cluster.md.",
            "I/N",
            also="Each shard writes its own folder.",
        ),
    ] = None
    picture_timeout: Annotated[
        float | None,
        Option(
            "Limit of the processor time of the busiest thread for one picture, 1 s to a week. A picture beyond it is "
            "retried once, then reported as failed. If not given, ten times the expected time, at least a minute.",
            "SECONDS",
            at_least=1,
            at_most=WEEK_S,
        ),
    ] = None
