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
    """The target, the layer that is gone on with and saved into, and where the tool listens."""

    target: Annotated[
        str,
        Argument(
            f"{named('target')}; an OBJ, PLY, STL, glTF, COLLADA, FBX, .blend, STEP or USD file, as of author.",
            "NAME_OR_FILE",
            words=bundled("target"),
        ),
    ]
    _: KW_ONLY
    out: Annotated[
        Path | None,
        Option(
            "The USD layer (.usda) to save in at every change, and to go on with where it is there; "
            "NAME_keypoints.usda if not given.",
            "FILE",
        ),
    ] = None
    pictures: Annotated[
        Path | None,
        Option("A dataset of the target: the keypoints are drawn into its pictures.", "DATASET"),
    ] = None
    units_per_metre: UnitsPerMetre = None
    prim: Prim = None
    any_size: AnySize = False
    host: Annotated[
        str, Option("Where to listen. Any other than 127.0.0.1 lets others change keypoints.", "ADDRESS")
    ] = LOCAL
    port: Annotated[int, Option("The port to listen on; 0 for any that is free.", "N")] = PORT

    @property
    def is_local(self) -> bool:
        """Whether only this machine can connect."""
        return self.host in (LOCAL, "localhost", "::1")
