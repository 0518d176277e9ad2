"""Datasets are read of Tango, whose parts and keypoints are of all kinds."""

import pytest


@pytest.fixture(scope="session")
def rendered(rendered_tango):
    """Three pictures of Tango, in place of the CubeSat's."""
    return rendered_tango
