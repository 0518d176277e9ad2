"""The codeless schema: its names, and its registration, which must happen before USD builds its schema registry.

Every module of `spin_usd.stage` imports this one before it opens or authors anything.
"""

from pxr import Plug, Usd

from spin_usd.basics.resources import schemas
from spin_usd.errors import StageError

LENS_API = "SpinLensAPI"
SENSOR_API = "SpinSensorAPI"
EVENT_SENSOR_API = "SpinEventSensorAPI"
OPTICS_API = "SpinOpticsAPI"
SHUTTER_API = "SpinShutterAPI"
LIDAR_API = "SpinLidarAPI"
RANGE_FINDER_API = "SpinRangeFinderAPI"
CAPTURE_API = "SpinCaptureAPI"
MOTION_API = "SpinMotionAPI"
TARGET_API = "SpinTargetAPI"
KEYPOINTS_API = "SpinKeypointsAPI"
SHAPE_API = "SpinShapeAPI"
PLANET_API = "SpinPlanetAPI"
STARS_API = "SpinStarsAPI"
BACK_PLATE_API = "SpinBackPlateAPI"
APIS = (
    LENS_API,
    SENSOR_API,
    EVENT_SENSOR_API,
    OPTICS_API,
    SHUTTER_API,
    LIDAR_API,
    RANGE_FINDER_API,
    CAPTURE_API,
    MOTION_API,
    TARGET_API,
    KEYPOINTS_API,
    SHAPE_API,
    PLANET_API,
    STARS_API,
    BACK_PLATE_API,
)
"""All our API schemas."""

LENS_MODEL = "spin:lens:model"
LENS_IMAGE_SIZE = "spin:lens:imageSize"
PROJECTION = ("fx", "fy", "cx", "cy")
LENS_MODELS = {"brownConrady": ("k1", "k2", "p1", "p2", "k3"), "fisheye": ("k1", "k2", "k3", "k4")}
"""The coefficients of each model, in the order of `Camera.distortion`."""
LENS_NUMBERS = {
    model: tuple(f"spin:lens:{name}" for name in (*PROJECTION, *names)) for model, names in LENS_MODELS.items()
}
"""The lens's attributes in the order fx, fy, cx, cy, k1, k2, p1, p2, k3."""

SENSOR = {
    "channels": "spin:sensor:channels",
    "quantum_efficiency": "spin:sensor:quantumEfficiency",
    "panchromatic": "spin:sensor:panchromatic",
    "gain": "spin:sensor:gain",
    "full_well": "spin:sensor:fullWell",
    "read_noise": "spin:sensor:readNoise",
    "dark_current": "spin:sensor:darkCurrent",
    "prnu": "spin:sensor:prnu",
    "pattern_seed": "spin:sensor:patternSeed",
    "adc_bits": "spin:sensor:adcBits",
    "black_level": "spin:sensor:blackLevel",
    "contrast": "spin:sensor:contrast",
    "saturation": "spin:sensor:saturation",
    "filter": "spin:sensor:filter",
    "encoding": "spin:sensor:encoding",
    "gamma": "spin:sensor:gamma",
    "bit_depth": "spin:sensor:bitDepth",
    "jpeg_quality": "spin:sensor:jpegQuality",
}
"""The sensor's attributes, by the field of scene.sensor.Sensor."""
AUTO_EXPOSURE = "spin:sensor:autoExposure"
AUTO_EXPOSURE_LEVEL = "spin:sensor:autoExposure:level"
AUTO_EXPOSURE_STOPS = "spin:sensor:autoExposure:stops"

EVENT_SENSOR = {
    "threshold_on": "spin:event:thresholdOn",
    "threshold_off": "spin:event:thresholdOff",
    "threshold_spread": "spin:event:thresholdSpread",
    "dark": "spin:event:dark",
    "cutoff": "spin:event:cutoff",
    "leak": "spin:event:leak",
    "shot_noise": "spin:event:shotNoise",
    "shot_noise_in_white": "spin:event:shotNoiseInWhite",
    "refractory": "spin:event:refractory",
    "latency": "spin:event:latency",
    "jitter": "spin:event:jitter",
}
"""An event camera's attributes, by the field of scene.event_sensor.EventSensor."""

OPTICS = {
    "psf_sigma": "spin:optics:psfSigma",
    "glare": "spin:optics:glare",
    "glare_core": "spin:optics:glareCore",
    "glare_falloff": "spin:optics:glareFalloff",
    "bloom_intensity": "spin:optics:bloomIntensity",
    "bloom_scatter": "spin:optics:bloomScatter",
    "bloom_threshold": "spin:optics:bloomThreshold",
    "cos_fourth": "spin:optics:cosFourth",
    "vignetting": "spin:optics:vignetting",
}
"""The optics' attributes, by the field of scene.sensor.Optics."""

SHUTTER_READOUT_TIME = "spin:shutter:readoutTime"

