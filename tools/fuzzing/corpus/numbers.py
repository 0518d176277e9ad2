"""Classes: numbers at the extremes, indices out of range, and lengths that do not match."""

from collections.abc import Iterator, Mapping
from functools import partial

from fuzzing.corpus import hosts
from fuzzing.corpus.calls import trial
from fuzzing.running.ended import Command
from fuzzing.sandbox import Sandbox
from fuzzing.trial import Trial

REALS = ("nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "1e400", "9223372036854775808")
JSON_NAMES = {"nan": "NaN", "inf": "Infinity", "-inf": "-Infinity"}
INDICES = ("-1", "99", "2147483647", "-2147483648", "2147483648", "9223372036854775807", "9223372036854775808", "1.5")

RECORD = "records/nominal/img000001.json"
JSON_NUMBERS = {
    "pose q": hosts.in_json("poses.json", (0, "q_vbs2tango_true", 0)),
    "pose t": hosts.in_json("poses.json", (0, "r_Vo2To_vbs_true", 2)),
    "camera fx": hosts.in_json("camera.json", ("cameraMatrix", 0, 0)),
    "camera cx": hosts.in_json("camera.json", ("cameraMatrix", 0, 2)),
    "camera k1": hosts.in_json("camera.json", ("distCoeffs", 0)),
    "camera k3": hosts.in_json("camera.json", ("distCoeffs", 4)),
    "camera width": hosts.in_json("camera.json", ("Nu",)),
    "camera pitch": hosts.in_json("camera.json", ("ppx",)),
    "keypoint": hosts.in_json("keypoints.json", ("tip", 0), "--keypoints", "keypoints.json"),
    "record pose t": hosts.in_dataset(RECORD, ("targets", 0, "pose", "t_cam_body", 2)),
    "record pose q": hosts.in_dataset(RECORD, ("pose", "q_cam_body", 0)),
    "record fx": hosts.in_dataset(RECORD, ("camera", "fx")),
    "record k1": hosts.in_dataset(RECORD, ("camera", "distortion", 0)),
    "record box": hosts.in_dataset(RECORD, ("targets", 0, "box", "visible", 0)),
    "record time code": hosts.in_dataset(RECORD, ("time_code",)),
    "record index": hosts.in_dataset(RECORD, ("index",)),
    "measured": hosts.in_dataset("cache/measured.json", ("taken", "labels")),
    "dataset size": hosts.in_dataset("dataset.json", ("targets", 0, "size", 0)),
}
TEXT_NUMBERS = {
    "lidar range": hosts.in_text("lidar.toml", "[0.5, 100]", "[0.5, {}]", "--lidar", "lidar.toml"),
    "lidar rows": hosts.in_text("lidar.toml", "rows = 4", "rows = {}", "--lidar", "lidar.toml"),
    "lidar mounting": hosts.in_text(
        "lidar.toml", "forward = [0, 0, 1]", "forward = [0, {}, 1]", "--lidar", "lidar.toml"
    ),
    "spec low": hosts.in_spec("low = 0.8", "low = {}"),
    "spec seed": hosts.in_spec("seed = 3", "seed = {}"),
    "spec count": hosts.in_spec("count = 1", "count = {}"),
    "sample range": hosts.in_sample("high = 30", "high = {}"),
    "sample pictures": hosts.in_sample("pictures = 2", "pictures = {}"),
    "obj point": hosts.in_text("box.obj", "v 1 0 0", "v {} 0 0"),
    "mtl colour": hosts.in_text("box.mtl", "Kd 0.8", "Kd {}"),
    "stl point": hosts.in_text("box_ascii.stl", "vertex ", "vertex {} ", "--target", "box_ascii.stl"),
    "--units-per-metre": lambda sandbox, text: hosts.in_text("box.obj", "v", "v", "--units-per-metre", text)(
        sandbox, ""
    ),
    "stage metersPerUnit": hosts.in_stage("metersPerUnit = 1", "metersPerUnit = {}"),
    "stage fx": hosts.in_stage("fx = 100", "fx = {}"),
    "stage k1": hosts.in_stage("k1 = -0.1", "k1 = {}"),
    "stage position": hosts.in_stage("0: (0, 5, 0)", "0: (0, {}, 0)"),
    "stage orientation": hosts.in_stage("0: (1, 0, 0, 0)", "0: ({}, 0, 0, 0)"),
    "stage point": hosts.in_stage("(1, 0, 0), (0, 1, 0)", "({}, 0, 0), (0, 1, 0)"),
    "stage st": hosts.in_stage("(1, 0), (0, 1), (1, 1)]", "({}, 0), (0, 1), (1, 1)]"),
    "stage size": hosts.in_stage("double size = 0.5", "double size = {}"),
    "stage intensity": hosts.in_stage("intensity = 1361", "intensity = {}"),
    "stage angle": hosts.in_stage("angle = 0.53", "angle = {}"),
    "stage exposure": hosts.in_stage("exposure:time = 0.01", "exposure:time = {}"),
    "stage f-stop": hosts.in_stage("float fStop = 0", "float fStop = {}"),
    "stage end": hosts.in_stage("endTimeCode = 1", "endTimeCode = {}"),
    "stage rate": hosts.in_stage("timeCodesPerSecond = 24", "timeCodesPerSecond = {}"),
    "stage shutter": hosts.in_stage("shutter:close = 0", "shutter:close = {}"),
    "target rotation": hosts.in_target("(10, 20, 30)", "({}, 20, 30)"),
    "target scale": hosts.in_target("(1, 1, 1), (1, 1, 1)]", "({}, 1, 1), (1, 1, 1)]"),
    "target metersPerUnit": hosts.in_target("metersPerUnit = 1", "metersPerUnit = {}"),
}
INDEX_PLACES = {
    "faces": hosts.in_stage("[0, 1, 2, 0, 1, 3]", "[0, 1, {}, 0, 1, 3]"),
    "face counts": hosts.in_stage("faceVertexCounts = [3, 3]", "faceVertexCounts = [3, {}]"),
    "image size": hosts.in_stage("imageSize = (64, 48)", "imageSize = ({}, 48)"),
    "resolution": hosts.in_stage("resolution = (64, 48)", "resolution = ({}, 48)"),
    "bit depth": hosts.in_stage("bitDepth = 8", "bitDepth = {}"),
    "subset": hosts.in_target("indices = [2]", "indices = [{}]"),
    "holes": hosts.in_target("holeIndices = []", "holeIndices = [{}]"),
    "prototypes": hosts.in_target("protoIndices = [0, 0]", "protoIndices = [0, {}]"),
    "OBJ faces": hosts.in_text("box.obj", "f 1/1 2/2 4/3", "f 1/1 2/2 {}/3"),
    "OBJ texture": hosts.in_text("box.obj", "f 1/1 2/2 4/3", "f 1/1 2/2 4/{}"),
    "OBJ normals": hosts.in_text("box.obj", "3/3/1", "3/3/{}"),
    "PLY faces": hosts.in_text("box_ascii.ply", "3 1 3 0", "3 1 3 {}", "--target", "box_ascii.ply"),
    "PLY count": hosts.in_text("box_ascii.ply", "element face 12", "element face {}", "--target", "box_ascii.ply"),
    "glTF mesh": hosts.in_json("box.gltf", ("nodes", 0, "mesh"), "--target", "box.gltf"),
    "glTF child": hosts.in_json("box.gltf", ("nodes", 0, "children", 0), "--target", "box.gltf"),
    "glTF count": hosts.in_json("box.gltf", ("accessors", 0, "count"), "--target", "box.gltf"),
    "glTF offset": hosts.in_json("box.gltf", ("bufferViews", 0, "byteOffset"), "--target", "box.gltf"),
    "glTF length": hosts.in_json("box.gltf", ("bufferViews", 3, "byteLength"), "--target", "box.gltf"),
    "glTF texture": hosts.in_json("box.gltf", ("textures", 0, "source"), "--target", "box.gltf"),
    "glTF type": hosts.in_json("box.gltf", ("accessors", 2, "componentType"), "--target", "box.gltf"),
    "record's target": hosts.in_dataset(RECORD, ("targets", 0, "id")),
    "dataset's target": hosts.in_dataset("dataset.json", ("targets", 0, "id")),
    "dataset's frames": hosts.in_dataset("dataset.json", ("frames",)),
    "record's width": hosts.in_dataset(RECORD, ("camera", "width")),
}
COUNTS: Mapping[str, tuple[hosts.Host, str]] = {
    "fewer corners than counts say": (hosts.in_stage("[0, 1, 2, 0, 1, 3]", "{}"), "[0, 1, 2]"),
    "no corners": (hosts.in_stage("[0, 1, 2, 0, 1, 3]", "{}"), "[]"),
    "no points": (hosts.in_stage("[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]", "{}"), "[]"),
    "fewer texture coordinates": (hosts.in_stage("[(0, 0), (1, 0), (0, 1), (1, 1)]", "{}"), "[(0, 0)]"),
    "no texture coordinates": (hosts.in_stage("[(0, 0), (1, 0), (0, 1), (1, 1)]", "{}"), "[]"),
    "blocked points": (hosts.in_stage("[(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]", "{}"), "None"),
    "blocked translate": (hosts.in_stage("0: (0, 5, 0)", "0: {}"), "None"),
    "fewer normals": (hosts.in_target("[(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)]", "{}"), "[(0, 0, 1)]"),
    "fewer positions than instances": (hosts.in_target("[(0, 0, 0), (0.5, 0.5, 0.5)]", "{}"), "[(0, 0, 0)]"),
    "fewer orientations": (hosts.in_target("[(1, 0, 0, 0), (1, 0, 0, 0)]", "{}"), "[(1, 0, 0, 0)]"),
    "fewer scales": (hosts.in_target("[(1, 1, 1), (1, 1, 1)]", "{}"), "[]"),
    "two target classes": (hosts.in_target('["bus"]', "{}"), '["a", "b"]'),
    "quaternion of three": (hosts.in_json("poses.json", (0, "q_vbs2tango_true")), "[1, 0, 0]"),
    "quaternion of none": (hosts.in_json("poses.json", (0, "q_vbs2tango_true")), "[]"),
    "position of lists": (hosts.in_json("poses.json", (0, "r_Vo2To_vbs_true")), "[[0], [0], [5]]"),
    "camera matrix of two rows": (hosts.in_json("camera.json", ("cameraMatrix",)), "[[100, 0, 32], [0, 100, 24]]"),
    "ragged camera matrix": (hosts.in_json("camera.json", ("cameraMatrix", 1)), "[0]"),
    "40 lens coefficients": (hosts.in_json("camera.json", ("distCoeffs",)), str([0.0] * 40)),
    "PLY with fewer points": (
        hosts.in_text("box_ascii.ply", "element vertex 8", "element vertex {}", "--target", "box_ascii.ply"),
        "7",
    ),
    "PLY with more points": (
        hosts.in_text("box_ascii.ply", "element vertex 8", "element vertex {}", "--target", "box_ascii.ply"),
        "9",
    ),
    "glTF with a longer buffer": (hosts.in_json("box.gltf", ("buffers", 0, "byteLength"), "--target", "box.gltf"), "1"),
    "glTF indices of two": (hosts.in_json("box.gltf", ("accessors", 2, "count"), "--target", "box.gltf"), "2"),
    "record without targets": (hosts.in_dataset(RECORD, ("targets",)), "[]"),
    "record of two equal targets": (hosts.in_dataset(RECORD, ("targets", 0, "box", "visible")), "[1, 2, 3]"),
    "dataset without targets": (hosts.in_dataset("dataset.json", ("targets",)), "[]"),
    "dataset without variants": (hosts.in_dataset("dataset.json", ("variants",)), "[]"),
}


def numbers() -> Iterator[Trial]:
    """Each extreme number in each place that is read."""
    for place, host in JSON_NUMBERS.items():
        for real in REALS:
            yield trial("numbers", f"{place} = {real}", partial(_prepare, host, JSON_NAMES.get(real, real)))
    for place, host in TEXT_NUMBERS.items():
        for real in REALS:
            yield trial("numbers", f"{place} = {real}", partial(_prepare, host, real))


def indices() -> Iterator[Trial]:
    """Each index in each place."""
    for place, host in INDEX_PLACES.items():
        for index in INDICES:
            yield trial("indices", f"{place} = {index}", partial(_prepare, host, index))


def counts() -> Iterator[Trial]:
    """Lengths that do not match."""
    for name, (host, text) in COUNTS.items():
        yield trial("counts", name, partial(_prepare, host, text))


def _prepare(host: hosts.Host, text: str, sandbox: Sandbox) -> list[Command]:
    return list(host(sandbox, text))
