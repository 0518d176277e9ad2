"""The child's part of `debug`: it reads the scene of one picture, and has Blender write it."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import spin_usd
from spin_usd.basics.progress import Progress
from spin_usd.commands.debug.calls import WriteBlend, WrittenBlend
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.processes.open_renderer import DEFAULT_RENDERER, open_scene_writer
from spin_usd.records.record import StageProvenance
from spin_usd.renderers.background.sky import sky
from spin_usd.renderers.downscale import reduced
from spin_usd.renderers.renderer import OpenableScene
from spin_usd.scene.derived.content_keys import (
    KeyMaker,
    Keys,
    RenderSettings,
    background_seed,
    render_seed,
)
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.finding import in_sentences
from spin_usd.scene.scene import Scene
from spin_usd.sensor.exposure import exposed
from spin_usd.stage.read.frames import frame_named
from spin_usd.stage.read.stage_reader import StageReader
from spin_usd.studio.studio import Studio

PREVIEW = "raycast"  # renderer
STEP, STEPS = "debug: step", 3  # the scene is read, its sky and exposure are computed, the file is written

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
render or beside it. Labels see no blur. The share of noise between several lights differs a little, for Blender chooses
among lights by their own strengths; and Cycles denoises the sum of all light, spin_usd each light by itself. What lies
behind is a picture: it does not move with the camera."""


def write_blend(request: WriteBlend, progress: Progress) -> WrittenBlend:
    """Write a picture's scene, as it is rendered with the request's effort, into a new file."""
    progress(STEP, 0, STEPS)
    reader = StageReader(request.stage, variant=request.variant)
    scene = reader.scene(frame_named(reader.frames, request.frame, request.stage))
    progress(STEP, 1, STEPS)
    seed = reader.seed if request.seed is None else request.seed
    settings = RenderSettings(renderer=DEFAULT_RENDERER, effort=request.effort, seed=seed)
    rendered = reduced(scene, settings.effort.reduction)
    openable = OpenableScene(
        scene=rendered,
        effort=_in_own_light(settings.effort, scene),
        seed=render_seed(scene, settings),
        behind=sky(rendered, seed=background_seed(scene, settings)),
        camera_path=reader.camera_path,
        exposure=_exposure(scene, settings),
        readme=readme(scene, settings, KeyMaker(settings).keys(scene), request.stage, reader.provenance("stage")),
    )
    progress(STEP, 2, STEPS)
    open_scene_writer().write(openable, Path(request.file))
    progress(STEP, STEPS, STEPS)
    return WrittenBlend(frame=scene.frame.name, notes=tuple(in_sentences(reader.notes)))


def _in_own_light(effort: Effort, scene: Scene) -> Effort:
    """Return the effort for a render in the lights' own strengths, with the clamp scaled to them."""
    brightest = max((sum(gain) / 3 for gain in in_unit_light(scene).gains), default=1.0)
    return replace(effort, clamp=float(effort.clamp * brightest))


def _exposure(scene: Scene, settings: RenderSettings) -> float:
    """Return the factor from radiance to the detector's full scale, by a preview if the detector meters itself."""
    if scene.sensor.auto_exposure is None:
        return scene.sensor.exposure
    preview = replace(settings, effort=Effort(samples=1))
    studio = Studio(replace(preview, renderer=PREVIEW))
    studio.open_renderer()
    return exposed(scene.sensor, studio.maker.radiance(scene, preview, Stopwatch())).exposure


def readme(
    scene: Scene, settings: RenderSettings, keys: Keys, stage: str, provenance: StageProvenance
) -> tuple[str, ...]:
    """Return the lines of the text."""
    return (*_origin(scene, settings, keys, stage, provenance), "", *HELD.splitlines(), "", *_rest())


def _rest() -> tuple[str, ...]:
    return (*AXES.splitlines(), "", *LACKING.splitlines())


def _origin(
    scene: Scene, settings: RenderSettings, keys: Keys, stage: str, provenance: StageProvenance
) -> Iterator[str]:
    frame = scene.frame
    yield f"spin_usd {spin_usd.__version__}: frame {frame.name} of the variant {frame.variant}"
    yield ""
    yield f"stage: {Path(stage).parent.name}/{Path(stage).name}"
    yield f"stage hash: {provenance.hash}"
    yield f"frame: number {frame.index}, time code {frame.time_code:g}"
    yield "variants: " + (", ".join(f"{name}={chosen}" for name, chosen in provenance.variants.items()) or "none")
    yield f"effort: {settings.effort.text}; seed {settings.seed}"
    for name in ("geometry", "radiance", "exposure"):
        yield f"{name} key: {getattr(keys, name)}"
