"""The record of a picture: records/VARIANT/FRAME.json of a dataset."""

from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import Annotated, Any, Literal, Self, TypeAlias

import numpy as np
from msgspec import UNSET, Meta, UnsetType
from msgspec.structs import asdict

from spin_usd.basics.arrays import Float
from spin_usd.basics.json_fields import (
    UTC_PATTERN,
    Count,
    FileName,
    FrameName,
    Id,
    JsonStruct,
    Name,
    Pixel,
    Positive,
    Quaternion,
    Sha256,
    Share,
    Size,
    Span,
    VariantName,
    Vector,
    one_of,
)
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.fisheye import Fisheye
from spin_usd.geometry.transform import Transform
from spin_usd.scene.derived.content_keys import KEYS, RenderSettings
from spin_usd.scene.effort import CPU, Effort
from spin_usd.scene.keypoints import KeypointState
from spin_usd.scene.lidar import Lidar

NumberType: TypeAlias = Literal["uint8", "uint16", "uint32", "float32"]
AtLeastOne = Annotated[int, Meta(ge=1)]
RECORDED_KEYS = (*KEYS, "targets")
"""The keys that each picture has; labels may have their own beside them."""


class RecordedCamera(JsonStruct, frozen=True, kw_only=True):
    """Intrinsics in pixels; (0, 0) is the corner of the image. Distortion k1, k2, p1, p2, k3 as OpenCV orders them; k1,
    k2, k3, k4 of OpenCV's module fisheye where the model is that."""

    width: AtLeastOne
    height: AtLeastOne
    fx: Positive
    fy: Positive
    cx: float
    cy: float
    distortion: Annotated[list[float], Meta(min_length=4, max_length=5)]
    model: Literal["fisheye"] | UnsetType = UNSET

    @classmethod
    def of(cls, camera: Camera) -> Self:
        """Return the camera's entry of a record."""
        return cls(
            width=camera.width,
            height=camera.height,
            fx=camera.fx,
            fy=camera.fy,
            cx=camera.cx,
            cy=camera.cy,
            distortion=list(camera.distortion),
            model="fisheye" if camera.fisheye else UNSET,
        )

    @property
    def camera(self) -> Camera:
        """The camera. Raises GeometryError for one that no camera is like."""
        return Camera(
            width=self.width,
            height=self.height,
            fx=self.fx,
            fy=self.fy,
            cx=self.cx,
            cy=self.cy,
            distortion=tuple(self.distortion) if self.model is UNSET else Fisheye(*self.distortion),
        )


class RecordedPose(JsonStruct, frozen=True, kw_only=True):
    """p_cam = R(q_cam_body) p_body + t_cam_body: scalar-first unit quaternion, metres, OpenCV camera axes."""

    q_cam_body: Quaternion
    t_cam_body: Vector

    @classmethod
    def of(cls, T_cam_body: Transform) -> Self:
        """Return the pose's entry of a record."""
        return cls(q_cam_body=T_cam_body.quaternion.tolist(), t_cam_body=T_cam_body.translation.tolist())

    @property
    def T_cam_body(self) -> Transform:
        """The pose. Raises GeometryError for an invalid quaternion."""
        return Transform.from_quaternion(to="cam", of="body", q=self.q_cam_body, t=self.t_cam_body)


class RecordedPixels(JsonStruct, frozen=True, kw_only=True):
    """How many pixel centres in the frame the target covers."""

    visible: Annotated[Count, Meta(description="Pixels that show it.")]
    amodal: Annotated[Count, Meta(description="Pixels that would show it without occlusion.")]


class RecordedBox(JsonStruct, frozen=True, kw_only=True):
    """Boxes x0, y0, x1, y1 in pixels; (0, 0) is the corner of the image."""

    visible: Annotated[
        Annotated[list[Count], Meta(min_length=4, max_length=4)] | None,
        Meta(description="Tight around the pixels that show it, x1 and y1 past the last; null where none does."),
    ]
    amodal: Annotated[
        Annotated[list[float], Meta(min_length=4, max_length=4)] | None,
        Meta(
            description="Of its projected surface, all that the lens sees of it, as if nothing else were there, in the "
            "frame or not, at most 65536 px outside; null where the lens sees none."
        ),
    ]
    truncated: Annotated[
        bool,
        Meta(description="Whether some of it is outside the frame, behind the camera, or outside the lens's view."),
    ]


