"""The columns of a child's plan: lists by these names, one entry a picture."""

from spin_usd.scene.derived.content_keys import KEYS

STATED = ("index", "frame", "time_code")  # by the stage
COSTLY = ("extent", "light_groups", "features")
COLUMNS = (*STATED, *KEYS, "targets", *COSTLY, "stated", "label_keys")
PLANNING = "planning: picture"  # how it reports how far it is
