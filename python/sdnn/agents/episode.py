"""The present episodes of a training, one in each of its environments."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.agents.environment_adapter import OneEnvironment, StepResult, adapter_for
from sdnn.agents.evaluation import episode_seed
from sdnn.agents.saved_training import SavedEpisode

__all__ = ["Actions", "Episode", "Episodes", "UnrepeatedEpisodeError"]

_LEARNING = 0

_PART = 1024
"""Actions in an array."""


class UnrepeatedEpisodeError(ValueError):
    """An environment does not repeat the episode in which a training was saved."""


class Actions:
    """The actions of an episode, which may have millions of them, in arrays of many each.

    Parameters
    ----------
    taken
        Those that it has already, shape (n, ...).
    """

    def __init__(self, taken: NDArray[Any] | None = None) -> None:
        self._old = [] if taken is None or not len(taken) else [taken]
        self._recent: list[Any] = []

    @property
    def taken(self) -> NDArray[Any]:
        """All of them, shape (n, ...)."""
        recent = [np.array(self._recent)] if self._recent else []
        parts = self._old + recent
        return np.concatenate(parts) if parts else np.empty(0)

    def append(self, action: Any) -> None:
        """Add one, of the shape and type of the others."""
        self._recent.append(action)
        if len(self._recent) == _PART:
            self._old.append(np.array(self._recent))
            self._recent.clear()


@dataclass(slots=True, eq=False)
class Episode:
    """The state of an episode.

    Parameters
    ----------
    number
        Of all that have begun.
    observation
        What was observed before ``outcome``, if that is still to be learned; else the last one.
    actions
        Taken in it, where it may have to be repeated.
    n_steps
        How many were taken.
    action
        The last one.
    sum_of_rewards
        Learned in it.
    outcome
        What the last action led to, if it is still to be learned.
    """

    number: int
    observation: Any
    actions: Actions = field(default_factory=Actions)
    n_steps: int = 0
    action: Any = None
    sum_of_rewards: float = 0.0
    outcome: StepResult | None = None

    @property
    def last_observation(self) -> Any:
        """What was observed last, learned or not."""
        return self.observation if self.outcome is None else self.outcome.observation


class Episodes:
    """Begins episodes in all environments of a training, steps them, and can repeat them.

    Parameters
    ----------
    env
        An environment, or a vector of them.
    seed
        Root of the episodes' seeds; None: resets have no seeds.
    first
        The number of the first episode.
    options
        Gives the options of the reset of the single environment from an episode's number.

    Attributes
    ----------
    n_environments : int
    present : list of (Episode or None)
        In each environment; None: the next one has not begun.
    next_number : int
        Of the episode that begins next.
    """

    def __init__(
        self,
        env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any],
        seed: int | None,
        first: int,
        options: Callable[[int], dict[str, Any] | None],
    ) -> None:
        self._env, self._seed, self._options = env, seed, options
        self._adapter = adapter_for(env)
        self.n_environments = self._adapter.n_environments
        self.next_number = first
        self.present: list[Episode | None] = [None] * self.n_environments
        self._first_left = 0  # the environments before it have learned this round's step

    def leave(self) -> None:
        """Begin anew in every environment with the next round, with other seeds."""
        self._adapter = adapter_for(self._env)
        self.present[:] = [None] * self.n_environments

    def outcomes(
        self, begin: Callable[[int], None], act: Callable[[int, Episode], Any]
    ) -> Iterator[tuple[int, Episode, StepResult]]:
        """Give the outcomes of steps, in the order of environments; each is to be learned.

        When those of a round are learned, a step is taken in every environment.

        Parameters
        ----------
        begin
            Called with an environment whose episode has begun.
        act
            Gives the action in an environment.
        """
        if isinstance(self._adapter, OneEnvironment):
            yield from self._outcomes_of_one(self._adapter, begin, act)
        present, has_seeds = self.present, self._seed is not None
        while True:
            for i in range(self._first_left, self.n_environments):
                episode = present[i]
                if episode is not None and episode.outcome is not None:
                    self._first_left = i
                    yield i, episode, episode.outcome
            self._first_left = 0
            numbers = {}
            if None in present:
                numbers = self._begin_episodes(begin)
            actions = []
            for i, episode in enumerate(present):
                actions.append(None if episode is None else act(i, episode))
            for i, outcome in enumerate(self._adapter.step(actions)):
                episode = present[i]
                if episode is None:
                    present[i] = Episode(numbers[i], outcome.observation)
                    begin(i)
                    continue
                episode.outcome, episode.action = outcome, actions[i]
                episode.n_steps += 1
                if has_seeds:
                    episode.actions.append(actions[i])

    def _outcomes_of_one(
        self,
        env: OneEnvironment,
        begin: Callable[[int], None],
        act: Callable[[int, Episode], Any],
    ) -> Iterator[tuple[int, Episode, StepResult]]:
        """Give the same of a single environment, where a round is as short as can be."""
        present, has_seeds, step = self.present, self._seed is not None, env.step_one
        while True:
            episode = present[0]
            if episode is None:
                self._begin_episodes(begin)
                episode = present[0]
                assert episode is not None
            if episode.outcome is None:
                action = act(0, episode)
                episode.outcome, episode.action = step(action), action
                episode.n_steps += 1
                if has_seeds:
                    episode.actions.append(action)
            yield 0, episode, episode.outcome

    def _begin_episodes(self, begin: Callable[[int], None]) -> dict[int, int]:
        """Begin an episode where the last one is over; return their numbers."""
        over = [i for i, episode in enumerate(self.present) if episode is None]
        numbers = {i: self.next_number + k for k, i in enumerate(over)}
        self.next_number += len(over)
        for i, observation in self._reset(numbers).items():
            self.present[i] = Episode(numbers[i], observation)
            begin(i)
        return numbers

    def _reset(self, numbers: Mapping[int, int]) -> dict[int, Any]:
        """Begin episodes of these numbers in some environments: their first observations."""
        seeds = {
            i: None if self._seed is None else episode_seed(self._seed, _LEARNING, number)
            for i, number in numbers.items()
        }
        return self._adapter.reset(seeds, self._options(1 + max(numbers.values())))

    def saved(
        self, shape: tuple[int, ...], flat: Callable[[Any], NDArray[np.float64]]
    ) -> list[SavedEpisode | None]:
        """Describe the present episodes; ``shape`` is an action's, ``flat`` makes vectors."""
        return [
            None
            if episode is None
            else SavedEpisode(
                number=episode.number,
                sum_of_rewards=episode.sum_of_rewards,
                actions=episode.actions.taken.reshape((-1, *shape)),
                observation=np.asarray(flat(episode.last_observation)),
                waits=episode.outcome is not None,
            )
            for episode in self.present
        ]

    def repeat(
        self, saved: Sequence[SavedEpisode | None], flat: Callable[[Any], NDArray[np.float64]]
    ) -> None:
        """Bring every environment to where its episode was saved.

        Raises
        ------
        UnrepeatedEpisodeError
            If an environment does not repeat its episode.
        ValueError
            If the environments are others, or cannot be reset one by one with seeds.
        """
        self._require_repeatable(len(saved))
        for i, one in enumerate(saved):
            if one is not None:
                n = len(one.actions)
                last = one.actions[-1] if n else None
                self.present[i] = Episode(
                    one.number, None, Actions(one.actions), n, last, one.sum_of_rewards
                )
        self._replay({i for i, one in enumerate(saved) if one is not None and one.waits})
        for now, then in zip(self.present, saved, strict=True):
            if now is not None and then is not None:
                found = flat(now.last_observation)
                if not np.array_equal(found, then.observation):
                    raise UnrepeatedEpisodeError(
                        "env must repeat the episode in which the training was saved: the same"
                        f" seed and actions led to {found}, not to {then.observation}"
                    )

    def _require_repeatable(self, n_saved: int) -> None:
        if n_saved != self.n_environments:
            raise ValueError(
                f"env must have {n_saved} environments, as the training had,"
                f" got {self.n_environments}"
            )
        if self._seed is None:
            raise ValueError(
                "repeat_episodes must be False for a training whose episodes had no seeds, got True"
            )
        if not self._adapter.can_repeat:
            raise ValueError(
                "env must reset each of its environments with a seed of its own where episodes are"
                f" repeated, got {type(self._env.unwrapped).__name__}: repeat_episodes=False begins"
                " new ones; or take SyncVectorEnv or AsyncVectorEnv of Gymnasium 1.1 or newer, as"
                " gymnasium.make_vec(..., vectorization_mode='sync') makes it, with shared memory"
                " or the autoreset mode DISABLED"
            )

    def _replay(self, waiting: Iterable[int]) -> None:
        """Take the actions of all present episodes again, so that all end at the same time.

        Until its own episode begins, an environment does anything.
        """
        present = {i: episode for i, episode in enumerate(self.present) if episode is not None}
        taken = {i: episode.actions.taken for i, episode in present.items()}
        n_rounds = max(map(len, taken.values()), default=0)
        longest = next((one for one in taken.values() if len(one) == n_rounds), None)
        every = range(self.n_environments)
        numbers = {i: present[i].number if i in present else 0 for i in every}
        ended = set(every)
        for t in range(n_rounds):
            assert longest is not None
            starts = {i for i, own in taken.items() if n_rounds - len(own) == t}
            if starts | ended:
                seen = self._reset({i: numbers[i] for i in sorted(starts | ended)})
            for i in starts:
                present[i].observation = seen[i]
            actions = [
                taken[i][t - n_rounds]
                if i in taken and t >= n_rounds - len(taken[i])
                else longest[t]
                for i in every
            ]
            outcomes = self._adapter.step(actions)
            ended = {i for i, outcome in enumerate(outcomes) if outcome.ends}
            for i, episode in present.items():
                if t < n_rounds - 1 or i not in waiting:
                    episode.observation = outcomes[i].observation
                else:
                    episode.outcome = outcomes[i]
