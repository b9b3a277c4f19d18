"""What the engine asks of a trial, and the trial computed in C++."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from numpy.typing import NDArray

if TYPE_CHECKING:
    from sdnn.experiments.config import TrialConfig


class Trial(Protocol):
    """One trial that can be advanced in pieces; the pieces' sizes do not change its outcome."""

    @property
    def episode(self) -> int:
        """Learning episodes done."""

    @property
    def finished(self) -> bool:
        """Whether all learning episodes are done."""

    @property
    def n_decisions(self) -> int:
        """Decisions made so far, in learning and test episodes."""

    def advance(self, n: int, /) -> None:
        """Run up to `n` more learning episodes and the test episodes due among them."""

    def test_rows(self) -> dict[str, NDArray[Any]]:
        """Test episodes so far: arrays `episode`, `steps`, `episode_return`, `solved`, (n,)."""


MakeTrial: TypeAlias = "Callable[[TrialConfig, int], Trial]"
"""Makes a trial from its configuration and seed."""


def make_core_trial(config: TrialConfig, seed: int) -> Trial:
    """Make the trial that runs in C++ and releases the GIL while it advances.

    Raises
    ------
    ValueError
        If a value of the configuration is out of its range.
    """
    from sdnn import _core

    kind = {
        "sdnn-c": _core.AcrobotTrial,
        "fql": _core.FuzzyAcrobotTrial,
        "rbfn": _core.RBFAcrobotTrial,
    }[config.agent]
    trial: Trial = kind(
        approximator=config.approximator.to_core(),
        learning=config.learning.to_core(),
        acrobot=config.acrobot.to_core(),
        goal=config.goal.to_core(),
        sensors=config.sensors.to_core(),
        protocol=config.protocol.to_core(),
        seed=seed,
    )
    return trial
