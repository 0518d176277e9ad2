import struct

import pytest
from pxr import Sdf, Usd

from spin_usd.errors import StageError
from spin_usd.stage.check.variant_opinions import opinions

HEADER = 88  # bytes; behind it lie the lists of prims and of properties
NO_TOKEN = 255
ONE = struct.pack("<Q", 1)  # the length of a list


def test_a_layer_that_lists_a_property_that_it_does_not_hold_is_damaged(tmp_path) -> None:
    """USD gives None for it. Here the number of the property's name in a binary layer is one that no name has."""
    file = tmp_path / "layer.usdc"
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    Sdf.AttributeSpec(Sdf.CreatePrimInLayer(layer, "/A"), "x", Sdf.ValueTypeNames.Int)
    layer.Export(str(file))
    data = bytearray(file.read_bytes())
    prims = data.index(ONE, HEADER)
    data[data.index(ONE, prims + len(ONE)) + len(ONE)] = NO_TOKEN
    file.write_bytes(data)
    stage = Usd.Stage.Open(str(file))
    (opinion,) = opinions(stage.GetPrimAtPath("/A"))
    assert None in list(opinion.spec.properties)
    with pytest.raises(StageError, match=r"layer\.usdc /A: lists a property that the layer does not hold"):
        opinion.properties  # noqa: B018
