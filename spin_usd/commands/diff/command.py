"""`spin-usd diff`: the differences between two variants, for people and for programs."""

from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from spin_usd.basics.pluralise import pluralise
from spin_usd.options import Frames, Stage
from spin_usd.terminal.lines import BAD, GOOD, NAME, QUIET, Line, Painted, print_out, show_report
from spin_usd.terminal.parameters import Json
from spin_usd.terminal.progress import shown

if TYPE_CHECKING:
    from spin_usd.records.difference import Difference, DiffReport

VariantA = Annotated[str, typer.Argument(metavar="VARIANT_A", help="An augmentation, nominal, or SET=VARIANT,...")]
VariantB = Annotated[str, typer.Argument(metavar="VARIANT_B", help="The same. Each line shows A's value -> B's.")]


def diff(
    context: typer.Context,
    stage: Stage,
    variant_a: VariantA,
    variant_b: VariantB,
    frames: Frames = None,
    as_json: Json = False,
) -> None:
    """Show the differences between two variants by prim and property, and the work they cause.

    A VARIANT is one of the augmentations, nominal, or a choice in other variant sets, such as camera=rich or
    isda_1,camera=rich. The last lines count the pictures that need other labels, renders or images.

    The exit code is 0 whether or not the variants differ; check reports variants that do not.
    """
    from spin_usd.commands.diff.run import diff as compare
    from spin_usd.store.stage_path import existing_stage

    with shown(context.obj["quiet"]) as progress:
        answer = compare(existing_stage(Path(stage)), variant_a, variant_b, frames=frames, progress=progress)
    if as_json:
        show_report(answer)
        return
    print_out(*_listed(answer.differences), *_summary(answer))


def _listed(differences: "Sequence[Difference]") -> Iterator[Line]:
    """Yield a paragraph for each prim, and one for the files."""
    for where, here in groupby(
        differences, key=lambda each: each.where.partition(".")[0] if each.kind != "file" else ""
    ):
        yield (Painted(where or "files", bold=True),)
        for each in here:
            yield from _difference(each)
        yield ""


def _difference(each: "Difference") -> Iterator[Line]:
    subject = each.where if each.kind == "file" else _subject(each)
    before, after = Painted(_text(each.before), BAD), Painted(_text(each.after), GOOD)
    samples = ""
    if each.samples:
        which = "the only time sample" if each.samples == 1 else f"the first of {each.samples} time samples"
        samples = f"   (at {each.time_code:g}, {which} that differ{'s' * (each.samples == 1)})"
    yield "  ", Painted(subject, NAME), "   ", before, " -> ", after, samples
    if each.before_from or each.after_from:
        origin = f"      {each.before_from or 'not authored'} -> {each.after_from or 'not authored'}"
        yield (Painted(origin, QUIET),)


def _subject(each: "Difference") -> str:
    name = each.where.partition(".")[2]
    match each.kind:
        case "selection":
            return f"variant set {each.name}"
        case "schemas":
            return "applied schemas"
        case "metadata":
            return f"{each.name} of {name}" if name else each.name
        case "connection":
            return f"{name} connected to"
    return name or each.kind


def _text(value: str | None) -> str:
    return "none" if value is None else value


def _summary(answer: "DiffReport") -> Iterator[str]:
    pictures, count = answer.pictures, len(answer.differences)
    before, after = answer.before, answer.after
    places, total = pluralise(count, "place"), pluralise(pictures.compared, "picture")
    yield f"{after} differs from {before} in {places}" if count else f"{after} is composed as {before} is"
    labels, renders, images = pictures.geometry, pictures.radiance, pictures.exposure
    yield f"of {total}: labels differ in {labels}, renders in {renders}, images in {images}"
    for count, name in ((pictures.only_before, before), (pictures.only_after, after)):
        if count:
            yield f"{pluralise(count, 'picture')} only in {name}"
    yield _cost(answer)


def _cost(answer: "DiffReport") -> str:
    pictures = answer.pictures
    labels, renders, images = pictures.geometry, pictures.radiance, pictures.exposure
    if not images and not answer.resampled:
        return "nothing differs in any picture"
    if not images:
        return "the images differ only in random samples: noise and back plates; nothing is rendered again"
    if not renders:
        developed = pluralise(pictures.compared if answer.resampled else images, "image")
        return f"nothing is rendered again: {developed} developed from the same renders"
    again = f"{renders} of {pluralise(pictures.compared, 'picture')} rendered again"
    return f"{again}, and {labels} labelled again" if labels else f"{again}; labels are the same"
