"""Pictures whose target is smaller than a pixel."""

from spin_usd.scene.model import Scene


class SmallTargets:
    """Collects the pictures in which the target, at its widest, is less than a pixel across.

    Labels are of the rays through the pixels' centres, which may all miss such a target; its light is in the image, as
    far as the picture's own rays find it.
    """

    def __init__(self) -> None:
        self.pictures: list[str] = []
        self.where = ""
        self._least = 1.0

    @property
    def found(self) -> str:
        return (
            f"in {len(self.pictures)} pictures the target is less than a pixel across (at least {self._least:.2g} px): "
            "labels, which are of pixel centres, may show nothing of it, and its light needs many samples"
        )

    def add(self, scene: Scene) -> None:
        """Look at one picture."""
        mesh, camera = scene.target.mesh, scene.camera
        depth = float(scene.T_cam_body.points(mesh.centre)[2])
        if depth <= mesh.radius:
            return
        pixels = 2 * mesh.radius * max(camera.fx, camera.fy) / depth
        if pixels < 1:
            self.pictures.append(scene.frame.name)
            self.where, self._least = scene.target.path, min(self._least, pixels)
