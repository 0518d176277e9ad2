"""The passes of pictures from their scenes, as arrays: one ray caster and one renderer kept open for many pictures."""

from collections.abc import Iterator, Sequence

from spin_usd.labels.table import CLOUD_LABELS
from spin_usd.picture.make_picture import Made, Stopwatch, make_clouds, make_labels, render_in
from spin_usd.picture.render_file import in_order
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.renderers.renderer import Renderer
from spin_usd.scene.derived.content_keys import RenderSettings, render_seed
from spin_usd.scene.derived.light_groups import UnitLight, in_unit_light
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene


class PassMaker:
    """Makes labels by the `caster` and light by the `renderer`, None for labels alone."""

    def __init__(self, caster: EmbreeCaster, renderer: Renderer | None) -> None:
        self.caster, self.renderer = caster, renderer

    def labels(self, scene: Scene, kinds: Sequence[str], settings: RenderSettings, watch: Stopwatch) -> Iterator[Made]:
        """Make the labels among `kinds`, labels of pixels first."""
        yield from make_labels(scene, self.caster, kinds, watch, self.caster)
        if any(kind in CLOUD_LABELS for kind in kinds):
            yield from make_clouds(scene, self.caster.first_faces, kinds, watch, seed=render_seed(scene, settings))

    def render(self, light: UnitLight, settings: RenderSettings, watch: Stopwatch) -> Radiance:
        """Render the bodies in unit light: what all pictures with this radiance key share."""
        assert self.renderer, "opened without a renderer"
        return in_order(render_in(light, self.renderer, settings, watch))

    def radiance(self, scene: Scene, settings: RenderSettings, watch: Stopwatch) -> Radiance:
        """Render the bodies in the scene's own light."""
        light = in_unit_light(scene)
        return self.render(light, settings, watch).relit(light.gains)
