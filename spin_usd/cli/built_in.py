"""The names of what travels with spin_usd, for helps."""

from spin_usd.errors import InputError
from spin_usd.resources import bundled_names


def named(kind: str) -> str:
    """Of one of resources.BUNDLED, such as "sun, sunlamp"; in a broken installation, which doctor tells of, only that
    they have names."""
    try:
        return ", ".join(bundled_names(kind))
    except InputError:
        return "a name"
