"""Pictures of test charts by a stage's own camera, optics and detector, and what they show of them.

The charts are a grey plate of known radiance that fills the view, in steps of exposure; the slanted edge of such a
plate; and the dark. Numbers are the detector's, before any tone curve, and the offset is such that no noise is cut off
in the dark, as EMVA Standard 1288, "Standard for Characterization of Image Sensors and Cameras", release 4.0, has it;
the edge is that of ISO 12233.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from msgspec import UNSET

from spin_usd.basics.arrays import Float
from spin_usd.basics.resources import stages
from spin_usd.commands.evidence.calls import Calibrate
from spin_usd.commands.evidence.report import Calibrated
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.scene.light import DistantLight
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.scene.sensor import Sensor
from spin_usd.sensor.detector import when_full
from spin_usd.sensor.develop import develop
from spin_usd.studio.open_stage import OpenStage
from spin_usd.studio.picture_request import PictureRequest
from spin_usd.studio.studio import Studio

CHARTS, PLATE, EDGE = "charts/plate.usda", "plate", "edge"
SIDE, LEAST_SIDE = 256, 48  # pixels around the principal point that are measured, at most and at least
LEVEL = 0.5  # of the detector's full signal, of the plate at the camera's own exposure
STEPS = (0.2, 0.5, 0.8, 1.1, 1.4)  # of that exposure
OFFSET = 1 / 16  # of the ADC's steps
SLANT = np.radians(5)  # of the edge off the vertical
EDGES = 48  # pictures of the edge
REACH, BIN = 24.0, 0.125  # pixels of its profile
SIGMAS, ROUNDS = 5.0, 4
ROUNDING = 1 / 12
LEAST_NOISE = 0.4  # steps: less is lost in the rounding
WHITE = 65535


def calibrated(request: Calibrate) -> dict[str, Calibrated]:
    """Return what pictures of charts show of camera and detector; nothing of a detector that is blind, and where too
    little of the picture is about the principal point. Raises InputError, StageError."""
    own = OpenStage(request.stage, variant=request.variant).scene(PictureRequest())
    studio = Studio(request.settings)
    studio.open_renderer()
    blind = own.sensor.exposure * _weight(own.sensor) <= 0
    if blind or min(_around_principal(own.camera, SIDE).shape) < LEAST_SIDE:
        return {}
    return Chart.of(own, studio).measured()


@dataclass(frozen=True, kw_only=True, eq=False)
class Chart:
    """The charts before a camera, and its detector in a known state."""

    plate: Scene
    edge: Scene
    studio: Studio
    sensor: Sensor
    region: Region
    """The measured pixels, about the principal point."""
    radiance: float
    """Radiance of the plate, W/m2/sr."""

    @classmethod
    def of(cls, own: Scene, studio: Studio) -> "Chart":
        """Return the charts for the camera, optics and detector of a scene; the plate reaches LEVEL at the camera's own
        exposure."""
        most = 2**own.sensor.adc_bits - 1
        sensor = replace(
            own.sensor, auto_exposure=None, encoding="linear", bit_depth=16, contrast=1.0, saturation=1.0,
            filter=(1.0, 1.0, 1.0), jpeg_quality=0, black_level=max(own.sensor.black_level, OFFSET * most),
        )  # fmt: skip
        full = when_full(sensor)[0] - (sensor.black_level / most if sensor.gain else 0)
        radiance = LEVEL * full / sensor.exposure / _weight(sensor)
        charts = OpenStage(stages() / CHARTS)
        scenes = [charts.scene(PictureRequest(frame=name)) for name in (PLATE, EDGE)]
        albedo, sun = scenes[0].bodies[0].target.materials[0].diffuse_color, scenes[0].lights[0]
        assert isinstance(albedo, tuple)
        assert isinstance(sun, DistantLight)
        light = replace(sun, irradiance=(radiance * np.pi / albedo[1],) * 3)
        camera = _cropped(own.camera)
        plate, edge = (
            replace(scene, camera=camera, optics=own.optics, sensor=sensor, lights=(light,)) for scene in scenes
        )
        region = _around_principal(camera, SIDE)
        return cls(plate=plate, edge=edge, studio=studio, sensor=sensor, region=region, radiance=radiance)

    @cached_property
    def light(self) -> tuple[Radiance, Radiance]:
        """The light of the plate, and of its edge."""
        maker, settings = self.studio.maker, self.studio.settings
        return maker.radiance(self.plate, settings, Stopwatch()), maker.radiance(self.edge, settings, Stopwatch())

    def pictures(self, radiance: Radiance, seeds: Sequence[int], exposure: float = 1.0) -> Float:
        """Return (S, H, W) steps of the ADC, or shares of full scale of a detector without, in the region."""
        sensor = replace(self.sensor, exposure=self.sensor.exposure * exposure, time=self.sensor.time * exposure)
        scene = replace(self.plate, sensor=sensor)
        made = [develop(scene, radiance, None, seed=seed, region=self.region) for seed in seeds]
        one = [image if image.ndim == 2 else image[..., 1] for image in made]
        return np.array(one, np.float64) / WHITE * self.top

    def measured(self) -> dict[str, Calibrated]:
        """Return what its pictures show, by name."""
        return {**_of_exposures(self), **_of_edge(self)}

    @property
    def top(self) -> float:
        """Full scale."""
        return 2**self.sensor.adc_bits - 1 if self.sensor.gain else 1.0


def _weight(sensor: Sensor) -> float:
    """Return the signal of white light over its radiance: of a detector in colour, in green."""
    if sensor.channels == "rgb":
        return sensor.quantum_efficiency[1]
    return float(np.array(sensor.quantum_efficiency) @ np.array(sensor.panchromatic))


def _around_principal(camera: Camera, side: int) -> Region:
    """Return `side` pixels each way about the principal point, as far as they are in the picture."""
    x0, y0 = (round(at - side / 2) for at in (camera.cx, camera.cy))
    return Region(x0=x0, y0=y0, x1=x0 + side, y1=y0 + side) & camera.frame


def _cropped(camera: Camera) -> Camera:
    """Return the camera with no more of its picture than the charts need."""
    part = _around_principal(camera, 2 * SIDE)
    return replace(camera, width=part.width, height=part.height, cx=camera.cx - part.x0, cy=camera.cy - part.y0)


def _of_exposures(chart: Chart) -> dict[str, Calibrated]:
    """Return radiance and linearity, and gain and noise of a detector that has them, by pairs of pictures."""
    shown = chart.light[0], Radiance.dark(chart.region, groups=1)
    pairs = [[chart.pictures(light, (2 * n, 2 * n + 1), step) for light in shown] for n, step in enumerate(STEPS)]
    signal, central = (
        np.array([part(bright) - part(dark) for bright, dark in pairs], np.float64) for part in (np.mean, _central)
    )
    slope, middle = (float(each @ STEPS / np.square(STEPS).sum()) for each in (signal, central))
    measured = middle / chart.top / chart.sensor.exposure / _weight(chart.sensor)
    off = float(np.abs(signal - slope * np.array(STEPS)).max() / signal.max())
    found = {
        "radiance": Calibrated(
            unit="W/m2/sr", description="Radiance of a grey plate.", claimed=chart.radiance, measured=measured
        ),
        "nonlinearity": Calibrated(
            unit="", description="Largest deviation from a line over the signal.", claimed=0.0, measured=off
        ),
    }
    return found | (_of_noise(chart.sensor, pairs, signal) if chart.sensor.gain else {})


def _central(images: Float) -> float:
    """Return the mean of the middle of images (N, H, W), where no lens vignettes."""
    rows, columns = (slice(3 * length // 8, 5 * length // 8) for length in images.shape[1:])
    return float(images[:, rows, columns].mean())


def _of_noise(sensor: Sensor, pairs: Sequence[Sequence[Float]], signal: Float) -> dict[str, Calibrated]:
    """Return gain by photon transfer, and noise in the dark. A pixel's own gain cancels in differences."""
    variances = np.array([[float(np.var(one - other)) / 2 for one, other in pair] for pair in pairs])
    per_electron = float(signal @ (variances[:, 0] - variances[:, 1]) / (signal @ signal))
    step, dark = sensor.gain * 100 / sensor.iso, float(np.sqrt(max(variances[1, 1] - ROUNDING, 0.0)))
    time = sensor.time * STEPS[1]
    resolved = dark > LEAST_NOISE and per_electron > 0
    return {
        "gain": Calibrated(
            unit="electrons per step",
            description="Slope of the noise's variance over the signal (photon transfer).",
            claimed=step,
            measured=1 / per_electron if per_electron > 0 else UNSET,
        ),
        "dark_noise": Calibrated(
            unit="electrons",
            description="Standard deviation in the dark, at half of the camera's exposure time.",
            claimed=float(np.hypot(sensor.read_noise, np.sqrt(sensor.dark_current * time))),
            measured=dark / per_electron if resolved else UNSET,
        ),
    }


