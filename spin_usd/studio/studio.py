"""A studio: a ray caster and a renderer kept open, which make pictures of scenes."""

from collections.abc import Collection, Sequence
from dataclasses import asdict

from spin_usd.labels.table import own_keys
from spin_usd.picture.kinds import RENDERED
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.picture.pass_maker import PassMaker
from spin_usd.picture.versions import library_versions
from spin_usd.processes.open_renderer import open_renderer as opened
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.renderers.renderer import Renderer
from spin_usd.scene.derived.content_keys import KeyMaker, Keys, RenderSettings, render_seed
from spin_usd.scene.scene import Scene
from spin_usd.studio.picture_passes import PicturePasses, Sink
from spin_usd.studio.record import CurrentPicture


class Studio:
    """Makes pictures with the same settings, one after another.

    The same arguments give the same picture, whatever the earlier pictures. The renderer opens when the first light is
    rendered, or when `open_renderer` is called.
    """

    def __init__(self, settings: RenderSettings) -> None:
        self.settings = settings
        self.caster = EmbreeCaster()
        self.maker = PassMaker(self.caster, None)
        self.versions = library_versions()
        self._keys = KeyMaker(settings)
        self._passes = PicturePasses(self.maker)

    def open_renderer(self, *, crop: bool = True, keep: Collection[str] = ()) -> Renderer:
        """Return the renderer, opened now if it is not open yet. `crop` and `keep`: as for open_renderer."""
        if self.maker.renderer is None:
            name, device = self.settings.renderer, self.settings.device
            self.maker.renderer = opened(name, device=device, crop=crop, keep=keep, caster=self.caster)
            self.versions |= self.maker.renderer.versions()
        return self.maker.renderer

    def close(self) -> None:
        """Close the renderer; the next light opens it again."""
        if self.maker.renderer is not None:
            self.maker.renderer.close()
            self.maker.renderer = None

    def keys(self, scene: Scene, settings: RenderSettings | None = None) -> Keys:
        """Return the content keys of a scene; `settings`: settings that differ in the seed alone."""
        self._keys.seed = (settings or self.settings).seed
        return self._keys.keys(scene)

    def make(
        self,
        scene: Scene,
        kinds: Sequence[str],
        sink: Sink,
        watch: Stopwatch,
        *,
        settings: RenderSettings | None = None,
        keep_render: bool = True,
        keep_labels: bool = True,
        recorded: bool = True,
    ) -> CurrentPicture:
        """Make these kinds of file of the scene, as far as the sink does not have them, and give them to it.

        `settings`: settings that differ in the seed alone. `keep_render`, `keep_labels`: whether the sink stores them
        for other pictures. `recorded`: whether a record will be made. A picture that fails leaves none of its files.
        """
        settings = settings or self.settings
        if RENDERED.intersection(kinds):
            self.open_renderer()
        keys = self.keys(scene, settings)
        own = own_keys(kinds, scene, keys.geometry, render_seed(scene, settings))
        picture = CurrentPicture(
            scene=scene,
            kinds=kinds,
            keys={**asdict(keys), **own},
            settings=settings,
            watch=watch,
            keep_render=keep_render,
            keep_labels=keep_labels,
            recorded=recorded,
        )
        picture.files = self._passes.write_all(picture, sink)
        return picture
