"""A target in which a ball stands in several places, moved, scaled, sheared and mirrored: kept once, and made out."""

from dataclasses import replace

import numpy as np
import trimesh

from spin_usd.scene.instances import Instances
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.shape import Shape
from spin_usd.scene.target import Part, Target
from tests.cases.scenes import box, target, with_first


def shape():
    """A ball of two parts and two materials, with smooth normals, a primvar, and axes far from its middle."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.3)
    points, faces = np.array(ball.vertices), np.array(ball.faces)
    normals = points[faces] / np.linalg.norm(points[faces], axis=-1, keepdims=True)
    middle = points[faces].mean(1)
    return Shape(
        points=points + np.array([50, 0, 0]),
        faces=faces,
        face_part=middle[:, 0] > 0,
        face_material=middle[:, 1] > 0,
        corner_normals=normals,
        primvars={"shade": np.random.default_rng(0).random((len(faces), 3, 1), np.float32)},
    )


def instances(*, count=5, seed=1):
    """The ball in so many places, of which every second is mirrored and of a face group of its own."""
    rng = np.random.default_rng(seed)
    linear = rng.normal(0, 0.2, (count, 3, 3)) + np.eye(3)
    linear[1::2, 2] *= -1
    at = np.stack([np.linspace(-0.9, 0.9, count), rng.uniform(-0.4, 0.4, count), rng.uniform(-0.3, 0.3, count)], -1)
    offset = at - linear @ np.array([50.0, 0, 0])
    return Instances(
        shape=shape(),
        matrices=np.concatenate([linear, offset[..., None]], axis=2),
        parts=np.arange(1, 2 * count + 1).reshape(count, 2),
        groups=np.arange(count) % 2,
    )


def made_out(mesh):
    """The same mesh without instances, by each place's own matrix; corners are shared by none."""
    parts = [(mesh.points[mesh.faces], mesh.face_part, mesh.face_material, mesh.corner_normals, mesh.face_group)]
    values = [np.zeros((len(mesh.faces), 3, 1))]
    for each in mesh.instances:
        body, shape = each.shape.points[each.shape.faces], each.shape
        for matrix, ids, group in zip(each.matrices, each.parts, each.groups, strict=True):
            order = [0, 2, 1] if np.linalg.det(matrix[:, :3]) < 0 else [0, 1, 2]
            placed = sum(body[..., i, None] * matrix[:, i] for i in range(3)) + matrix[:, 3]
            normals = np.linalg.solve(matrix[:, :3].T, shape.corner_normals[..., None].astype(float))[..., 0]
            normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
            group = np.full(len(body), group)
            parts.append((placed[:, order], ids[shape.face_part], shape.face_material, normals[:, order], group))
            values.append(shape.primvars["shade"][:, order])
    corners, part, material, normals, group = (np.concatenate(each) for each in zip(*parts, strict=True))
    return Mesh(
        points=corners.reshape(-1, 3),
        faces=np.arange(3 * len(corners)).reshape(-1, 3),
        face_part=part,
        face_material=material,
        corner_normals=normals,
        face_group=group,
        primvars={"shade": np.concatenate(values)},
    )


def placed(*, materials, count=5):
    """A target of a plate of its own, the last part, before which so many balls stand."""
    own, balls = target(*box((-1.2, -0.7, 0.7), (1.2, 0.7, 0.8))).mesh, instances(count=count)
    last = int(balls.parts.max()) + 1
    mesh = Mesh(
        points=own.points,
        faces=own.faces,
        face_part=np.full(len(own.faces), last),
        face_material=own.face_material,
        corner_normals=own.corner_normals,
        instances=(balls,),
    )
    parts = tuple(Part(id=i, path=f"/T/p{i:02}", name=f"p{i}", class_name="c") for i in range(1, last + 1))
    return Target(path="/T", name="T", mesh=mesh, parts=parts, materials=materials)


def expanded(scene):
    """`scene` with all instances made out."""
    return with_first(scene, target=replace(scene.target, mesh=made_out(scene.target.mesh)))
