"""Files of others with a few bytes, lines or numbers changed: read, or refused in a sentence, by every text reader."""

import io
import json
import random
import re
from contextlib import suppress

import h5py
import numpy as np
import pytest

from spin_usd.basics.progress import no_progress
from spin_usd.basics.resources import bundled
from spin_usd.commands.author.scenario_pictures import ScenarioPictures
from spin_usd.errors import SpinError
from spin_usd.exchange.read_camera import read_camera
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.exchange.spades import POSITION, QUATERNION
from spin_usd.formats.table_file import read_materials_file
from spin_usd.orbits.attitudes import Aem
from spin_usd.orbits.orbits import Oem, Tle
from spin_usd.specifications.appearances import read_appearances
from spin_usd.specifications.sampling_spec import open_spec
from tests.exchange.test_read_camera import BASALT, CAMERA_INFO, KALIBR, ORB, OST, ROS, SVO, VINS
from tests.orbits.test_attitudes import AEM, sight
from tests.orbits.test_mean_elements import OF_ISS, csv, kvn, xml
from tests.orbits.test_orbits import ISS, checksum, context, segments

NUMBERS = ["nan", "inf", "-1e308", "1e999", "1e-999999999", "", "9" * 30, "0", "-1", "1_0"]
NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
STEPS = 3  # changes to a file at most
AEM_ROWS = "2024-05-01T12:00:00 0 0 0 1\n2024-05-01T12:00:30 0 0 0.6 0.8"
TLE = "\n".join(checksum(f"{line:<69}") for line in ISS.splitlines()[1:])
TUM = "".join(f"140371527{i}262140160 -0.3 0 -6 0 0 0 1\n" for i in range(4))
POSES = "name,time [ms],qw,qx,qy,qz,x,y,z\na,1,1,0,0,0,0,0,6\nb,2,1,0,0,0,0,0,6\n"
EUROC = "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n" + "".join(
    f"140363658083855564{i},0.1,0.2,-6,1,0,0,0\n" for i in range(4)
)
IMAGES = "# Image list\n1 1 0 0 0 0 0 6 1 a.png\n10.5 20.5 -1\n2 1 0 0 0 0.1 0 6 1 b.png\n"
SCENARIO = """epoch = "2026-03-20T10:05:00Z"
times_s = [0, 12.5]
stars = -3
[target]
orbit = { kind = "keplerian", semi_major_axis_m = 7_078_137, inclination_deg = 98.2 }
attitude = { kind = "tumbling", q = [1, 0, 0, 0], rate_deg_s = [0.3, 1.0, -0.5], inertia_kg_m2 = [20, 30, 40] }
[chaser]
orbit = { kind = "relative_state", place_m = [0, -8, 0], velocity_m_s = [0, 0.02, 0] }
"""


def spades():
    """A trajectory of three poses."""
    rows = np.zeros(
        3, [("filename", "S9"), ("timestamp", "<i8"), *((name, "<f8") for name in (*POSITION, *QUATERNION))]
    )
    rows["filename"], rows["timestamp"] = [b"a.png", b"b.png", b"c.png"], [0, 1000, 2000]
    rows["Qw"], rows["Tz"] = 1, 5
    made = io.BytesIO()
    with h5py.File(made, "w") as file:
        file.create_group("labels").create_dataset("data", data=rows)
    return made.getvalue()


def mutant(choose: random.Random, data: bytes) -> bytes:
    """Return the file with up to three changes: of bytes, lines, words or numbers."""
    for _ in range(choose.randint(1, STEPS)):
        lines = data.splitlines(keepends=True) or [b"a"]
        place = choose.randrange(len(lines))
        numbers = list(NUMBER.finditer(data)) or list(re.finditer(b"$", data))
        number, at = choose.choice(numbers), choose.randrange(len(data) + 1)
        data = choose.choice(
            [
                data[:at],
                data[:at] + bytes([choose.randrange(256)]) + data[at + 1 :],
                b"".join(lines[:place] + lines[place + 1 :]),
                b"".join([*lines, lines[place]]),
                b"".join([*lines[place:], *lines[:place]]),
                data[: number.start()] + choose.choice(NUMBERS).encode() + data[number.end() :],
                data[: number.start()] + choose.choice(numbers)[0] + data[number.end() :],
            ]
        )
    return data


@pytest.fixture(scope="module")
def oem_text(tmp_path_factory):
    folder = tmp_path_factory.mktemp("oem")
    segments(folder)
    return (folder / "craft.oem").read_text()


READERS = {
    "oem": (["OEM"], 40, lambda path: Oem(file=path.name).states(context(path.parent, 0.0))),
    "aem": ([AEM.format(rows=AEM_ROWS)], 40, lambda path: Aem(file=path.name).rotations(sight(path.parent, 0.0))),
    "elements": (
        [TLE, kvn(OF_ISS), csv(OF_ISS), xml(OF_ISS), json.dumps([OF_ISS], indent=1)],
        60,
        lambda path: Tle(file=path.name).states(context(path.parent, 0.0)),
    ),
    "poses.csv": ([POSES, POSES.replace("time [ms]", "field.header.stamp"), EUROC, TUM], 100, read_pose_list),
    "images.txt": ([IMAGES], 30, read_pose_list),
    "RT000.h5": ([spades()], 20, read_pose_list),
    "camera.txt": ([ROS, CAMERA_INFO, KALIBR, OST, ORB, VINS, SVO, json.dumps(BASALT, indent=1)], 160, read_camera),
    "materials.csv": (["pattern,material\n*panel*,solar_cell\nbody,gold_foil\n*,keep\n"], 40, read_materials_file),
    "appearances.toml": (
        [bundled("specification", "ablation_camera").read_bytes()],
        30,
        lambda path: read_appearances(str(path)),
    ),
    "sample.toml": ([bundled("sample", "fly_around").read_bytes()], 30, lambda path: open_spec(path, 4)),
    "scenario.toml": ([SCENARIO], 10, lambda path: ScenarioPictures(path, None, no_progress)),
}


@pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning")
@pytest.mark.parametrize("name", READERS)
def test_a_mutant_is_read_or_refused(tmp_path, oem_text, name) -> None:
    """No other error than ours; pytest's limit of time holds for the rest."""
    seeds, count, read = READERS[name]
    choose, path = random.Random(name), tmp_path / name
    for number in range(count):
        seed = oem_text if seeds == ["OEM"] else seeds[number % len(seeds)]
        data = seed if isinstance(seed, bytes) else seed.encode()
        path.write_bytes(mutant(choose, data) if number >= len(seeds) else data)
        with suppress(*[SpinError] * (number >= len(seeds))):
            read(path)
