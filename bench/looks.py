"""Looks at a learner while it learns: greedy episodes, kept out of its processor time."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

from sdnn.agents import Callback, Training, evaluate
from sdnn.runs import RunSpec
from sdnn.runs.trial import training_of

N_LOOKS, N_EPISODES = 20, 20
N_LAST_EPISODES = 100
N_FIRST_EPISODES = 10


class Looks(Callback):
    """Looks after given numbers of steps; a subclass says what it looks at.

    Parameters
    ----------
    spec
        What is learned.
    due
        The numbers of steps, ascending.
    """

    def __init__(self, spec: RunSpec, due: Iterable[int]) -> None:
        self._spec, self._due = spec, list(due)
        self._env = spec.make_env("evaluation_sensor_noise")
        self.found: dict[str, Any] = {}
        self._began = time.process_time()

    def on_step(self, training: Training) -> None:
        """Look where it is due; the clock stands still meanwhile."""
        if not self._due or training.n_steps < self._due[0]:
            return
        paused = time.process_time()
        while self._due and training.n_steps >= self._due[0]:
            self._due.pop(0)
        self.look(training, round(paused - self._began, 2))
        self._began += time.process_time() - paused

    def look(self, training: Training, seconds: float) -> None:
        """Look at it after so many seconds of its processor time."""
        raise NotImplementedError

    def mean_return(self, training: Training, episodes: int) -> float:
        """Play greedy episodes, always the same."""
        found = evaluate(training.agent, self._env, episodes, seed=self._spec.seed)
        return round(found.mean_return, 2)

    def learn(self) -> dict[str, Any]:
        """Learn under these eyes; return what they found."""
        training_of(self._spec, self._spec.make_training_env(), None, [self]).run()
        return self.found


class Curve(Looks):
    """Looks at equal distances: returns and seconds until then, and the bytes kept at the end."""

    def __init__(self, spec: RunSpec) -> None:
        steps = spec.length
        super().__init__(spec, [steps * (i + 1) // N_LOOKS for i in range(N_LOOKS)])
        self.found = {"steps": [], "cpu_seconds": [], "mean_return": []}

    def look(self, training: Training, seconds: float) -> None:
        """Note one."""
        n_episodes = N_EPISODES if self._due else N_LAST_EPISODES
        self.found["steps"].append(training.n_steps)
        self.found["cpu_seconds"].append(seconds)
        self.found["mean_return"].append(self.mean_return(training, n_episodes))
        if not self._due:
            self.found["bytes"] = n_bytes(training.agent)


def n_bytes(agent: Any) -> int:
    """Tell what is kept in order to learn on."""
    if hasattr(agent, "n_bytes"):
        return int(agent.n_bytes)
    return sum(array.nbytes for array in agent.state().values())


class UntilSolved(Looks):
    """Looks every so many steps, until 100 greedy episodes have a mean return that solves the task.

    Ten episodes tell whether the hundred are worth playing. The last look is what is found.
    """

    def __init__(self, spec: RunSpec, interval: int, solved: float) -> None:
        super().__init__(spec, range(interval, spec.length + 1, interval))
        self._solved = solved

    def look(self, training: Training, seconds: float) -> None:
        """Note one, and stop where it is solved."""
        mean = self.mean_return(training, N_FIRST_EPISODES)
        if mean >= self._solved:
            mean = self.mean_return(training, N_LAST_EPISODES)
        is_solved = mean >= self._solved
        self.found = {
            "steps": training.n_steps,
            "cpu_seconds": seconds,
            "mean_return": mean,
            "solved": int(is_solved),
        }
        if is_solved:
            training.stop()
