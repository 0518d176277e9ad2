"""The largest size in bytes of a file of each kind: above any useful size, and below a machine's memory."""

from collections.abc import Mapping

MAX_SPECIFICATION = 2**22  # TOML or JSON written by people: cameras, LiDARs, specifications
MAX_TABLE = 2**24  # a row for each part or keypoint of a model
MAX_POSE_LIST = 2**30  # a million pictures of 1 kB each
MAX_RECORD = 2**24  # of one picture, with all its targets and labels
MAX_DOCUMENT = 2**27  # our own JSON: enough for 100,000 variants and parts
MAX_SHARD = 2**40  # a tar file, which is read a member at a time
MAX_MODEL = 2**31  # text of 2^24 faces
MAX_TEXTURE = 2**29
MAX_ARRAY = 2**31  # an image or a point cloud of a picture: 2^26 pixels of eight floats
UNBOUNDED = 2**62  # for files read piece by piece

GLTF_ENTRIES: Mapping[str, int] = {
    "nodes": 2**18,
    "scenes": 2**10,
    "meshes": 2**18,
    "primitives": 2**14,
    "materials": 2**14,
    "textures": 2**14,
    "images": 2**14,
    "samplers": 2**14,
    "skins": 2**12,
    "accessors": 2**20,
    "bufferViews": 2**20,
    "buffers": 2**14,
}
"""The most entries of each list in a glTF file, refused before any of them is looked into; primitives: of one mesh."""
MAX_PLACEMENTS = 2**20  # joints and instances in all, of a matrix each
MAX_UNSTORED = 2**22  # elements of an accessor without bytes in the file
MAX_ELEMENTS_OF_XML = 2**22
