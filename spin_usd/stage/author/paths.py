"""The paths of prims in an authored stage."""

from pxr import Sdf

WORLD = Sdf.Path("/World")
CAMERA = WORLD.AppendChild("Camera")
LIGHTS = WORLD.AppendChild("Lights")
ENVIRONMENT = WORLD.AppendChild("Environment")
TARGET = WORLD.AppendChild("Target")
MODEL = TARGET.AppendChild("Model")
"""The target's own asset, which TARGET moves."""
