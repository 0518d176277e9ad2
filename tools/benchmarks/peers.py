"""Others that make the same pictures, each a script in a process of its own, spoken to in lines.

A script is started as `SCRIPT ANSWERS SCENE.npz FOLDER SAMPLES frame|box ...`: the file descriptor for its answers,
since libraries print whatever they like; camera, mesh, materials and light; a folder for its files; and whether it
renders the whole frame or a box. It answers its version, then to each line of 16 numbers (rotation and translation from
body to OpenCV camera, and the box x0 y0 x1 y1, pixels) `done` when its files are there. Mitsuba's takes two more, which
are samples and a seed.
"""

import os
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from spin_usd.renderers.background.surroundings import Surroundings
from spin_usd.scene.light import DistantLight
from spin_usd.scene.scene import Scene
from spin_usd.scene.texture import Colored, Primvar, Scalar, Texture, Tiles

HERE = Path(__file__).resolve().parent
MITSUBA_VARIANTS = ("llvm_ad_rgb", "scalar_rgb")  # the fastest first
CROPS = {"frame": "full frame", "box": "cropped to the target's box"}


@dataclass(frozen=True, kw_only=True, eq=False)
class Peer:
    """`name`: what it is and renders; `version`: what it says of itself; `log`: what it and its libraries print."""

    name: str
    version: str
    process: subprocess.Popen[str]
    answers: IO[str]
    log: Path

    @property
    def pid(self) -> int:
        return self.process.pid

    def picture(self, scene: Scene, *more: int) -> None:
        """Make the picture of `scene`: of its target's pose, in the box that the target can cover, with `more` numbers
        that its script takes. Raises ChildProcessError where it ends instead."""
        pose, region = scene.bodies[0].T_cam_body, scene.picture_region
        box = (region.x0, region.y0, region.x1, region.y1)
        assert self.process.stdin is not None
        print(*pose.rotation.ravel(), *pose.translation, *box, *more, file=self.process.stdin, flush=True)
        if not self.answers.readline():
            raise ChildProcessError(f"made no picture: {_end(self.process, self.log)}")

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self.answers.close()


def write_scene(scene: Scene, file: Path) -> None:
    """Write what the scripts know: the lens without its distortion, flat faces, materials with one colour, metallic and
    roughness, the means of their textures, distant lights, and what shines from all around as an image. The plain bpy
    script takes of these the first material and the first light."""
    camera, mesh, materials = scene.camera, scene.bodies[0].target.mesh, scene.bodies[0].target.materials
    suns = [light for light in scene.lights if isinstance(light, DistantLight)]
    around = Surroundings.of(scene)
    np.savez(
        file,
        camera=[camera.width, camera.height, camera.fx, camera.cx, camera.cy],
        points=mesh.points,
        faces=mesh.faces,
        face_material=mesh.face_material,
        colors=np.stack([_mean(material.diffuse_color, 3) for material in materials]),
        metal_rough=np.stack([_mean(each, 1) for m in materials for each in (m.metallic, m.roughness)]).reshape(-1, 2),
        suns=np.array([[*sun.direction_cam, *sun.irradiance] for sun in suns]),
        around=np.zeros((0, 0, 3), np.float32) if around is None else around.pixels,
        turn_around=np.eye(3) if around is None else around.rotation,
    )


def _mean(value: Colored | Scalar, channels: int) -> NDArray[np.float64]:
    """Return (channels,): a constant, the mean of a texture, or grey where the mesh has the values."""
    if isinstance(value, Texture):
        image = value.image.images[0][1] if isinstance(value.image, Tiles) else value.image
        scaled = image.pixels * np.array(value.scale) + np.array(value.bias)
        return np.asarray(scaled.mean((0, 1))[:channels], np.float64)
    return np.full(channels, 0.5) if isinstance(value, Primvar) else np.array(value, float).reshape(channels)


def start_all(scene: Scene, folder: Path, samples: int, mitsuba_python: str) -> tuple[list[Peer], dict[str, str]]:
    """Start Blender's and Mitsuba's, each of the whole frame and of the box, and have them make the picture of `scene`;
    returns them, and those that cannot, with the reason."""
    write_scene(scene, folder / "scene.npz")
    mitsuba = [
        (f"Mitsuba {each.partition('_')[0]}", [mitsuba_python, "plain_mitsuba.py", each]) for each in MITSUBA_VARIANTS
    ]
    peers: list[Peer] = []
    left_out = {}
    for ways in ([("plain bpy script", [sys.executable, "plain_bpy.py"])], mitsuba):
        for name, how in ways:
            try:
                peers += _pair(scene, name, how, folder, samples)
                break
            except OSError as error:
                left_out[name] = str(error)
    return peers, left_out


def _pair(scene: Scene, name: str, how: list[str], folder: Path, samples: int) -> list[Peer]:
    """Start one of the whole frame and one of the box. Raises OSError where one does not start, or cannot make the
    picture."""
    with ExitStack() as unless_both_work:
        pair = []
        for crop in CROPS:
            pair.append(_started(name, how, folder, samples, crop))
            unless_both_work.callback(pair[-1].close)
        for peer in pair:
            peer.picture(scene)
        unless_both_work.pop_all()
    return pair


def start_bpy(folder: Path, samples: int) -> Peer:
    """Start Blender's, of the whole frame of the scene that is written in the folder. Raises OSError where it does not
    start."""
    return _started("plain bpy script", [sys.executable, "plain_bpy.py"], folder, samples, "frame")


def start_mitsuba(scene: Scene, folder: Path, mitsuba_python: str) -> Peer:
    """Start the fastest Mitsuba, cropped to the target's box. Raises OSError where it does not start, or cannot make
    the picture."""
    write_scene(scene, folder / "scene.npz")
    peer = _started("Mitsuba llvm", [mitsuba_python, "plain_mitsuba.py", MITSUBA_VARIANTS[0]], folder, 1, "box")
    try:
        peer.picture(scene)
    except OSError:
        peer.close()
        raise
    return peer


def _started(name: str, how: list[str], folder: Path, samples: int, crop: str) -> Peer:
    """Start a script. `how`: Python, script, and what that is told besides. Raises OSError where it does not start."""
    python, script, *more = how
    own = folder / f"{name} {crop}"
    own.mkdir()
    log = own / "log.txt"
    read, write = os.pipe()
    with log.open("wb") as printed:
        process = subprocess.Popen(
            [python, str(HERE / script), str(write), str(folder / "scene.npz"), str(own), str(samples), crop, *more],
            stdin=subprocess.PIPE,
            stdout=printed,
            stderr=printed,
            pass_fds=[write],
            text=True,
        )
    os.close(write)
    answers = os.fdopen(read)
    version = answers.readline().strip()
    if not version:
        answers.close()
        raise ChildProcessError(f"did not start: {_end(process, log)}")
    return Peer(name=f"{name}, {CROPS[crop]}", version=version, process=process, answers=answers, log=log)


def _end(process: subprocess.Popen[str], log: Path) -> str:
    """Return the exit code of a process that answers no more, and what it said last, of an error if it did."""
    lines = log.read_text(errors="replace").strip().splitlines()
    telling = [line for line in lines if "error" in line.lower()] or lines or ["no word"]
    return f"exit code {process.wait()}, {telling[-1]}"
