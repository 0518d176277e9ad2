"""What share of a picture the target covers, as estimated for costs, against the faces that rays meet."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from spin_usd.planning.picture_columns import Coverage, filled
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.stage.read.stage_reader import StageReader
from tests.cases.scenes import SPEEDPLUS, scene, target

SPLAT = 0.1  # off, where middles of faces stand for them: a pixel that one is in counts whole
USUAL, MOST = 0.02, 0.05  # off, of the pixels that are there, as the module says: sides are 13 degrees apart


def test_the_estimate_is_near_what_rays_meet(small_stage) -> None:
    reader, coverage, caster = StageReader(small_stage), Coverage(), EmbreeCaster()
    scenes = [replace(reader.scene(frame), camera=SPEEDPLUS) for frame in reader.frames]
    found = np.array([np.count_nonzero(caster.visibility(scene).face >= 0) for scene in scenes])
    off = np.abs(np.array([coverage.target_pixels(scene) for scene in scenes]) / found - 1)
    assert np.median(off) <= USUAL
    assert off.max() <= MOST


def test_a_picture_alone_is_estimated_as_among_others(small_stage) -> None:
    """The sides that it needs are looked at when it is asked for, whichever were before."""
    reader, coverage = StageReader(small_stage), Coverage()
    for frame in reader.frames:
        scene = reader.scene(frame)
        assert coverage.target_pixels(scene) == Coverage().target_pixels(scene)


def test_many_faces_are_estimated_by_their_middles(monkeypatch) -> None:
    ring = trimesh.creation.torus(1.0, 0.3, major_sections=256, minor_sections=128)
    one, side = scene(target(ring.vertices, ring.faces)), np.array([0.6, 0, 0.8])
    expected = filled(one, side, EmbreeCaster())
    monkeypatch.setattr("spin_usd.planning.picture_columns.MANY_FACES", 1000)
    assert filled(one, side, EmbreeCaster()) == pytest.approx(expected, rel=SPLAT)
