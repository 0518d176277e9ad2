"""The options of `reproduce`."""

from dataclasses import KW_ONLY, dataclass
from typing import Annotated

from spin_usd.completions import frames_of_dataset, listed_in, variants_of_dataset
from spin_usd.options import Argument, Dataset, Option, Options


@dataclass(frozen=True)
class ReproduceOptions(Options):
    """The picture to make again, and the device."""

    dataset: Dataset
    frame: Annotated[str, Argument("A frame's name, such as img000001.", words=frames_of_dataset)]
    _: KW_ONLY
    variant: Annotated[str, Option("The variant of the frame.", "NAME", words=variants_of_dataset)] = "nominal"
    device: Annotated[
        str | None,
        Option(
            "Device that renders the light: cpu, optix, cuda ...; the recorded one if not given.",
            "NAME",
            words=listed_in("spin_usd.processes.devices", "DEVICES"),
            also="On another device the image's bytes may differ.",
        ),
    ] = None
