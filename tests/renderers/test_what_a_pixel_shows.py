"""What image, preview and labels show of one pixel: each row of the table in docs/concepts/conventions.md.

Each surface shines by itself in a colour of its own, so a pixel says which surfaces it shows.
"""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.body import OCCLUDER, Body
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.scene.effort import Effort
from spin_usd.scene.material import PRESENCE, Material
from spin_usd.scene.texture import Image, Texture
from tests.cases.scenes import box, pose, scene, target, with_first
from tests.conftest import REPOSITORY

CAMERA = Camera(width=9, height=9, fx=30, fy=30, cx=4.5, cy=4.5, distortion=(0.0,) * 5)
CENTRE = (4, 4)
RED, GREEN, BLUE = np.eye(3)
FRONT, BEHIND, ARM = (
    Material(path=f"/{i}", diffuse_color=(0.0, 0.0, 0.0), ior=1.0, emissive_color=tuple(c))
    for i, c in enumerate(np.eye(3))
)
SAMPLES = 256
NOISE = 5 * np.sqrt(0.25 / SAMPLES)  # of a mixture by chance, five standard deviations
FLOAT32 = 1e-5

CLEAR = Image(name="clear", pixels=np.zeros((1, 1, 4), np.float32))
"""An image that is nowhere opaque."""


def plates(*depths, materials, turned=False, apart=True):
    """Plates across the view, each a part with a material of its own; `turned` shows the backs of all."""
    points, faces = np.array([[-1, -1, 0], [-1, 1, 0], [1, 1, 0], [1, -1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])
    faces = faces[:, ::-1] if turned else faces
    return target(
        np.concatenate([points + np.array([0, 0, depth]) for depth in depths]),
        np.concatenate([faces + 4 * i for i in range(len(depths))]),
        parts=np.repeat(np.arange(len(depths)) + 1, 2),
        materials=materials,
        face_material=np.repeat(np.arange(len(depths)), 2),
        primvars={"st": np.zeros((2 * len(depths), 3, 2))},
    )


def two(front, **options):
    return scene(plates(0, 1, materials=(front, BEHIND), **options), camera=CAMERA)


def textured(threshold):
    return replace(
        FRONT, opacity=Texture(path="/t", image=CLEAR, output="a"), opacity_threshold=threshold, opacity_mode=PRESENCE
    )


def nested(front):
    """A box within a box, as parts 2 and 1."""
    (outer, faces), (inner, _) = box((-1, -1, -1), (1, 1, 1)), box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
    both = target(
        np.concatenate([outer, inner]),
        np.concatenate([faces, faces + 8]),
        parts=np.repeat([1, 2], 12),
        materials=(front, BEHIND),
        face_material=np.repeat([0, 1], 12),
    )
    return scene(both, camera=CAMERA)


def behind_an_arm():
    arm = Body(
        id=OCCLUDER, target=target(*box((-1, -1, 0), (1, 1, 0.1)), materials=[ARM]), T_cam_body=pose(t=(0, 0, 2))
    )
    return with_first(two(FRONT), others=(arm,))


def one_in_another():
    """The second target lies within the first."""
    inner = Body(id=2, target=target(*box((-0.5,) * 3, (0.5,) * 3), materials=[BEHIND]), T_cam_body=pose())
    return scene(target(*box((-1,) * 3, (1,) * 3), materials=[FRONT]), camera=CAMERA, others=(inner,))


HALF = replace(FRONT, opacity=0.5, opacity_mode=PRESENCE)
GLASS = replace(FRONT, opacity=0.0)
ROWS = {  # the scene · part and target of the labels · the image's colour · the preview's
    "opaque": (two(FRONT), (1, 1), RED, RED),
    "seen from its back": (two(FRONT, turned=True), (1, 1), RED, RED),
    "half transparent": (two(HALF), (1, 1), (RED + GREEN) / 2, RED),
    "emissive glass": (two(GLASS), (1, 1), RED + GREEN, RED),
    "transparent by an image": (two(textured(0.0)), (1, 1), GREEN, RED),
    "cut out": (two(textured(0.5)), (2, 1), GREEN, GREEN),
    "a part within another": (nested(FRONT), (1, 1), RED, RED),
    "a part within a half transparent one": (nested(HALF), (1, 1), (RED + GREEN) / 2, RED),
    "a target within another": (one_in_another(), (1, 1), RED, RED),
    "an occluder before both": (behind_an_arm(), (3, OCCLUDER), BLUE, BLUE),
}


@pytest.mark.parametrize("row", ROWS)
def test_each_row_of_the_table(blender, row) -> None:
    s, (part, body), image, preview = ROWS[row]
    for seen in (EmbreeCaster().visibility(s), blender.visibility(s)):
        surface = visible_surface(s, seen)
        labels = {name: PIXEL_LABELS[name].make(s, surface)[CENTRE] for name in ("segmentation", "instance")}
        assert labels == {"segmentation": part, "instance": body}
    rendered = blender.radiance(s, Effort(samples=SAMPLES), seed=1)
    mixed = np.count_nonzero(image) > 1
    np.testing.assert_allclose(rendered.rgb[CENTRE], image, atol=NOISE if mixed else FLOAT32)
    cast = RaycastRenderer().radiance(s, Effort(samples=1), seed=1)
    np.testing.assert_allclose(cast.rgb[CENTRE], preview, atol=FLOAT32)


def test_of_coincident_surfaces_labels_and_preview_have_the_first(blender) -> None:
    """Cycles may show either, or both: nothing says which is in front."""
    s = scene(plates(0, 0, materials=(FRONT, BEHIND)), camera=CAMERA)
    surface = visible_surface(s, EmbreeCaster().visibility(s))
    assert (PIXEL_LABELS["segmentation"].make(s, surface) == 1).all()
    np.testing.assert_allclose(RaycastRenderer().radiance(s, Effort(samples=1), seed=1).rgb[CENTRE], RED, atol=FLOAT32)
    assert blender.radiance(s, Effort(samples=1), seed=1).rgb[CENTRE].max() > 0


def test_the_documents_table_has_each_row() -> None:
    text = (REPOSITORY / "docs" / "concepts" / "conventions.md").read_text(encoding="utf-8")
    table = text.split("### What a pixel shows")[1].split("\n\n#")[0]
    rows = [line.split("|")[1].strip() for line in table.splitlines() if line.startswith("| ")]
    left_out = "of opacity 0, without light or gloss"  # by the reader of stages: tests/stage/read/bodies/test_target.py
    assert rows[2:] == [*ROWS, left_out, "coincident with another"]
