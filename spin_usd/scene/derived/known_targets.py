"""Targets kept from scene to scene: a renderer's data for a target serve every scene with an equal one."""

from dataclasses import replace

from spin_usd.scene.scene import Scene
from spin_usd.scene.target import Target


class KnownTargets:
    """The targets of the scene before."""

    def __init__(self) -> None:
        self._targets: dict[tuple[str, str, str], Target] = {}

    def in_place(self, scene: Scene) -> Scene:
        """Return the scene with the targets of the one before where they are the same."""
        shapes = {(body.target.path, body.target.name, body.target.key): body.target for body in scene.bodies}
        known = {key: self._targets.get(key, target) for key, target in shapes.items()}
        by_new = {id(target): known[key] for key, target in shapes.items()}
        self._targets = known
        return replace(scene, bodies=tuple(replace(body, target=by_new[id(body.target)]) for body in scene.bodies))