class RecordedBox3d(JsonStruct, frozen=True, kw_only=True):
    """The target's bounding box along its own axes."""

    box: Annotated[
        list[Vector],
        Meta(
            min_length=2,
            max_length=2,
            description="The target's least and largest coordinates in its own axes, metres; equal to dataset.json, "
            "unless it changes its shape.",
        ),
    ]
    corners: Annotated[
        list[Pixel | None],
        Meta(
            min_length=8,
            max_length=8,
            description="The corners of that box in pixels: the first is the one of least x, y and z, then z grows, "
            "then y, then x. null where the lens sees none.",
        ),
    ]


class RecordedMotion(JsonStruct, frozen=True, kw_only=True):
    """How a target moves before the camera, in the camera's axes."""

    velocity: Annotated[Vector, Meta(description="Of the origin of its axes, m/s.")]
    angular_velocity: Annotated[Vector, Meta(description="Radians a second.")]


class RecordedPartShape(JsonStruct, frozen=True, kw_only=True):
    """A part that is not as the target's model has it; the parts below its prim follow it."""

    name: str
    path: Annotated[str, Meta(description="Its prim's.")]
    T_body_drawn: Annotated[
        list[Annotated[list[float], Meta(min_length=4, max_length=4)]],
        Meta(
            min_length=4,
            max_length=4,
            description="From its place in the model to its true one, in body axes, metres: rotation times scale, and "
            "shift. It acts after the bulge and the bend.",
        ),
    ]
    bend: Annotated[float, Meta(description="Angle between the directions of its start and its end, degrees.")]
    bulge: Annotated[float, Meta(description="Height of the bulge of its broadest flat face, metres.")]
    missing: bool


class RecordedShapedKeypoint(JsonStruct, frozen=True, kw_only=True):
    """A keypoint of a target that is not as its model has it."""

    part: Annotated[str | None, Meta(description="Path of the part that it belongs to; null for the body itself.")]
    drawn: Annotated[Vector, Meta(description="Its place in the model, body axes, metres.")]
    true: Annotated[Vector | None, Meta(description="Its place in the picture, likewise; null if its part is missing.")]


class RecordedTarget(JsonStruct, frozen=True, kw_only=True):
    """A target in the picture."""

    id: Id
    name: str
    pose: RecordedPose
    motion: Annotated[RecordedMotion | UnsetType, Meta(description="Absent if not in the stage.")] = UNSET
    range: Annotated[Size, Meta(description="From the camera to the origin of the target's axes, metres.")]
    pixels: RecordedPixels
    visible_fraction: Annotated[
        Share | None,
        Meta(
            description="Visible pixels over all that it covers without occlusion, also outside the frame; null if it "
            "covers no pixel's centre."
        ),
    ]
    box: RecordedBox
    box_3d: RecordedBox3d
    keypoints: Annotated[
        list[
            tuple[
                float | None,
                float | None,
                Annotated[
                    KeypointState,
                    Meta(
                        description="visible: nothing stands before it · self-occluded, occluded: the first surface "
                        "before it is its own body's, or another's; its own surface less than 0.5 % of the longest "
                        "edge of the target's box before it does not hide it · outside: of the frame, or where the "
                        "lens sees nothing · behind the camera · missing: its part is missing, and u and v are null."
                    ),
                ],
            ]
        ],
        Meta(
            description="Each of the target's keypoints, in the order of dataset.json: u and v in pixels, null "
            "outside the lens's view, and its visibility."
        ),
    ]
    shape: Annotated[
        list[RecordedPartShape] | UnsetType,
        Meta(description="The parts that are not as its model has them; absent if all are."),
    ] = UNSET
    shaped_keypoints: Annotated[
        list[RecordedShapedKeypoint] | UnsetType,
        Meta(description="Its keypoints in the model and in the picture, in the order of `keypoints`; likewise."),
    ] = UNSET

    @property
    def true_keypoints(self) -> Float | None:
        """The keypoints (K, 3) in body axes, metres, NaN for missing ones; None where they are the model's."""
        if self.shaped_keypoints is UNSET:
            return None
        return np.array([each.true or [np.nan] * 3 for each in self.shaped_keypoints]).reshape(-1, 3)