def _of_edge(chart: Chart) -> dict[str, Calibrated]:
    """Return the point spread function, by which the edge is wider in the picture than in its radiance. Pictures are
    divided by those of the whole plate, without which vignetting and the pixels' own gains would count."""
    seeds, dark = range(EDGES), chart.sensor.black_level if chart.sensor.gain else 0.0
    flat, sharp = (_in_region(chart, each) for each in chart.light)
    whole, soft = (chart.pictures(each, seeds).mean(0) - dark for each in chart.light)
    profiles = [_profile(chart, _share(image, of)) for image, of in ((sharp, flat), (soft, whole))]
    return {
        "psf_sigma": Calibrated(
            unit="px",
            description="Standard deviation of the point spread function, by a slanted edge; glare near it counts.",
            claimed=chart.plate.optics.psf_sigma,
            measured=_width(*profiles),
        )
    }


def _share(image: Float, of: Float) -> Float:
    """Return (H, W) an image over another, 0 where that is dark."""
    return np.divide(image, of, out=np.zeros_like(image), where=of > 0)


def _in_region(chart: Chart, radiance: Radiance) -> Float:
    """Return (H, W) the radiance in green of the measured region."""
    found, shown = np.zeros(chart.region.shape), radiance.region & chart.region
    found[shown.within(chart.region).slices] = radiance.rgb[shown.within(radiance.region).slices][..., 1]
    return found


