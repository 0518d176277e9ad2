"""What a device does not need: files of the environment that no picture is made with."""

import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

PACKAGES = "lib/python3.13/site-packages"
BLENDER = f"{PACKAGES}/bpy/5.2"
KERNELS = f"{BLENDER}/scripts/addons_core/cycles/lib"

# Patterns of pathlib below the bundle's root, by why they are left out.
NOWHERE: Mapping[str, Sequence[str]] = {
    "tests, headers and types of packages": (
        *(f"{PACKAGES}/{name}/**/tests" for name in ("numpy", "scipy", "matplotlib", "trimesh", "psutil", "PIL")),
        *(f"{PACKAGES}/**/{ending}" for ending in ("*.pyi", "*.a", "*.pxd", "*.pyx")),
        *(f"{PACKAGES}/{name}/**/*.h" for name in ("numpy", "scipy", "pxr", "OpenImageIO")),  # Cycles' are OSL's
        f"{PACKAGES}/matplotlib/mpl-data/sample_data",
    ),
    "what compiles or installs": (f"{PACKAGES}/pip", f"{PACKAGES}/pip-*", f"{PACKAGES}/Cython", f"{PACKAGES}/cython*"),
    "Blender's copies of what is there twice": (
        *(f"{BLENDER}/python/lib/python3.13/site-packages/{name}" for name in ("pxr", "OpenImageIO", "openvdb*")),
        *(f"{BLENDER}/python/lib/python3.13/site-packages/{name}" for name in ("MaterialX", "PyOpenColorIO")),
    ),
    "what Blender shows on a screen": (
        *(f"{BLENDER}/datafiles/{name}" for name in ("assets", "icons", "studiolights")),
        *(f"{BLENDER}/scripts/{name}" for name in ("templates_*", "presets")),
        *(
            f"{BLENDER}/scripts/addons_core/{name}"
            for name in ("hydra_storm", "node_wrangler", "rigify", "ui_translate")
        ),
        f"{BLENDER}/datafiles/fonts/Noto Sans CJK*",
    ),
    "kernels of AMD and Intel": (  # not libhiprt, whose zstd all of Blender uses, nor libsycl, which lists devices
        *(f"{KERNELS}/{name}" for name in ("*.fatbin.zst", "*.hipfb.zst")),
        *(
            f"{PACKAGES}/bpy/lib/{name}"
            for name in (
                "libOpenImageDenoise_device_hip*",
                "libOpenImageDenoise_device_sycl*",
                "libcycles_kernel_oneapi*",
            )
        ),
    ),
}
NVIDIA = (
    *(f"{KERNELS}/{name}" for name in ("*.cubin.zst", "*.ptx.zst")),
    f"{PACKAGES}/bpy/lib/libOpenImageDenoise_device_cuda*",
)
DEVICES: Mapping[str, Mapping[str, Sequence[str]]] = {
    "cpu": {**NOWHERE, "kernels of NVIDIA": NVIDIA},
    "cuda": NOWHERE,  # cuda and optix
}


def prune(root: Path, device: str, compute: str | None = None) -> dict[str, int]:
    """Delete what `device` does not need; return how many bytes each reason left out. `compute`: the one compute
    capability of NVIDIA, as 8.6, whose kernels stay beside those that a driver compiles for any."""
    reasons = dict(DEVICES[device])
    if compute is not None:
        others = [
            file.name
            for file in (root / KERNELS).glob("*.cubin.zst")
            if f"_sm_{compute.replace('.', '')}." not in file.name
        ]
        reasons[f"kernels of NVIDIA for others than {compute}"] = [f"{KERNELS}/{name}" for name in others]
    return {why: sum(map(_deleted, _found(root, patterns))) for why, patterns in reasons.items()}


def _found(root: Path, patterns: Sequence[str]) -> Iterator[Path]:
    for pattern in patterns:
        yield from sorted(root.glob(pattern))


def _deleted(path: Path) -> int:
    """Delete a file or folder, which an earlier pattern may have taken; return its bytes."""
    if path.is_dir() and not path.is_symlink():
        size = sum(file.stat().st_size for file in path.rglob("*") if file.is_file())
        shutil.rmtree(path)
        return size
    if not path.is_symlink() and not path.exists():
        return 0
    size = path.lstat().st_size
    path.unlink()
    return size