class RecordedSun(JsonStruct, frozen=True, kw_only=True):
    """The brightest distant light, behind a planet or not."""

    towards_cam: Annotated[Vector, Meta(description="Unit vector towards it in the camera's axes.")]
    towards_body: Annotated[Vector, Meta(description="The same in the first target's axes.")]
    obscured: Annotated[Share, Meta(description="Share of it that planets hide from the target.")]


class PosedTarget(JsonStruct, frozen=True, kw_only=True):
    """A target in another view."""

    id: Id
    pose: RecordedPose


class PairedCamera(JsonStruct, frozen=True, kw_only=True):
    """The camera that is paired with this picture's, to which disparity leads: the second camera with the first, the
    first with every other."""

    variant: Annotated[VariantName, Meta(description="Of its picture of the same frame.")]
    camera: RecordedCamera
    targets: Annotated[list[PosedTarget], Meta(description="Where the targets are in its axes.")]


class RecordedRig(JsonStruct, frozen=True, kw_only=True):
    """Which of the stage's several cameras took the picture."""

    camera: Annotated[Name, Meta(description="Its name.")]
    q_first_cam: Annotated[
        Quaternion,
        Meta(
            description="Its pose in the axes of the first camera: p_first = R(q_first_cam) p_cam + t_first_cam: "
            "scalar-first unit quaternion, metres, OpenCV camera axes of both."
        ),
    ]
    t_first_cam: Vector


class NextFrame(JsonStruct, frozen=True, kw_only=True):
    """The next frame of the stage, to which flow goes."""

    frame: Annotated[str, Meta(description="Its name.")]
    camera: RecordedCamera
    targets: list[PosedTarget]


class RecordedTones(JsonStruct, frozen=True, kw_only=True):
    """How bright the target is in the image, all bodies counted, of the pixels of which they cover at least half."""

    pixels: Annotated[AtLeastOne, Meta(description="How many those are.")]
    mean: Annotated[Share, Meta(description="Of their numbers, as a share of the highest number.")]
    dark: Annotated[
        Share,
        Meta(
            description="Share of them that does not show: in every channel no further above black than 1/64 of the "
            "detector's full scale, or than three standard deviations of the noise in the dark; above 0.75 the picture "
            "is nearly black."
        ),
    ]
    saturated: Annotated[
        Share,
        Meta(
            description="Share of them that is saturated: in every channel as bright as the image shows a detector "
            "whose wells or ADC are full, whatever number contrast and filter make of that; above 0.75 the picture is "
            "nearly white."
        ),
    ]
    exposure_end: Annotated[
        Annotated[str, one_of("shortest", "longest")] | UnsetType,
        Meta(
            description="The end of its range that auto-exposure stopped at, more than a stop short of its level; "
            "absent where it did not."
        ),
    ] = UNSET


