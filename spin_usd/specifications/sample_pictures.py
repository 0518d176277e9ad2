"""Sample a `sample` table for an opened stage: apply distributions, units and constraints to the stage's contents."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from msgspec import structs

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.sampling.constraints import CONSTRAINTS, GROUPS, PLANET_BEHIND, Constraint, planet_behind
from spin_usd.sampling.distribution import Choice, Distribution, Fixed, LogUniform, Normal, Uniform, Value
from spin_usd.sampling.sample import ParameterValues, Sample, Shared, distribution_of, sample_all, sample_one
from spin_usd.scene.environment import Sky
from spin_usd.scene.material import LIMITS
from spin_usd.specifications.sample_table import SampleEntry
from spin_usd.stage.augment.attribute_change import BaseStage
from spin_usd.stage.augment.body_axes import body_rotations
from spin_usd.stage.augment.lights import SUNS
from spin_usd.stage.augment.materials import material_names
from spin_usd.stage.augment.parameter import Parameter
from spin_usd.stage.augment.parameters import FIELDS, MATERIAL, parameter_named
from spin_usd.stage.augment.planet import PLANET
from spin_usd.stage.augment.sampled_values import SampledValues, sampled_values
from spin_usd.stage.augment.sun_and_planet import read_sky
from spin_usd.stage.usd.values import Range

MAX_TRIES = 1000
EACH = "material.each."
ALWAYS = Constraint(
    description="The whole target is before the planet.", holds=planet_behind, bears_on=GROUPS[1], needs_planet=True
)
Check = Callable[[Value], None]


@dataclass(frozen=True, kw_only=True)
class SampledPictures:
    """The pictures of a base, by their names."""

    names: Sequence[str]
    shared: Shared = field(default_factory=dict)
    """Name for which each picture's value is sampled, for parameters per frame whose value several pictures share. They
    change together if a constraint requires another sample."""

    def sampled_for(self, parameter: str) -> Sequence[str]:
        return self.shared.get(parameter, self.names)


def sample_pictures(
    base: BaseStage,
    pictures: SampledPictures,
    entries: Sequence[SampleEntry],
    *,
    seed: int,
    name: str,
    constraints: Mapping[str, float] | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> SampledValues:
    """Sample the `entries` for `name`, as `draw_values` does, and return their changes of the `pictures` of `base`,
    whose variants are selected."""
    samples = samples_on(base, entries)
    draws = draw_values(base, pictures, samples, seed=seed, name=name, constraints=constraints)
    return sampled_values(base, draws.constant, draws.per_frame, progress)


def draw_values(
    base: BaseStage,
    pictures: SampledPictures,
    samples: Sequence[Sample],
    *,
    seed: int,
    name: str,
    constraints: Mapping[str, float] | None = None,
) -> ParameterValues:
    """Draw the `samples` of `base` for `name` and its `pictures`.

    A value depends only on the seed, `name`, the parameter's name and, if it is per frame, the picture's name. Raises
    InputError that names the parameter, or the picture and the constraint that cannot be met.
    """
    draws = sample_all(samples, seed=seed, name=name, frames=pictures.names, shared=pictures.shared)
    draws = _Resampling(base, pictures, samples, seed, name).placed(draws, constraints or {})
    for parameter, values in (*((p, [v]) for p, v in draws.constant.items()), *draws.per_frame.items()):
        for value in values:
            parameter_named(parameter).check(value)
    return draws


def samples_on(base: BaseStage, entries: Sequence[SampleEntry]) -> tuple[Sample, ...]:
    """Return the entries' distributions within the limits of the changed attributes in `base`. Raises InputError that
    names the parameter."""
    return tuple(_on_base(base, sample) for sample in samples_for(_of_each_material(base, entries)))


def _of_each_material(base: BaseStage, entries: Sequence[SampleEntry]) -> Sequence[SampleEntry]:
    """Return the entries, with material.each.INPUT replaced by one entry for each material without its own, sampled
    separately."""
    said = {entry.parameter for entry in entries}
    found: list[SampleEntry] = []
    for entry in entries:
        if not entry.parameter.startswith(EACH):
            found.append(entry)
            continue
        own = [f"material.{name}.{entry.parameter.removeprefix(EACH)}" for name in material_names(base.stage)]
        if not own:
            raise InputError(
                "no target has a material that can be overridden", where=entry.parameter, do="leave it out"
            )
        found += [replace(entry, parameter=name) for name in own if name not in said]
    return found


def samples_for(entries: Sequence[SampleEntry]) -> tuple[Sample, ...]:
    """Return the entries' distributions in the parameters' own units and within their limits. Raises InputError that
    names the parameter."""
    samples = {entry.parameter: _sample(entry) for entry in entries}
    for sample in samples.values():
        if wrong := _wrong_link(sample, samples.get(sample.stream)):
            found = f"cannot be chosen together with {sample.stream}: {wrong}"
            raise InputError(found, where=sample.parameter, do="correct together, or leave it out")
    return tuple(samples.values())


def _wrong_link(sample: Sample, leader: Sample | None) -> str:
    """Return why the sample cannot have the values of the same place as its `leader`, whose name its distribution
    gives; empty if it can, or names none."""
    own = sample.distribution
    if not (isinstance(own, Choice) and own.together):
        return ""
    if leader is None or leader is sample:
        return "that is the parameter itself" if leader else "it is not sampled here"
    its = leader.distribution
    if not isinstance(its, Choice) or its.together:
        return f"it follows {its.together}; name that" if isinstance(its, Choice) else "it is not a choice"
    if len(own.values) != len(its.values):
        return f"there are {len(own.values)} values, and {len(its.values)} of it"
    if own.weights != its.weights or sample.per_frame != leader.per_frame:
        return "their weights differ" if own.weights != its.weights else "one is sampled once, the other per picture"
    kinds = _resampled_with(sample.parameter), _resampled_with(leader.parameter)
    apart = kinds[0] != kinds[1] and (all(kinds) or PLANET in kinds)
    return "they are sampled again apart, to meet constraints" if apart else ""


def _resampled_with(parameter: str) -> str:
    """Return the name of the group in which the parameter is sampled again; empty if no constraint bears on it."""
    if parameter.startswith(PLANET):
        return PLANET
    return parameter if parameter in SUNS else GROUPS[0][0] if parameter in GROUPS[0] else ""


def _sample(entry: SampleEntry) -> Sample:
    parameter = parameter_named(entry.parameter)
    if entry.per_frame and not parameter.changes:
        raise InputError("cannot change from picture to picture", where=parameter.name, do="leave per out")
    try:
        distribution = limited(distribution_of(entry.words, parameter.factor(entry.unit)), parameter)
    except InputError as error:
        raise InputError(error.found, where=entry.parameter, do=error.do) from None
    return Sample(parameter=entry.parameter, distribution=distribution, per_frame=entry.per_frame)


def _on_base(base: BaseStage, sample: Sample) -> Sample:
    """Return the sample within the limits that the multiplied value in `base` sets for a factor."""
    name = sample.parameter
    if not is_material_factor(name):
        return sample
    check_ends(sample.distribution, partial(check_factor, base, name))
    try:
        return replace(sample, distribution=cut(sample.distribution, factor_limits(base, name)))
    except InputError as error:
        raise InputError(error.found, where=name, do=error.do) from None


@dataclass(frozen=True, kw_only=True)
class _AskedConstraint:
    """A constraint with its angle, by the name that a specification gives it."""

    name: str
    degrees: float
    constraint: Constraint


class _Resampling:
    """Samples again, group after group, until constraints are met."""

    def __init__(
        self, base: BaseStage, pictures: SampledPictures, samples: Sequence[Sample], seed: int, name: str
    ) -> None:
        self._base, self._pictures, self._seed, self._name = base, pictures, seed, name
        self._samples = {sample.parameter: sample for sample in samples}

    def placed(self, draws: ParameterValues, constraints: Mapping[str, float]) -> ParameterValues:
        """Return `draws`, sampled again where constraints apply until all are met."""
        wanted = [_AskedConstraint(name=n, degrees=d, constraint=CONSTRAINTS[n]) for n, d in constraints.items()]
        moves_planet = any(parameter in draws for parameter in GROUPS[1])
        if not wanted and not moves_planet:
            return draws
        sky = read_sky(self._base)
        if moves_planet and sky.planet is not None:  # without one, its samples are refused by name elsewhere
            wanted.append(_AskedConstraint(name=PLANET_BEHIND, degrees=0.0, constraint=ALWAYS))
        for want in wanted:
            _refuse_without(want, sky)
        last = {want.name: max((i for i, g in enumerate(GROUPS) if self._bears(want, g)), default=0) for want in wanted}
        for index, group in enumerate(GROUPS):
            draws = self._group(draws, group, [want for want in wanted if last[want.name] == index], sky)
        of_sun = [want for want in wanted if {*GROUPS[0]} & {*want.constraint.bears_on}]
        for another in (name for name in SUNS if name in draws):
            draws = self._group(draws, (another,), of_sun, sky)
        return draws

    def _bears(self, want: _AskedConstraint, group: tuple[str, ...]) -> bool:
        return any(p in self._samples and p in want.constraint.bears_on for p in group)

    def _group(
        self, draws: ParameterValues, group: tuple[str, ...], wanted: list[_AskedConstraint], sky: Sky
    ) -> ParameterValues:
        """Sample the group's parameters again until all constraints are met in all pictures."""
        sampled = [self._samples[name] for name in group if name in self._samples]
        moving = [sample for sample in sampled if sample.per_frame] or sampled
        streams = {sample.stream for sample in moving}  # what is chosen together stays together
        moving += [each for each in self._samples.values() if each.stream in streams and each not in moving]
        for again in range(1, MAX_TRIES + 1):
            unmet = self._unmet(draws, group, wanted, sky)
            if unmet is None:
                return draws
            if not moving:
                break
            draws = self._again(draws, moving, unmet[1], again)
        want, wrong = unmet or (wanted[0], np.array([0]))
        what = " and ".join(sample.parameter for sample in moving) or "the stage, without any sample,"
        found = f"no sample of {what} of {MAX_TRIES} meets" if moving else f"{what} does not meet"
        limit = "" if want.name == PLANET_BEHIND else f" = {want.degrees:g}"
        message = f"{found} {want.name}{limit} in picture {self._pictures.names[int(wrong[0])]}"
        raise InputError(message, do="widen the distribution, or loosen the constraint")

    def _unmet(
        self, draws: ParameterValues, group: tuple[str, ...], wanted: list[_AskedConstraint], sky: Sky
    ) -> tuple[_AskedConstraint, np.ndarray] | None:
        """Return the first constraint that is not met, and the indices of the pictures where any is not."""
        now = self._seen(draws, group, sky)
        count = len(self._pictures.names)
        held = [np.broadcast_to(want.constraint.holds(now, want.degrees), count) for want in wanted]
        for want, holds in zip(wanted, held, strict=True):
            if not holds.all():
                return want, np.flatnonzero(~np.logical_and.reduce(held))
        return None

    def _seen(self, draws: ParameterValues, group: tuple[str, ...], sky: Sky) -> Sky:
        """Return `sky` with the sampled values; its Sun is the group's, if any."""
        named = group[0] if group[0] in SUNS else "sun.direction"
        if named in draws:
            sky = replace(sky, sun=_directions(draws.of(named)))
        elif "sun.from_target" in draws:
            sun = np.squeeze(self._R_cam_body @ _directions(draws.of("sun.from_target"))[..., None], -1)
            sky = replace(sky, sun=sun)
        if sky.planet is not None and any(parameter in draws for parameter in GROUPS[1]):
            sky = replace(sky, planet=_planet(draws, sky.planet, sky.radii[1]))
        return sky

    @cached_property
    def _R_cam_body(self) -> Float:
        return body_rotations(self._base)

    def _again(self, draws: ParameterValues, moving: list[Sample], wrong: np.ndarray, again: int) -> ParameterValues:
        constant, per_frame = dict(draws.constant), dict(draws.per_frame)
        for sample in moving:
            if not sample.per_frame:
                constant[sample.parameter] = sample_one(sample, seed=self._seed, name=self._name, again=again)
                continue
            names, column = self._pictures.sampled_for(sample.stream), per_frame[sample.parameter]
            values = {
                own: sample_one(sample, seed=self._seed, name=self._name, frame=own, again=again)
                for own in dict.fromkeys(names[int(i)] for i in wrong)
            }
            per_frame[sample.parameter] = [values.get(own, old) for own, old in zip(names, column, strict=True)]
        return ParameterValues(constant=constant, per_frame=per_frame)


