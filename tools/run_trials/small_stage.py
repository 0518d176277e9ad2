"""A stage of many small pictures, for trials of whole runs."""

import json
from pathlib import Path

import spin_usd
from spin_usd import resources

POSES = resources.stages() / "examples" / "tango_speedplus_poses.json"
WIDTH, HEIGHT = 64, 48
RELIGHT = 'schema = "augment-1"\nseed = 0\n\n[[augmentation]]\nname = "v"\ncount = {count}\n\n[augmentation.sample]\n'
RELIGHT += '"sun.direction" = {{ distribution = "directions", per = "frame" }}\n'


def author(folder: Path, frames: int, variants: int = 1) -> Path:
    """Write a stage of so many frames and variants, each with a direction of the Sun for each frame; return its root
    layer."""
    folder.mkdir(parents=True)
    known = json.loads(POSES.read_text())
    poses = [{**known[i % len(known)], "filename": f"img{i:06d}.png"} for i in range(frames)]
    (folder / "poses.json").write_text(json.dumps(poses))
    (folder / "camera.json").write_text(json.dumps(camera()))
    made = spin_usd.author(
        poses=folder / "poses.json", target="cubesat", camera=folder / "camera.json", out=folder / "stage"
    )
    if variants > 1:
        (folder / "relight.toml").write_text(RELIGHT.format(count=variants - 1))
        spin_usd.augment(made.root, spec=folder / "relight.toml")
    return Path(made.root)


def camera() -> dict[str, object]:
    """A small camera with the field of view of SPEED+'s, and no distortion."""
    focal = 100.0
    return {
        "Nu": WIDTH,
        "Nv": HEIGHT,
        "ppx": 1e-5,
        "ppy": 1e-5,
        "fx": focal * 1e-5,
        "fy": focal * 1e-5,
        "ccx": WIDTH / 2,
        "ccy": HEIGHT / 2,
        "cameraMatrix": [[focal, 0, WIDTH / 2], [0, focal, HEIGHT / 2], [0, 0, 1]],
        "distCoeffs": [0, 0, 0, 0, 0],
    }
