"""The options of `keypoints`."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

from spin_usd.browser.own_page import LOCAL
from spin_usd.completions import bundled, named
from spin_usd.options import AnySize, Argument, Option, Options, Prim, UnitsPerMetre

PORT = 8642


@dataclass(frozen=True)
class KeypointsOptions(Options):
    """The target, the layer to continue and save, and the address to listen on."""

    target: Annotated[
        str,
        Argument(
            f"{named('target')}; an OBJ, PLY, STL, glTF, COLLADA, FBX, .blend, STEP or USD file, as for author.",
            "NAME_OR_FILE",
            words=bundled("target"),
        ),
    ]
    _: KW_ONLY
    out: Annotated[
        Path | None,
        Option(
            "The USD layer (.usda) to save at every change, and to continue if it exists; NAME_keypoints.usda if not "
            "given.",
            "FILE",
        ),
    ] = None
    pictures: Annotated[
        Path | None,
        Option("A dataset of the target, to draw the keypoints into its pictures.", "DATASET"),
    ] = None
    units_per_metre: UnitsPerMetre = None
    prim: Prim = None
    any_size: AnySize = False
    host: Annotated[str, Option("Address to listen on. Any but 127.0.0.1 lets others change keypoints.", "ADDRESS")] = (
        LOCAL
    )
    port: Annotated[int, Option("Port to listen on; 0 for any free port.", "N")] = PORT

    @property
    def is_local(self) -> bool:
        """Whether only this machine can connect."""
        return self.host in (LOCAL, "localhost", "::1")
