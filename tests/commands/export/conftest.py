"""The datasets of the tests of `exchange`, for the tests of the command."""

from tests.exchange.conftest import blanked, plain, rendered, two_variants

__all__ = ["blanked", "plain", "rendered", "two_variants"]
