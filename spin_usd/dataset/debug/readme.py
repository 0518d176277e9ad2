"""The text README in a .blend: what it shows, what it lacks, and what it was made of."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import spin_usd
from spin_usd.scene.derived.content_keys import Keys, RenderSettings
from spin_usd.scene.model import Scene

AXES = """\
Axes: Blender's world has the axes of the camera: x right, y up, looking along -z; metres. Its origin is the camera, or
the target's centre where the target is far away: the camera shader then starts each ray just before the target, so that
no range costs precision. The camera object stands at the origin in both cases."""
HELD = """\
Press F12: the picture before optics and detector, linear radiance in W/m2/sr, as it is in the render that spin_usd
develops into an image. Save it as OpenEXR to keep its numbers; the screen shows it with the detector's exposure alone.

- camera: Blender's own where that is exact, else the text "camera shader": the lens, its blur and its distortion.
- lights: in their own strengths and colours. spin_usd renders each in unit light, and multiplies afterwards.
- world: domes, and planets that light the target, as one image. The camera does not see it.
- behind: planets, stars, domes and back plate, where there are any, as the camera sees them; by the compositor.
- bodies: one surface each, its parts as vertex groups, its materials by the names of their prims."""
LACKING = """\
Not in it: optics (blur, glare, vignetting), detector (exposure, noise, rows, encoding) and labels, which come after the
render or beside it. Labels see no blur. What several lights share of the noise differs a little, for Blender chooses
among lights by their own strengths; and Cycles denoises the sum of all light, spin_usd each light by itself. What lies
behind is a picture: it does not move with the camera."""


def readme(
    scene: Scene, settings: RenderSettings, keys: Keys, stage: str, provenance: Mapping[str, Any]
) -> tuple[str, ...]:
    """Return the lines of the text."""
    return (*_origin(scene, settings, keys, stage, provenance), "", *HELD.splitlines(), "", *_rest())


def _rest() -> tuple[str, ...]:
    return (*AXES.splitlines(), "", *LACKING.splitlines())


def _origin(
    scene: Scene, settings: RenderSettings, keys: Keys, stage: str, provenance: Mapping[str, Any]
) -> Iterator[str]:
    frame = scene.frame
    yield f"spin_usd {spin_usd.__version__}: frame {frame.name} of the variant {frame.variant}"
    yield ""
    yield f"stage: {Path(stage).parent.name}/{Path(stage).name}"
    yield f"stage hash: {provenance['hash']}"
    yield f"frame: number {frame.index}, time code {frame.time_code:g}"
    yield "variants: " + (", ".join(f"{name}={chosen}" for name, chosen in provenance["variants"].items()) or "none")
    yield f"effort: {settings.effort.text}; seed {settings.seed}"
    for name in ("geometry", "radiance", "exposure"):
        yield f"{name} key: {getattr(keys, name)}"
