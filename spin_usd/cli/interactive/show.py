"""`spin-usd show`: writes a page that shows a dataset in a browser."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import spin_usd
from spin_usd.cli.arguments import options
from spin_usd.cli.arguments.completions import listed_in
from spin_usd.cli.output.lines import show as print_lines
from spin_usd.cli.output.lines import tell
from spin_usd.cli.output.progress import shown
from spin_usd.counted import counted
from spin_usd.errors import FINDINGS

if TYPE_CHECKING:
    from spin_usd.dataset.gallery.report import GalleryReport

NAMED = 10  # damaged pictures that are named; the page shows all


def show(
    context: typer.Context,
    dataset: Annotated[Path, typer.Argument(help="A dataset's folder.")],
    out: Annotated[
        Path | None,
        typer.Option(help="The page's folder; DATASET_page if not given. Run again, it makes what changed."),
    ] = None,
    beside: Annotated[Path | None, typer.Option(metavar="DATASET", help="Show its distributions beside.")] = None,
    labels: Annotated[
        str,
        typer.Option(metavar="NAME,...", help="Labels to show over the images, such as depth,segmentation; or none."),
    ] = "all",
    images: Annotated[
        str,
        typer.Option(
            autocompletion=listed_in("spin_usd.dataset.gallery.request", "IMAGES"),
            metavar="NAME",
            help="jpeg in full size; small: 960 pixels wide; original: the files.",
        ),
    ] = "jpeg",
    workers: options.Workers = None,
) -> None:
    """Write a page that shows a dataset in a browser: pictures, labels, values, distributions. It needs no server."""
    with shown(context.obj["quiet"]) as progress:
        report = spin_usd.show(
            dataset, out=out, beside=beside, labels=labels, images=images, workers=workers, on_progress=progress
        )
    for name, fault in list(report.damaged.items())[:NAMED]:
        tell(f"damaged: {name}: {fault}")
    print_lines(_sentence(report))
    if report.damaged:
        raise typer.Exit(FINDINGS)


def _sentence(report: "GalleryReport") -> str:
    """Say in one line what was written."""
    damaged = f", {len(report.damaged)} damaged" if report.damaged else ""
    return (
        f"{report.page}   ({counted(report.pictures, 'picture')}{damaged}: {report.made} made, {report.kept} already "
        f"there; {report.bytes / 1e6:.1f} MB; in {report.seconds:.1f} s)"
    )
