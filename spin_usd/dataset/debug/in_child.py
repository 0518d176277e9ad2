"""The child's part of `debug`: it reads the scene of one picture, and has Blender write it."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from spin_usd.dataset.debug.readme import readme
from spin_usd.dataset.plan.in_child import stage_provenance
from spin_usd.dataset.process.open_renderer import DEFAULT_RENDERER, open_renderer, open_scene_writer
from spin_usd.progress import Progress
from spin_usd.renderers.background.sky import sky
from spin_usd.renderers.downscale import reduced
from spin_usd.renderers.renderer import OpenableScene
from spin_usd.scene.derived.content_keys import KeyMaker, RenderSettings, picture_seed, render_seed
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.finding import in_sentences
from spin_usd.scene.model import Scene
from spin_usd.sensor.exposure import exposed
from spin_usd.stage.read.frames import frame_named
from spin_usd.stage.read.stage_reader import StageReader

STEP, STEPS = "debug: step", 3  # the scene is read, its sky and exposure are computed, the file is written


def write_blend(
    *,
    stage: str,
    frame: str,
    variant: str,
    effort: Mapping[str, Any],
    seed: int | None,
    file: str,
    progress: Progress,
) -> dict[str, Any]:
    """Write the picture `frame` of the `variant`, as it is rendered with that `effort`, into the new `file`; return the
    frame's name, and sentences on what is rendered otherwise than the stage authors it."""
    progress(STEP, 0, STEPS)
    reader = StageReader(stage, variant=variant)
    scene = reader.scene(frame_named(reader.frames, frame, stage))
    progress(STEP, 1, STEPS)
    of_dataset = reader.seed if seed is None else seed
    settings = RenderSettings(renderer=DEFAULT_RENDERER, effort=Effort(**effort), seed=of_dataset)
    rendered = reduced(scene, settings.effort.reduction)
    openable = OpenableScene(
        scene=rendered,
        effort=_in_own_light(settings.effort, scene),
        seed=render_seed(scene, settings),
        behind=sky(rendered, seed=picture_seed(scene, settings)),
        camera_path=reader.camera_path,
        exposure=_exposure(scene, settings),
        readme=readme(scene, settings, KeyMaker(settings).keys(scene), stage, stage_provenance(reader)),
    )
    progress(STEP, 2, STEPS)
    open_scene_writer().write(openable, Path(file))
    progress(STEP, STEPS, STEPS)
    return {"frame": scene.frame.name, "notes": in_sentences(reader.notes)}


def _in_own_light(effort: Effort, scene: Scene) -> Effort:
    """Return the effort for a render in the lights' own strengths, which its clamp is in proportion to."""
    brightest = max((sum(gain) / 3 for gain in in_unit_light(scene).gains), default=1.0)
    return replace(effort, clamp=float(effort.clamp * brightest))


def _exposure(scene: Scene, settings: RenderSettings) -> float:
    """Return the factor from radiance to the detector's full scale, by a preview where the detector meters itself."""
    if scene.sensor.auto_exposure is None:
        return scene.sensor.exposure
    light, preview = in_unit_light(scene), open_renderer("raycast")
    radiance = preview.radiance(light.scene, Effort(samples=1), seed=render_seed(scene, settings))
    preview.close()
    return exposed(scene.sensor, radiance.relit(light.gains)).exposure
