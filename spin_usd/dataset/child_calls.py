"""The calls that a child process answers."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from importlib import import_module
from typing import Any

CONVERSION = "spin_usd.renderers.blender.model_conversion"  # named as text: it loads Blender


class ChildCalls:
    """The calls that a child answers: a method for each, of the call's name, which takes the arguments of a request and
    returns what goes into JSON.

    Each imports what it needs when it is called, so that a child carries no more than that. `progress` is called as
    work goes on.
    """

    def __init__(self, progress: Callable[..., None]) -> None:
        self._progress = progress
        self._stage: Any = None  # what `open_plan` has opened
        self._worker: Any = None
        self._measuring: Any = None
        self._exported: Any = None
        self._viewer: Any = None

    def author(self, **arguments: Any) -> Any:
        from spin_usd.dataset.author.author import author_stage

        return author_stage(progress=self._progress, **arguments).as_json()

    def author_sample(self, **arguments: Any) -> Any:
        from spin_usd.dataset.author.author import author_sample

        return author_sample(progress=self._progress, **arguments).as_json()

    def convert_model(self, **arguments: Any) -> Any:
        return import_module(CONVERSION).convert_model(**arguments)

    def convert_step(self, **arguments: Any) -> Any:
        from spin_usd.formats.mesh.step_file import convert_step

        return convert_step(**arguments)

    def augment(self, **arguments: Any) -> Any:
        from spin_usd.dataset.author.augment import augment_stage

        return augment_stage(progress=self._progress, **arguments).as_json()

    def parameter_list(self) -> Any:
        from spin_usd.dataset.author.parameter_list import parameter_list

        return parameter_list()

    def open_plan(self, **arguments: Any) -> Any:
        from spin_usd.dataset.plan.in_child import open_plan

        described, self._stage = open_plan(**arguments)
        return described

    def plan_pictures(self, **arguments: Any) -> Any:
        from spin_usd.dataset.plan.in_child import plan_pictures

        return plan_pictures(progress=self._progress, opened=self._stage, **arguments)

    def open_worker(self, **arguments: Any) -> Any:
        from spin_usd.dataset.render.worker import Worker

        self._worker = Worker(on_open=self._progress, **arguments)
        return self._worker.versions

    def picture(self, **arguments: Any) -> Any:
        return self._worker.picture(**arguments)

    def reproduce(self, **arguments: Any) -> Any:
        from spin_usd.dataset.reproduce.in_child import make_again

        return make_again(**arguments)

    def check_stage(self, **arguments: Any) -> Any:
        from spin_usd.dataset.check.in_child.stage import stage_findings

        return stage_findings(progress=self._progress, **arguments)

    def check_picture(self, **arguments: Any) -> Any:
        from spin_usd.dataset.check.in_child.picture import picture_findings

        return picture_findings(**arguments)

    def cross_picture(self, **arguments: Any) -> Any:
        from spin_usd.dataset.check.in_child.cross import cross_findings

        return cross_findings(**arguments)

    def write_blend(self, **arguments: Any) -> Any:
        from spin_usd.dataset.debug.in_child import write_blend

        return write_blend(progress=self._progress, **arguments)

    def open_viewer(self, **arguments: Any) -> None:
        from spin_usd.dataset.watch.in_child import Viewer

        self._viewer = self._viewer or Viewer(**arguments)

    def view(self, **arguments: Any) -> Any:
        return self._viewer.view(**arguments)

    def diff(self, **arguments: Any) -> Any:
        from spin_usd.dataset.diff.in_child.compare import compare

        return compare(progress=self._progress, **arguments)

    def open_measuring(self, **arguments: Any) -> None:
        from spin_usd.dataset.measure.worker import MeasuringWorker

        self._measuring = MeasuringWorker(on_made=self._progress, **arguments)

    def measure(self, what: str, **arguments: Any) -> Any:
        return getattr(self._measuring, what)(**arguments)

    def export(self, request: Mapping[str, Any]) -> Any:
        from spin_usd.dataset.export.export import export
        from spin_usd.dataset.export.request import ExportRequest

        return asdict(export(ExportRequest.from_json(request), progress=self._progress))

    def export_pictures(self, first: int, last: int, **arguments: Any) -> Any:
        from spin_usd.dataset.export.pictures import PictureMaker

        self._exported = self._exported or PictureMaker.of_plan(**arguments)
        rows, counts = self._exported.make(first, last)
        return rows, asdict(counts)

    def save_models(self, **arguments: Any) -> Any:
        from spin_usd.dataset.export.models.in_child import save_models

        return save_models(progress=self._progress, **arguments)

    def save_target(self, **arguments: Any) -> Any:
        from spin_usd.dataset.keypoints.in_child import save_target

        return save_target(**arguments)

    def read_keypoints(self, **arguments: Any) -> Any:
        from spin_usd.dataset.keypoints.in_child import read_keypoints

        return read_keypoints(**arguments)

    def picture_part(self, **arguments: Any) -> Any:
        from spin_usd.dataset.keypoints.in_child import picture_part

        return picture_part(**arguments)

    def keypoints_text(self, **arguments: Any) -> Any:
        from spin_usd.dataset.keypoints.in_child import keypoints_text

        return keypoints_text(**arguments)

    def show_picture(self, **arguments: Any) -> Any:
        from spin_usd.dataset.gallery.in_child.picture_files import write_picture_files

        return write_picture_files(**arguments)

    def graphics_processors(self) -> Any:
        from spin_usd.dataset.process.open_renderer import graphics_processors

        return graphics_processors()

    def try_renderer(self, name: str) -> Any:
        from spin_usd.dataset.process.open_renderer import open_renderer

        renderer = open_renderer(name)
        found = ", ".join(f"{key} {value}" for key, value in renderer.versions().items())
        renderer.close()
        return found
