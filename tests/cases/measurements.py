"""Measurements made by hand."""

from spin_usd.accuracy.measurement import Configuration, Figures, MeasuredPicture, Measurement
from spin_usd.scene.effort import QUALITIES, Effort, parse_effort

NOISE_DN = 1.5


def setting(effort, renderer="blender"):
    """`effort`: an Effort, or its text."""
    return Configuration(renderer=renderer, effort=effort if isinstance(effort, Effort) else parse_effort(effort))


def figures(
    setting, *, cpu_s, error=0.0, frame="a", error_dn=None, bias=0.0, uncertainty=0.0, error_dn_uncertainty=0.0
):
    """`error` and `bias`, relative, and `uncertainty` of the error's square; `error_dn` and its uncertainty in digital
    numbers, 10 times the error where it is not given."""
    return Figures(
        frame=frame,
        setting=setting,
        seeds=4,
        cpu_s=cpu_s,
        wall_s=cpu_s / 2,
        memory_bytes=300_000_000,
        variance=error**2 - bias**2,
        bias_squared=bias**2,
        uncertainty=uncertainty,
        brightness=-0.01,
        error_dn=10 * error if error_dn is None else error_dn,
        error_dn_uncertainty=error_dn_uncertainty,
        structure=error / 4,
    )


def frame(name="a", noise_dn=NOISE_DN):
    return MeasuredPicture(
        name=name,
        index=0,
        region=(10, 20, 90, 80),
        target_pixels=2400,
        reference_samples=4096,
        reference_error=0.0004,
        noise_dn=noise_dn,
    )


def measurement(each, frames=None, **fields):
    """Of the figures `each`."""
    usual = {"stage": "5" * 64, "variant": "nominal", "machine": {"cores": 2}, "versions": {"bpy": "5.2.3"}}
    return Measurement(**{**usual, **fields}, frames=tuple(frames or [frame()]), figures=tuple(each))


def usual(noise_dn=NOISE_DN):
    """Of a stage's three pictures: plain and denoised samples, a few others, and the preview of raycast."""
    frames = [frame(name, noise_dn) for name in ("img000001", "img000007", "img000003")]
    made = []
    for i, each in enumerate(frames):
        share = 1 + 0.4 * i
        for n in (1, 2, 4, 8, 16, 32, 64, 256):
            plain = setting(f"samples={n}")
            made.append(figures(plain, cpu_s=share * (0.15 + 0.06 * n), error=0.4 * share / n**0.5, frame=each.name))
            fast = setting(f"samples={n},denoiser=fast")
            error = (0.02**2 + (0.11 * share) ** 2 / n) ** 0.5
            made.append(figures(fast, cpu_s=share * (0.25 + 0.06 * n), error=error, bias=0.02, frame=each.name))
        for name in ("preview", "draft", "standard"):
            named = setting(QUALITIES[name])
            made.append(figures(named, cpu_s=share * (0.3 + 0.08 * named.effort.samples), error=0.4, frame=each.name))
        for text, cpu_s, error in (
            ("samples=64,adaptive=0.05", 1.9, 0.07),
            ("samples=16,bounces=0", 1.0, 0.16),
            ("samples=16,reduction=2", 0.5, 0.2),
            (QUALITIES["reference"], 16.0, 0.024),
        ):
            made.append(figures(setting(text), cpu_s=share * cpu_s, error=error, frame=each.name))
        preview = setting("samples=1", "raycast")
        made.append(figures(preview, cpu_s=0.05, error=0.7, bias=0.69, frame=each.name))
    return measurement(made, frames)
