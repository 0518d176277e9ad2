"""Pictures of a stage on request, in memory: a child process keeps the stage and the renderer open.

Neither USD nor Blender is loaded into the caller's process.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from msgspec import to_builtins
from numpy.typing import ArrayLike

from spin_usd.arrays import frozen
from spin_usd.commands.render.worker_options import WorkerOptions
from spin_usd.errors import InputError
from spin_usd.faults import reading
from spin_usd.options import PictureOptions
from spin_usd.picture.kinds import IMAGE
from spin_usd.planning.request import RenderRequest
from spin_usd.processes.open_renderer import ANOTHER_RENDERER, require_renderer
from spin_usd.reading.description import Description, described
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.effort import CPU
from spin_usd.scene.scene import NOMINAL
from spin_usd.simulator.live_picture import RECORD, LivePicture, Made
from spin_usd.simulator.picture_request import PictureRequest, plain, pose_matrix
from spin_usd.simulator.picture_workers import PictureLog, PictureWorkers

AHEAD = 2  # pictures for each worker that may be made before the one that is waited for
STAGES_OWN = -1  # as a seed


class Simulator:
    """Makes pictures of a stage on request.

    ```python
    with spin_usd.Simulator("my_stage", renderer="raycast") as simulator:
        picture = simulator.picture(pose=(q, t), sun=(0.3, -0.5, -0.8))
        picture.image, picture.depth, picture.T_cam_body
    ```

    Equal requests give equal arrays, whatever was asked before, by whatever number of workers, and after a worker's
    death: those of `spin-usd render` where a frame of the stage is asked for as it is.

    Attributes:
        frames: the names of the stage's frames.
        variants: those of its variants.
        seed: that of all that is random.
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
            variant: The variant that is shown unless a request names another.
            labels: Those that are made with each picture; others are made when they are asked of it.
            image: Whether the image is made with each picture; else it is when it is asked for.
            renderer: As `render` has it.
            quality: As `render` has it.
            samples: As `render` has it.
            effort: As `render` has it.
            seed: As `render` has it.
            device: As `render` has it.
            workers: How many processes make pictures for `pictures`.
            log: A folder where all pictures that are asked for become frames of a stage, over a copy of this one. It is
                rendered to the same images as any stage is: `spin-usd render FOLDER`. There the shutter is an instant,
                and one worker makes all pictures.
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
        if workers < 1 or (log is not None and workers > 1):
            do = "give 1: a log has an order" if log is not None else "give 1 or more"
            raise InputError(f"there cannot be {workers} workers", do=do)
        self.stage, self.variant, self._count = asked.stage, variant, workers
        self.kinds = tuple(kind for kind in asked.kinds if image or kind != IMAGE)
        settings = RenderSettings(
            renderer=asked.renderer,
            effort=asked.effort,
            seed=STAGES_OWN if seed is None else seed,
            device=asked.devices()[0],
        )
        options = WorkerOptions(root="", work="", stage=self.stage.name, settings=settings, chosen=asked.chosen)
        self.workers = PictureWorkers(
            stage=str(self.stage),
            options=to_builtins(options),
            variant=variant,
            graphics=settings.device != CPU,
            count=workers,
            log=None if log is None else PictureLog(log=str(Path(log).absolute()), parts=list(log_parts)),
        )
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
        """End the workers, and write a log to its end; again does nothing."""
        self.workers.close()

    def picture(self, frame: str | int | None = None, **asked: Any) -> LivePicture:
        """Make one picture: a frame of the stage, or that with other poses, light or values.

        Args:
            frame: The frame's name, or its place; the first if not given.
            **asked: As `request` takes them.

        Raises:
            SpinError: For what cannot be shown.
        """
        return self._result(self.workers.ask(self.request(frame, **asked), self.kinds))

    def pictures(self, requests: Iterable[Any]) -> Iterator[LivePicture]:
        """Make many pictures, by all workers, in order. Each request is a frame, or a mapping of what `picture` takes.
        What comes after the pictures that are waited for is made ahead."""
        asked: deque[int] = deque()
        try:
            for each in requests:
                given = self.request(**each) if isinstance(each, Mapping) else self.request(each)
                asked.append(self.workers.ask(given, self.kinds))
                if len(asked) >= AHEAD * self._count:
                    yield self._result(asked.popleft())
            while asked:
                yield self._result(asked.popleft())
        finally:
            self.workers.forget(asked)

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
        """Return what `picture` asks for.

        Args:
            frame: The frame's name, or its place; what is not said otherwise is as in that frame.
            variant: Another variant than the simulator's.
            pose: T_cam_body (4, 4), or a unit quaternion, scalar first, and a translation, metres; a mapping of those
                by the targets' names.
            sun: The direction to the Sun (3,), camera axes.
            exposure: The exposure time, seconds.
            lights: Factors on the strengths of lights, by their names or paths.
            parts: Where parts of the first target are moved to, by their names: (4, 4) in the target's axes, metres.
            values: Other parameters that an augmentation can sample, by name, each in its own unit, such as
                {"sensor.read_noise": 12}; docs/how-to/own-augmentation.md has them.
            time: Seconds of the stage, instead of a frame.
            seed: That of all that is random, instead of the simulator's.
            name: What the picture is called; its noise depends on it. That of the frame if not given, and of the pose
                where there is one.

        Raises:
            InputError: For what is no pose.
        """
        given = dict(values or {})
        given |= {} if sun is None else {"sun.direction": sun}
        given |= {} if exposure is None else {"exposure.time": exposure}
        poses = pose if isinstance(pose, Mapping) else {} if pose is None else {"": pose}
        return PictureRequest(
            frame=None if frame is None else str(frame),
            variant=variant,
            time=time,
            name=name,
            seed=seed,
            poses={each: pose_matrix(of, f"the pose of {each or 'the target'}") for each, of in poses.items()},
            parts={each: pose_matrix(of, f"the place of {each}") for each, of in (parts or {}).items()},
            lights={each: float(factor) for each, factor in (lights or {}).items()},
            values=plain(given),
        )

    def _result(self, number: int) -> LivePicture:
        """Wait for a picture."""
        found = self.workers.result(number)
        asked, made, camera = found.asked, found.made, found.made.camera.camera

        def make(kind: str) -> Made:
            recorded = kind == RECORD
            kinds = self.kinds if recorded else (kind,)
            more = self.workers.ask(asked.request, kinds, first=True, recorded=recorded, logged=asked.logged)
            whole = self.workers.result(more)
            return whole.arrays, whole.made.record or ""

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
            request=asked.request,
            arrays=found.arrays,
            make=make,
        )
