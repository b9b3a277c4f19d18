"""The measurements behind ``sdnn bench``.

Other programs disturb every measurement. So everything is repeated often and briefly, things that
are compared take turns, and medians are taken. The loops are in C++; here are nanoseconds per
repetition only.

Results are values that JSON can hold. Times are in microseconds unless named otherwise; a spread
has the quartiles of repetitions as ``lower``, ``median`` and ``upper``.
"""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import date
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.support import machine
from sdnn.support.interrupts import thread_pool

Nanoseconds: TypeAlias = NDArray[np.int64]
Run: TypeAlias = Callable[[int], Nanoseconds]
"""A function that makes n repetitions and returns the time of each, shape (n,)."""

SEED = 1
NETWORK_INPUTS = (4, 6)  # numbers of inputs of the paper's smallest and largest network
CASES = ((4, 0.0), (4, 0.02), (6, 0.02))  # inputs and noise of trials whose decisions are timed
THREADS_CASE = (6, 0.02)
N_THREADS = 2
N_CORRECTED = 5
"""Units corrected by the learning steps that are timed: the mean over those that correct any."""
SELECTIONS_PER_REPETITION = 100
N_COLD = 2  # first repetitions of a turn, which refill the caches after other measurements


@dataclass(frozen=True)
class Effort:
    """Number and length of measurements."""

    n_rounds: int = 30  # turns of each measurement that is compared
    n_repetitions: int = 10  # per turn, after N_COLD more that are not counted
    n_episodes: int = 300  # learning episodes of a short trial
    n_runs: int = 7  # repetitions of the same trial


QUICK = Effort(n_rounds=3, n_repetitions=2, n_episodes=10, n_runs=2)


def run_benchmarks(*, quick: bool = False) -> dict[str, object]:
    """Measure everything, about half a minute, and return what ``sdnn bench --json`` prints.

    With `quick` there are few repetitions, as a check that it works.
    """
    effort = QUICK if quick else Effort()
    return {
        "sdnn": _core.__version__,
        "date": date.today().isoformat(),
        "quick": quick,
        "machine": describe_machine(),
        "instruction_set": machine.instruction_set(),
        "best_instruction_set": machine.available_instruction_sets()[-1],
        "instruction_sets": list(machine.available_instruction_sets()),
        "networks": [measure_network(n_inputs, effort) for n_inputs in NETWORK_INPUTS],
        "acrobot": measure_acrobot(effort),
        "decisions": [measure_decisions(*case, effort) for case in CASES],
        "threads": measure_threads(*THREADS_CASE, effort),
    }


