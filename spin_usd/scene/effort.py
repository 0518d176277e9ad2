"""Effort: the settings that trade a render's speed for its accuracy."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Annotated, Any, Literal, TypeAlias, get_args

from msgspec import Meta

from spin_usd.errors import InputError

CPU = "cpu"  # the device that renders light by default
Denoiser: TypeAlias = Literal["none", "fast", "balanced", "high"]
DENOISERS: tuple[Denoiser, ...] = get_args(Denoiser)
MAX_SAMPLES = 1 << 20
MAX_BOUNCES = 1024  # as many as Cycles takes
MAX_FILTER_GLOSSY = 10  # as much as Blender takes
Reduction: TypeAlias = Literal[1, 2, 4, 8]
REDUCTIONS: tuple[Reduction, ...] = get_args(Reduction)
LOOKS_EVERY = 16  # samples after which adaptive sampling looks at the noise, and so the least that it takes


@dataclass(frozen=True, kw_only=True)
class Effort:
    """The settings that decide a render's cost and accuracy.

    The defaults are those of an effort's text, which names differences from plain path tracing; the default of `render`
    is DEFAULT_QUALITY. Unit light, in which some are given: the strongest light's irradiance is 1 W/m2 (beside emissive
    parts, the power of 16 nearest to its own), so that a white diffuse surface that faces it has the radiance 1/pi.
    """

    samples: Annotated[int, Meta(ge=1, description="Rays through each pixel.")] = 16
    adaptive: Annotated[
        float,
        Meta(
            ge=0,
            lt=1,
            description="The noise at which a pixel takes no more of them, 0.01 to 0.1 as usual; it is looked at after "
            "every 16th, as Cycles measures it in unit light. 0: every pixel takes all.",
        ),
    ] = 0.0
    denoiser: Annotated[Denoiser, Meta(description="Quality of Open Image Denoise.")] = "none"
    bounces: Annotated[
        int,
        Meta(
            ge=0,
            description="How often light may go from part to part of the target at most, on its way from its source, "
            "lamp or emissive part, to the camera: 1 for each part but the first.",
        ),
    ] = 4
    clamp: Annotated[
        float,
        Meta(
            ge=0,
            description="The most that one indirect contribution, light by way of another part, may add to a sample's "
            "radiance, mean of red, green and blue, in unit light; 0: any.",
        ),
    ] = 0.0
    filter_glossy: Annotated[
        float,
        Meta(
            ge=0,
            le=MAX_FILTER_GLOSSY,
            description="Cycles' Filter Glossy, against glints: where light of a small source reaches the camera "
            "through two surfaces, and the second spreads it at densities below this, 1/sr, the first "
            "counts as rougher. 0, or absent: actual roughness.",
        ),
    ] = 0.0
    light_tree: Annotated[
        bool,
        Meta(
            description="Whether one of several lights is chosen by its effect at the shaded point, else by its power."
        ),
    ] = True
    reduction: Annotated[
        Reduction, Meta(description="Side, in pixels, of the square that each rendered pixel represents.")
    ] = 1

    def __post_init__(self) -> None:
        for field in fields(self):
            kinds, kind = _KINDS[type(field.default)]
            self._refuse_unless(field.name, type(getattr(self, field.name)) in kinds, kind)
        self._refuse_unless("samples", 1 <= self.samples <= MAX_SAMPLES, f"1 to {MAX_SAMPLES}")
        self._refuse_unless("adaptive", 0 <= self.adaptive < 1, "at least 0 and below 1")
        self._refuse_unless("denoiser", self.denoiser in DENOISERS, f"one of {', '.join(DENOISERS)}")
        self._refuse_unless("bounces", 0 <= self.bounces <= MAX_BOUNCES, f"0 to {MAX_BOUNCES}")
        self._refuse_unless("clamp", 0 <= self.clamp < float("inf"), "0 or more")
        self._refuse_unless("filter_glossy", 0 <= self.filter_glossy <= MAX_FILTER_GLOSSY, f"0 to {MAX_FILTER_GLOSSY}")
        self._refuse_unless("reduction", self.reduction in REDUCTIONS, f"one of {', '.join(map(str, REDUCTIONS))}")

    def _refuse_unless(self, name: str, well: bool, do: str) -> None:
        if not well:
            raise InputError(f"{name} is {getattr(self, name)!r}", where="effort", do=f"make it {do}")

    @property
    def unusual(self) -> tuple[str, ...]:
        """Names of the settings that are not the usual ones."""
        usual = Effort()
        return tuple(f.name for f in fields(self) if getattr(self, f.name) != getattr(usual, f.name))

    @property
    def text(self) -> str:
        """The text that a person writes, such as `samples=16,denoiser=fast`: the samples, and the settings that are not
        the usual ones."""
        return ",".join(f"{k}={_text(getattr(self, k))}" for k in dict.fromkeys(("samples", *self.unusual)))


_KINDS: Mapping[type, tuple[tuple[type, ...], str]] = MappingProxyType(
    {
        int: ((int,), "a whole number"),  # not a bool, though that is an int to Python
        float: ((int, float), "a number"),
        bool: ((bool,), "True or False"),
        str: ((str,), "text"),
    }
)
"""Types of a setting, and their names, by the type of its default."""


QUALITIES: Mapping[str, Effort] = MappingProxyType(
    {
        "preview": Effort(samples=1, denoiser="fast", filter_glossy=0.2),
        "draft": Effort(samples=4, denoiser="fast", filter_glossy=0.2),
        "standard": Effort(samples=16, denoiser="balanced", filter_glossy=0.2),
        "reference": Effort(samples=256, bounces=8, filter_glossy=0.2),
    }
)
"""Efforts with a name, the cheapest first: from the measured fronts of three stages (docs/concepts/accuracy.md)."""

DEFAULT_QUALITY = "standard"
"""The default quality of a render."""


def parse_effort(text: str) -> Effort:
    """Return the effort that `Effort.text` writes so. Raises InputError for a text that is not an effort."""
    kinds = {f.name: f.type for f in fields(Effort)}
    given: dict[str, Any] = {}
    for part in text.split(","):
        name, equals, value = (each.strip() for each in part.partition("="))
        if name in kinds and not value:
            raise InputError(f"effort setting {name} has no value", where=text, do=f"write {name}=value")
        if name not in kinds or not equals or name in given:
            do = f"write name=value,... with each at most once of {', '.join(kinds)}"
            raise InputError(f"{part.strip()!r} is not an effort setting", where=text, do=do)
        given[name] = _parsed(name, value, text)
    return Effort(**given)


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return str(value).removesuffix(".0")  # of floats the shortest text that is exactly them


def _parsed(name: str, value: str, where: str) -> Any:
    usual = getattr(Effort(), name)
    try:
        if isinstance(usual, bool):
            return {"on": True, "off": False}[value]
        return type(usual)(value)
    except (KeyError, ValueError):
        kind = "on or off" if isinstance(usual, bool) else "a number"
        raise InputError(f"{name} is {value!r}", where=where, do=f"make it {kind}") from None
