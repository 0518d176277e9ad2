"""The request that a user makes to `render` or `plan`, and the plan of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from spin_usd.dataset.picture.make_picture import IMAGE, KINDS, RADIANCE
from spin_usd.dataset.plan.effort_choice import Chosen
from spin_usd.dataset.plan.make_plan import Plan, Question, make_plan
from spin_usd.dataset.plan.work import RunOptions
from spin_usd.dataset.process.devices import AUTO, refuse_unknown_device, require_device, usable_devices
from spin_usd.dataset.process.open_renderer import DEFAULT_RENDERER, RENDERERS, renderer_entry
from spin_usd.dataset.process.processors import usable_cpus
from spin_usd.errors import InputError
from spin_usd.labels.table import CLOUD_LABELS, DEFAULT_LABELS, LABELS, LABELS_OF_SEVERAL, PIXEL_LABELS
from spin_usd.progress import Progress
from spin_usd.scene.effort import CPU, Effort

IMAGE_SUFFIXES = (".png", ".jpg")


@dataclass(frozen=True, kw_only=True)
class RenderRequest:
    """The request that a user makes to `render` or `plan`. chosen: why the effort is what it is, where it was not
    given · device: renders the light, one of renderers.device.DEVICES or AUTO · offered: labels that are made too where
    the stage has what they are made of."""

    stage: Path
    frames: str | None = None
    variants: tuple[str, ...] = ()
    effort: Effort
    chosen: Chosen | None = None
    seed: int | None = None
    renderer: str = DEFAULT_RENDERER
    device: str = CPU
    labels: tuple[str, ...] = DEFAULT_LABELS
    offered: tuple[str, ...] = ()
    image: bool = True
    radiance: bool = False
    image_suffix: str = ".png"

    def __post_init__(self) -> None:
        for label in self.labels:
            if label not in LABELS:
                raise InputError(f"there is no label {label!r}", do=f"choose among {', '.join(LABELS)}")
        refuse_unknown_device(self.device, AUTO)
        if self.device not in (CPU, AUTO):
            self._refuse_device()
        heeded = renderer_entry(self.renderer).effort
        if unused := set(self.effort.unusual) - heeded:
            found = f"{self.renderer} has no {' and no '.join(sorted(unused))}"
            raise InputError(found, where=self.effort.text, do=f"give it only {' and '.join(sorted(heeded))}")
        if self.image_suffix not in IMAGE_SUFFIXES:
            formats = " or ".join(suffix.removeprefix(".") for suffix in IMAGE_SUFFIXES)
            raise InputError(f"images cannot be {self.image_suffix[1:]!r}", do=f"choose {formats}")
        if not self.kinds:
            raise InputError("no file is asked for", do="ask for labels, the image, or both")

    def _refuse_device(self) -> None:
        """Raise InputError where no light is rendered on the device that is named."""
        if not self.renders:
            raise InputError(f"device {self.device} is given where no light is rendered", do="leave --device out")
        if not renderer_entry(self.renderer).graphics:
            able = " or ".join(f"--renderer {name}" for name, entry in RENDERERS.items() if entry.graphics)
            found = f"the renderer {self.renderer} renders on the CPU alone, and the device {self.device} is asked for"
            raise InputError(found, do=f"leave --device out, or choose {able}")

    def devices(self) -> tuple[str, ...]:
        """Return the devices of this machine that may render the light, the best first. Raises UnsupportedError where
        the one that is asked for is not there."""
        if self.device == AUTO and self.renders and renderer_entry(self.renderer).graphics:
            return tuple(usable_devices())
        name = CPU if self.device == AUTO else self.device
        require_device(name)
        return (name,)

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of file asked for of each picture."""
        wanted = {*self.labels, *([IMAGE] if self.image else []), *([RADIANCE] if self.radiance else [])}
        return tuple(kind for kind in KINDS if kind in wanted)

    @property
    def renders(self) -> bool:
        """Whether pictures take a renderer: labels alone take none."""
        return self.image or self.radiance


def plan(
    request: RenderRequest,
    *,
    progress: Progress,
    explain: bool = False,
    copy_to: Path | None = None,
    had: Sequence[str] = (),
) -> Plan:
    """Plan what a run would make. With `explain` the plan also says what work is skipped, and why. `had`: the kinds of
    file that the dataset has, which pictures that are made again keep.

    Writes nothing, unless `copy_to` is given: then the stage is first copied into that folder, and the copy is planned.
    """
    question = Question(
        stage=request.stage,
        variants=request.variants,
        frames=request.frames,
        renderer=request.renderer,
        effort=request.effort,
        seed=request.seed,
        devices=request.devices(),
        image_suffix=request.image_suffix if request.image else None,
        renders=request.renders,
        labels=tuple(kind for kind in LABELS if kind in (*request.labels, *request.offered, *had)),
        copy_to=copy_to,
        explain=explain,
    )
    return make_plan(question, processes=len(usable_cpus()), progress=progress)


def wanted_kinds(request: RenderRequest, plan: Plan) -> tuple[str, ...]:
    """Return the kinds of file to make of each picture: those asked for, of several bodies what tells them apart, and
    what is offered where the stage has a LiDAR. Raises InputError for a LiDAR's label where it has none, and for one
    that cannot hold so many targets."""
    _refuse_targets(request, len(plan.description["targets"]))
    has_lidar, clouds = plan.description["lidar"], [kind for kind in request.kinds if kind in CLOUD_LABELS]
    if clouds and not has_lidar:
        do = "author it with --lidar, for example --lidar flash, or leave that label out"
        raise InputError(f"has no LiDAR, which the label {clouds[0]} needs", where=request.stage, do=do)
    of_pixels = any(kind in PIXEL_LABELS for kind in request.kinds)
    more = LABELS_OF_SEVERAL if of_pixels and plan.description["bodies"] > 1 else ()
    offered = request.offered if has_lidar else ()
    return tuple(kind for kind in KINDS if kind in (*request.kinds, *more, *offered))


def _refuse_targets(request: RenderRequest, count: int) -> None:
    """Raise InputError where a label that is asked for cannot hold so many targets."""
    for name in request.kinds:
        label = PIXEL_LABELS.get(name)
        if label and label.max_targets is not None and count > label.max_targets:
            do = "leave that label out: instance holds any number of targets"
            found = f"has {count} targets, and the label {name} holds {label.max_targets} at most"
            raise InputError(found, where=request.stage, do=do)


def run_options(request: RenderRequest, plan: Plan) -> RunOptions:
    """Return how all pictures of the run are made."""
    width, height = plan.description["camera"]
    return RunOptions(
        renderer=request.renderer,
        effort=request.effort,
        kinds=wanted_kinds(request, plan),
        frame_pixels=width * height,
    )
