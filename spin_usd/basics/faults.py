"""Faults of parsers, of the system and of the installation, as opposed to internal defects.

An error of a library on its input is a fault of the input, a refusal of the system is the machine's, and a missing
package is the installation's: each becomes a SpinError, one sentence, anywhere. Only this file defines which they are.
"""

import errno
import logging
import os
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from spin_usd.basics.extras import EXTRAS
from spin_usd.errors import InputError, MissingPackageError, OutputError, SpinError

PARSERS: Mapping[str, str] = {
    "builtins.UnicodeError": "contains text that is not UTF-8",
    "builtins.RecursionError": "is nested too deeply",
    "builtins.MemoryError": "needs more memory than a process that reads it may take",
    "builtins.OverflowError": "holds a number that is too large",
    "json.decoder.JSONDecodeError": "is not JSON",
    "tomllib.TOMLDecodeError": "is not TOML",
    "numpy.linalg.LinAlgError": "holds numbers that cannot be calculated with",
    "cv2.error": "holds numbers that cannot be calculated with",
    "pxr.Tf.ErrorException": "is damaged",
    "tokenize.TokenError": "is damaged",
    "builtins.SyntaxError": "is damaged",
    "zipfile.BadZipFile": "is damaged",
    "zlib.error": "is damaged",
    "_lzma.LZMAError": "is damaged",
    "_csv.Error": "is not CSV",
    "struct.error": "is damaged",
    "builtins.EOFError": "is cut short",
}
"""Classes of parser errors, as text, so that importers do not import pxr. Their messages are about the input."""

FETCH_AGAIN = "check that the file is whole, and export or copy it again if not"

LOGGERS = ("trimesh", "PIL", "xsdata")
"""Loggers of libraries; their messages only go to handlers that the program's user has set up."""

for _name in LOGGERS:
    logging.getLogger(_name).addHandler(logging.NullHandler())  # else Python prints it to the terminal

SYSTEM: Mapping[int, str] = {
    errno.EACCES: "change its permissions, or choose another place",
    errno.EPERM: "change its permissions, or choose another place",
    errno.EROFS: "choose a place that can be written",
    errno.ENOSPC: "free some space",
    errno.EDQUOT: "free some space",
    errno.EFBIG: "free some space, or raise the limit of a file's size (ulimit -f)",
    errno.EIO: "check the disk",
    errno.ESTALE: "check the network's file system",
    errno.ELOOP: "remove the links that lead in a circle",
    errno.ENAMETOOLONG: "give a shorter name",
    errno.EMFILE: "raise the limit of open files (ulimit -n)",
    errno.ENFILE: "end programs that hold many files open",
    errno.EAGAIN: "raise the limit of processes (ulimit -u)",
    errno.ENOMEM: "free some memory, or raise its limit (ulimit -v)",
}
"""Refusals of the system, and the remedy for each."""

OF_UNIX = ("fcntl", "resource")
"""Modules that Python has on Linux and macOS alone. Reading a dataset and scoring predictions need none of them."""


def expected(fault: BaseException, where: object = None) -> SpinError | None:
    """Return the fault as a SpinError, with `where` unless it has a place; None for a defect."""
    if isinstance(fault, SpinError):
        return fault
    if isinstance(fault, OSError) and fault.errno is not None and fault.errno in SYSTEM:
        reason, at = os.strerror(fault.errno), fault.filename if fault.filename is not None else where
        return OutputError(reason if at is None else f"the system reports: {reason}", where=at, do=SYSTEM[fault.errno])
    if isinstance(fault, ModuleNotFoundError):
        module = (fault.name or "").partition(".")[0]
        for extra in EXTRAS.values():
            if package := extra.packages.get(module):
                do = extra.to_install(*(extra.missing or [package]))
                return MissingPackageError(f"{package} is not installed", do=do)
    if isinstance(fault, ModuleNotFoundError) and fault.name in OF_UNIX:
        do = "read datasets and score predictions here, and do all else on Linux"
        return MissingPackageError(f"this system has no {fault.name}", do=do)
    names = (f"{kind.__module__}.{kind.__qualname__}" for kind in type(fault).__mro__)
    found = next((PARSERS[name] for name in names if name in PARSERS), None)
    if found is None:
        return None
    return InputError(found if where is not None else f"what was read {found}", where=where, do=FETCH_AGAIN)


@contextmanager
def decoding(where: object) -> Iterator[None]:
    """Raise any error of the block as InputError with `where`, except refusals of the system.

    Only for a block that decodes untrusted bytes by a library. Its possible errors are unknown: a damaged head of a zip
    file is a NotImplementedError. Warnings of the library are not printed.
    """
    try:
        with reading(where), warnings.catch_warnings(action="ignore"):
            yield
    except SpinError:
        raise
    except Exception as fault:
        raise InputError(f"is damaged ({fault})", where=where, do=FETCH_AGAIN) from fault


@contextmanager
def reading(where: object = None) -> Iterator[None]:
    """Raise errors of the block as SpinError, if they are faults: faults of parsers as InputError with `where`."""
    try:
        yield
    except Exception as fault:
        error = expected(fault, where)
        if error is None or error is fault:
            raise
        raise error from fault
