"""Write a picture's scene as a .blend, by a child process."""

from dataclasses import dataclass
from pathlib import Path

from spin_usd.basics.progress import Progress
from spin_usd.commands.debug.calls import WRITE_BLEND, WriteBlend, WrittenBlend
from spin_usd.commands.debug.options import DebugOptions
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.options import takes
from spin_usd.planning.effort_choice import setting_of
from spin_usd.processes.ask_child import ask_child
from spin_usd.processes.child_limits import RENDER_PATIENCE_S, rendering_memory
from spin_usd.processes.open_renderer import DEFAULT_RENDERER, require_renderer
from spin_usd.scene.effort import Effort
from spin_usd.store.atomic import fill_atomically
from spin_usd.store.hidden_folder import hidden_folder
from spin_usd.store.stage_path import existing_stage

SUFFIX = ".blend"
NAME = "spin_usd-debug"  # of the folder of the file until it is complete


@dataclass(frozen=True, kw_only=True)
class DebugFile:
    """A .blend that was written."""

    path: Path
    """Path of the file."""
    frame: str
    """Frame of the picture that it shows."""
    variant: str
    """Variant of that picture."""
    notes: tuple[str, ...]
    """Sentences on differences between the render and the stage."""


@takes(DebugOptions)
def debug(options: DebugOptions) -> DebugFile:
    """Write the scene of a picture as a .blend, which Blender opens and renders to the picture before the detector.

    Raises InputError if the stage has no such frame or the file exists, StageError, UnsupportedError without Blender.
    """
    root = existing_stage(Path(options.stage))
    setting, _ = setting_of(root, options, renderer=DEFAULT_RENDERER)
    return write_debug_file(
        root,
        options.frame,
        variant=options.variant,
        out=None if options.out is None else Path(options.out),
        effort=setting.effort,
        seed=options.seed,
        progress=options.progress,
    )


def write_debug_file(
    stage: Path,
    frame: str,
    *,
    variant: str,
    out: Path | None,
    effort: Effort,
    seed: int | None,
    progress: Progress,
) -> DebugFile:
    """Write the scene of a picture of the `stage` into the new file `out`, else FRAME_VARIANT.blend.

    `frame`: its name, or its number from 0. Raises InputError, StageError, UnsupportedError, and OutputError where the
    file cannot be written.
    """
    require_renderer(DEFAULT_RENDERER)
    file = Path(f"{frame}_{variant}{SUFFIX}".replace("/", "_")) if out is None else out
    if file.suffix != SUFFIX:
        raise InputError("is not the name of a .blend", where=file, do="choose a name that ends in .blend")
    if file.exists():
        raise InputError("exists already", where=file, do="remove it, or choose another --out")
    written: list[WrittenBlend] = []

    def write(path: Path) -> None:
        request = WriteBlend(
            stage=str(stage.absolute()), frame=frame, variant=variant, effort=effort, seed=seed, file=str(path)
        )
        made = ask_child(
            WRITE_BLEND,
            request,
            reads=stage,
            memory=rendering_memory(),
            progress=progress,
            within_s=RENDER_PATIENCE_S,
            writes=(path.parent,),
        )
        written.append(made)

    folder = Folder(file.absolute().parent)
    with hidden_folder(folder.root, NAME) as (work, _):
        fill_atomically(folder, file.name, write, work=work)
    return DebugFile(path=file, frame=written[0].frame, variant=variant, notes=written[0].notes)
