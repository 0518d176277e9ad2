"""A rendezvous by Basilisk whose camera is `spin-usd serve`: what is seen steers the chaser, five times a second.

python docs/loop_basilisk.py [ADDRESS] [STEPS], with bsk, msgpack, numpy and pyzmq installed; spin_usd is not needed
there. The target is found as the bright pixels' middle, and its range by how many there are: no filter, no network. The
camera turns to where it is seen, and the chaser comes nearer at a steady rate.
"""

import sys
import time

import msgpack
import numpy as np
import zmq
from Basilisk.simulation import extForceTorque, spacecraft
from Basilisk.utilities import SimulationBaseClass, macros, simIncludeGravBody

STEP_S, MASS = 0.2, 500.0  # kg
START, AWAY = 12.0, 6.0  # metres along the orbit, where it begins and where it stays
SUN = np.array([0.3, -0.9, 0.3]) / np.linalg.norm([0.3, -0.9, 0.3])  # in inertial axes
SEEN = 30  # of 255, above which a pixel counts
GAIN, DAMPING = 0.02, 0.3  # of the approach: 1/s^2, 1/s


class Camera:
    """What `spin-usd serve` shows."""

    def __init__(self, address: str) -> None:
        self.socket = zmq.Context().socket(zmq.REQ)
        self.socket.connect(address)
        self.taken: list[float] = []

    def image(self, T_cam_body: np.ndarray, sun: np.ndarray, seconds: float) -> tuple[np.ndarray, dict]:
        """Return the image (H, W) and the camera."""
        began = time.perf_counter()
        asked = {"pose": T_cam_body.tolist(), "sun": sun.tolist(), "time": seconds}
        self.socket.send(msgpack.packb(asked))
        reply = msgpack.unpackb(self.socket.recv())
        if "error" in reply:
            raise SystemExit(reply["error"])
        array = reply["arrays"]["image"]
        self.taken.append(1000 * (time.perf_counter() - began))
        return np.frombuffer(array["data"], array["dtype"]).reshape(array["shape"]), reply["camera"]


def craft(simulation, task: str, name: str, gravity, place: np.ndarray, velocity: np.ndarray):
    """Return a spacecraft in orbit, and what pushes it."""
    made, push = spacecraft.Spacecraft(), extForceTorque.ExtForceTorque()
    made.ModelTag, made.hub.mHub = name, MASS
    made.hub.r_CN_NInit, made.hub.v_CN_NInit = place, velocity
    gravity.addBodiesTo(made)
    push.extForce_N = [[0.0], [0.0], [0.0]]
    made.addDynamicEffector(push)
    for model in (push, made):
        simulation.AddModelToTask(task, model)
    return made, push


def looking(along: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) from inertial axes to those of a camera that looks `along`: x right, y down."""
    z = along / np.linalg.norm(along)
    x = np.cross(-up, z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def main() -> None:
    camera = Camera(sys.argv[1] if len(sys.argv) > 1 else "tcp://127.0.0.1:8644")
    steps = int(sys.argv[2]) if len(sys.argv) > 2 else 600
    simulation = SimulationBaseClass.SimBaseClass()
    simulation.CreateNewProcess("dynamics").addTask(simulation.CreateNewTask("task", macros.sec2nano(0.05)))
    gravity = simIncludeGravBody.gravBodyFactory()
    earth = gravity.createEarth()
    earth.isCentralBody = True
    place = np.array([7.0e6, 0, 0])
    velocity = np.array([0, np.sqrt(earth.mu / 7.0e6), 0])
    target, _ = craft(simulation, "task", "target", gravity, place, velocity)
    behind = START / 7.0e6  # radians along the orbit
    back = np.array([[np.cos(behind), np.sin(behind), 0], [-np.sin(behind), np.cos(behind), 0], [0, 0, 1]])
    chaser, push = craft(simulation, "task", "chaser", gravity, back @ place, back @ velocity)
    simulation.InitializeSimulation()

    aim = velocity / np.linalg.norm(velocity) + np.array([0.03, 0, 0.02])  # a first guess, two degrees off
    before, ranges, off = START, [], []
    began = time.perf_counter()
    for step in range(steps):
        seconds = STEP_S * (step + 1)
        simulation.ConfigureStopTime(macros.sec2nano(seconds))
        simulation.ExecuteSimulation()
        own, other = chaser.scStateOutMsg.read(), target.scStateOutMsg.read()
        true = np.array(other.r_BN_N) - np.array(own.r_BN_N)
        R_cam_world = looking(aim, np.array(own.r_BN_N))
        T_cam_body = np.eye(4)
        spin = 0.01 * seconds
        turn = [[np.cos(spin), -np.sin(spin), 0], [np.sin(spin), np.cos(spin), 0], [0, 0, 1]]
        T_cam_body[:3, :3], T_cam_body[:3, 3] = R_cam_world @ turn, R_cam_world @ true
        image, lens = camera.image(T_cam_body, R_cam_world @ SUN, seconds)

        rows, columns = np.nonzero(image > SEEN)
        if not len(rows):
            raise SystemExit(f"the target was lost after {seconds:.1f} s, {np.linalg.norm(true):.1f} m away")
        uv = np.array([columns.mean(), rows.mean()]) + 0.5
        ray = np.append((uv - (lens["cx"], lens["cy"])) / (lens["fx"], lens["fy"]), 1.0)
        aim = R_cam_world.T @ ray
        seen = lens["fx"] * 0.6 / np.sqrt(len(rows))  # of a body some 0.6 m wide, lit from one side
        rate, before = (seen - before) / STEP_S if step else 0.0, seen
        force = MASS * (GAIN * (seen - AWAY) + DAMPING * np.clip(rate, -0.2, 0.2))
        push.extForce_N = [[value] for value in (np.clip(force, -20, 20) * aim / np.linalg.norm(aim)).tolist()]
        ranges.append(float(np.linalg.norm(true)))
        off.append(float(np.degrees(np.arccos(np.clip(aim @ true / np.linalg.norm(aim) / ranges[-1], -1, 1)))))
    spent = time.perf_counter() - began
    print(f"{steps} steps in {spent:.1f} s: {steps / spent:.1f} a second")
    print(f"range {ranges[0]:.2f} to {ranges[-1]:.2f} m; aim off by {off[0]:.2f}, at the end {off[-1]:.2f} degrees")
    shares = np.percentile(camera.taken, (50, 90, 99, 100))
    print("latency, ms: median {:.1f}, 90 % {:.1f}, 99 % {:.1f}, longest {:.1f}".format(*shares))


if __name__ == "__main__":
    main()
