"""The child's part of the keypoint tool: it reads models and layers, and makes the layer to save."""

import base64
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.commands.author.model import axes_note, model_file, model_unit, write_model
from spin_usd.commands.author.plausible_target import refuse_size
from spin_usd.commands.keypoints.calls import CutPicture, KeypointsLayer, PlacedKeypoints, SavedTarget, SaveTarget
from spin_usd.errors import InputError
from spin_usd.exchange.layout.models import Model
from spin_usd.files.size_limits import MAX_ARRAY
from spin_usd.files.user_file import read_bytes
from spin_usd.formats.image_file import write_image
from spin_usd.labels import preview
from spin_usd.reading.dataset import Dataset
from spin_usd.scene.keypoints import Keypoints
from spin_usd.scene.material import Material
from spin_usd.scene.target import Target
from spin_usd.scene.texture import Color, Texture
from spin_usd.stage.author.added_layer import keypoints_layer
from spin_usd.stage.author.target_prim import composed_target
from spin_usd.stage.read.bodies.keypoints import holds_keypoints_alone, read_keypoints_layer

PART_PX = 720  # most columns of a part of a picture
PLAIN = (0.5, 0.5, 0.5)  # linear, of a surface whose colour comes with its corners


def save_target(request: SaveTarget) -> SavedTarget:
    """Save the surface of a model, and return what else is shown of it. Raises as `author` does, also for the size."""
    file, units_per_metre = model_file(request.target), request.units_per_metre
    with tempfile.TemporaryDirectory() as work:
        asset, notes = write_model(file, Path(work), units_per_metre, request.prim)
        read = composed_target(asset, Path(work))
        colors = _face_colors(read)  # here: textures are read where they are needed
    if not request.any_size:
        refuse_size(read.mesh.hull, model_unit(file, asset, units_per_metre))
    notes += axes_note(file, asset, "keypoints are meant in these")
    model = Model.of(read.mesh)
    np.savez(Path(request.folder, "target.npz"), points=model.points, faces=model.faces, colors=colors)
    return SavedTarget(name=asset.name, notes=notes, keypoints=_placed(read.keypoint_names, read.keypoints))


def read_keypoints(path: str) -> PlacedKeypoints:
    """Read the keypoints in the layer at `path`. Raises InputError for a file that would lose something if it were
    written anew, such as a model."""
    found = read_keypoints_layer(Path(path))
    if not holds_keypoints_alone(Path(path)):
        raise InputError("holds more than keypoints, and would be replaced", where=path, do="give another --out")
    return _placed(found.names, found.points)


def keypoints_text(request: KeypointsLayer) -> str:
    """Return the text of a layer with keypoints."""
    names, points = request.keypoints.names, request.keypoints.points
    keypoints = Keypoints(names=names, points=np.array(points, np.float64).reshape(-1, 3))
    documentation = f"The keypoints of {request.target}, picked by spin-usd keypoints: metres, body axes."
    return str(keypoints_layer(keypoints, documentation).ExportToString())


def picture_part(request: CutPicture) -> str:
    """Return the part of a picture's image as a JPEG, in base64. Raises InputError where there is none."""
    image = preview.image(Dataset(request.dataset).picture(request.frame, request.variant).image)
    image = image[request.region.slices]
    with tempfile.TemporaryDirectory() as work:
        file = Path(work, "part.jpg")
        write_image(file, preview.reduced(image, min(PART_PX, image.shape[1])), channels=("R", "G", "B"))
        return base64.b64encode(read_bytes(file, MAX_ARRAY)).decode()


def _placed(names: Sequence[str], points: Float) -> PlacedKeypoints:
    return PlacedKeypoints(names=tuple(names), points=tuple(map(tuple, points.tolist())))


def _face_colors(target: Target) -> Float:
    """Return the linear colour (F, 3) of each face, in the order of Mesh.placed: one for each material."""
    mesh = target.mesh
    pieces = [mesh.face_material] if len(mesh.faces) else []
    pieces += [np.tile(each.shape.face_material, len(each.matrices)) for each in mesh.instances]
    colors = np.array([_color(material) for material in target.materials], np.float64)
    return colors[np.concatenate(pieces)]


def _color(material: Material) -> Color:
    """Return one linear colour for all of a material: the mean of a texture."""
    color = material.diffuse_color
    if isinstance(color, Texture):
        mean = np.mean([image.pixels.mean((0, 1)) for image in color.images], axis=0)
        red, green, blue, _ = (float(each) for each in np.clip(mean * color.scale + color.bias, 0, 1))
        return red, green, blue
    return color if isinstance(color, tuple) else PLAIN
