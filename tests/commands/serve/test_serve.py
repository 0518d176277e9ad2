"""`spin-usd serve`: what a client gets is what `render` makes of the log, to the bit; and no client can end it."""

import math
import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from types import SimpleNamespace

import msgspec
import numpy as np
import psutil
import pytest
import zmq

from spin_usd import Dataset
from spin_usd.commands.serve.run import MAX_WAITING, Server, _listening
from spin_usd.processes.child import IN_PROCESS
from tests.conftest import REPOSITORY

pytestmark = pytest.mark.children

COMMAND = (sys.executable, "-m", "spin_usd.command_line")
FLOOD = 3 * MAX_WAITING  # pictures that one client asks for at once
RENDERER = ("--renderer", "raycast", "--samples", "1")


@contextmanager
def served(stage, *options):
    """Yield the address of a server, which ends as by Ctrl-C, and its process."""
    command = [*COMMAND, "serve", str(stage), "--at", "tcp://127.0.0.1:*", *RENDERER, *map(str, options)]
    environment = {name: value for name, value in os.environ.items() if name != IN_PROCESS}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    try:
        line = process.stdout.readline()
        assert line.startswith("tcp://127.0.0.1:"), line + process.stderr.read()
        yield line.split()[0], process
    finally:
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=30)
    assert (process.returncode, said) == (0, "")


class Client:
    """As a program without our package has it."""

    def __init__(self, at, kind=zmq.REQ) -> None:
        self.socket: zmq.Socket[bytes] = zmq.Context.instance().socket(kind)
        self.socket.setsockopt(zmq.LINGER, 0)
        self.socket.setsockopt(zmq.RCVTIMEO, 60_000)
        self.socket.connect(at)

    def ask(self, **asked):
        self.socket.send(msgspec.msgpack.encode(asked))
        return msgspec.msgpack.decode(self.socket.recv())

    def picture(self, **asked):
        answer = self.ask(**asked)
        assert "error" not in answer, answer
        arrays = {
            kind: np.frombuffer(each["data"], each["dtype"]).reshape(each["shape"])
            for kind, each in answer["arrays"].items()
        }
        return answer, arrays


def approach(step):
    """A pose that nears the target and turns, as [q, t]."""
    half = 0.05 * step
    return [[math.cos(half), 0.0, math.sin(half), 0.0], [0.01 * step, 0.0, 5 - 0.1 * step]]


def test_its_log_is_rendered_to_the_same_pictures(small_stage, spin_usd, tmp_path) -> None:
    got = []
    with served(small_stage, "--log", tmp_path / "log") as (at, process):
        client = Client(at)
        stage = client.ask(ask="stage")
        assert list(stage["targets"]) == ["cubesat"]
        assert len(stage["frames"]) == 8
        for step in range(12):
            asked = {"pose": approach(step), "time": 0.2 * step, "arrays": ["image", "depth"]}
            asked |= {"sun": [0.1 * step, -0.5, -1.0]} if step % 3 == 1 else {}
            asked |= {"exposure": 0.02 * step, "values": {"optics.psf_sigma": 0.5}} if step > 6 else {}
            if step == 5:
                for child in psutil.Process(process.pid).children():
                    child.kill()
            got.append(client.picture(**asked))
        assert "the time of the picture before" in client.ask(pose=approach(0), time=0.0)["error"]
    made = spin_usd("render", tmp_path / "log", "--out", tmp_path / "dataset", *RENDERER, "--labels", "depth", "--json")
    assert '"made": 12' in made.stdout.replace('"made":', '"made": ').replace("  ", " ")
    for (answer, arrays), stored in zip(got, Dataset(tmp_path / "dataset"), strict=True):
        assert (answer["frame"], answer["logged"]) == (stored.frame, stored.index)
        np.testing.assert_array_equal(arrays["image"], stored.image)
        np.testing.assert_array_equal(arrays["depth"], stored.depth)
        assert answer["pose"]["t_cam_body"] == stored.t_cam_body.tolist()
        assert stored.time_s == pytest.approx(0.2 * stored.index)
    assert spin_usd("check", tmp_path / "dataset").returncode == 0


def test_a_log_goes_on_where_it_ended(small_stage, spin_usd, tmp_path) -> None:
    for part in range(2):
        with served(small_stage, "--log", tmp_path / "log") as (at, _):
            client = Client(at)
            names = [client.picture(pose=approach(3 * part + step))[0]["frame"] for step in range(3)]
        assert names == [f"request_{3 * part + step:06d}" for step in range(3)]
    plan = spin_usd("plan", tmp_path / "log", *RENDERER)
    assert plan.stdout.splitlines()[1].split()[:2] == ["nominal", "6"]