def describe_machine() -> dict[str, object]:
    """Describe this machine; ``n_cores`` are those that this process may use."""
    return {
        "processor": machine.processor(),
        "system": f"{platform.system()} {platform.machine()}",
        "n_cores": machine.n_cores(),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def in_turns(runs: Mapping[str, Run], effort: Effort) -> dict[str, Nanoseconds]:
    """Interleave the measurements in turns; return their times, (n_rounds * n_repetitions,) each.

    The first repetitions of a turn find cold caches and are dropped.
    """
    times: dict[str, list[Nanoseconds]] = {name: [] for name in runs}
    for _ in range(effort.n_rounds):
        for name, run in runs.items():
            times[name].append(run(N_COLD + effort.n_repetitions)[N_COLD:])
    return {name: np.concatenate(turns) for name, turns in times.items()}


def spread(times: Nanoseconds, n_parts: int = 1) -> dict[str, float]:
    """Return the quartiles, in microseconds, of repetitions of `n_parts` equal parts each.

    >>> spread(np.array([1000, 2000, 3000, 4000, 5000]))
    {'lower': 2.0, 'median': 3.0, 'upper': 4.0}
    """
    quartiles = np.percentile(times, (25, 50, 75)) / (1000.0 * n_parts)
    return dict(zip(("lower", "median", "upper"), map(float, quartiles), strict=True))


def measure_network(n_inputs: int, effort: Effort) -> dict[str, object]:
    """Time the parts of a network that has learned a little.

    Spreads are those of ``values`` (all action values of a new state, by instruction set),
    ``remembered_values`` (of the same state again), ``correction`` (a learning step of a state just
    asked about) and ``selection`` (of its units).
    """
    parts = network_parts(n_inputs, effort)
    config = _core.SDNNCConfig(n_inputs=n_inputs)
    levels = machine.available_instruction_sets()
    runs: dict[str, Run] = {
        **{level: at_level(level, parts.time_values) for level in levels},
        "remembered_values": parts.time_remembered_values,
        "selection": lambda n: parts.time_selections(n, SELECTIONS_PER_REPETITION, N_CORRECTED),
    }
    times = in_turns(runs, effort)
    # Corrections come last, because they change the weights.
    corrected = in_turns({"": lambda n: parts.time_corrections(n, N_CORRECTED)}, effort)
    return {
        "n_inputs": n_inputs,
        "n_hidden_units": config.n_hidden_units,
        "n_columns": config.n_pattern_units * n_inputs * (n_inputs - 1),
        "n_actions": config.n_hidden_units - config.n_active_units + 1,
        "n_episodes": effort.n_episodes,
        "values": {level: spread(times[level]) for level in levels},
        "remembered_values": spread(times["remembered_values"]),
        "correction": spread(corrected[""]),
        "n_corrected": N_CORRECTED,
        "selection": spread(times["selection"], SELECTIONS_PER_REPETITION),
    }


def network_parts(n_inputs: int, effort: Effort) -> _core.NetworkParts:
    """Return the parts of a network that has learned in a short trial."""
    trial = _short_trial(n_inputs, 0.0, effort.n_episodes)
    trial.advance(effort.n_episodes)
    return _core.NetworkParts(trial.agent.networks[0], SEED)


def measure_acrobot(effort: Effort) -> dict[str, object]:
    """Time the acrobot without an agent: microseconds a decision, nanoseconds a step in it."""
    acrobot = _core.AcrobotDecisions(_core.AcrobotConfig(), SEED)
    times = spread(in_turns({"acrobot": acrobot.run}, effort)["acrobot"])
    n_steps = acrobot.n_integration_steps
    return {
        "decision": times,
        "n_integration_steps": n_steps,
        "integration_step_ns": 1000.0 * times["median"] / n_steps,
    }


def measure_decisions(n_inputs: int, noise: float, effort: Effort) -> dict[str, object]:
    """Time whole decisions of a short trial: acting, the acrobot, its sensors, learning.

    A trial makes the same decisions whenever it is run; the time of a decision is its median over
    the runs, so that what else the machine did shows little. ``max_of_all_runs`` is the longest
    single decision of any run.
    """
    runs = [
        _core.time_decisions(_short_trial(n_inputs, noise, effort.n_episodes), effort.n_episodes)
        for _ in range(effort.n_runs)
    ]
    all_times = np.stack(runs) / 1000.0
    times = np.median(all_times, axis=0)
    p50, p99, longest = (float(q) for q in np.percentile(times, (50, 99, 100)))
    return {
        "n_inputs": n_inputs,
        "noise": noise,
        "n_episodes": effort.n_episodes,
        "n_decisions": int(times.size),
        "n_runs": effort.n_runs,
        "mean": float(times.mean()),
        "p50": p50,
        "p99": p99,
        "max": longest,
        "max_over_p50": longest / p50,
        "max_of_all_runs": float(all_times.max()),
    }


def measure_threads(n_inputs: int, noise: float, effort: Effort) -> dict[str, object]:
    """Time equal trials alone and at once, in turns; the quickest of the runs.

    Wall-clock times depend on the cores that are free; the processor's time per trial shows
    whether trials are in each other's way.
    """

    def advance(trial: _core.AcrobotTrial) -> float:
        """Run a trial to its end; return its processor time."""
        begin = time.thread_time()
        trial.advance(effort.n_episodes)
        return time.thread_time() - begin

    def seconds(n_threads: int) -> tuple[float, float]:
        """Return the wall time of one trial per thread, and the mean processor time of a trial."""
        trials = [_short_trial(n_inputs, noise, effort.n_episodes) for _ in range(n_threads)]
        with thread_pool(n_threads) as pool:
            begin = time.perf_counter()
            processor = list(pool.map(advance, trials))
            return time.perf_counter() - begin, sum(processor) / n_threads

    runs = np.array([[*seconds(1), *seconds(N_THREADS)] for _ in range(effort.n_runs)])
    alone, processor_alone, together, processor_together = (float(least) for least in runs.min(0))
    return {
        "n_inputs": n_inputs,
        "noise": noise,
        "n_episodes": effort.n_episodes,
        "n_threads": N_THREADS,
        "alone_s": alone,
        "together_s": together,
        "speedup": N_THREADS * alone / together,
        "processor_alone_s": processor_alone,
        "processor_together_s": processor_together,
    }


def _short_trial(n_inputs: int, noise: float, n_episodes: int) -> _core.AcrobotTrial:
    """Make a trial of learning episodes only: its test episodes would not learn."""
    return _core.AcrobotTrial(
        approximator=_core.SDNNCConfig(n_inputs=n_inputs),
        learning=_core.QLearningConfig(),
        acrobot=_core.AcrobotConfig(),
        goal=_core.GoalScheduleConfig(),
        sensors=_core.SensorConfig(n_sensors=n_inputs, noise=noise),
        protocol=_core.ProtocolConfig(episodes=n_episodes, evaluate_every_episodes=n_episodes + 1),
        seed=SEED,
    )


def at_level(level: str, run: Run) -> Run:
    """Return a run that is measured with another instruction set."""

    def _run(n: int) -> Nanoseconds:
        """Call `run` under the instruction set `level`, then restore the previous one."""
        before = machine.instruction_set()
        machine.set_instruction_set(level)
        try:
            return run(n)
        finally:
            machine.set_instruction_set(before)

    return _run
