"""The request of a run: a user's options, with the effort that results from them."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from spin_usd.basics.suggestion import suggestion
from spin_usd.errors import InputError
from spin_usd.labels.table import DEFAULT_LABELS, LABELS, NOT_EVERYWHERE
from spin_usd.options import PictureOptions, names_in
from spin_usd.picture.kinds import FILE_KINDS, IMAGE, RADIANCE
from spin_usd.planning.effort_choice import Chosen, setting_of
from spin_usd.planning.shard import Shard
from spin_usd.processes.devices import AUTO, refuse_unknown_device, require_device, usable_devices
from spin_usd.processes.open_renderer import DEFAULT_RENDERER, RENDERERS, renderer_entry
from spin_usd.scene.effort import CPU, Effort
from spin_usd.store.stage_path import existing_stage, root_layer

IMAGE_SUFFIXES = (".png", ".jpg")


@dataclass(frozen=True, kw_only=True)
class RenderRequest:
    """The pictures that a user requests.

    Raises InputError for options that do not go together.
    """

    options: PictureOptions
    effort: Effort
    """Effort that results from the options."""
    chosen: Chosen | None = None
    """Reason for the effort, if it was not given."""

    def __post_init__(self) -> None:
        for label in self.labels:
            if label not in LABELS:
                raise InputError(f"there is no label {label!r}", do=suggestion(label, LABELS))
        refuse_unknown_device(self.device, AUTO)
        if self.device not in (CPU, AUTO):
            self._refuse_device()
        supported = renderer_entry(self.renderer).effort
        if unused := set(self.effort.unusual) - supported:
            found = f"{self.renderer} has no {' and no '.join(sorted(unused))}"
            raise InputError(found, where=self.effort.text, do=f"give it only {' and '.join(sorted(supported))}")
        if f".{self.options.image_format}" not in IMAGE_SUFFIXES:
            formats = " or ".join(suffix.removeprefix(".") for suffix in IMAGE_SUFFIXES)
            raise InputError(f"images cannot be {self.options.image_format!r}", do=f"choose {formats}")
        if not self.kinds:
            raise InputError("no file is requested", do="request labels, the image, or both")

    @classmethod
    def of(cls, options: PictureOptions) -> "RenderRequest":
        """Return the request for the pictures of an existing stage. Raises InputError for options that do not go
        together, and for missing files."""
        if options.labels_only and not options.radiance:
            for name in ("quality", "error"):
                if getattr(options, name) is not None:
                    raise InputError(f"{name} is given with labels_only, which renders no light", do="drop one of them")
        root = root_layer(Path(options.stage))
        error = None if options.error is None else str(options.error)
        measured = None if options.measured is None else Path(options.measured)
        setting, chosen = setting_of(root, options, renderer=options.renderer, error=error, measured=measured)
        request = cls(options=options, effort=setting.effort, chosen=chosen)
        existing_stage(Path(options.stage))
        return request

    @cached_property
    def stage(self) -> Path:
        """The stage's root layer."""
        return root_layer(Path(self.options.stage))

    @property
    def variants(self) -> tuple[str, ...]:
        """Names and patterns; none for the stage's own selection."""
        return names_in(self.options.variants)

    @property
    def renderer(self) -> str:
        return self.options.renderer or DEFAULT_RENDERER

    @property
    def device(self) -> str:
        """Device that renders the light, one of renderers.device.DEVICES or AUTO."""
        return self.options.device

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """The named labels; the names may include "default", "all", which leaves out labels that not every stage can
        have, and "none"."""
        everywhere = tuple(name for name in LABELS if name not in NOT_EVERYWHERE)
        groups = {"default": DEFAULT_LABELS, "all": everywhere, "none": ()}
        return tuple(label for name in names_in(self.options.labels) for label in groups.get(name, (name,)))

    @property
    def labels_where_possible(self) -> tuple[str, ...]:
        """Labels to make too if the stage can have them."""
        return NOT_EVERYWHERE if "all" in names_in(self.options.labels) else ()

    @property
    def image(self) -> bool:
        return not self.options.labels_only

    @property
    def image_suffix(self) -> str:
        return f".{self.options.image_format}"

    @property
    def kinds(self) -> tuple[str, ...]:
        """The requested kinds of file of each picture."""
        wanted = {*self.labels, *([IMAGE] if self.image else []), *([RADIANCE] if self.options.radiance else [])}
        return tuple(kind for kind in FILE_KINDS if kind in wanted)

    @property
    def renders(self) -> bool:
        """Whether pictures need a renderer: labels alone do not."""
        return self.image or self.options.radiance

    def devices(self) -> tuple[str, ...]:
        """Return the devices of this machine that may render the light, the best first. Raises UnsupportedError if the
        requested one is missing."""
        if self.device == AUTO and self.renders and renderer_entry(self.renderer).graphics:
            return tuple(usable_devices())
        name = CPU if self.device == AUTO else self.device
        require_device(name)
        return (name,)

    def _refuse_device(self) -> None:
        """Raise InputError if no light would be rendered on the named device."""
        if not self.renders:
            raise InputError(f"device {self.device} is given where no light is rendered", do="leave --device out")
        if not renderer_entry(self.renderer).graphics:
            able = " or ".join(f"--renderer {name}" for name, entry in RENDERERS.items() if entry.graphics)
            found = f"the renderer {self.renderer} renders on the CPU alone, and the device {self.device} is requested"
            raise InputError(found, do=f"leave --device out, or choose {able}")


@dataclass(frozen=True, kw_only=True)
class PlanRequest:
    """The request for a plan."""

    request: RenderRequest
    devices: tuple[str, ...] = (CPU,)
    """Devices that may render the light; the first able one is taken."""
    labels: tuple[str, ...] = ()
    """Labels to return keys of."""
    copy_to: Path | None = None
    """A folder to copy the stage to first."""
    explain: bool = False
    """Whether to count the work that the scenes do not need."""
    shard: Shard | None = None
    """Shard whose pictures alone are planned; None for all."""
    trial: bool = False
    """Whether to measure how fast this machine is."""