def _refuse_without(want: _AskedConstraint, sky: Sky) -> None:
    if want.constraint.needs_planet and sky.planet is None:
        raise InputError(f"{want.name} is given, but the stage has no planet", do="select an environment with one")
    if "sun.direction" in want.constraint.bears_on and sky.sun is None:
        raise InputError(f"{want.name} is given, but the stage has no Sun", do="select lights with one")


def _planet(draws: ParameterValues, own: Float, longest: float) -> Float:
    """Return the place of the planet's centre, (N, 3) or (1, 3), in the axes and units of `own`."""
    far = np.linalg.norm(own, axis=1, keepdims=True)
    direction = own / far
    if "earth.direction" in draws:
        direction = _directions(draws.of("earth.direction"))
    if "earth.altitude" in draws:
        far = np.array(draws.of("earth.altitude"), np.float64)[:, None] + longest
    placed: Float = direction * far
    return placed


def _directions(sampled: Sequence[Value]) -> Float:
    """Return sampled directions as unit vectors (N, 3)."""
    given = np.array(sampled, np.float64)
    unit: Float = given / np.linalg.norm(given, axis=1, keepdims=True)
    return unit


def limited(distribution: Distribution, parameter: Parameter) -> Distribution:
    """Return `distribution`, a normal one cut at the parameter's limits if it has no ends.

    Raises InputError, with the parameter's name `where`, for ends and values outside of the limits.
    """
    if isinstance(distribution, Uniform | LogUniform):
        parameter.check_span(distribution.low, distribution.high)
    if isinstance(distribution, Normal):
        for end in distribution.ends:
            parameter.check(end)
    check_ends(distribution, parameter.check)
    return cut(distribution, parameter.limits)


