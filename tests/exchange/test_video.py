"""Video: every picture a frame, in order, of any size, with boxes and axes where they belong."""

import json

import cv2
import numpy as np
import pytest

from spin_usd.errors import UnsupportedError
from spin_usd.exchange.layout.exported_dataset import ExportedPicture
from spin_usd.exchange.video import AXIS_COLOURS, BOX_COLOUR, frame_of
from spin_usd.formats.image_file import write_image
from spin_usd.reading.dataset import Dataset
from tests.exchange.conftest import clone, contents, write_export

LOSSY = 3.0  # levels of 255, on average, that the code loses


def frames_of(path):
    """All frames of a video."""
    video = cv2.VideoCapture(str(path))
    frames = []
    while (frame := video.read()[1]) is not None:
        frames.append(frame)
    return frames


def exported(dataset, name):
    picture = Dataset(dataset).picture(name)
    return ExportedPicture(picture=picture, name=name, number=0, split="train", target_name="tango")


def resized(rendered, folder, width, height):
    """A dataset of one picture of that size, grey from 0 in the first column on."""
    dataset = clone(
        rendered, folder, [{"frame": "a", "camera": {"width": width, "height": height}, "kinds": ["image"]}]
    )
    file = dataset / "image" / "nominal" / "a.png"
    file.unlink()  # another dataset has it too
    image = np.broadcast_to(np.linspace(0, 200, width).astype(np.uint8), (height, width))
    write_image(file, image, channels=("Y",))
    return dataset


def test_each_variant_is_a_file_of_its_pictures_in_order(two_variants, tmp_path) -> None:
    write_export(two_variants, "video", tmp_path / "out", options={"fps": "4"})
    assert sorted(path.name for path in tmp_path.glob("out/*.mp4")) == ["noisy_1.mp4", "nominal.mp4"]
    for variant in ("nominal", "noisy_1"):
        frames = frames_of(tmp_path / "out" / f"{variant}.mp4")
        pictures = [picture for picture in Dataset(two_variants) if picture.variant == variant]
        for frame, picture in zip(frames, pictures, strict=True):
            assert np.abs(frame - picture.image[..., None].astype(float)).mean() < LOSSY
    write_export(two_variants, "video", tmp_path / "again", options={"fps": "4"})
    assert contents(tmp_path / "again") == contents(tmp_path / "out")


def timed(folder, *times):
    """Give the records of a dataset's variant their times, in the order of the pictures."""
    for file, time in zip(sorted((folder / "records" / "nominal").iterdir()), times, strict=True):
        file.write_text(json.dumps(json.loads(file.read_text()) | {"time_s": time}))


def test_real_time_is_that_of_the_pictures(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "set", [{"frame": name} for name in "abc"])
    with pytest.raises(UnsupportedError, match="nominal: has pictures without times, or one alone; give fps a number"):
        write_export(dataset, "video", tmp_path / "out", options={"fps": "real"})
    timed(dataset, 5.0, 5.5, 6.0)
    write_export(dataset, "video", tmp_path / "real", options={"fps": "real"})
    assert cv2.VideoCapture(str(tmp_path / "real" / "nominal.mp4")).get(cv2.CAP_PROP_FPS) == pytest.approx(2)
    timed(dataset, 5.0, 5.5, 7.0)
    with pytest.raises(UnsupportedError, match="not equally far apart in time"):
        write_export(dataset, "video", tmp_path / "again", options={"fps": "real"})


@pytest.mark.parametrize("size", [(64, 48), (63, 47), (1, 1), (17, 5), (1921, 3)])
def test_frames_of_any_size_are_whole(rendered, tmp_path, size) -> None:
    """An odd side is one longer, which is even."""
    dataset = resized(rendered, tmp_path / "set", *size)
    write_export(dataset, "video", tmp_path / "out")
    (frame,) = frames_of(tmp_path / "out" / "nominal.mp4")
    even = [side + side % 2 for side in size]
    assert frame.shape == (even[1], even[0], 3)
    if min(size) > 16:
        wanted = frame_of(exported(dataset, "a"), "none").astype(float)
        assert np.abs(frame - wanted).mean() < LOSSY


def test_a_box_is_drawn_around_the_visible_pixels(rendered) -> None:
    picture = exported(rendered, Dataset(rendered)[0].frame)
    drawn = (frame_of(picture, "box") == BOX_COLOUR).all(-1)
    rows, columns = np.nonzero(drawn)
    x0, y0, x1, y1 = picture.target.box_visible.tolist()
    assert [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1] == [x0, y0, x1, y1]
    assert np.count_nonzero(drawn) == 2 * (x1 - x0 + y1 - y0) - 4


def test_axes_start_at_the_origin_and_end_where_opencv_projects_them(rendered) -> None:
    picture = exported(rendered, Dataset(rendered)[0].frame)
    plain, frame = frame_of(picture, "none"), frame_of(picture, "axes")
    half = np.ptp(picture.target.box, axis=0).max() / 2
    turn, _ = cv2.Rodrigues(picture.target.T_cam_body[:3, :3])
    camera = picture.camera
    ends = np.concatenate([np.zeros((1, 3)), half * np.eye(3)])
    lens = np.array(camera.distortion)
    pixels = cv2.projectPoints(ends, turn, picture.target.t_cam_body, camera.matrix, lens)[0].reshape(-1, 2)
    changed = (frame != plain).any(-1)
    rows, columns = np.nonzero(changed)
    margin = 2.0  # pixels: a line's own width, and the pixel that a point lies in
    assert columns.min() >= pixels[:, 0].min() - margin
    assert columns.max() <= pixels[:, 0].max() + margin
    assert rows.min() >= pixels[:, 1].min() - margin
    assert rows.max() <= pixels[:, 1].max() + margin
    for tip, colour in zip(pixels[1:], AXIS_COLOURS, strict=True):
        x, y = (pixels[0] + 0.8 * (tip - pixels[0])).astype(int)
        near = frame[y - 2 : y + 3, x - 2 : x + 3].reshape(-1, 3).astype(int)
        assert np.abs(near - colour).sum(-1).min() < 200


def test_sizes_that_differ_or_are_too_large_are_refused(rendered, tmp_path) -> None:
    small = {"width": 120, "height": 75}
    dataset = clone(rendered, tmp_path / "set", [{"frame": "a"}, {"frame": "b", "camera": small}])
    with pytest.raises(UnsupportedError, match="b: is of another size than a, and a video has one; choose variants"):
        write_export(dataset, "video", tmp_path / "out")
    large = clone(rendered, tmp_path / "large", [{"frame": "a", "camera": {"width": 8192}}])
    with pytest.raises(UnsupportedError, match="a: is 8192 x 150 pixels, and MPEG-4 has 8190 a side at most"):
        write_export(large, "video", tmp_path / "out")
    assert not (tmp_path / "out").exists()
