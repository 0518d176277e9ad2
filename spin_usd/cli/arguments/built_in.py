"""The names of what travels with spin_usd, for help texts."""

from spin_usd.errors import InputError
from spin_usd.resources import bundled_names


def named(kind: str) -> str:
    """List the bundled names of `kind`, one of resources.BUNDLED, such as "sun, sunlamp".

    In a broken installation, which doctor reports, it says only that there are names.
    """
    try:
        return ", ".join(bundled_names(kind))
    except InputError:
        return "a name"
