"""The Python with the programs that users read pictures and exports with."""

import pytest

from tests.conftest import REPOSITORY

PYTHON = REPOSITORY / ".venv-readers" / "bin" / "python"


@pytest.fixture(scope="session")
def readers():
    """The Python that has them; tests that want it are skipped where it is not."""
    if not PYTHON.is_file():
        pytest.skip("no .venv-readers; tools/readers_environment makes it")
    return PYTHON
