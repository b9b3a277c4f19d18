"""How long a step of an agent takes, for the experiment on the number of inputs."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from gymnasium.spaces import Box

from sdnn import _core
from sdnn.agents import FuzzyQLearning, QLearningConfig, RBFQLearning, SDNNQLearning
from sdnn.approximators import FuzzyRulesConfig, RBFNetworkConfig
from sdnn.experiments.cost import StepTimes

if TYPE_CHECKING:
    from sdnn.experiments.cost import CostConfig, Series

SEED = 1
TimedAgent: TypeAlias = (
    "_core.SDNNQLearning | _core.FuzzyQLearning | _core.RBFQLearning | _core.PlainRBFQLearning"
)

LARGEST_TABLE = 2**32
"""Bytes of the largest table that is tried: FQL with 8 inputs has 3.6 GB, nearly all untouched."""

_BYTES_OF_FLOAT, _BYTES_OF_DOUBLE = 4, 8


def measure_steps(series: Series, n_inputs: int, config: CostConfig) -> StepTimes | None:
    """Measure a step of an agent of the paper's sizes: acting in a new state and learning.

    Parameters
    ----------
    series : Series
        Which agent, evaluated how.
    n_inputs : int
        Number of inputs d.
    config : CostConfig
        How thoroughly.

    Returns
    -------
    StepTimes or None
        None where there is no memory for the agent.

    Raises
    ------
    ValueError
        If the series is unknown.
    """
    try:
        agent, table_bytes = _make(series.id, n_inputs)
    except MemoryError:
        return None
    step_seconds = float(_core.time_agent_steps(agent, 1, SEED)[0]) / 1e9
    in_a_round = int(config.round_seconds / step_seconds)
    n_learned = min(config.n_learned, in_a_round)
    learning = _core.time_agent_steps(agent, n_learned, SEED + 1)
    if n_learned:
        in_a_round = int(config.round_seconds * 1e9 / float(np.median(learning)))
    n_steps = max(config.min_steps, in_a_round)
    medians = [
        float(np.median(_core.time_agent_steps(agent, n_steps, SEED + 2 + number))) / 1e3
        for number in range(config.n_rounds)
    ]
    return StepTimes(
        microseconds=np.array(medians, np.float64), n_steps=n_steps, table_bytes=table_bytes
    )


def _make(series_id: str, n_inputs: int) -> tuple[TimedAgent, int]:
    """Make the agent of a series; returns it and the bytes of its weights or values."""
    states = Box(0.0, 1.0, (n_inputs,), np.float64)
    actions = Box(-1.0, 1.0, (1,), np.float64)
    if series_id == "sdnn-c":
        sdnn = SDNNQLearning(states, actions, seed=SEED)
        n_columns = sdnn.approximator.n_pattern_units * n_inputs * (n_inputs - 1)
        return sdnn.core, n_columns * sdnn.approximator.n_hidden_units
    if series_id == "fql":
        rules = FuzzyRulesConfig(max_table_bytes=LARGEST_TABLE)
        fuzzy = FuzzyQLearning(states, actions, approximator=rules, seed=SEED)
        return fuzzy.core, fuzzy.n_rules * rules.n_actions * _BYTES_OF_FLOAT
    network = RBFNetworkConfig(n_inputs=n_inputs)
    table_bytes = network.n_bases ** (n_inputs + 1) * _BYTES_OF_DOUBLE
    if series_id == "rbfn":
        return RBFQLearning(states, actions, approximator=network, seed=SEED).core, table_bytes
    if series_id == "rbfn-plain":
        plain = _core.PlainRBFQLearning(
            approximator=network.to_core(), learning=QLearningConfig().to_core(), seed=SEED
        )
        return plain, table_bytes
    raise ValueError(f"series must be one of the experiment's, got {series_id!r}")
