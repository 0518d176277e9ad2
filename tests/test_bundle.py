"""A bundle of Python and a package unpacks without either, runs from where it lies, and says what is missing of it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import zstandard

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tools"))

from bundling import archive, kernels, leave_out, libraries, tree  # noqa: E402

PACKAGES = Path("lib", "python3.13", "site-packages")
MODULE = "NUMBER = 42\n" + "# padding that makes several parts\n" * 1000
PART_BYTES = 2000

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.version_info[:2] != (3, 13), reason="a bundle holds Python 3.13"),
    pytest.mark.skipif(shutil.which("cc") is None, reason="stand-ins are compiled"),
]


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bundle of this Python and of one small package."""
    folder = tmp_path_factory.mktemp("bundle")
    venv = folder / "venv"
    (venv / "bin").mkdir(parents=True)
    (venv / "bin" / "python").symlink_to(sys.executable)
    (venv / PACKAGES).mkdir(parents=True)
    (venv / PACKAGES / "answer.py").write_text(MODULE)
    (venv / PACKAGES / "noise.bin").write_bytes(os.urandom(2 * PART_BYTES))
    root, out = folder / "tree", folder / "parts"
    out.mkdir()
    tree.lay_out(root, venv)
    libraries.settle(root, venv)
    archive.write(root, out, PART_BYTES, glibc=libraries.lowest_glibc(root))
    shutil.copy(ROOT / "tools" / "bundling" / "unpack.sh", out)
    shutil.rmtree(root)
    return out


def unpacked(parts: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Unpack with an environment that has no Python."""
    where = {"PATH": "/usr/bin:/bin"}
    return subprocess.run(["sh", parts / "unpack.sh", folder], env=where, capture_output=True, text=True)


def test_it_runs_from_any_folder(bundle: Path, tmp_path: Path) -> None:
    folder = tmp_path / "a b"
    done = unpacked(bundle, folder)
    assert done.returncode == 0, done.stderr
    moved = folder.rename(tmp_path / "moved")
    code = "import answer, ctypes, hashlib, lzma, sys; print(answer.NUMBER, sys.prefix)"
    ran = subprocess.run([moved / "bin" / "python3.13", "-c", code], env={}, capture_output=True, text=True)
    assert ran.stdout.split() == ["42", str(moved)], ran.stderr


def test_a_missing_and_a_damaged_part_are_named(bundle: Path, tmp_path: Path) -> None:
    parts = tmp_path / "parts"
    shutil.copytree(bundle, parts)
    second = parts / "rest.tar.xz.001"
    whole = second.read_bytes()
    second.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    damaged = unpacked(parts, tmp_path / "out")
    second.unlink()
    missing = unpacked(parts, tmp_path / "out")
    assert damaged.returncode == missing.returncode == 2
    assert "rest.tar.xz.001 is damaged; copy it again" in damaged.stderr
    assert "rest.tar.xz.001 is missing; copy it again" in missing.stderr
    assert not (tmp_path / "out").exists()


def test_a_folder_that_is_not_empty_stays_as_it_is(bundle: Path, tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("mine")
    done = unpacked(bundle, tmp_path)
    assert done.returncode == 2
    assert "not empty" in done.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["mine"]


def test_a_stand_in_answers_nothing_and_gives_way_to_who_defines_it(tmp_path: Path) -> None:
    """The consumer asks the original for two functions; another library has one of them."""

    def compiled(name: str, text: str, *more: str) -> Path:
        (tmp_path / f"{name}.c").write_text(text)
        out = tmp_path / f"{name}.so"
        subprocess.run(["cc", "-shared", "-fPIC", "-o", out, tmp_path / f"{name}.c", *more], check=True)
        return out

    original = compiled("original", "long absent(void) { return 7; } long shared(void) { return 7; }")
    shared = compiled("shared", "long shared(void) { return 3; }")
    consumer = compiled(
        "consumer", "long absent(void); long shared(void); long sum(void) { return absent() + shared(); }"
    )
    found = [libraries._read(file) for file in (shared, consumer)]
    (tmp_path / "made").mkdir()
    libraries._stand_in(tmp_path / "made", "original.so", found, libraries._read(original))
    code = (
        "import ctypes, sys; [ctypes.CDLL(name, ctypes.RTLD_GLOBAL) for name in sys.argv[1:3]]; "
        "print(ctypes.CDLL(sys.argv[3]).sum())"
    )
    run = [sys.executable, "-c", code, tmp_path / "made" / "original.so", shared, consumer]
    assert subprocess.run(run, capture_output=True, text=True, check=True).stdout == "3\n"


def test_what_is_left_out_is_what_a_device_does_not_need(tmp_path: Path) -> None:
    kernels = tmp_path / leave_out.KERNELS
    kernels.mkdir(parents=True)
    for name in ("sm_75.cubin", "sm_86.cubin", "compute_75.ptx", "gfx1030.fatbin"):
        (kernels / f"kernel_{name}.zst").write_bytes(b"12")
    leave_out.prune(tmp_path, "cuda", "8.6")
    assert {file.name for file in kernels.iterdir()} == {"kernel_sm_86.cubin.zst", "kernel_compute_75.ptx.zst"}
    assert leave_out.prune(tmp_path, "cpu")["kernels of NVIDIA"] == 4
    assert not list(kernels.iterdir())


def test_kernels_are_assembled_of_the_newest_text_that_is_not_newer_under_the_name_that_cycles_looks_for(
    tmp_path: Path,
) -> None:
    for number in ("61", "75", "120"):
        (tmp_path / f"kernel_compute_{number}.ptx.zst").write_bytes(zstandard.compress(f"of {number}".encode()))
    assembler = tmp_path / "ptxas"
    assembler.write_text('#!/bin/sh\n(echo "$1"; cat "$3") > "$5"\n')
    assembler.chmod(0o755)
    made = kernels.assemble(tmp_path, "9.0", str(assembler))
    assert made == tmp_path / "kernel_sm_90.cubin.zst"
    assert zstandard.decompress(made.read_bytes()).decode() == "--gpu-name=sm_90\nof 75"