class RecordedLidar(JsonStruct, frozen=True, kw_only=True):
    """The LiDAR that measured the points in the files lidar and lidar_ply. Its axes are x forward, y left, z up;
    azimuth turns to the left, elevation upwards."""

    q_cam_lidar: Annotated[
        Quaternion,
        Meta(description="p_cam = R(q_cam_lidar) p_lidar + t_cam_lidar: scalar-first unit quaternion, metres."),
    ]
    t_cam_lidar: Vector
    pattern: Literal["raster", "spinning", "rosette"]
    rows: AtLeastOne
    columns: Annotated[AtLeastOne, Meta(description="Beam i is in row i / columns and column i % columns.")]
    azimuth_deg: Span
    elevation_deg: Span
    range_limits: Annotated[Span, Meta(description="Metres.")]
    noise_constant: Annotated[
        Size,
        Meta(description="Metres: the standard deviation of a range is this and noise_proportional times the range."),
    ]
    noise_proportional: Size
    drop_out: Annotated[float, Meta(ge=0, lt=1, description="Share of the returns that are lost by chance.")]
    max_incidence_deg: Annotated[
        float, Meta(gt=0, le=90, description="From the surface's normal: at larger angles nothing comes back.")
    ]

    @property
    def lidar(self) -> Lidar:
        """The LiDAR. Raises GeometryError for an invalid one."""
        rest: dict[str, Any] = {name: tuple(it) if isinstance(it, list) else it for name, it in asdict(self).items()}
        pose = Transform.from_quaternion(to="cam", of="lidar", q=rest.pop("q_cam_lidar"), t=rest.pop("t_cam_lidar"))
        return Lidar(T_cam_lidar=pose, **rest)


class RecordedRangeFinder(JsonStruct, frozen=True, kw_only=True):
    """Exact measurements of the laser range finder: distances from its position, metres."""

    origin: Annotated[Vector, Meta(description="Its position in the camera's axes, metres.")]
    direction: Annotated[Vector, Meta(description="Its boresight in the camera's axes, a unit vector.")]
    divergence_deg: Annotated[float, Meta(ge=0, description="Full angle of the cone that it lights, degrees.")]
    range: Annotated[Size | None, Meta(description="Along the boresight; null where nothing is.")]
    target: Annotated[Annotated[int, Meta(ge=0, le=65535)], Meta(description="The id of the target there, 0 for none.")]
    nearest: Annotated[Size | None, Meta(description="Within its cone; null without a hit.")]
    mean: Annotated[Size | None, Meta(description="Over the part of the cone that meets something; likewise.")]
    share: Annotated[Share, Meta(description="Of the cone that meets something.")]


class RecordedFile(JsonStruct, frozen=True, kw_only=True):
    """A file of the picture: its path, and the meaning of its numbers."""

    path: Annotated[
        str,
        Meta(
            pattern="^[a-z][a-z0-9_]*/[a-z0-9_]+(-[a-z0-9_]+)?/[A-Za-z0-9][A-Za-z0-9._-]*$",
            description="KIND/VARIANT/FRAME.SUFFIX, relative to the dataset.",
        ),
    ]
    sha256: Sha256
    dtype: Annotated[
        NumberType | Annotated[dict[str, NumberType], Meta(min_length=1)],
        Meta(description="Type and bits of its numbers, as numpy names them; of a table each column's, by its name."),
    ]
    channels: Annotated[
        dict[str, str],
        Meta(
            min_length=1,
            description="Content of each channel, or column of a table, by its name in the file (Y, or R, G, B and "
            "A, since some readers know no others); OpenCV gives them as B, G, R. Labels are 0 for no "
            "surface; dataset.json describes each kind of file in a sentence.",
        ),
    ]
    unit: Annotated[
        Annotated[str, Meta(min_length=1)] | UnsetType,
        Meta(description="Of the numbers, such as m or W/m2/sr; absent where they have none."),
    ] = UNSET
    frame: Annotated[
        Annotated[str, Meta(min_length=1)] | UnsetType,
        Meta(
            description="The axes of coordinates: cam (x right, y down, z forward), body, the target's, or lidar (x "
            "forward, y left, z up); absent without coordinates."
        ),
    ] = UNSET
    encoding: Annotated[
        Literal["linear", "srgb", "gamma"] | UnsetType,
        Meta(description="The transfer curve of light to the file's numbers; absent of labels."),
    ] = UNSET
    gamma: Annotated[
        Positive | UnsetType, Meta(description="Degree of the root of the encoding gamma; absent for others.")
    ] = UNSET


