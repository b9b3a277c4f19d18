"""The first steps of an agent that does not know the ranges of its observations yet."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["MOST_ENVIRONMENTS", "WarmUp"]

MOST_ENVIRONMENTS = 2**14
"""In which an agent can learn at once, as in `agents/episodes.hpp`."""

Step: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64], float, NDArray[np.float64], bool]
"""Observation, action, reward, next observation, terminated."""

_STREAM = 2**32
_EVALUATION_STREAM = 2**32 + 1
_MOST_REPETITIONS = 100


class _Episode:
    """What belongs to the present episode in one environment."""

    def __init__(self) -> None:
        self.begins = True
        """With its next transition."""
        self.kept: list[Any] | None = None
        self.n_kept = 0


class WarmUp:
    """Acts at random and remembers transitions, which the agent learns when it is over.

    A random action is kept for at least k steps with probability 1 / k, so that more is seen than
    by trembling around the start. Each environment has an action of its own.

    Parameters
    ----------
    n_variables, n_dimensions
        Of observations and actions.
    n_steps
        Transitions until it is over.
    seed
        The agent's.
    learns_any_transition
        False: who comes after it cannot learn what it did, and it is therefore not over while it
        has acted in an environment and not learned of it.
    """

    def __init__(
        self,
        n_variables: int,
        n_dimensions: int,
        n_steps: int,
        seed: int,
        *,
        learns_any_transition: bool,
    ) -> None:
        self._shape = (n_variables, n_dimensions)
        self._n_steps = n_steps
        self._random = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, _STREAM])))
        self._evaluation = np.random.Generator(
            np.random.PCG64(np.random.SeedSequence([seed, _EVALUATION_STREAM]))
        )
        self._learns_any_transition = learns_any_transition
        self._steps: list[Step] = []
        self._begins: list[bool] = []
        self._environments: list[int] = []
        self._episodes = [_Episode()]
        self._acted: set[int] = set()

    @property
    def n_environments(self) -> int:
        """How many environments there are now."""
        return len(self._episodes)

    @n_environments.setter
    def n_environments(self, n: int) -> None:
        del self._episodes[n:]
        self._episodes += [_Episode() for _ in range(n - len(self._episodes))]
        self._acted &= set(range(n))

    @property
    def n_in_all(self) -> int:
        """How many environments there are, or were when a transition was remembered."""
        return max([self.n_environments, *(i + 1 for i in self._environments)])

    @property
    def is_over(self) -> bool:
        """Whether there are enough transitions."""
        return len(self._steps) >= self._n_steps and not self._acted

    def begin_episode(self, environment: int) -> None:
        """Note that the next transition is an episode's first."""
        episode = self._episodes[environment]
        episode.begins, episode.n_kept = True, 0
        self._acted.discard(environment)

    def act(
        self,
        draw: Callable[[np.random.Generator], list[Any]],
        explore: bool,
        environment: int,
    ) -> list[Any]:
        """Choose an action at random; without `explore` from a stream of its own."""
        if not explore:
            return draw(self._evaluation)
        episode = self._episodes[environment]
        if episode.kept is None or episode.n_kept == 0:
            episode.kept = draw(self._random)
            episode.n_kept = int(min(1.0 / (1.0 - self._random.random()), _MOST_REPETITIONS))
        episode.n_kept -= 1
        if not self._learns_any_transition:
            self._acted.add(environment)
        return episode.kept

    def learn(
        self,
        observation: NDArray[np.float64],
        action: NDArray[np.float64],
        reward: float,
        following: NDArray[np.float64],
        terminated: bool,
        environment: int,
    ) -> None:
        """Remember a transition, of flattened observations and actions."""
        self._steps.append((observation.copy(), action, reward, following.copy(), terminated))
        self._begins.append(self._episodes[environment].begins)
        self._environments.append(environment)
        self._episodes[environment].begins = False
        self._acted.discard(environment)

    def observations(self) -> NDArray[np.float64]:
        """Give all that was observed, shape (n, n_variables)."""
        seen = [step[0] for step in self._steps] + [step[3] for step in self._steps]
        return np.array(seen).reshape(-1, self._shape[0])

    def transitions(self) -> Iterator[tuple[bool, int, Step]]:
        """Go through the transitions in order: whether one begins an episode, and where it was."""
        yield from zip(self._begins, self._environments, self._steps, strict=True)

    def state(self) -> dict[str, NDArray[Any]]:
        """Give all that is remembered, as arrays."""
        n_variables, n_dimensions = self._shape
        first, *others = self._episodes
        state: dict[str, NDArray[Any]] = {
            "observations": np.array([s[0] for s in self._steps]).reshape(-1, n_variables),
            "actions": np.array([s[1] for s in self._steps]).reshape(-1, n_dimensions),
            "rewards": np.array([s[2] for s in self._steps], np.float64),
            "next_observations": np.array([s[3] for s in self._steps]).reshape(-1, n_variables),
            "terminated": np.array([s[4] for s in self._steps], np.uint8),
            "begins": np.array([*self._begins, first.begins], np.uint8),
            "kept": _kept(first),
            "n_kept": np.array(first.n_kept, np.int64),
            "random": _words(self._random),
            "evaluation": _words(self._evaluation),
        }
        for number, episode in enumerate(others, 1):
            prefix = f"environment.{number}."
            state[prefix + "begins"] = np.array(episode.begins, np.uint8)
            state[prefix + "kept"] = _kept(episode)
            state[prefix + "n_kept"] = np.array(episode.n_kept, np.int64)
        if any(self._environments):
            state["environments"] = np.array(self._environments, np.int64)
        if self._acted:
            state["acted"] = np.array(sorted(self._acted), np.int64)
        return state

    def restore(self, state: Mapping[str, NDArray[Any]], check: Callable[[Any], Any]) -> None:
        """Take what `state` gave; ``check`` raises for a kept action that is none."""
        n = len(state["rewards"])
        n_variables, n_dimensions = self._shape
        shapes: dict[str, tuple[int, ...]] = {
            "observations": (n, n_variables),
            "actions": (n, n_dimensions),
            "rewards": (n,),
            "next_observations": (n, n_variables),
            "terminated": (n,),
            "begins": (n + 1,),
            "n_kept": (),
            "random": (6,),
            "evaluation": (6,),
        }
        n_environments = 1
        while f"environment.{n_environments}.n_kept" in state:
            prefix = f"environment.{n_environments}."
            shapes |= {prefix + "begins": (), prefix + "n_kept": ()}
            n_environments += 1
        if "environments" in state:
            shapes["environments"] = (n,)
        for name, shape in shapes.items():
            if state[name].shape != shape:
                raise ValueError(f"{name} must have shape {shape}, got {state[name].shape}")
        self._acted = {int(i) for i in state.get("acted", ())}
        if n >= self._n_steps and not self._acted:
            raise ValueError("the warm-up must not be over")
        if not self._acted <= set(range(n_environments)):
            raise ValueError(f"acted must be of {n_environments} environments")
        self._environments = [int(i) for i in state.get("environments", [0] * n)]
        if any(not 0 <= i < MOST_ENVIRONMENTS for i in self._environments):
            raise ValueError("environments must be numbers of environments")
        self._steps = [
            (observation, action, float(reward), following, bool(terminated))
            for observation, action, reward, following, terminated in zip(
                state["observations"],
                state["actions"],
                state["rewards"],
                state["next_observations"],
                state["terminated"],
                strict=True,
            )
        ]
        self._begins = [bool(begins) for begins in state["begins"][:-1]]
        self.n_environments = n_environments
        for number, episode in enumerate(self._episodes):
            prefix = f"environment.{number}." if number else ""
            episode.begins = bool(state[prefix + "begins"].flat[-1])
            kept = state[prefix + "kept"]
            if kept.size not in (0, n_dimensions):
                raise ValueError(f"{prefix}kept must be one action at most")
            episode.kept = kept.tolist() if kept.size else None
            if episode.kept is not None:
                check(episode.kept)
            episode.n_kept = int(state[prefix + "n_kept"])
        _set_words(self._random, state["random"])
        _set_words(self._evaluation, state["evaluation"])


def _kept(episode: _Episode) -> NDArray[Any]:
    return np.array([] if episode.kept is None else episode.kept)


_WORD = 2**64


def _words(generator: np.random.Generator) -> NDArray[np.uint64]:
    state: Any = generator.bit_generator.state
    numbers = state["state"]
    words = [
        *divmod(numbers["state"], _WORD),
        *divmod(numbers["inc"], _WORD),
        state["has_uint32"],
        state["uinteger"],
    ]
    return np.array(words, np.uint64)


def _set_words(generator: np.random.Generator, words: NDArray[np.uint64]) -> None:
    first, second, third, fourth, has_half, half = (int(word) for word in words)
    generator.bit_generator.state = {
        "bit_generator": "PCG64",
        "state": {"state": first * _WORD + second, "inc": third * _WORD + fourth},
        "has_uint32": has_half,
        "uinteger": half,
    }
