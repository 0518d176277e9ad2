"""The files of pictures, which children write, for they decode what strangers may have written."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from spin_usd.dataset.gallery.picture_keys import PictureKeys
from spin_usd.dataset.gallery.request import GalleryRequest
from spin_usd.dataset.gallery.survey import SurveyedPicture
from spin_usd.dataset.process.processors import usable_cpus
from spin_usd.dataset.process.shared_calls import Call, results_of
from spin_usd.errors import OutputError, SpinError
from spin_usd.progress import Progress

PICTURES_PER_CHILD = 8  # starting one takes as long as so many


def lacking(pictures: Sequence[SurveyedPicture], present: set[str]) -> dict[int, PictureKeys]:
    """Return the keys of the files that are not `present`, by the place of the picture that they are made of. Where
    pictures share a file, it is made of the first."""
    begun, found = set(present), {}
    for place, picture in enumerate(pictures):
        keys = picture.keys.without(begun)
        if keys.image or keys.labels:
            found[place] = keys
        begun |= set(picture.keys.names.values())
    return found


def written(
    pictures: Sequence[SurveyedPicture],
    missing: Mapping[int, PictureKeys],
    request: GalleryRequest,
    work: Path,
    *,
    progress: Progress,
) -> dict[str, str]:
    """Let children write the `missing` files; return what is wrong, by the keys of files that could not be written.

    Raises OutputError where the gallery cannot be written, and ChildInternalError for a defect of ours.
    """
    calls = [_call(pictures[place], keys, request, work) for place, keys in missing.items()]
    children = request.workers or max(1, min(len(usable_cpus()), len(calls) // PICTURES_PER_CHILD))
    faults: dict[str, str] = {}
    for done, (keys, result) in enumerate(
        zip(missing.values(), results_of(calls, children, progress=progress), strict=True)
    ):
        progress("showing: picture", done, len(calls))
        if isinstance(result, OutputError):
            raise result
        faults |= dict.fromkeys((keys.image, keys.labels), str(result)) if isinstance(result, SpinError) else result
    progress("showing: picture", len(calls), len(calls))
    return faults


def _call(picture: SurveyedPicture, keys: PictureKeys, request: GalleryRequest, work: Path) -> Call:
    arguments = {
        "dataset": str(request.dataset),
        "frame": picture.frame,
        "variant": picture.variant,
        "out": str(request.out),
        "work": str(work),
        "images": request.images,
        "keys": keys,
    }
    return Call("show_picture", arguments)
