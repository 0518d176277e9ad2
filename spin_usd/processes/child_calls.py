"""The calls that a child process answers: a table of what each loads and calls there.

Everything is named as text, so that a child carries no more than what it is asked for, and its parent nothing of that.
A class is opened by its call and kept, for calls of its methods.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, is_dataclass
from importlib import import_module
from inspect import signature
from typing import Any

CALLS: Mapping[str, str] = {
    "author": "spin_usd.commands.author.in_child:author_stage",
    "confine": "spin_usd.processes.confine:confine",
    "convert_model": "spin_usd.renderers.blender.model_conversion:convert_model",
    "convert_step": "spin_usd.formats.mesh.step_file:convert_step",
    "augment": "spin_usd.commands.author.augment:augment_stage",
    "parameter_list": "spin_usd.commands.augment.parameter_list:parameter_list",
    "open_plan": "spin_usd.planning.in_child:StagePlanner",
    "plan_pictures": "spin_usd.planning.in_child:StagePlanner.pictures",
    "open_worker": "spin_usd.commands.render.worker:Worker",
    "picture": "spin_usd.commands.render.worker:Worker.picture",
    "count_event_steps": "spin_usd.events.event_stage:count_steps",
    "open_events": "spin_usd.events.in_child:EventWorker",
    "event_light": "spin_usd.events.in_child:EventWorker.light",
    "make_events": "spin_usd.events.in_child:EventWorker.events",
    "finish_events": "spin_usd.events.in_child:EventWorker.finish",
    "open_simulated": "spin_usd.simulator.in_child:StagePictures",
    "simulated_picture": "spin_usd.simulator.in_child:StagePictures.picture",
    "open_logged": "spin_usd.simulator.logged_pictures:LoggedPictures",
    "logged_picture": "spin_usd.simulator.logged_pictures:LoggedPictures.picture",
    "save_log": "spin_usd.simulator.logged_pictures:LoggedPictures.save",
    "open_fresh": "spin_usd.simulator.fresh_images:FreshImages",
    "fresh_image": "spin_usd.simulator.fresh_images:FreshImages.image",
    "reproduce": "spin_usd.commands.reproduce.in_child:make_again",
    "check_stage": "spin_usd.commands.check.in_child.stage:stage_findings",
    "check_picture": "spin_usd.commands.check.in_child.picture:picture_findings",
    "check_events": "spin_usd.commands.check.in_child.events:event_findings",
    "cross_picture": "spin_usd.commands.check.in_child.cross:cross_findings",
    "write_blend": "spin_usd.commands.debug.in_child:write_blend",
    "open_viewer": "spin_usd.commands.watch.in_child:Viewer",
    "view": "spin_usd.commands.watch.in_child:Viewer.view",
    "diff": "spin_usd.commands.diff.in_child:compare",
    "open_measuring": "spin_usd.commands.measure.worker:MeasuringWorker",
    "measure": "spin_usd.commands.measure.worker:MeasuringWorker.do",
    "export": "spin_usd.commands.export.in_child:export",
    "export_pictures": "spin_usd.commands.export.pictures:PictureMakers.make",
    "save_models": "spin_usd.exchange.layout.save_models:save_models",
    "save_target": "spin_usd.commands.keypoints.in_child:save_target",
    "read_keypoints": "spin_usd.commands.keypoints.in_child:read_keypoints",
    "picture_part": "spin_usd.commands.keypoints.in_child:picture_part",
    "keypoints_text": "spin_usd.commands.keypoints.in_child:keypoints_text",
    "show_picture": "spin_usd.commands.show.in_child:write_picture_files",
    "graphics_processors": "spin_usd.processes.open_renderer:graphics_processors",
    "reload_layers": "spin_usd.stage.usd.layer_file:reload_layers",
    "try_renderer": "spin_usd.processes.open_renderer:try_renderer",
}
"""By name the module, and in it the function, the class, or the method of one. What takes `progress` is given it."""


def modules_of(*calls: str) -> tuple[str, ...]:
    """Return the modules that a child loads to answer the `calls`."""
    return tuple(CALLS[call].partition(":")[0] for call in calls)


class ChildCalls:
    """Answers calls. `progress` is called as work goes on."""

    def __init__(self, progress: Callable[..., None]) -> None:
        self._progress = progress
        self._opened: dict[str, Any] = {}  # by class

    def answer(self, call: str, arguments: Mapping[str, Any]) -> Any:
        """Return what goes into JSON: the result, or of a class that is opened its `opened`, where it has one."""
        module, _, place = CALLS[call].partition(":")
        name, _, method = place.partition(".")
        found = getattr(import_module(module), name)
        if method:
            opened = self._opened[name] = self._opened.get(name) or found()
            found = getattr(opened, method)
        given = {**arguments, "progress": self._progress} if "progress" in signature(found).parameters else arguments
        result = found(**given)
        if isinstance(found, type):
            self._opened[name] = result
            return getattr(result, "opened", None)
        return asdict(result) if is_dataclass(result) and not isinstance(result, type) else result
