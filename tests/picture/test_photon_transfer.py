"""The show: a camera authored in USD, a white plate rendered in the Sun, and the detector recovered from the files."""

import numpy as np
import pytest

from spin_usd.commands.render.run import render_dataset
from spin_usd.formats.image_file import read_image
from spin_usd.options import RunOptions
from spin_usd.scene.effort import Effort
from tests.authorities import photon_transfer
from tests.cases.requests import request_for

RECOVERED = 0.02
SIDE = 256
GAIN, READ_NOISE, FULL_WELL, BITS, BLACK, PRNU = 6.0, 15.0, 20_000, 12, 100, 0.015
LEVELS = 10

# Each picture lights the plate from the camera's side; radiance E / pi, and the exposure brings E = pi to full scale.
STAGE = f"""#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Z"
    metersPerUnit = 1
    startTimeCode = 0
    endTimeCode = {{last}}
)

def Xform "World"
{{{{
    def Camera "Camera" (
        prepend apiSchemas = ["SpinLensAPI", "SpinSensorAPI"]
    )
    {{{{
        int2 spin:lens:imageSize = ({SIDE}, {SIDE})
        double spin:lens:fx = 400
        double spin:lens:fy = 400
        double spin:lens:cx = {SIDE / 2}
        double spin:lens:cy = {SIDE / 2}
        float exposure:time = {{time}}
        float exposure:responsivity = {{responsivity}}
        double spin:sensor:gain = {GAIN}
        double spin:sensor:readNoise = {READ_NOISE}
        double spin:sensor:fullWell = {FULL_WELL}
        double spin:sensor:prnu = {PRNU}
        double spin:sensor:darkCurrent = 100
        double spin:sensor:blackLevel = {BLACK}
        int spin:sensor:adcBits = {BITS}
        int spin:sensor:bitDepth = 16
        token spin:sensor:encoding = "linear"
    }}}}

    def Xform "Target" (
        prepend apiSchemas = ["SpinTargetAPI"]
    )
    {{{{
        double3 xformOp:translate = (0, 0, -10)
        uniform token[] xformOpOrder = ["xformOp:translate"]

        def Mesh "Plate"
        {{{{
            point3f[] points = [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]
            int[] faceVertexCounts = [4]
            int[] faceVertexIndices = [0, 1, 2, 3]
            uniform token subdivisionScheme = "none"
            color3f[] primvars:displayColor = [(1, 1, 1)]
        }}}}
    }}}}

    def DistantLight "Sun"
    {{{{
        float inputs:intensity.timeSamples = {{intensities}}
        bool inputs:normalize = 1
        float inputs:angle = 0.5
    }}}}
}}}}
"""


def rendered(folder, levels, *, time=0.01):
    """The images of one picture per level of full scale, by the raycast renderer."""
    folder.mkdir()
    samples = ", ".join(f"{i}: {np.pi * level}" for i, level in enumerate(levels))
    text = STAGE.format(last=len(levels) - 1, time=time, responsivity=1 / time, intensities="{" + samples + "}")
    (folder / "stage.usda").write_text(text)
    request = request_for(folder / "stage.usda", labels="none", effort=Effort(samples=1), renderer="raycast")
    assert not render_dataset(request, folder / "out", RunOptions(workers=1), progress=lambda *_: None).failed
    return [read_image(path)[0].astype(float) for path in sorted((folder / "out" / "image" / "nominal").iterdir())]


@pytest.mark.slow
def test_the_authored_detector_is_recovered_from_rendered_flat_fields(tmp_path) -> None:
    fullest = FULL_WELL / GAIN / (2**BITS - 1)
    levels = np.repeat(np.linspace(0.06, 0.85, LEVELS) * fullest, 2)
    images = rendered(tmp_path / "light", [*levels, 3 * fullest])
    dark = rendered(tmp_path / "dark", [1e-9, 1e-9], time=1e-6)
    found = photon_transfer.characterise(dark, list(zip(images[:-1:2], images[1:-1:2], strict=True)), images[-1])
    assert found.gain == pytest.approx(GAIN, rel=RECOVERED)
    assert found.read_noise == pytest.approx(READ_NOISE, rel=RECOVERED)
    assert found.full_well == pytest.approx(FULL_WELL, rel=RECOVERED)
    assert found.bits == pytest.approx(BITS, abs=0.01)
    assert found.black_level == pytest.approx(BLACK, rel=RECOVERED)
    assert found.prnu == pytest.approx(PRNU, rel=RECOVERED)
