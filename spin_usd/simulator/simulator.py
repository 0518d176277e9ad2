"""Pictures of a stage on request, in memory: a child process keeps the stage and the renderer open.

Neither USD nor Blender is loaded into the caller's process.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import Any, Self

import numpy as np
from msgspec import structs
from numpy.typing import ArrayLike

from spin_usd.basics.arrays import frozen
from spin_usd.basics.faults import reading
from spin_usd.errors import InputError
from spin_usd.options import PictureOptions
from spin_usd.picture.kinds import IMAGE
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.open_renderer import ANOTHER_RENDERER, require_renderer
from spin_usd.reading.description import Description, described
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import CPU
from spin_usd.scene.scene import NOMINAL
from spin_usd.simulator.calls import OpenLog, OpenSimulator
from spin_usd.simulator.live_picture import RECORD, LivePicture, Made
from spin_usd.simulator.picture_workers import PictureWorkers, SimulatorTask
from spin_usd.specifications.augmentation_spec import spec_path
from spin_usd.studio.picture_request import (
    DrawnFrom,
    PictureRequest,
    finite_number,
    plain,
    pose_matrix,
    shortened,
    whole_number,
)

NEEDED = ("depth",)  # a record needs at least one file
AHEAD = 2  # pictures that each worker may make ahead of the next one taken


class Simulator:
    """Makes pictures of a stage on request.

    ```python
    with spin_usd.Simulator("my_stage", renderer="raycast") as simulator:
        picture = simulator.picture(pose=(q, t), sun=(0.3, -0.5, -0.8))
        picture.image, picture.depth, picture.T_cam_body
    ```

    Equal requests give equal arrays, whatever the earlier requests, the number of workers and their deaths; a frame of
    the stage as it is gives the arrays of `spin-usd render`. One process and one thread use a simulator; others open
    their own.

    Attributes:
        frames: the names of the stage's frames.
        variants: the names of its variants.
        seed: the seed of all random values.
        description: its targets and parts.
        workers: the processes that make its pictures.
    """

    def __init__(
        self,
        stage: str | Path,
        *,
        variant: str = NOMINAL,
        labels: str | Sequence[str] = "none",
        image: bool = True,
        renderer: str | None = None,
        quality: str | None = None,
        samples: int | None = None,
        effort: str | None = None,
        seed: int | None = None,
        device: str = CPU,
        workers: int = 1,
        log: str | Path | None = None,
        log_parts: Sequence[str] = (),
    ) -> None:
        """Open the stage.

        Args:
            stage: The stage's folder or its root layer.
            variant: The variant of requests that name none.
            labels: Labels made with each picture; others are made on first access.
            image: Whether the image is made with each picture; else on first access.
            renderer: Renderer of the light, "blender" or "raycast"; this and the next are as for `render`.
            quality: Name of the render settings.
            samples: Samples per pixel, instead of the quality's.
            effort: Render settings one by one.
            seed: Seed of all random values; the stage's own if not given.
            device: Device that renders the light.
            workers: How many processes make pictures for `pictures`.
            log: A folder where all requested pictures become frames of a stage, over a copy of this one, which
                `spin-usd render FOLDER` renders to the same images. A log has one variant, one seed and one worker,
                its shutter is an instant, and all names are different.
            log_parts: The parts of the first target that requests may move, where there is a log.

        Raises:
            SpinError: For a stage that cannot be opened, and options that do not go together.
        """
        with reading():
            asked = RenderRequest.of(
                PictureOptions(
                    stage=stage,
                    variants=variant,
                    labels=labels,
                    renderer=renderer,
                    quality=quality,
                    samples=samples,
                    effort=effort,
                    seed=seed,
                    device=device,
                )
            )
            require_renderer(asked.renderer, instead=ANOTHER_RENDERER)
        if not isinstance(variant, str):
            raise InputError(f"the variant is {shortened(variant)}", do="give the name of one")
        if whole_number(workers, "the number of workers") < 1 or (log is not None and workers > 1):
            do = "give 1: a log has an order" if log is not None else "give 1 or more"
            raise InputError(f"there cannot be {workers} workers", do=do)
        if log is None and log_parts:
            raise InputError("log_parts are given without a log", do="leave them out, or give log a folder")
        if log is not None and not str(log):
            raise InputError("the log has no folder", do="give its name")
        own = None if seed is None else whole_number(seed, "the seed")
        self.stage, self.variant = asked.stage, variant
        self._ahead = AHEAD * workers if log is None else 1  # a log contains no picture that was not taken
        self.kinds = tuple(kind for kind in asked.kinds if image or kind != IMAGE)
        settings = RenderSettings(
            renderer=asked.renderer,
            effort=asked.effort,
            seed=own or 0,
            device=asked.devices()[0],
        )
        opening = OpenSimulator(
            stage=str(self.stage),
            options=WorkerOptions(root="", work="", stage=self.stage.name, settings=settings, chosen=asked.chosen),
            variant=variant,
            seed=own,
            memory=-1,
            cpus=[],
            log=None if log is None else OpenLog(folder=str(Path(log).absolute()), parts=tuple(log_parts)),
        )
        self.workers = PictureWorkers(opening, workers=workers)
        opened = self.workers.opened
        self.frames, self.variants, self.seed = tuple(opened.frames), tuple(opened.variants), opened.seed
        self.description: Description = described(opened.targets, opened.parts)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __len__(self) -> int:
        return len(self.frames)

    def close(self) -> None:
        """End the workers, and write a log to its end; a second call does nothing."""
        self.workers.close()

    def picture(self, frame: str | int | PictureRequest | None = None, **asked: Any) -> LivePicture:
        """Make one picture: a frame of the stage, or one with other poses, light or values.

        Args:
            frame: The frame's name, or its place; the first if not given. A request, from `request` or from a picture,
                makes that picture again.
            **asked: As for `request`.

        Raises:
            SpinError: If it cannot be shown.
        """
        request = frame if isinstance(frame, PictureRequest) else self.request(frame, **asked)
        return self._result(self.workers.ask(request, self.kinds))

    def pictures(self, requests: Iterable[Any]) -> Iterator[LivePicture]:
        """Make many pictures, by all workers, in order. Each request is a frame, a mapping of arguments of `picture`,
        or the result of `request`. Workers make pictures ahead of the one that is taken."""
        if isinstance(requests, str | Mapping):
            raise InputError(f"{shortened(requests)} is one request", do="give a list of them, or call picture")
        asked: deque[SimulatorTask] = deque()
        try:
            for each in requests:
                given = self.request(**each) if isinstance(each, Mapping) else each
                request = given if isinstance(given, PictureRequest) else self.request(given)
                asked.append(self.workers.ask(request, self.kinds))
                if len(asked) >= self._ahead:
                    yield self._result(asked.popleft())
            while asked:
                yield self._result(asked.popleft())
        finally:
            self.workers.forget(asked)

    def stream(
        self,
        poses: str | Path | Callable[[np.random.Generator], Any],
        spec: str | Path | None = None,
        *,
        seed: int = 0,
        start: int = 0,
    ) -> Iterator[LivePicture]:
        """Make pictures without end, each of a new pose in a new appearance, which its `request` contains. The same
        arguments give the same pictures, whatever the number of workers.

        Args:
            poses: Source of poses: text such as "range=4..8 inside=1", a file or a name, as for `author --sample`,
                with the light that it draws; or a function that takes a generator of random numbers and returns a pose
                as for `request`.
            spec: A specification of augmentations, its file or its name. Each picture takes one of its augmentations.
            seed: Seed of all drawn values, and of noise.
            start: The number of the first picture.

        Raises:
            SpinError: If a picture cannot be drawn or shown.
        """
        if (first := whole_number(start, "the start")) < 0 or (own := whole_number(seed, "the seed")) < 0:
            raise InputError(f"the seed is {seed} and the start {start}", do="give 0 or more")
        file = None
        if spec is not None:
            with reading():
                file = str(spec_path(spec).absolute())
        law = None if callable(poses) else str(poses)

        def requests() -> Iterator[PictureRequest]:
            for number in count(first):
                name = f"drawn_{own}_{number:06d}"
                pose = None
                if callable(poses):
                    pose = poses(np.random.default_rng((own, number)))
                    pose = pose if pose and isinstance(pose, Mapping) else {"": pose}
                drawn = DrawnFrom(seed=own, number=number, poses=law, spec=file)
                yield structs.replace(self.request(pose=pose, name=name), drawn=drawn)

        return self.pictures(requests())

    def request(
        self,
        frame: str | int | None = None,
        *,
        variant: str | None = None,
        pose: Any = None,
        sun: ArrayLike | None = None,
        exposure: float | None = None,
        lights: Mapping[str, float] | None = None,
        parts: Mapping[str, Any] | None = None,
        values: Mapping[str, Any] | None = None,
        time: float | None = None,
        seed: int | None = None,
        name: str | None = None,
    ) -> PictureRequest:
        """Return the request that `picture` makes.

        Args:
            frame: The frame's name, or its place. Anything you leave out is taken from the frame.
            variant: Another variant than the simulator's.
            pose: T_cam_body (4, 4), or a unit quaternion, scalar first, and a translation, metres; or a mapping of
                these by the targets' names.
            sun: The direction to the Sun (3,), camera axes.
            exposure: The exposure time, seconds.
            lights: Factors on the strengths of lights, by their names or paths.
            parts: New places of parts of the first target, by their names: (4, 4) in the target's axes, metres.
            values: Other parameters that an augmentation can sample, by name, each in its own unit, such as
                {"sensor.read_noise": 12}; docs/how-to/own-augmentation.md lists them.
            time: Seconds of the stage, instead of a frame; from its first picture's to its last one's, if it has times.
            seed: Seed of all random values, instead of the simulator's.
            name: Name of the picture, which its noise depends on. If not given, the frame's name, or one made from the
                pose where there is one.

        Raises:
            InputError: If an argument is not valid.
        """
        for what, mapping in (("lights", lights), ("parts", parts), ("values", values)):
            if not isinstance(mapping, Mapping | None):
                raise InputError(f"{what} are {shortened(mapping)}", do="give a mapping by names")
        for text in (variant, name):
            if not isinstance(text, str | None):
                raise InputError(f"{shortened(text)} is not a name", do="give text")
        if frame is not None and time is not None:
            raise InputError("a frame and a time are both given", do="give one of them")
        given = dict(values or {})
        given |= {} if sun is None else {"sun.direction": sun}
        given |= {} if exposure is None else {"exposure.time": finite_number(exposure, "the exposure")}
        poses = pose if isinstance(pose, Mapping) else {} if pose is None else {"": pose}
        factors = {str(each): finite_number(factor, f"the factor of {each}") for each, factor in (lights or {}).items()}
        if dark := [each for each, factor in factors.items() if factor < 0]:
            raise InputError(f"the factor of {dark[0]} is {factors[dark[0]]:g}", do="give 0 or more")
        return PictureRequest(
            frame=None if frame is None else frame if isinstance(frame, str) else str(whole_number(frame, "the frame")),
            variant=None if variant is None else str(variant),
            time=None if time is None else finite_number(time, "the time"),
            name=None if name is None else str(name),
            seed=None if seed is None else whole_number(seed, "the seed"),
            poses={str(each): pose_matrix(of, f"the pose of {each or 'the target'}") for each, of in poses.items()},
            parts={str(each): pose_matrix(of, f"the place of {each}") for each, of in (parts or {}).items()},
            lights=factors,
            values=plain(given),
        )

    def _result(self, task: SimulatorTask) -> LivePicture:
        """Wait for a picture."""
        made = self.workers.result(task)
        camera, request = made.camera.camera, made.request or task.request.picture

        def make(kind: str) -> Made:
            recorded = kind == RECORD
            kinds = (self.kinds or NEEDED) if recorded else (kind,)
            more = self.workers.ask(request, kinds, first=True, recorded=recorded, logged=task.logged)
            made_more = self.workers.result(more)
            return more.arrays, made_more.record or ""

        return LivePicture(
            root=self.stage,
            frame=made.frame,
            variant=made.variant,
            index=made.index,
            files={},
            camera=camera,
            whole_camera=camera,
            T_cam_body=frozen(made.pose.T_cam_body.matrix),
            description=self.description,
            request=request,
            arrays=task.arrays,
            make=make,
        )
