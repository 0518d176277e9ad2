"""The formats that there are. A new one is a file of its own and an entry here."""

from spin_usd.errors import InputError
from spin_usd.exchange.bop import BOP
from spin_usd.exchange.coco import COCO
from spin_usd.exchange.croissant import CROISSANT
from spin_usd.exchange.cubesat_cdt import CUBESAT_CDT
from spin_usd.exchange.layout.layout import ExportFormat
from spin_usd.exchange.shirt import SHIRT
from spin_usd.exchange.spark import SPARK
from spin_usd.exchange.speed import SPEED
from spin_usd.exchange.speedplus import SPEEDPLUS
from spin_usd.exchange.swisscube import SWISSCUBE
from spin_usd.exchange.urso import URSO
from spin_usd.exchange.webdataset import WEBDATASET
from spin_usd.exchange.yolo import YOLO

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
