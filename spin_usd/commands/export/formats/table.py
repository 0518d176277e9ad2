"""The formats that there are. A new one is a file of its own and an entry here."""

from spin_usd.commands.export.formats.bop import BOP
from spin_usd.commands.export.formats.coco import COCO
from spin_usd.commands.export.formats.croissant import CROISSANT
from spin_usd.commands.export.formats.cubesat_cdt import CUBESAT_CDT
from spin_usd.commands.export.formats.shirt import SHIRT
from spin_usd.commands.export.formats.spark import SPARK
from spin_usd.commands.export.formats.speed import SPEED
from spin_usd.commands.export.formats.speedplus import SPEEDPLUS
from spin_usd.commands.export.formats.swisscube import SWISSCUBE
from spin_usd.commands.export.formats.urso import URSO
from spin_usd.commands.export.formats.webdataset import WEBDATASET
from spin_usd.commands.export.formats.yolo import YOLO
from spin_usd.commands.export.layout.layout import ExportFormat
from spin_usd.errors import InputError

_ALL = (
    SPEEDPLUS,
    SPEED,
    SHIRT,
    SPARK,
    URSO,
    CUBESAT_CDT,
    COCO,
    YOLO,
    BOP,
    SWISSCUBE,
    WEBDATASET,
    CROISSANT,
)
EXPORT_FORMATS = {each.name: each for each in _ALL}
"""By name."""


def format_named(name: str) -> ExportFormat:
    """Return the format of that name. Raises InputError that lists those there are."""
    if name not in EXPORT_FORMATS:
        raise InputError(f"there is no format {name!r}", do=f"choose among {', '.join(EXPORT_FORMATS)}")
    return EXPORT_FORMATS[name]