class StageProvenance(JsonStruct, frozen=True, kw_only=True):
    """The stage that the picture shows."""

    root: Annotated[FileName, Meta(description="The root layer, relative to the dataset.")]
    hash: Annotated[Sha256, Meta(description="Hash of the composed content, independent of its folder.")]
    files: Annotated[
        dict[FileName, Sha256],
        Meta(description="Layers and assets used, relative to the root layer's folder."),
    ]
    variants: Annotated[
        dict[str, str],
        Meta(
            description="The variant selected of every variant set that has a selection: NAME of the default prim's, "
            "PRIM_PATH{NAME} of other prims'."
        ),
    ]

    @property
    def layers(self) -> Iterator[tuple[str, str]]:
        """The name in the dataset and the sha256 of each file that made the picture."""
        folder = PurePosixPath(self.root).parent
        return ((f"{folder / layer}", sha256) for layer, sha256 in self.files.items())


class EffortChoice(JsonStruct, frozen=True, kw_only=True):
    """Why the effort was this."""

    by: Annotated[str, one_of("error", "quality")]
    asked: Annotated[str, Meta(description="The most that the relative error may be, or auto; or the quality's name.")]
    reason: str
    measurement: Annotated[
        Sha256 | UnsetType, Meta(description="Of the measure.json that the choice was made from.")
    ] = UNSET


class RecordedRender(JsonStruct, frozen=True, kw_only=True):
    """How the picture's light was rendered."""

    renderer: Annotated[Name, Meta(description="Its name: blender, raycast, or another that was added.")]
    device: Annotated[
        Annotated[str, one_of("cpu", "optix", "cuda", "hip", "metal", "oneapi")] | UnsetType,
        Meta(description="Device that rendered the light; absent in old records: cpu. Labels run on the CPU."),
    ] = UNSET
    effort: Annotated[
        Effort,
        Meta(
            description="Effort of the picture's light: all settings that trade speed for accuracy.",
            extra_json_schema={
                "required": ["samples", "adaptive", "denoiser", "bounces", "clamp", "light_tree", "reduction"]
            },
        ),
    ]
    region: Annotated[list[int], Meta(min_length=4, max_length=4, description="x0, y0, x1, y1 of the pixels rendered.")]
    chosen: Annotated[
        EffortChoice | UnsetType, Meta(description="Absent where the effort was given, or is the usual one.")
    ] = UNSET


class RecordedSeeds(JsonStruct, frozen=True, kw_only=True):
    """The seeds of the picture."""

    dataset: int
    render: Annotated[int, Meta(description="Of the rays: of the frame, the same in all variants.")]
    picture: Annotated[int, Meta(description="Of the noise and whatever else is sampled for this picture alone.")]


class Provenance(JsonStruct, frozen=True, kw_only=True):
    """All that the picture was made from."""

    stage: StageProvenance
    keys: Annotated[
        dict[str, Annotated[Sha256, Meta(description="Digest of all inputs of the key's results.")]],
        Meta(
            description="geometry: inputs of the labels, except labels with their own keys, by their names · "
            "radiance: inputs of the linear radiance · exposure: inputs of the image · targets: inputs "
            "of this record's data on the targets, except their names.",
            extra_json_schema={"required": list(RECORDED_KEYS)},
        ),
    ]
    render: RecordedRender
    time_code: float
    seed: RecordedSeeds
    options: Annotated[
        dict[Name, str | int | float | bool] | UnsetType,
        Meta(
            description="Other options of the command that change pictures, by name, if not the default.",
            extra_json_schema={"minProperties": 1},
        ),
    ] = UNSET
    versions: dict[str, str]
    auto_exposure: Annotated[
        Positive | UnsetType,
        Meta(
            description="The factor on the camera's exposure time that metering on the target chose; absent without "
            "auto-exposure."
        ),
    ] = UNSET

    def __post_init__(self) -> None:
        if lacking := next((key for key in RECORDED_KEYS if key not in self.keys), None):
            raise ValueError(f"keys lack {lacking}")


class RecordedLight(JsonStruct, frozen=True, kw_only=True):
    """How strong a light is, in red, green and blue: a Sun in W/m2, a point in W/sr, surfaces and domes in W/m2/sr."""

    path: str
    strength: Annotated[list[float], Meta(min_length=3, max_length=3)]
    unit: Literal["W/m2", "W/sr", "W/m2/sr"]


