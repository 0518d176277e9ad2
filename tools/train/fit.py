"""Training: steps from a seed, taken up where an earlier run was stopped, to the same weights."""

import os
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from train.network import HeatmapNetwork

CHECKPOINT = "checkpoint.pt"
DROPS = (0.7, 0.9)  # of all steps; after each the rate is a tenth


@dataclass(frozen=True, kw_only=True)
class Training:
    """steps, each of pictures (batch) · size: of a crop, pixels · layers, width, decoder: of the network · rate: of
    Adam at the start · jitter: whether boxes are a little off · seed: of weights, batches and boxes."""

    steps: int = 1500
    batch: int = 32
    size: int = 128
    layers: int = 18
    width: int = 16
    decoder: int = 64
    rate: float = 1e-3
    jitter: bool = True
    seed: int = 0


class Lesson(Protocol):
    """Pictures, and what a network learns of each."""

    @property
    def outputs(self) -> int:
        """Channels of the network's output."""
        ...

    def __len__(self) -> int: ...

    def example(self, place: int, size: int, rng: np.random.Generator | None) -> tuple[NDArray[np.uint8], NDArray[Any]]:
        """Return a crop (S, S) of a picture, and what the network is to answer, (..., S / 4, S / 4); with `rng` of a
        box that is a little off."""
        ...

    def loss(self, answers: Tensor, wanted: Tensor) -> Tensor:
        """Return how far off the answers (B, C, S / 4, S / 4) are."""
        ...


class Batches(torch.utils.data.Dataset[tuple[NDArray[np.uint8], NDArray[Any]]]):
    """The batch of each step: it depends on the seed and the step alone, not on who makes it."""

    def __init__(self, lesson: Lesson, training: Training) -> None:
        self.lesson, self.training = lesson, training

    def __len__(self) -> int:
        return self.training.steps

    def __getitem__(self, step: int) -> tuple[NDArray[np.uint8], NDArray[Any]]:
        """Return crops (B, S, S) and what is wanted of them, (B, ..., S / 4, S / 4)."""
        training, count = self.training, len(self.lesson)
        rng = np.random.default_rng((training.seed, step))
        chosen = rng.integers(count, size=training.batch).tolist() if training.batch < count else range(count)
        jitter = rng if training.jitter else None
        crops, wanted = zip(*(self.lesson.example(place, training.size, jitter) for place in chosen), strict=True)
        return np.stack(crops), np.stack(wanted)


@dataclass(kw_only=True)
class Fit:
    """What a run has come to: the network, its losses by step, and the processor seconds that it has taken, without
    those of processes that make batches."""

    network: HeatmapNetwork
    losses: list[float]
    cpu_s: float


def fit(lesson: Lesson, training: Training, folder: Path, *, device: str, loaders: int, save_every_s: float) -> Fit:
    """Train a network on the lesson, with its checkpoint in the folder, written every so many seconds. loaders:
    processes that make batches."""
    network, optimiser = learner(lesson.outputs, training, device)
    found = Fit(network=network, losses=[], cpu_s=0.0)
    file = folder / CHECKPOINT
    if file.is_file():
        _take_up(torch.load(file, map_location=device, weights_only=True), training, found, optimiser, file)
    done = len(found.losses)
    start, begun, said = time.process_time() - found.cpu_s, time.monotonic(), time.monotonic()
    loader: Any = torch.utils.data.DataLoader(
        Batches(lesson, training), batch_size=None, sampler=range(done, training.steps), num_workers=loaders
    )
    for crops, wanted in loader:
        for group in optimiser.param_groups:
            group["lr"] = training.rate * 0.1 ** sum(len(found.losses) >= drop * training.steps for drop in DROPS)
        found.losses.append(step(network, optimiser, lesson, crops, wanted, device=device))
        if time.monotonic() - said > save_every_s:
            said, found.cpu_s = time.monotonic(), time.process_time() - start
            _save(file, training, found, optimiser)
            at = len(found.losses)
            left = (said - begun) / (at - done) * (training.steps - at)
            recent = float(np.mean(found.losses[-50:]))
            print(f"training: step {at} of {training.steps}, loss {recent:.6f}, {left:.0f} s left", flush=True)
    found.cpu_s = time.process_time() - start
    if done < training.steps:
        _save(file, training, found, optimiser)
    return found


def learner(outputs: int, training: Training, device: str) -> tuple[HeatmapNetwork, torch.optim.Adam]:
    """Return the network that the seed begins with, of so many outputs, and what makes its weights better."""
    torch.manual_seed(training.seed)
    torch.use_deterministic_algorithms(True)
    sizes = {"layers": training.layers, "width": training.width, "decoder": training.decoder}
    network = HeatmapNetwork(outputs, **sizes).to(device)
    network.train()
    return network, torch.optim.Adam(network.parameters(), lr=training.rate)


def step(
    network: HeatmapNetwork,
    optimiser: torch.optim.Adam,
    lesson: Lesson,
    crops: Tensor,
    wanted: Tensor,
    *,
    device: str,
) -> float:
    """Learn from a batch, and return its loss before that."""
    loss = lesson.loss(network(as_input(crops, device)), wanted.to(device))
    optimiser.zero_grad(set_to_none=True)
    loss.backward()
    optimiser.step()
    return float(loss.item())


def as_input(crops: Tensor, device: str) -> Tensor:
    """Return crops (B, S, S) uint8 as the network takes them: (B, 1, S, S), -1 to 1."""
    return crops.to(device)[:, None].float() / 127.5 - 1


def predicted(
    network: HeatmapNetwork, crops: Sequence[NDArray[np.uint8]], device: str, batch: int = 64
) -> NDArray[np.float32]:
    """Return the answers (N, C, S / 4, S / 4) to crops."""
    network.eval()
    with torch.inference_mode():
        found = [
            network(as_input(torch.from_numpy(np.stack(crops[at : at + batch])), device)).cpu().numpy()
            for at in range(0, len(crops), batch)
        ]
    return np.concatenate(found)


def _take_up(kept: dict[str, Any], training: Training, found: Fit, optimiser: torch.optim.Adam, file: Path) -> None:
    if kept["training"] != asdict(training):
        raise SystemExit(f"{file} is of other settings; give another --out, or remove it")
    found.network.load_state_dict(kept["network"])
    optimiser.load_state_dict(kept["optimiser"])
    found.losses, found.cpu_s = list(kept["losses"]), kept["cpu_s"]


def _save(file: Path, training: Training, found: Fit, optimiser: torch.optim.Adam) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    kept = {
        "training": asdict(training),
        "network": found.network.state_dict(),
        "optimiser": optimiser.state_dict(),
        "losses": found.losses,
        "cpu_s": found.cpu_s,
    }
    new = file.with_suffix(".new")
    torch.save(kept, new)
    os.replace(new, file)  # so that a kill leaves the one before
