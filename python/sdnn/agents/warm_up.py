"""The first steps of an agent that does not know the ranges of its observations yet."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["WarmUp"]

Step: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64], float, NDArray[np.float64], bool]
"""Observation, action, reward, next observation, terminated."""

_STREAM = 2**32
_EVALUATION_STREAM = 2**32 + 1
_MOST_REPETITIONS = 100


class WarmUp:
    """Acts at random and remembers transitions, which the agent learns when it is over.

    A random action is kept for at least k steps with probability 1 / k, so that more is seen than
    by trembling around the start.

    Parameters
    ----------
    n_variables, n_dimensions
        Of observations and actions.
    n_steps
        Transitions until it is over.
    seed
        The agent's.
    """

    def __init__(self, n_variables: int, n_dimensions: int, n_steps: int, seed: int) -> None:
        self._shape = (n_variables, n_dimensions)
        self._n_steps = n_steps
        self._random = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, _STREAM])))
        self._evaluation = np.random.Generator(
            np.random.PCG64(np.random.SeedSequence([seed, _EVALUATION_STREAM]))
        )
        self._steps: list[Step] = []
        self._begins: list[bool] = []
        self._begins_now = True
        self._kept: list[Any] | None = None
        self._n_kept = 0

    @property
    def is_over(self) -> bool:
        """Whether there are enough transitions."""
        return len(self._steps) >= self._n_steps

    def begin_episode(self) -> None:
        """Note that the next transition is an episode's first."""
        self._begins_now = True
        self._n_kept = 0

    def act(self, draw: Callable[[np.random.Generator], list[Any]], explore: bool) -> list[Any]:
        """Choose an action at random; without `explore` from a stream of its own."""
        if not explore:
            return draw(self._evaluation)
        if self._kept is None or self._n_kept == 0:
            self._kept = draw(self._random)
            self._n_kept = int(min(1.0 / (1.0 - self._random.random()), _MOST_REPETITIONS))
        self._n_kept -= 1
        return self._kept

    def learn(
        self,
        observation: NDArray[np.float64],
        action: NDArray[np.float64],
        reward: float,
        following: NDArray[np.float64],
        terminated: bool,
    ) -> None:
        """Remember a transition, of flattened observations and actions."""
        self._steps.append((observation.copy(), action, reward, following.copy(), terminated))
        self._begins.append(self._begins_now)
        self._begins_now = False

    def observations(self) -> NDArray[np.float64]:
        """Give all that was observed, shape (n, n_variables)."""
        seen = [step[0] for step in self._steps] + [step[3] for step in self._steps]
        return np.array(seen).reshape(-1, self._shape[0])

    def transitions(self) -> Iterator[tuple[bool, Step]]:
        """Go through the transitions in order, each with whether an episode begins with it."""
        yield from zip(self._begins, self._steps, strict=True)

    def state(self) -> dict[str, NDArray[Any]]:
        """Give all that is remembered, as arrays."""
        n_variables, n_dimensions = self._shape
        return {
            "observations": np.array([s[0] for s in self._steps]).reshape(-1, n_variables),
            "actions": np.array([s[1] for s in self._steps]).reshape(-1, n_dimensions),
            "rewards": np.array([s[2] for s in self._steps], np.float64),
            "next_observations": np.array([s[3] for s in self._steps]).reshape(-1, n_variables),
            "terminated": np.array([s[4] for s in self._steps], np.uint8),
            "begins": np.array([*self._begins, self._begins_now], np.uint8),
            "kept": np.array([] if self._kept is None else self._kept),
            "n_kept": np.array(self._n_kept, np.int64),
            "random": _words(self._random),
            "evaluation": _words(self._evaluation),
        }

    def restore(self, state: Mapping[str, NDArray[Any]], check: Callable[[Any], Any]) -> None:
        """Take what `state` gave; ``check`` raises for a kept action that is none."""
        n = len(state["rewards"])
        n_variables, n_dimensions = self._shape
        shapes = {
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
        for name, shape in shapes.items():
            if state[name].shape != shape:
                raise ValueError(f"{name} must have shape {shape}, got {state[name].shape}")
        if n >= self._n_steps or state["kept"].size not in (0, n_dimensions):
            raise ValueError("the warm-up must not be over, and keep one action at most")
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
        self._begins_now = bool(state["begins"][-1])
        kept = state["kept"]
        self._kept = kept.tolist() if kept.size else None
        if self._kept is not None:
            check(self._kept)
        self._n_kept = int(state["n_kept"])
        _set_words(self._random, state["random"])
        _set_words(self._evaluation, state["evaluation"])


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
