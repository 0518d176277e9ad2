"""The environment that has Ray and fsspec."""

import pytest

from tests.conftest import REPOSITORY

PYTHON = REPOSITORY / ".venv-cluster" / "bin" / "python"


@pytest.fixture(scope="session")
def python():
    """The Python that has them."""
    if not PYTHON.is_file():
        pytest.skip("no .venv-cluster; tools/cluster_environment makes it")
    return PYTHON
