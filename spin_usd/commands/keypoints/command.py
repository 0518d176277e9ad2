"""`spin-usd keypoints`: picks the keypoints of a target in the browser."""

from spin_usd.commands.keypoints.options import KeypointsOptions
from spin_usd.counted import counted
from spin_usd.terminal.lines import show, tell


def keypoints(options: KeypointsOptions) -> None:
    """Pick the keypoints of a target in the browser: click on it, name, move, copy. Saves a layer that author reads."""
    from spin_usd.commands.keypoints.run import pick_keypoints

    if not options.is_local:
        tell(f"warning: whoever reaches {options.host} over a network can see the target and change its keypoints")
    session = pick_keypoints(options, tell=tell)
    show(f"{session.saved_in}   ({counted(len(session.keypoints.names), 'keypoint')})")