def check_ends(distribution: Distribution, check: Check) -> None:
    """Call `check` with every value and both ends of `distribution`; a normal one can be cut."""
    match distribution:
        case Fixed(value=value):
            check(value)
        case Choice(values=values):
            for value in values:
                check(value)
        case Uniform(low=low, high=high) | LogUniform(low=low, high=high):
            check(low)
            check(high)


def cut(distribution: Distribution, limits: Range) -> Distribution:
    """Return a normal distribution cut to samples within `limits`; any other unchanged."""
    if not isinstance(distribution, Normal):
        return distribution
    low, high = max(distribution.low, limits.minimum), min(distribution.high, limits.high)
    return structs.replace(distribution, low=low, high=high)


def is_material_factor(name: str) -> bool:
    """Return whether the parameter multiplies an input of a material."""
    found = MATERIAL.fullmatch(name)
    return bool(found and found[3])


def check_factor(base: BaseStage, name: str, value: Any) -> None:
    """Raise InputError, with the name `where`, for a factor that takes an input of `base` beyond its limits."""
    allowed = _allowed(name)
    for number in _multiplied(base, name, value):
        if number not in allowed:
            found = f"may be sampled as {value}, which turns an input into {number:g}"
            raise InputError(found, where=name, do=f"choose factors that keep it among the {allowed}")


def factor_limits(base: BaseStage, name: str) -> Range:
    """Return the limits of a factor that is one number."""
    allowed, own = _allowed(name), [number for number in _multiplied(base, name, 1.0) if number > 0]
    limits = parameter_named(name).limits
    return Range(
        max([limits.low, *(allowed.low / number for number in own)]),
        min([limits.high, *(allowed.high / number for number in own)]),
    )


def _allowed(name: str) -> Range:
    limits = LIMITS[FIELDS[_input(name)]]
    return Range(limits.low, limits.high)


def _input(name: str) -> str:
    return name.split(".")[2]


def _multiplied(base: BaseStage, name: str, factor: Any) -> Iterator[float]:
    """Yield the products of the factor and inputs without an image, at the first picture."""
    change = parameter_named(name).make(base, (name,))
    values = change.values({name: factor}, base.times[0])
    for attribute, value in zip(change.attributes, values, strict=True):
        if attribute.name == f"inputs:{_input(name)}":
            yield from (float(number) for number in np.ravel(np.array(value, np.float64)))
