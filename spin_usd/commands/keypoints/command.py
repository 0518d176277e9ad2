"""`spin-usd keypoints`: picks the keypoints of a target in the browser."""

from spin_usd.basics.pluralise import pluralise
from spin_usd.commands.keypoints.options import KeypointsOptions
from spin_usd.terminal.lines import print_err, print_out


def keypoints(options: KeypointsOptions) -> None:
    """Pick the keypoints of a target in the browser: click, name, move, copy. Saves a layer that author reads."""
    from spin_usd.commands.keypoints.run import pick_keypoints

    if not options.is_local:
        print_err(f"warning: anyone who can reach {options.host} can see the target and change its keypoints")
    session = pick_keypoints(options, tell=print_err)
    print_out(f"{session.saved_in}   ({pluralise(len(session.keypoints.names), 'keypoint')})")
