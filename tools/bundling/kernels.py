"""Cycles' kernels for a compute capability of NVIDIA for which Blender brings none, assembled as a driver would."""

import subprocess
import sys
import tempfile
from pathlib import Path

import zstandard

PTX = "kernel_compute_*.ptx.zst"


def assemble(kernels: Path, compute: str, ptxas: str) -> Path:
    """Write the kernels for `compute`, as 9.0, into the folder `kernels`, where Cycles looks for them first; return the
    file. They are made of the newest PTX there that is not newer. `ptxas` is CUDA's program, no newer than the
    CUDA of the driver. Ends the program where there is nothing to assemble.
    """
    number = compute.replace(".", "")
    texts = {int(file.name.split("_")[-1].split(".")[0]): file for file in kernels.glob(PTX)}
    able = [version for version in texts if version <= int(number)]
    assembled = kernels / f"kernel_sm_{number}.cubin.zst"
    if assembled.exists() or not able:
        brings = "brings kernels" if assembled.exists() else "has no text of kernels"
        sys.exit(f"tools/bundle: Blender {brings} for compute capability {compute}; leave --ptxas out")
    source = texts[max(able)]
    with tempfile.TemporaryDirectory() as folder:
        ptx, cubin = Path(folder, "kernel.ptx"), Path(folder, "kernel.cubin")
        ptx.write_bytes(zstandard.decompress(source.read_bytes()))
        subprocess.run([ptxas, f"--gpu-name=sm_{number}", "--split-compile=0", ptx, "-o", cubin], check=True)
        assembled.write_bytes(zstandard.compress(cubin.read_bytes(), 19))
    return assembled
