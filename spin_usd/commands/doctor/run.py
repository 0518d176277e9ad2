"""Check this machine for spin_usd's requirements."""

import os
import platform
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated

import psutil
from msgspec import Meta

import spin_usd
from spin_usd.basics.extras import EXTRAS, to_install
from spin_usd.basics.json_fields import JsonStruct
from spin_usd.commands.render.workers import MEMORY_PER_WORKER, default_workers
from spin_usd.errors import MissingPackageError, SpinError
from spin_usd.picture.versions import LIBRARIES
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import rendering_memory
from spin_usd.processes.confine import landlock_version
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.processes.devices import graphics_processors
from spin_usd.processes.open_renderer import RENDERERS, TRY_RENDERER
from spin_usd.processes.processors import usable_cpus
from spin_usd.scene.effort import CPU

DISK_WANTED = 5 << 30
GLIBC = (2, 28)  # of Blender's wheels for Linux: manylinux_2_28


@dataclass(frozen=True, kw_only=True)
class Line:
    """One thing that was examined."""

    subject: Annotated[str, Meta(min_length=1, description="Subject of the check, such as memory or numpy.")]
    found: str
    remedy: Annotated[str, Meta(description="Remedy; empty if it is well.")] = ""

    @property
    def well(self) -> bool:
        return not self.remedy


class DoctorReport(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="doctor-report-1"):
    """Output of spin-usd doctor --json. The exit code is 0 if all is well, 1 otherwise."""

    well: Annotated[bool, Meta(description="Whether no line has a remedy.")]
    lines: Annotated[list[Line], Meta(min_length=1)]


def examine(folder: Path) -> Iterator[Line]:
    """Examine all that spin_usd needs of this machine, with `folder` as the place where datasets would go."""
    yield Line(subject="spin_usd", found=spin_usd.__version__)
    yield _python()
    yield _system()
    needed = [*EXTRAS["read"].packages.values(), *EXTRAS["render"].packages.values()]
    for name in {each.lower(): each for each in (*LIBRARIES, *needed)}.values():
        yield _library(name)
    yield from (_extra(name) for name in EXTRAS if name not in ("read", "render"))
    yield from _children()
    yield _processors()
    yield _devices()
    yield _memory()
    yield _disk(folder)
    yield _confinement()


def _python() -> Line:
    remedy = "" if sys.version_info >= (3, 11) else "use Python 3.13"
    return Line(subject="python", found=f"Python {platform.python_version()}", remedy=remedy)


def _system() -> Line:
    """Report the system and its C library, with a remedy for an untested one."""
    library, version_of_it = platform.libc_ver()
    known = (platform.system(), platform.machine(), library) == ("Linux", "x86_64", "glibc")
    well = known and tuple(map(int, version_of_it.split(".")[:2])) >= GLIBC
    found = f"{platform.system()} on {platform.machine()}, {library or 'another C library than glibc'} {version_of_it}"
    remedy = "" if well else "render on Linux on x86-64 with glibc 2.28 or later; elsewhere it was not tried"
    return Line(subject="system", found=found.strip(), remedy=remedy)


def _library(name: str) -> Line:
    try:
        return Line(subject=name, found=version(name))
    except PackageNotFoundError:
        return Line(subject=name, found="not installed", remedy=to_install(name))


def _extra(name: str) -> Line:
    """Report an extra; none that is missing needs a remedy."""
    extra = EXTRAS[name]
    missing = f"not installed; if you want it, {to_install(*extra.missing)}" if extra.missing else "installed"
    return Line(subject=f"extra [{name}]", found=f"for {extra.use}: {missing}")


def _children() -> Iterator[Line]:
    """Start each renderer as a render would start it: a library that crashes must not take us along."""
    for renderer in RENDERERS:
        try:
            with Child(memory=rendering_memory()) as child:
                found = child.call(TRY_RENDERER, renderer)
            yield Line(subject=f"renderer {renderer}", found=found)
        except MissingPackageError as e:
            yield Line(subject=f"renderer {renderer}", found=e.found, remedy=str(e.do))
        except (SpinError, RuntimeError) as e:
            yield Line(subject=f"renderer {renderer}", found=str(e), remedy="install the locked packages again")


def _confinement() -> Line:
    """Report whether the kernel can confine a reader of a stranger's model to its folder. Absence is not a fault of
    the machine: nothing else needs it."""
    if number := landlock_version():
        found = f"Landlock {number}: readers of .blend, FBX and STEP cannot open files outside the model's folder"
    else:
        found = "no Landlock in this kernel: a .blend or FBX is opened before its paths are checked"
    return Line(subject="strangers' models", found=found)


def _processors() -> Line:
    return Line(
        subject="processors", found=f"{len(usable_cpus())} usable; render would start {default_workers()} workers"
    )


def _devices() -> Line:
    """List devices besides the CPU that can render light."""
    try:
        found = graphics_processors()
    except ChildDiedError as died:
        remedy = "look after the graphics driver; --device cpu does not need it"
        return Line(subject="devices", found=f"{CPU}; the search for others failed: {died}", remedy=remedy)
    more = [f"{name} ({', '.join(models)})" for name, models in found.items()]
    return Line(subject="devices", found="; ".join([CPU, *more]))


def _memory() -> Line:
    free = psutil.virtual_memory().available
    remedy = "" if free > MEMORY_PER_WORKER else "free some memory: a worker may need 1 GB"
    return Line(subject="memory", found=f"{free / 2**30:.1f} GB available", remedy=remedy)


def _disk(folder: Path) -> Line:
    if not folder.is_dir():
        return Line(subject="disk", found=f"{folder} is not a folder", remedy="choose a folder that exists")
    free = shutil.disk_usage(folder).free
    writable = os.access(folder, os.W_OK)
    remedy = "" if free > DISK_WANTED else "free some space: a thousand SPEED+ pictures with labels need about 2 GB"
    if not writable:
        remedy = "choose a folder that you may write"
    return Line(subject="disk", found=f"{free / 2**30:.1f} GB free in {folder}", remedy=remedy)
