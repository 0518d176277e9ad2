"""Flow: how far, in pixels, the surface point that each pixel shows moves until the next frame."""

from collections.abc import Iterator

from spin_usd.labels.displacement import HOLDS, OFF_PX, decided_by, displacement, largest_error
from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.labels.preview import by_motion
from spin_usd.scene.channels import Channels


def faults(picture: LabelledPicture) -> Iterator[LabelFault]:
    """Flow takes each pixel to where the dense pose's point is in the next frame."""
    found = picture.arrays["flow"]
    if picture.next_frame is None:
        if found.any():
            yield LabelFault(code="flow", message="flow is not 0 in a picture whose record names no next frame")
        return
    worst = largest_error(picture, found, picture.next_frame)
    if not worst <= OFF_PX:
        yield LabelFault(code="flow", message=f"flow ends {worst:.3g} px beside the dense pose's points")


FLOW = Label(
    name="flow",
    make=lambda scene, surface: displacement(scene, surface, scene.next_frame),
    decided_by=lambda scene: decided_by(scene, scene.next_frame),
    takes="next_frame",
    channels=Channels(
        meaning="how far the surface point moves until the next frame, pixels right and down, and what becomes of it: "
        f"float32 channels R, G, B; B {HOLDS}; 0 = nothing, and all over the last frame",
        dtype="float32",
        holds={"R": "right", "G": "down", "B": "what becomes of the point"},
        unit="px",
    ),
    suffix=".exr",
    usd_type="float3",
    file_bytes=4.0,
    target_s=3.5e-07,
    preview=by_motion,
    faults=faults,
)