def _profile(chart: Chart, image: Float) -> Float:
    """Return (K,) the mean of an image across the edge, from REACH pixels before it to REACH behind."""
    camera, region = chart.plate.camera, chart.region
    along = np.linspace(-2, 2, 1001) * region.height / camera.fy
    edge = camera.project(np.stack([-np.sin(SLANT) * along, np.cos(SLANT) * along, np.ones_like(along)], -1))
    u, v = np.arange(region.x0, region.x1) + 0.5, np.arange(region.y0, region.y1) + 0.5
    at = np.interp(v, edge[:, 1], edge[:, 0])[:, None]
    away = (u - at) / np.hypot(1, np.gradient(at[:, 0], v))[:, None]
    place = np.floor((away + REACH) / BIN).astype(int)
    near = (place >= 0) & (place < round(2 * REACH / BIN))
    counts = np.bincount(place[near], minlength=round(2 * REACH / BIN))
    sums = np.bincount(place[near], image[near], minlength=len(counts))
    return np.asarray(sums / np.maximum(counts, 1))


def _variance(profile: Float, sigma: float) -> float:
    """Return the variance, pixels squared, of the line spread of a profile (K,), within SIGMAS times about `sigma`."""
    half = min(round((SIGMAS * sigma + 1.5) / BIN), len(profile) // 2)
    near = profile[len(profile) // 2 - half : len(profile) // 2 + half]
    end = round(0.5 / BIN)
    high, low = near[:end].mean(), near[-end:].mean()
    share, x = (near - low) / (high - low), (np.arange(-half, half) + 0.5) * BIN
    mean = float(share.sum()) * BIN - half * BIN
    return float((half * BIN) ** 2 + 2 * (share @ x) * BIN - mean**2)


def _width(sharp: Float, soft: Float) -> float:
    """Return the standard deviation, pixels, that turns the profile `sharp` (K,) into `soft`: variances add up."""
    sigma = REACH / SIGMAS
    for _ in range(ROUNDS):  # the narrower the profile, the less of its surroundings with their noise counts
        sigma = max(_variance(soft, sigma) - _variance(sharp, sigma), 0.0) ** 0.5
    return sigma
