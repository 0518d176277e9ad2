"""USD in and out: the only folder that imports pxr."""

# Before any other module of this package can make USD build its schema registry.
from spin_usd.stage.usd import schema as schema
