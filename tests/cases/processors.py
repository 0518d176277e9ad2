"""Lesser processors, as the switches of the libraries have them."""

from numpy._core._multiarray_umath import __cpu_features__  # type: ignore[import-not-found]  # of C, without stubs

LESSER = {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR", "OPENBLAS_CORETYPE": "Prescott"}
"""Variables by which numpy and its BLAS do without the instructions that not every processor has."""


def numpy_uses_avx2() -> bool:
    """Whether numpy uses AVX2 and what comes with it in x86-64-v3, which LESSER takes from it."""
    return bool(__cpu_features__.get("X86_V3"))
