"""The renderers, and the one place that opens them.

A new renderer is a file with a class that implements `renderers.renderer.Renderer`, and an entry here. Its class is
named as text and loaded when it is opened: one of them needs Blender, which only child processes load.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from platform import python_version
from types import NoneType
from typing import TYPE_CHECKING, Any

from spin_usd.basics.extras import to_install
from spin_usd.errors import InputError, UnsupportedError
from spin_usd.processes.call import Call
from spin_usd.scene.effort import CPU, DEFAULT_QUALITY, QUALITIES, Effort

if TYPE_CHECKING:
    from spin_usd.renderers.embree.caster import EmbreeCaster
    from spin_usd.renderers.renderer import LabelPass, Renderer, SceneWriter

UNMEASURED: Mapping[str, float] = {"picture": 0.05, "sample": 1e-6}


@dataclass(frozen=True, kw_only=True)
class RendererEntry:
    """A renderer's description, used before it is opened."""

    name: str
    """Name in `--renderer` and in records."""
    module: str
    """Module of its class."""
    class_name: str
    library: str = ""
    """Library that it needs and that not every Python has."""
    python: str = ""
    """Version of Python that has that library."""
    graphics: str = ""
    """Module that lists the graphics processors it can use; "" for one that renders on the CPU alone."""
    effort: frozenset[str] = frozenset({"samples"})
    """Settings of scene.effort.Effort that it supports; others are refused."""
    skips_work: bool = False
    """Whether its class takes `crop` and `keep`, and skips work that a scene does not need, by renderers.skipped."""
    casts: bool = False
    """Whether its class takes the `caster` of the run's labels, and casts its own rays with it."""
    image_costs: Mapping[str, float] = field(default_factory=lambda: UNMEASURED)
    """Seconds of one core for each unit of a render, by planning.work's names of units; units not listed cost
    nothing."""
    device_costs: Mapping[str, float] = field(default_factory=lambda: UNMEASURED)
    """Likewise seconds of a graphics processor, by `tools/bench device` on an NVIDIA H200."""

    @property
    def installed(self) -> bool:
        """Whether this Python has the library that the renderer needs; loads nothing."""
        return not self.library or find_spec(self.library) is not None


_ALL = (
    RendererEntry(
        name="blender",
        module="spin_usd.renderers.blender.renderer",
        class_name="BlenderRenderer",
        library="bpy",
        python="3.13",
        graphics="spin_usd.renderers.blender.cycles_settings",
        effort=frozenset(
            {"samples", "adaptive", "denoiser", "bounces", "clamp", "filter_glossy", "light_tree", "reduction"}
        ),
        skips_work=True,
        image_costs={
            "picture": 0.014,
            "sample": 1.5e-6,
            "glossy": 9.5e-7,
            "surroundings": 6e-7,
            "denoised": 2.4e-6,
            "denoised high": 1.4e-5,
        },
        device_costs={"picture": 0.03, "pixel": 4.5e-7, "sample": 5e-9, "denoised": 2e-7, "denoised high": 1e-6},
    ),
    RendererEntry(
        name="raycast",
        module="spin_usd.renderers.raycast.renderer",
        class_name="RaycastRenderer",
        effort=frozenset({"samples", "reduction"}),
        casts=True,
        image_costs={"picture": 0.1, "sample": 2.2e-6},
    ),
)
RENDERERS: Mapping[str, RendererEntry] = {entry.name: entry for entry in _ALL}
DEFAULT_RENDERER = "blender"
CHECKING = "blender"  # whose label pass shares no code with the label pass of runs
TRY_RENDERER = Call("spin_usd.processes.open_renderer:try_renderer", str, str)
GRAPHICS_PROCESSORS = Call("spin_usd.processes.open_renderer:graphics_processors", NoneType, dict[str, list[str]])
ANOTHER_RENDERER = "choose " + " or ".join(f"--renderer {entry.name}" for entry in _ALL if not entry.library)
"""The remedy in a command that renders, where a library is missing."""


def renderer_entry(name: str) -> RendererEntry:
    """Return the entry of the renderer `name`. Raises InputError if there is none."""
    if name not in RENDERERS:
        raise InputError(f"there is no renderer {name!r}", do=f"choose {' or '.join(RENDERERS)}")
    return RENDERERS[name]


def default_effort(name: str) -> Effort:
    """Return the default effort, DEFAULT_QUALITY, as far as the renderer `name` supports it. Raises InputError if there
    is no such renderer."""
    wanted = QUALITIES[DEFAULT_QUALITY]
    return Effort(**{setting: getattr(wanted, setting) for setting in renderer_entry(name).effort})


def require_renderer(name: str, *, instead: str = "") -> None:
    """Raise UnsupportedError if the renderer `name` lacks its library; load nothing. `instead`: an alternative for the
    user, such as ANOTHER_RENDERER."""
    entry = renderer_entry(name)
    if not entry.installed:
        found = f"the renderer {name} needs {entry.library}, which this Python {python_version()} does not have"
        do = to_install(entry.library)
        raise UnsupportedError(found, do=f"{do}, or {instead}" if instead else do)


def graphics_processors() -> dict[str, list[str]]:
    """Return the models of graphics processors that a renderer can use, by the name of the device; loads Blender."""
    found: dict[str, list[str]] = {}
    for entry in _ALL:
        if entry.graphics and entry.installed:
            found |= import_module(entry.graphics).graphics_processors()
    return found


def open_renderer(
    name: str,
    *,
    device: str = CPU,
    crop: bool = True,
    keep: Collection[str] = (),
    caster: "EmbreeCaster | None" = None,
) -> "Renderer":
    """Open the renderer `name`, one of RENDERERS, to render light on the `device`.

    Without `crop` a renderer that skips work renders whole frames instead of the target's part of them, to the same
    bytes; with `keep` it does the work that the rules of renderers.skipped would skip, to a picture as equal as each
    rule states. A renderer that casts rays shares the `caster` of the labels if given, and its meshes.
    Raises InputError for any other name.
    """
    entry = renderer_entry(name)
    options: dict[str, Any] = {"crop": crop, "keep": keep} if entry.skips_work else {}
    options |= {"device": device} if entry.graphics else {}
    options |= {"caster": caster} if entry.casts else {}
    renderer: Renderer = getattr(import_module(entry.module), entry.class_name)(**options)
    return renderer


def try_renderer(name: str) -> str:
    """Open the renderer `name` and close it; return the versions of its libraries."""
    renderer = open_renderer(name)
    found = ", ".join(f"{key} {value}" for key, value in renderer.versions().items())
    renderer.close()
    return found


def open_scene_writer() -> "SceneWriter":
    """Open the writer of scenes as .blend files."""
    writer: SceneWriter = import_module("spin_usd.renderers.blender.blend_file").BlendFileWriter()
    return writer


def open_check_pass() -> "LabelPass":
    """Open Cycles' own label pass, which checks the labels of runs."""
    entry = RENDERERS[CHECKING]
    label_pass: LabelPass = getattr(import_module(entry.module), entry.class_name)()
    return label_pass
