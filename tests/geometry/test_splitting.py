"""Split triangles cover the same surface, without gaps, until no edge is too long."""

import numpy as np
import trimesh

from spin_usd.geometry import splitting
from spin_usd.geometry.splitting import split_edges


def longer_than(limit):
    return lambda a, b: np.linalg.norm(a - b, axis=1) > limit


def test_it_keeps_the_surface_closed_and_in_place() -> None:
    made = trimesh.creation.icosphere(1)
    points, corners = np.asarray(made.vertices), np.asarray(made.faces, np.int64)
    split = split_edges(points, corners, longer_than(0.5))
    after = trimesh.Trimesh(split.points, split.corners, process=False)
    assert after.is_watertight
    assert len(split.corners) > len(corners)
    np.testing.assert_allclose([after.area, after.volume], [made.area, made.volume], rtol=1e-12)
    assert after.edges_unique_length.max() <= 0.5
    np.testing.assert_allclose(split.values(points[corners]), split.points[split.corners], atol=1e-15)


def test_each_kind_of_split_covers_its_triangle() -> None:
    triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    for code in range(8):
        edges = [edge for i, edge in enumerate(((0, 1), (1, 2), (2, 0))) if code >> i & 1]
        middles = [(triangle[i] + triangle[j]) / 2 for i, j in edges]

        def chosen(a, b, middles=middles):
            sizes = np.linalg.norm(a - b, axis=1)
            return np.array([any(np.allclose(m, x) for x in middles) for m in (a + b) / 2]) & (sizes >= 1)

        split = split_edges(triangle, np.array([[0, 1, 2]]), chosen)
        areas = np.cross(*np.moveaxis(split.points[split.corners][:, 1:] - split.points[split.corners][:, :1], 1, 0))
        assert len(split.corners) == len(edges) + 1
        assert (areas[:, 2] > 0).all()
        assert np.isclose(areas[:, 2].sum(), 1)


def test_it_stops_before_there_are_too_many(monkeypatch) -> None:
    monkeypatch.setattr(splitting, "MAX_SPLIT", 100)
    made = trimesh.creation.box((1, 1, 1))
    split = split_edges(np.asarray(made.vertices), np.asarray(made.faces, np.int64), longer_than(1e-3))
    assert 12 < len(split.corners) <= 100