def test_frames_and_records_without_a_log(server, rendered) -> None:
    stored = Dataset(rendered)[1]
    answer, arrays = Client(server).picture(frame=1, arrays=["segmentation"], record=True)
    np.testing.assert_array_equal(arrays["segmentation"], stored.segmentation)
    assert msgspec.json.decode(answer["record"])["targets"] == stored.record["targets"]
    assert answer["frame"] == stored.frame


def test_a_stage_that_goes_away_is_said_and_may_come_back(small_stage, tmp_path) -> None:
    stage = shutil.copytree(small_stage.parent, tmp_path / "stage")
    with served(stage) as (at, process):
        client = Client(at)
        first = client.picture(frame=0)[1]["image"]
        stage.rename(tmp_path / "away")
        for child in psutil.Process(process.pid).children():
            child.kill()
        assert str(stage) in client.ask(frame=0)["error"]
        (tmp_path / "away").rename(stage)
        np.testing.assert_array_equal(client.picture(frame=0)[1]["image"], first)


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (b"", "the message cannot be read"),
        (b"\xff\x00rubbish", "the message cannot be read"),
        (b"\x91" * 100_000, "the message cannot be read"),
        (msgspec.msgpack.encode({"posse": 1}), "unknown field `posse`"),
        (msgspec.msgpack.encode({"sun": "up"}), "the message cannot be read"),
        (msgspec.msgpack.encode({"ask": "quit"}), "ask is 'quit'"),
        (msgspec.msgpack.encode({"arrays": ["colour"]}), "there is no 'colour'"),
        (msgspec.msgpack.encode({"pose": [1, 2, 3]}), "is not a pose"),
        (msgspec.msgpack.encode({"pose": {"a": None}}), "is not a pose"),
        (msgspec.msgpack.encode({"values": {"sensor.gain": [[1], 2]}}), "sensor.gain: does not take"),
        (msgspec.msgpack.encode({"values": {"sensor.gain": {"a": 1}}}), "sensor.gain is {'a': 1}"),
        (msgspec.msgpack.encode({"values": {"sensor.gain": msgspec.msgpack.Ext(5, b"x")}}), "sensor.gain is <msgspec"),
        (msgspec.msgpack.encode({"values": {"sensor.gain": {(1, 2): 2}}}), "sensor.gain is {(1, 2)"),
        (msgspec.msgpack.encode({"values": {"background": "/etc/passwd"}}), "names a file of the server's machine"),
        (msgspec.msgpack.encode({"sun": [float("nan"), 0, 0]}), "is nan"),
        (msgspec.msgpack.encode({"frame": "img9"}), "has no frame 'img9'"),
    ],
)
def test_bad_messages_get_a_sentence(server, body, said) -> None:
    client = Client(server)
    client.socket.send(body)
    assert said in msgspec.msgpack.decode(client.socket.recv())["error"]
    assert client.ask(ask="ping") == {"waiting": 0}


def test_a_defect_is_an_answer_too(capsys) -> None:
    server = Server(None, SimpleNamespace(workers=None))  # which has none of what a stage is told from
    assert "the server has a defect" in server.answer(b"client", [], msgspec.msgpack.encode({"ask": "stage"})).error
    assert "Traceback" in capsys.readouterr().err


@pytest.fixture(scope="module")
def server(small_stage, request):
    with served(small_stage) as (at, _):
        yield at


def test_a_client_that_vanishes_or_floods_keeps_nobody_else_waiting(server) -> None:
    gone = Client(server, zmq.DEALER)
    for _ in range(3):
        gone.socket.send_multipart([b"", msgspec.msgpack.encode({"frame": 0})])
    gone.socket.close()
    flood = Client(server, zmq.DEALER)
    for _ in range(FLOOD):
        flood.socket.send_multipart([b"", msgspec.msgpack.encode({"frame": 0})])
    began = time.monotonic()
    other = Client(server)
    assert other.picture(frame=1)[1]["image"].any()
    assert time.monotonic() - began < 30
    answers = [msgspec.msgpack.decode(flood.socket.recv_multipart()[-1]) for _ in range(FLOOD)]
    refused = [each["error"] for each in answers if "error" in each]
    assert 0 < len(refused) <= FLOOD - MAX_WAITING
    assert f"{MAX_WAITING} of your pictures wait already" in refused[0]
    huge = Client(server, zmq.DEALER)
    huge.socket.send_multipart([b"", b"\0" * (2 << 20)])  # the connection is cut
    assert Client(server).ask(ask="ping")["waiting"] >= 0


def test_replies_are_in_the_order_of_requests(server) -> None:
    client = Client(server, zmq.DEALER)
    names = [f"img{number:06d}" for number in range(4)]
    for frame in (3, 1, 2, 0):
        client.socket.send_multipart([b"", msgspec.msgpack.encode({"frame": frame})])
    found = [msgspec.msgpack.decode(client.socket.recv_multipart()[-1])["index"] for _ in names]
    assert found == [3, 1, 2, 0]


