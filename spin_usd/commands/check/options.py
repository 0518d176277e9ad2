"""The options of `check`."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.options import Argument, ListeningToNotes, Option


@dataclass(frozen=True)
class CheckOptions(ListeningToNotes):
    """The stage or dataset to check, and the checks to run."""

    path: Annotated[str | Path, Argument("A stage, a dataset, or a folder with a third-party data set as it lies.")]
    _: KW_ONLY
    repair: Annotated[
        bool,
        Option(
            "First make missing and damaged files of a dataset again, from its own copy of the stage. (render "
            "--verify does the same from a given stage.)",
            also="The report then lists what was `repaired`, and what is `unrepaired`.",
        ),
    ] = False
    cross: Annotated[
        bool,
        Option(
            "Also make a dataset's labels again with Cycles, an independent ray caster, and report differences: about "
            "0.3 s per picture.",
            also="The report then contains the number of pictures `compared`.",
        ),
    ] = False
    cross_pictures: Annotated[int | None, Option("With --cross: compare only N pictures, evenly spread.", "N")] = None
    layout: Annotated[
        str | None,
        Option("Layout of a third-party data set, such as speedplus, bop or coco; guessed if not given.", "NAME"),
    ] = None
    camera: Annotated[
        str | Path | None,
        Option("Calibration for a third-party data set, instead of its own, as `author` takes it.", "FILE"),
    ] = None
    model: Annotated[
        str | Path | None,
        Option("Model of a third-party data set's target, a mesh, which is compared with masks and images.", "FILE"),
    ] = None
    model_unit: Annotated[float, Option("Metres of the model's unit, such as 0.001.", "X")] = 1.0
    without_pixels: Annotated[bool, Option("Check the lists of a third-party data set alone, and open no image.")] = (
        False
    )
    report: Annotated[
        str | Path | None,
        Option("Write a page on a third-party data set, with its worst pictures, to this folder.", "FOLDER"),
    ] = None
    repair_to: Annotated[
        str | Path | None,
        Option("Copy a third-party data set to this folder, with lists repaired where one remedy fits.", "FOLDER"),
    ] = None
    labels_to: Annotated[
        str | Path | None,
        Option(
            "Make labels for a third-party data set in this folder, from its poses, its camera and --model, which may "
            "also be a bundled target or a USD file here: depth, segmentation, dense pose, boxes and keypoints.",
            "FOLDER",
        ),
    ] = None
