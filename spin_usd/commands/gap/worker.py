"""The child's part of `gap`: pairs of a real picture and ours, measured; trials of materials; and the written fits."""

from math import inf, log
from pathlib import Path

import numpy as np
from msgspec import structs

from spin_usd.commands.gap.calls import (
    FitLight,
    Fitted,
    LightAnswer,
    MeasuredPair,
    MeasurePair,
    OpenedGap,
    OpenGap,
    Pair,
    ShownMaterial,
    SurfaceErrors,
    TrySurfaces,
    WriteFits,
)
from spin_usd.commands.gap.pair_light import PairLight
from spin_usd.commands.gap.pair_measures import measured_pair
from spin_usd.commands.gap.pair_studio import PairStudio
from spin_usd.processes.processors import hold_to
from spin_usd.realism.surface_fit import INPUTS
from spin_usd.scene.derived.lookup import extremes
from spin_usd.scene.material import LIMITS, ROUNDING, Material
from spin_usd.scene.texture import Primvar, Texture
from spin_usd.stage.augment.fitted_stage import FittedPicture, write_fits
from spin_usd.studio.picture_request import PictureRequest


class GapWorker:
    """A stage that is open, with a studio."""

    opened: OpenedGap

    def __init__(self, request: OpenGap) -> None:
        hold_to(request.cpus)
        self._pictures = PairStudio(request.stage, request.variant, request.settings)
        self._studio, self._light = self._pictures.studio, PairLight(self._pictures)
        reader = self._pictures.stage.reader()
        sensor = reader.scene(reader.frames[0]).sensor
        self.opened = OpenedGap(frames=[each.name for each in reader.frames], sensor=sensor)

    def measure(self, request: MeasurePair) -> MeasuredPair:
        """Make our picture of a pair with the fits so far, and measure both. Raises InputError for a real picture that
        cannot be compared."""
        return measured_pair(self._pictures, request)

    def fit_light(self, request: FitLight) -> LightAnswer:
        """Fit the light of a real picture. Raises InputError as `measure` does."""
        return self._light.fit(request)

    def shown_materials(self, pair: Pair) -> dict[str, ShownMaterial]:
        """Count the pixels of each material of the first target in a picture."""
        scene = self._pictures.scene(pair, Fitted()).one_body_scenes[0]
        visible, target = self._studio.caster.visibility(scene), scene.bodies[0].target
        materials = target.mesh.face_material[visible.face[visible.face >= 0]]
        counts = np.bincount(materials, minlength=len(target.materials))
        return {
            material.path.rpartition("/")[2]: ShownMaterial(pixels=int(count), limits=_factor_limits(material))
            for material, count in zip(target.materials, counts, strict=True)
            if count and material.path
        }

    def try_surfaces(self, request: TrySurfaces) -> SurfaceErrors:
        """Fit the light of a picture anew with the values of each trial. Raises InputError as `measure` does."""
        fitted = (structs.replace(request.fitted, values=trial) for trial in request.trials)
        asked = (FitLight(pair=request.pair, fitted=each, psf_sigma=request.psf_sigma) for each in fitted)
        one, other = np.stack([self._light.residuals(each) for each in asked], axis=1)
        return SurfaceErrors(products=((one @ other.T + other @ one.T) / 2).tolist())

    def write_fits(self, request: WriteFits) -> str:
        """Write the fits as layers over a copy of the stage; return its root layer. Raises OutputError, and
        UnsupportedError for lights that cannot be written."""
        pictures = [
            FittedPicture(
                frame=self._pictures.stage.frame(PictureRequest(frame=each.pair.frame)),
                scene=self._pictures.scene(each.pair, structs.replace(each.fitted, values={})),
            )
            for each in request.pictures
        ]
        root, folder = Path(self._pictures.stage.path), Path(request.folder)
        return str(write_fits(root, folder, pictures, fits=request.fits, values=request.values))


def _factor_limits(material: Material) -> dict[str, tuple[float, float]]:
    """Return the limits of the logarithms of factors on a material's inputs, of those that can be changed."""
    found = {}
    for name, field in INPUTS.items():
        value, own = getattr(material, field), LIMITS[field]
        if isinstance(value, Primvar):
            most = 1.0
        else:
            most = float(extremes(value).max()) if isinstance(value, Texture) else float(np.max(value))
        if most > 0:
            found[name] = (log(own.low / most) if own.low else -inf, log(max(own.high - ROUNDING, most) / most))
    return found
