"""What travels with the package is found by its name, and what is none is told apart from a file that is there."""

import pytest

from spin_usd.basics.resources import bundled, bundled_names
from spin_usd.errors import InputError


@pytest.mark.parametrize("kind", ["preset", "lights", "environment", "lidar"])
def test_a_file_that_is_there_is_not_called_missing(tmp_path, kind) -> None:
    """A name that is none, of a file with another ending than its kind has."""
    assert bundled(kind, bundled_names(kind)[0]).is_file()
    file = tmp_path / "my.txt"
    with pytest.raises(InputError, match=r"there (is|are) no"):
        bundled(kind, str(file))
    file.write_text("")
    with pytest.raises(InputError, match="is a file that cannot be a"):
        bundled(kind, str(file))