LIDAR = {
    "pattern": "spin:lidar:pattern",
    "rows": "spin:lidar:rows",
    "columns": "spin:lidar:columns",
    "azimuth_deg": "spin:lidar:azimuth",
    "elevation_deg": "spin:lidar:elevation",
    "range_limits": "spin:lidar:range",
    "noise_constant": "spin:lidar:noise:constant",
    "noise_proportional": "spin:lidar:noise:proportional",
    "drop_out": "spin:lidar:dropOut",
    "max_incidence_deg": "spin:lidar:maxIncidence",
}
"""The LiDAR's attributes, by the field of scene.lidar.lidar.Lidar."""

RANGE_FINDER_DIVERGENCE = "spin:rangeFinder:divergence"

CAPTURE_FRAME = "spin:capture:frame"
CAPTURE_SOURCE_FILE = "spin:capture:sourceFile"
CAPTURE_TIME, CAPTURE_EPOCH = "spin:capture:time", "spin:capture:epoch"
CAPTURE_SEED = "spin:capture:seed"

MOTION_VELOCITY, MOTION_ANGULAR_VELOCITY = "spin:motion:velocity", "spin:motion:angularVelocity"

TARGET_NAME = "spin:target:name"
TARGET_KEYPOINTS = "spin:target:keypoints"
TARGET_MERGED_PARTS = "spin:target:mergedParts"
TARGET_KEEP_TRANSPARENT = "spin:target:keepTransparent"
KEYPOINT_NAME = "primvars:keypointName"
KEYPOINT_POSITIONS = "spin:keypoints:positions"
KEYPOINT_PARTS = "spin:keypoints:parts"

SHAPE_MISSING, SHAPE_BULGE, SHAPE_BEND = "spin:shape:missing", "spin:shape:bulge", "spin:shape:bend"
SHAPE_BEND_FRAME, SHAPE_BEND_LENGTH = "spin:shape:bendFrame", "spin:shape:bendLength"
SHAPE_OP = "xformOp:transform:shape"
"""The operation, the first in its prim's order, that moves a part away from its place in the model."""

PLANET_RADII = "spin:planet:radii"
PLANET_ALBEDO = "spin:planet:albedo"
PLANET_ALBEDO_FILE = "spin:planet:albedo:file"
PLANET_CLOUDS_FILE = "spin:planet:clouds:file"
PLANET_CLOUDS_ALBEDO = "spin:planet:clouds:albedo"
PLANET_NIGHT_FILE = "spin:planet:night:file"
PLANET_NIGHT_RADIANCE = "spin:planet:night:radiance"
PLANET_SCALE_HEIGHT = "spin:planet:atmosphere:scaleHeight"
PLANET_OPTICAL_DEPTH = "spin:planet:atmosphere:opticalDepth"
PLANET_ILLUMINATES = "spin:planet:illuminates"

STARS_SEED = "spin:stars:seed"
STARS_LIMITING_MAGNITUDE = "spin:stars:limitingMagnitude"
STARS_DIRECTIONS = "spin:stars:directions"
STARS_MAGNITUDES = "spin:stars:magnitudes"
STARS_TEMPERATURES = "spin:stars:temperatures"

BACK_PLATE_FILES = "spin:backPlate:files"
BACK_PLATE_RADIANCE = "spin:backPlate:radiance"
BACK_PLATE_PROBABILITY = "spin:backPlate:probability"
BACK_PLATE_ROLL = "spin:backPlate:roll"
BACK_PLATE_MIRROR = "spin:backPlate:mirror"

UNITS_OP = "xformOp:scale:units"
"""The operation that scales an asset in another unit to the stage's metres."""

CLASS_LABELS = "semantics:labels:class"
PART_LABELS = "semantics:labels:part"
GROUP_LABELS = "semantics:labels:group"
"""Groups of a part in its source file: not labels, but names for `--parts`."""

# Other USD tools' names for OpenCV lenses. Source: NVIDIA ovrtx documentation, "Lens Calibration".
OMNI_LENS_API = {
    "brownConrady": "OmniLensDistortionOpenCvPinholeAPI",
    "fisheye": "OmniLensDistortionOpenCvFisheyeAPI",
}
OMNI_LENS_MODEL = "omni:lensdistortion:model"
OMNI_LENS = {"brownConrady": "opencvPinhole", "fisheye": "opencvFisheye"}
OMNI_PROJECTION = "cameraProjectionType"
"""Names of the models there; attributes are omni:lensdistortion:MODEL:NAME. The last name is older."""

PROVENANCE = "spin"
"""The key of our dictionary in a layer's customLayerData."""
LOG = "log"
"""Key in it of a flag for layers that are a simulator's log."""
FIT = "fit"
"""Key in it of the kind of fit to real pictures that a layer is."""
INTENSITY_UNIT = "spin:intensityUnit"
"""Key in a light's customData for the unit of its inputs:intensity."""
INTENSITY_UNITS = ("W/m2", "W/m2/sr", "W/sr")
"""Of a normalised distant light, of any that is not normalised, of the other normalised ones."""


def register() -> None:
    """Register the schema with USD. Raises StageError where another program made USD build its registry before."""
    folder = schemas() / "spin"
    Plug.Registry().RegisterPlugins(str(folder))
    if not Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(LENS_API):
        raise StageError(
            "USD's schema registry was built before spin_usd's schema was registered",
            do=f"import spin_usd.stage before other USD code, or set PXR_PLUGINPATH_NAME to {folder}",
        )


register()