def test_clients_take_turns(server) -> None:
    many, few = Client(server, zmq.DEALER), Client(server, zmq.DEALER)
    few.socket.send_multipart([b"", msgspec.msgpack.encode({"ask": "ping"})])
    few.socket.recv_multipart()  # it is connected
    for client, count in ((many, MAX_WAITING), (few, 2)):
        for number in range(count):
            asked = {"pose": approach(number + 0.5 * count), "arrays": ["image", "normals_body", "dense_pose", "nocs"]}
            client.socket.send_multipart([b"%d" % number, b"", msgspec.msgpack.encode(asked)])
    for number in range(2):
        assert few.socket.recv_multipart()[0] == b"%d" % number
    came = 0
    while many.socket.poll(0):
        assert many.socket.recv_multipart()[0] == b"%d" % came
        came += 1
    assert came < MAX_WAITING
    for number in range(came, MAX_WAITING):
        assert many.socket.recv_multipart()[0] == b"%d" % number


def test_requests_that_wait_are_answered_where_the_server_is_stopped(small_stage) -> None:
    with served(small_stage) as (at, process):
        client = Client(at, zmq.DEALER)
        for _ in range(MAX_WAITING):
            client.socket.send_multipart(
                [b"", msgspec.msgpack.encode({"frame": 0, "arrays": ["range", "normals_body"]})]
            )
        client.socket.recv_multipart()
        process.send_signal(signal.SIGTERM)
        answers = [msgspec.msgpack.decode(client.socket.recv_multipart()[-1]) for _ in range(MAX_WAITING - 1)]
        assert answers[-1] == {"error": "the server was stopped"}


def test_an_address_that_is_taken_is_said(server, small_stage, spin_usd, tmp_path) -> None:
    done = spin_usd("serve", small_stage, "--at", server, *RENDERER, code=2)
    assert "is not available" in done.stderr
    for at in ("inproc://x", "tcp://127.0.0.1:99999", "tcp://*:8701x", "8701"):
        assert "is not an address" in spin_usd("serve", small_stage, "--at", at, *RENDERER, code=2).stderr
    (tmp_path / "taken").touch()
    done = spin_usd("serve", small_stage, "--at", f"ipc://{tmp_path}/taken", *RENDERER, code=2)
    assert "exists already" in done.stderr


def test_a_server_removes_the_file_of_its_address(tmp_path) -> None:
    file = tmp_path / "socket"
    with _listening(f"ipc://{file}"):
        assert file.is_socket()
    assert not file.exists()


def test_the_client_in_the_documents_works(server) -> None:
    pytest.importorskip("msgpack")
    client = [sys.executable, REPOSITORY / "docs" / "loop_client.py", server]
    done = subprocess.run(client, capture_output=True, text=True, check=True)
    first, *steps, last = done.stdout.splitlines()
    assert first == "targets: cubesat"
    seen = [int(step.split()[3]) for step in steps]
    assert len(seen) == 20
    assert seen[-1] > 3 * seen[0] > 0
    assert last.endswith("pictures a second")


FLOWN = """
import msgpack, numpy, runpy, sys
images, unpacked = {}, msgpack.unpackb
def unpackb(message):
    reply = unpacked(message)
    array = reply["arrays"]["image"]
    images[reply["frame"]] = numpy.frombuffer(array["data"], array["dtype"]).reshape(array["shape"])
    return reply
msgpack.unpackb = unpackb
script, file, *sys.argv[1:] = sys.argv[1:]
runpy.run_path(script, run_name="__main__")
numpy.savez(file, **images)
"""


@pytest.mark.slow
def test_what_basilisk_saw_is_rendered_again_to_the_byte(small_stage, spin_usd, tmp_path) -> None:
    python = os.environ.get("SPIN_USD_BASILISK")
    if not python:
        pytest.skip("SPIN_USD_BASILISK names no Python that has bsk, msgpack, numpy and pyzmq")
    with served(small_stage, "--log", tmp_path / "log") as (at, _):
        command = [python, "-c", FLOWN, str(REPOSITORY / "docs" / "loop_basilisk.py"), str(tmp_path / "seen.npz"), at]
        done = subprocess.run([*command, "600"], capture_output=True, text=True, check=True)
    print(done.stdout)
    assert float(done.stdout.partition(": ")[2].split()[0]) > 5  # steps a second
    spin_usd("render", tmp_path / "log", "--out", tmp_path / "dataset", *RENDERER, "--labels", "none")
    seen, stored = np.load(tmp_path / "seen.npz"), Dataset(tmp_path / "dataset")
    assert len(seen) == len(stored) == 600
    for picture in stored:
        np.testing.assert_array_equal(seen[picture.frame], picture.image)
