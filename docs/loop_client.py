"""A client of `spin-usd serve` without spin_usd: it approaches the target, and counts the pixels that show it.

python docs/loop_client.py [ADDRESS], with msgpack, numpy and pyzmq installed.
"""

import math
import sys
import time

import msgpack
import numpy as np
import zmq

socket = zmq.Context().socket(zmq.REQ)
socket.connect(sys.argv[1] if len(sys.argv) > 1 else "tcp://127.0.0.1:8644")


def ask(**asked):
    """Send a request, and return the reply; its arrays are numpy's."""
    socket.send(msgpack.packb(asked))
    reply = msgpack.unpackb(socket.recv())
    if "error" in reply:
        raise SystemExit(reply["error"])
    for kind, array in reply.get("arrays", {}).items():
        reply["arrays"][kind] = np.frombuffer(array["data"], array["dtype"]).reshape(array["shape"])
    return reply


print("targets:", *ask(ask="stage")["targets"])
began = time.perf_counter()
for step in range(20):
    half = 0.02 * step
    q, t = [math.cos(half), 0.0, math.sin(half), 0.0], [0.0, 0.0, 8.0 - 0.2 * step]  # T_cam_body, metres
    reply = ask(pose=[q, t], sun=[0.3, -0.5, -0.8], time=0.2 * step, arrays=["image", "segmentation"])
    seen = np.count_nonzero(reply["arrays"]["segmentation"])
    print(f"{reply['frame']}: {t[2]:.1f} m, {seen} pixels, mean {reply['arrays']['image'].mean():.1f}")
print(f"{20 / (time.perf_counter() - began):.1f} pictures a second")
