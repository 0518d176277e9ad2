"""A Ray cluster on this machine: a head without processors, and nodes of one processor each.

It reads lines and answers each with one: "add CPU" starts a node that has that processor and says its number, "kill N"
ends that node at once, as a machine does that loses power. It ends, and all that it started, with the end of its input.
"""

import os
import signal
import sys
from contextlib import redirect_stdout, suppress

os.environ["RAY_USAGE_STATS_ENABLED"] = "0"

import psutil
from ray.cluster_utils import Cluster

STORE = 80 << 20  # bytes, the least that Ray takes


def main() -> None:
    with redirect_stdout(sys.stderr):
        head = {"num_cpus": 0, "object_store_memory": STORE, "include_dashboard": False}
        cluster = Cluster(initialize_head=True, head_node_args=head)
    print(cluster.address, flush=True)
    nodes, started = [], set[psutil.Process]()
    for line in sys.stdin:
        match line.split():
            case ["add", cpu]:
                with redirect_stdout(sys.stderr):
                    os.sched_setaffinity(0, [int(cpu)])  # the node inherits it
                    nodes.append(cluster.add_node(num_cpus=1, object_store_memory=STORE))
                print(len(nodes) - 1, flush=True)
            case ["kill", number]:
                started |= set(psutil.Process().children(recursive=True))  # its agents are nobody's from now on
                (raylet,) = nodes[int(number)].all_processes["raylet"]
                os.kill(raylet.process.pid, signal.SIGKILL)
                print(number, flush=True)
    for each in started | set(psutil.Process().children(recursive=True)):
        with suppress(psutil.NoSuchProcess):
            each.kill()
    os._exit(0)  # without Ray's own way out, which may wait for nodes that were killed


if __name__ == "__main__":
    main()
