"""A Ray cluster on this machine: a head without processors, and nodes of one processor each.

It reads lines and answers each with one: "add" starts a node and says its number, "kill N" ends that node at once, as a
machine does that loses power. It ends, and all that it started, with the end of its input. All nodes share one
processor, and nothing depends on what else the machine does: where it fails it says why on standard error.
"""

import os
import shutil
import signal
import sys
import tempfile
from contextlib import redirect_stdout, suppress
from pathlib import Path

import psutil

# Sockets have paths of at most 107 bytes, so TMPDIR may be too long; /tmp/ray may be another user's.
FOLDER = Path(tempfile.mkdtemp(prefix="ray.", dir="/tmp"))
PATIENCE_S = 240  # for what Ray waits for, 30 s mostly: a machine may be busy, and read Ray from a cold disk
ENVIRONMENT = {
    "RAY_TMPDIR": str(FOLDER),
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_gcs_server_port_wait_time_s": str(PATIENCE_S),
    "RAY_raylet_start_wait_time_s": str(PATIENCE_S),
    "RAY_agent_register_timeout_ms": str(PATIENCE_S * 1000),
    "RAY_memory_monitor_refresh_ms": "0",  # it would end workers where others fill the memory
}

NODE = {
    "object_store_memory": 80 << 20,  # bytes, the least that Ray takes
    "memory": 2 << 30,  # bytes, instead of what is free now
}
LAST_LINES = 20


def main() -> None:
    os.environ |= ENVIRONMENT
    try:
        hold()
    except BaseException:
        tell_logs()
        raise
    finally:
        shutil.rmtree(FOLDER, ignore_errors=True)
    os._exit(0)  # without Ray's own way out, which may wait for nodes that were killed


def hold() -> None:
    """Hold the cluster until the input ends."""
    os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])  # the nodes inherit it
    from ray.cluster_utils import Cluster  # which reads the environment

    cluster = Cluster()
    with redirect_stdout(sys.stderr):
        cluster.add_node(num_cpus=0, include_dashboard=False, wait=False, **NODE)
    print(cluster.address, flush=True)
    nodes, started = [], set[psutil.Process]()
    for line in sys.stdin:
        match line.split():
            case ["add"]:
                with redirect_stdout(sys.stderr):
                    nodes.append(cluster.add_node(num_cpus=1, wait=False, **NODE))
                print(len(nodes) - 1, flush=True)
            case ["kill", number]:
                started |= set(psutil.Process().children(recursive=True))  # its agents are nobody's from now on
                (raylet,) = nodes[int(number)].all_processes["raylet"]
                os.kill(raylet.process.pid, signal.SIGKILL)
                print(number, flush=True)
    for each in started | set(psutil.Process().children(recursive=True)):
        with suppress(psutil.NoSuchProcess):
            each.kill()


def tell_logs() -> None:
    """Print the ends of what Ray's own processes logged."""
    for log in sorted(FOLDER.glob("ray/session_2*/logs/*.*")):
        if log.is_file() and (lines := log.read_text(errors="replace").splitlines()):
            print(f"--- {log.name}", *lines[-LAST_LINES:], sep="\n", file=sys.stderr)


if __name__ == "__main__":
    main()
