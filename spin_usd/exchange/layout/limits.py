"""Limits of formats: content that they cannot hold, refused before anything is written."""

from spin_usd.basics.extras import EXTRAS
from spin_usd.errors import UnsupportedError
from spin_usd.exchange.layout.export_format import Limit
from spin_usd.exchange.layout.survey import Survey, reach
from spin_usd.scene.poses import FRAME_NAME, FRAME_NAME_RULE

UINT16_MAX = 2**16 - 1
INSTANCE = "instance"


def needs_extra(name: str, *, but: str = "") -> Limit:
    """Return the limit to installations with the extra of that name, `but` that package; it raises
    MissingPackageError."""
    return lambda survey: EXTRAS[name].require(survey.format, but=but)


def undistorted(remedy: str) -> Limit:
    """Return the limit to cameras without lens distortion, for which the format has no field; `remedy` is what to do
    about it."""

    def limit(survey: Survey) -> None:
        for camera, picture in survey.cameras.items():
            if camera.distorted:
                found = f"has lens distortion, for which {survey.format} has no field"
                raise UnsupportedError(found, where=picture, do=remedy)

    return limit


def no_fisheye(survey: Survey) -> None:
    """Raise UnsupportedError where a camera is a fisheye: the format has the five coefficients of the other lens, and
    readers of it would take the four for those."""
    for camera, picture in survey.cameras.items():
        if camera.fisheye:
            found = f"has a fisheye lens, and {survey.format} holds only k1, k2, p1, p2, k3 of OpenCV's other lens"
            raise UnsupportedError(found, where=picture, do="export to colmap or nerfstudio, which hold it")


no_distortion = undistorted("export to speedplus, or render with a camera without distortion")
"""The limit of formats that pictures are not rectified for."""


def bodies_told_apart(survey: Survey) -> None:
    """Raise UnsupportedError if there are several bodies, and pictures lack the label of the body at each pixel."""
    if survey.several and survey.kinds[INSTANCE] < survey.tally.total():
        found = f"the dataset has several bodies, and {survey.format} has masks of each"
        raise UnsupportedError(found, do=f"render it with --labels default,{INSTANCE}")


def views_of_one_target(survey: Survey) -> None:
    """Raise UnsupportedError where pictures show different targets: the format holds views of one."""
    if survey.others:
        count = f"{survey.others} of {survey.tally.total()} pictures"
        found = f"{count} do not show {survey.target}, and {survey.format} holds views of one target"
        raise UnsupportedError(found, do=f"choose one, such as --target {survey.target}: other pictures are left out")


def has_keypoints(survey: Survey) -> None:
    """Raise UnsupportedError where no target has keypoints, for the format is made of them."""
    if not any(target.keypoints.names for target in survey.targets):
        do = "author the stage with --keypoints, and render again"
        raise UnsupportedError(f"no target has keypoints, which {survey.format} needs", do=do)


def one_camera(survey: Survey) -> None:
    """Raise UnsupportedError where pictures have different cameras: the format has one for all."""
    if len(survey.cameras) > 1:
        first, second = list(survey.cameras.values())[:2]
        found = f"has another camera than {first}, and {survey.format} has one for all pictures"
        raise UnsupportedError(found, where=second, do="choose variants of one camera with --variants")


def same_files(survey: Survey) -> None:
    """Raise UnsupportedError where pictures have different kinds of file: the format describes them once for all."""
    if len(survey.file_sets) > 1:
        first, second = list(survey.file_sets.values())[:2]
        found = f"has other kinds of file than {first}, and {survey.format} describes them once for all pictures"
        raise UnsupportedError(found, where=second, do="choose pictures that were rendered with the same labels")


def target_is_a_file_name(survey: Survey) -> None:
    """Raise UnsupportedError where the target's name, after which the format calls folders, cannot be one's."""
    if not FRAME_NAME.fullmatch(survey.target):
        found = f"{survey.target!r} cannot name a folder, and {survey.format} calls one after it"
        raise UnsupportedError(found, where="the target's name", do=f"rename it in the stage: {FRAME_NAME_RULE}")


def one_variant(survey: Survey) -> None:
    """Raise UnsupportedError where there are several variants: the format holds one series of pictures."""
    variants = sorted({variant for _, variant in survey.tally})
    if len(variants) > 1:
        found = f"has {len(variants)} variants, and {survey.format} holds one trajectory"
        raise UnsupportedError(f"the dataset {found}", do=f"choose one of them, such as --variants {variants[0]}")


def parts_at_most(count: int, bits: int) -> Limit:
    """Return the limit to `count` part ids, the capacity of `bits` bits."""

    def limit(survey: Survey) -> None:
        if survey.parts > count:
            raise UnsupportedError(
                f"the target has {survey.parts} parts, and {survey.format} has {bits} bits for them, {count} at most",
                do="merge parts with author --parts, or export without part ids",
            )

    return limit


def depth_at_most(millimetres: float, remedy: str) -> Limit:
    """Return the limit of depth in 16 bits whose unit is `millimetres`; `remedy` is the way around it."""
    metres = UINT16_MAX * millimetres / 1000

    def limit(survey: Survey) -> None:
        far, picture = survey.farthest
        deepest = far + reach(survey.targets)
        if deepest > metres:
            found = f"has its target up to {deepest:g} m away, and 16 bits of {millimetres:g} mm end at {metres:g} m"
            raise UnsupportedError(found, where=picture, do=remedy)

    return limit
