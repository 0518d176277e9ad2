"""Layers that a process holds follow their files."""

from pxr import Sdf, Usd

from spin_usd.stage.usd.layer_file import reload_layers

LAYERS = 8


def test_layers_that_a_reload_lets_go_are_passed_over(tmp_path) -> None:
    """A stage that nobody has collected yet holds sublayers until the reload of its root layer takes them away."""
    files = [tmp_path / f"{number}.usda" for number in range(LAYERS)]
    for file, sublayer in zip(files, [*files[1:], None], strict=True):
        layer = Sdf.Layer.CreateNew(str(file))
        layer.subLayerPaths = [f"./{sublayer.name}"] if sublayer else []
        layer.Save()
    del layer
    stage = Usd.Stage.Open(str(files[0]))
    assert len(stage.GetUsedLayers(includeClipLayers=False)) == LAYERS + 1  # and the session's
    for file in files:
        file.write_text('#usda 1.0\ndef Xform "New"\n{\n}\n')
    reload_layers()
    assert stage.GetPrimAtPath("/New")
    assert not any(Sdf.Layer.Find(str(file)) for file in files[1:])
