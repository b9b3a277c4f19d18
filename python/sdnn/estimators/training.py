"""The loop over epochs: order of samples, early stopping, progress."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sdnn.estimators.network import Network

__all__ = ["History", "Trainer", "run_epochs"]


class Trainer(Protocol):
    """What the core's trainers have in common."""

    @property
    def form(self) -> str:
        """The form of training."""

    @property
    def memory(self) -> int:
        """Bytes beside the layer."""

    def present(self, order: NDArray[np.int32]) -> tuple[int, int]:
        """Present samples in that order; returns how many samples and units were corrected."""

    def synchronize(self) -> None:
        """Bring the layer's weights up to date."""


@dataclasses.dataclass
class History:
    """What happened in each epoch.

    Attributes
    ----------
    n_corrected : list of int
        Samples that were corrected.
    scores : list of float
        Validation scores; empty without early stopping.
    """

    n_corrected: list[int] = dataclasses.field(default_factory=list)
    scores: list[float] = dataclasses.field(default_factory=list)


@contextmanager
def progress_bar(verbose: int, n_epochs: int) -> Iterator[Callable[[int], None]]:
    """Yield what to call after each epoch with the number of corrected samples."""
    if not verbose:
        yield lambda n_corrected: None
        return
    from rich.progress import MofNCompleteColumn, Progress

    with Progress(*Progress.get_default_columns(), MofNCompleteColumn()) as progress:
        task = progress.add_task("training", total=n_epochs)

        def _advance(n_corrected: int) -> None:
            progress.update(task, advance=1, description=f"training, {n_corrected} corrected")

        yield _advance


def run_epochs(
    network: Network,
    trainer: Trainer,
    n_samples: int,
    *,
    max_iter: int,
    random: np.random.RandomState | None = None,
    score: Callable[[], float] | None = None,
    n_iter_no_change: int = 10,
    verbose: int = 0,
) -> History:
    """Train until nothing is corrected, nothing improves, or ``max_iter`` epochs are over.

    Parameters
    ----------
    network : Network
        What is trained; at the end it has the last weights, or with ``score`` the best ones.
    trainer : Trainer
        Of the network's layer.
    n_samples : int
        Size of the training sample.
    max_iter : int
        Largest number of epochs.
    random : RandomState, optional
        Draws a new order for every epoch; without it the order is that of the sample.
    score : callable, optional
        Validation score of the network as it is; larger is better.
    n_iter_no_change : int
        Epochs without a better score after which training stops.
    verbose : int
        Whether to show a progress bar.
    """
    history = History()
    in_order = np.arange(n_samples, dtype=np.int32)
    best: tuple[NDArray[np.int32], NDArray[np.int32]] | None = None
    best_score, best_epoch = -np.inf, 0
    with progress_bar(verbose, max_iter) as advance:
        for epoch in range(max_iter):
            order = in_order if random is None else random.permutation(in_order)
            n_corrected, _ = trainer.present(order)
            history.n_corrected.append(n_corrected)
            advance(n_corrected)
            if score is not None:
                trainer.synchronize()
                history.scores.append(score())
                if best is None or history.scores[-1] > best_score:
                    best_score, best_epoch = history.scores[-1], epoch
                    best = network.weights, network.thresholds
                elif epoch - best_epoch >= n_iter_no_change:
                    break
            if n_corrected == 0:
                break
    trainer.synchronize()
    if best is not None:
        network.restore(*best)
    return history