class RecordedAppearance(JsonStruct, frozen=True, kw_only=True):
    """Exposure, light and background of the image; 0 for missing ones. The stage has the rest."""

    exposure: Annotated[float, Meta(description="Factor from W/m2/sr to full scale, as the camera is set.")]
    exposure_chosen: Annotated[
        float | UnsetType, Meta(description="The same, as auto-exposure chose it; absent without.")
    ] = UNSET
    time: Annotated[float, Meta(description="Seconds, as the camera is set.")]
    iso: float
    gain: Annotated[float, Meta(description="Electrons for each step of the ADC at ISO 100.")]
    full_well: Annotated[float, Meta(description="Electrons.")]
    read_noise: Annotated[float, Meta(description="Electrons.")]
    dark_current: Annotated[float, Meta(description="Electrons a second.")]
    psf_sigma: Annotated[float, Meta(description="Pixels.")]
    glare: float
    lights: list[RecordedLight]
    background: Annotated[str | UnsetType, Meta(description="The file of the picture behind; absent without.")] = UNSET


class Record(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="record-1"):
    """One picture of a spin_usd dataset."""

    frame: Annotated[FrameName, Meta(description="The frame's name: the stem of its files.")]
    index: Annotated[Count, Meta(description="The frame's place in the stage, from 0.")]
    variant: VariantName
    source_file: Annotated[
        Annotated[str, Meta(min_length=1)] | UnsetType,
        Meta(
            description="The file that the pose was given for in its list, such as img000001.jpg; absent where it "
            "comes from none."
        ),
    ] = UNSET
    time_s: Annotated[
        float | UnsetType,
        Meta(description="Time of exposure, seconds since the start; absent if unknown."),
    ] = UNSET
    utc: Annotated[
        Annotated[str, Meta(pattern=UTC_PATTERN)] | UnsetType,
        Meta(description="The same as UTC; absent if the start is unknown."),
    ] = UNSET
    camera: RecordedCamera
    pose: Annotated[RecordedPose, Meta(description="The first shown target's.")]
    targets: Annotated[
        list[RecordedTarget],
        Meta(
            min_length=1,
            description="The shown targets in order of their ids, which are the numbers in the label instance.",
        ),
    ]
    sun: Annotated[
        RecordedSun | UnsetType,
        Meta(description="Absent without a Sun, and for labels alone except lit."),
    ] = UNSET
    next: Annotated[
        NextFrame | UnsetType,
        Meta(description="Absent of the last frame, and of pictures without flow."),
    ] = UNSET
    appearance: Annotated[
        RecordedAppearance | UnsetType, Meta(description="Absent without an image, and of older versions.")
    ] = UNSET
    rig: Annotated[RecordedRig | UnsetType, Meta(description="Absent where the stage has one camera.")] = UNSET
    paired: Annotated[PairedCamera | UnsetType, Meta(description="Absent of pictures without disparity.")] = UNSET
    tones: Annotated[RecordedTones | UnsetType, Meta(description="Absent without an image or such pixels.")] = UNSET
    range_finder: Annotated[RecordedRangeFinder | UnsetType, Meta(description="Absent where the stage has none.")] = (
        UNSET
    )
    lidar: Annotated[RecordedLidar | UnsetType, Meta(description="Absent without those files.")] = UNSET
    files: Annotated[
        dict[Name, RecordedFile],
        Meta(min_length=1, description="Each file of the picture, by its kind."),
    ]
    provenance: Provenance

    @property
    def settings(self) -> RenderSettings:
        """How its light was rendered; the device is the CPU where the record is older than the choice."""
        render = self.provenance.render
        return RenderSettings(
            renderer=render.renderer,
            effort=render.effort,
            seed=self.provenance.seed.dataset,
            device=CPU if render.device is UNSET else render.device,
        )

    @property
    def options(self) -> dict[str, Any]:
        """The options that decide the picture, by name, where they were not as usual."""
        return {} if self.provenance.options is UNSET else self.provenance.options
