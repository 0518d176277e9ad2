"""The settings that are measured, and the pictures on which they are."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from spin_usd.accuracy.measurement import Configuration
from spin_usd.scene.effort import DEFAULT_QUALITY, DENOISERS, LOOKS_EVERY, QUALITIES, Effort, Reduction

BASE_SAMPLES = 16  # the default of `render`; one setting at a time is changed around them
STEP = 4  # from one number of samples to the next: half the noise
ADAPTIVE = (0.1, 0.03, 0.01)  # noise at which to stop
BOUNCES = (0, 1, 2, 8)
CLAMPS = (1.0, 0.1)  # white paint that faces the strongest light has 0.3
FILTERS = (0.1, 0.2, 1.0)  # densities, 1/sr: diffuse reflection is below 0.32
REDUCTIONS: tuple[Reduction, ...] = (2, 4)
RAYCAST_SAMPLES = (1, 4, 16)


def settings_to_measure(
    *, max_samples: int, several_lights: bool, glossy: bool, others: Sequence[Effort] = ()
) -> list[Configuration]:
    """Return all settings, each once, none of more than `max_samples`; and the `others`, such as named qualities, of at
    most one STEP more."""
    near = (effort for effort in others if effort.samples <= STEP * max_samples)
    efforts = dict.fromkeys([*_efforts(max_samples, several_lights=several_lights, glossy=glossy), *near])
    blender = [Configuration(renderer="blender", effort=effort) for effort in efforts]
    raycast = [Effort(samples=samples) for samples in RAYCAST_SAMPLES if samples <= max_samples]
    return [*blender, *(Configuration(renderer="raycast", effort=effort) for effort in raycast)]


def base_effort(max_samples: int) -> Effort:
    """Return the effort whose settings are changed one at a time."""
    return Effort(samples=min(BASE_SAMPLES, max_samples))


def _efforts(max_samples: int, *, several_lights: bool, glossy: bool) -> Iterator[Effort]:
    base = base_effort(max_samples)
    for samples in _samples(max_samples):
        for denoiser in DENOISERS:
            yield Effort(samples=samples, denoiser=denoiser)
    for noise in ADAPTIVE if max_samples > LOOKS_EVERY else ():
        yield Effort(samples=max_samples, adaptive=noise)
    for bounces in BOUNCES:
        yield replace(base, bounces=bounces)
    for clamp in CLAMPS:
        yield replace(base, clamp=clamp)
    for density in FILTERS if glossy else ():
        yield replace(base, filter_glossy=density)
    if glossy:
        yield Effort(samples=max_samples, denoiser="high", filter_glossy=QUALITIES[DEFAULT_QUALITY].filter_glossy)
    if several_lights:
        yield replace(base, light_tree=False)
    for reduction in REDUCTIONS:
        yield replace(base, reduction=reduction)


def _samples(most: int) -> list[int]:
    """Return the numbers of samples 1, 4, 16, ... and the most."""
    found = [1]
    while found[-1] * STEP < most:
        found.append(found[-1] * STEP)
    return found if found[-1] == most else [*found, most]


def representative(pixels: Mapping[int, int], count: int) -> list[int]:
    """Return the keys of `count` pictures, in their order, with `pixels` to render each: the middle ones of equal
    shares of all non-empty pictures, from the smallest to the largest."""
    ordered = sorted((key for key, size in pixels.items() if size > 0), key=lambda key: (pixels[key], key))
    few = min(count, len(ordered))
    return sorted(ordered[(2 * i + 1) * len(ordered) // (2 * few)] for i in range(few))
