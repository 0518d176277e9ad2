"""Where things lie in the asset."""

from pxr import Sdf

ROOT = Sdf.Path("/Tango")
MATERIALS = ROOT.AppendChild("mtl")
LOOK_SET = "look"
