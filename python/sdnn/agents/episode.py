"""Episodes of a training, one in each of its environments, and the transitions they give."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn.agents.adapters import (
    EnvironmentAdapter,
    OneEnvironment,
    Statistics,
    UnusableStepError,
    checked,
    learning_wrappers,
    names_of,
    own_copy,
    statistics_of,
)
from sdnn.agents.base import SavedEpisode

if TYPE_CHECKING:
    from sdnn._core import Controller

_LEARNING, EVALUATION = 0, 1
"""The kinds of episodes that `episode_seed` gives seeds to."""

_PART = 1024
"""Actions in an array."""


class UnrepeatedEpisodeError(ValueError):
    """An environment does not repeat the episode in which a training was saved."""


class Transition(NamedTuple):
    """One step of an environment.

    ``terminated`` is Gymnasium's: the episode ended in a terminal state. An episode cut off by a
    time limit (``truncated``) is not terminated; its last transition is learned like any other.
    ``next_mask`` has 1 for the actions that are allowed in a next state, as `Agent.act` has it.
    """

    observation: ArrayLike
    action: Any
    reward: float
    next_observation: ArrayLike
    terminated: bool
    next_mask: Any = None


class Learner(Protocol):
    """The interface of what is trained: every `sdnn.agents.Agent` has it.

    An agent that learns in one environment and is not saved needs only these methods, without the
    arguments ``environment`` and ``mask``. Where it has an attribute ``progress``, that is kept up
    to date.
    """

    def begin_episode(self) -> None:
        """Note that an episode begins."""

    def act(self, observation: Any, explore: bool = True) -> Any:
        """Choose an action; without `explore` nothing may be learned or remembered."""

    def learn(self, transition: Transition) -> None:
        """Learn a step."""


def episode_seed(seed: int, kind: int, episode: int) -> int:
    """Return the seed of an episode's `reset`; learning and evaluation have their own."""
    word = np.random.SeedSequence(seed, spawn_key=(kind, episode)).generate_state(1, np.uint32)[0]
    return int(word) % 2**31  # some environments take no larger ones


class Rounds:
    """Any learner in all environments of a training: it acts and learns in one after the other."""

    def __init__(self, learner: Any, n_environments: int) -> None:
        self._learner = learner
        self.progressing: Any = learner if hasattr(learner, "progress") else None
        """What follows the progress of the training."""
        self.places: list[dict[str, int]] = [{}]
        """Which environment, where there are several: arguments of the learner, parts of rows."""
        if n_environments > 1:
            self.places = [{"environment": i} for i in range(n_environments)]

    def begin_episode(self, environment: int) -> None:
        """Note that an episode begins."""
        self._learner.begin_episode(**self.places[environment])

    def read(self, name: str, seen: Any) -> Any:
        """Return observations as `act` and `learn` take them, copied; ValueError names them."""
        return [own_copy(one) for one in seen]

    def flat(self, observation: Any) -> NDArray[np.float64]:
        """Return the numbers of an observation that was read, for a file."""
        return np.asarray(self._learner.flat_observation(observation))

    def masks(self, found: list[Any]) -> Any:
        """Return masks of all environments as `act` and `learn` take them; ValueError names one."""
        return found

    def act(
        self, observations: Any, actions: Sequence[Any], environments: list[int], masks: Any = None
    ) -> Any:
        """Return actions as `learn` takes them: new ones in these, the others as they were."""
        taken = list(actions)
        for i in environments:
            mask = {} if masks is None else {"mask": masks[i]}
            taken[i] = self._learner.act(observations[i], **self.places[i], **mask)
        return taken

    def elements(self, actions: Any) -> Any:
        """Return the elements of the action space that `act` has chosen."""
        return actions

    def learn(
        self,
        observations: Any,
        actions: Any,
        rewards: list[float],
        next_observations: Any,
        terminated: list[bool],
        environments: list[int],
        progress: list[float],
        next_masks: Any = None,
    ) -> int:
        """Learn steps in the first of these environments or more; return in how many.

        ``progress`` is the learner's between two of them; it may be empty.
        """
        i = environments[0]
        reward, ends, _ = checked(rewards[i], terminated[i], False)
        mask = None if next_masks is None else next_masks[i]
        step = Transition(observations[i], actions[i], reward, next_observations[i], ends, mask)
        self._learner.learn(step, **self.places[i])
        return 1


class _CoreRounds(Rounds):
    """The same of an agent, with one call of its core for all environments; rows are read."""

    def __init__(
        self,
        learner: Any,
        n_environments: int,
        core: Controller,
        read: Callable[[str, Any], NDArray[np.float64]],
        elements: Callable[[NDArray[np.float64]], NDArray[Any]],
        mask: Callable[[str, Any], NDArray[np.uint8] | None],
    ) -> None:
        super().__init__(learner, n_environments)
        self.progressing, self._act = core, core.act_each
        self._mask, self._n_actions = mask, sum(core.n_actions)
        self.read = read  # type: ignore[assignment, method-assign]
        self.elements = elements  # type: ignore[assignment, method-assign]
        self.learn = core.learn_each  # type: ignore[method-assign]

    def flat(self, observation: Any) -> NDArray[np.float64]:
        return np.array(observation)

    def masks(self, found: list[Any]) -> Any:
        rows = np.ones((len(found), self._n_actions), np.uint8)
        for i, one in enumerate(found):
            if (mask := self._mask("action_mask", one)) is not None:
                rows[i] = mask
        return rows

    def act(
        self, observations: Any, actions: Sequence[Any], environments: list[int], masks: Any = None
    ) -> Any:
        taken = self._act(observations, environments, masks)
        if len(environments) < len(taken):
            for i in set(range(len(taken))).difference(environments):
                taken[i] = np.ravel(actions[i])  # an element of the space after a replay
        return taken


def _rounds_of(learner: Any, n_environments: int) -> Rounds:
    core_parts = getattr(type(learner), "core_parts", None)
    parts = core_parts and core_parts(learner)
    kind = _CoreRounds if parts else Rounds
    return kind(learner, n_environments, *(parts or ()))


class _Taken:
    """The actions of an episode, which may have millions of them, in arrays of many each."""

    def __init__(self, taken: NDArray[Any] | None = None) -> None:
        self._old = [] if taken is None or not len(taken) else [taken]
        self._recent: list[Any] = []

    def array(self) -> NDArray[Any]:
        """Return all of them, shape (n, ...)."""
        parts = self._old + ([np.array(self._recent)] if self._recent else [])
        return np.concatenate(parts) if parts else np.empty(0)

    def append(self, action: Any) -> None:
        """Add one, of the shape and type of the others."""
        self._recent.append(action)
        if len(self._recent) == _PART:
            self._old.append(np.array(self._recent))
            self._recent.clear()


@dataclass(slots=True, eq=False)
class Episode:
    """The state of an episode; ``actions`` are kept where it may be repeated."""

    number: int
    actions: _Taken = field(default_factory=_Taken)
    n_steps: int = 0
    sum_of_rewards: float = 0.0


class Episodes:
    """Begins episodes in all environments of a training, steps them, and can repeat them.

    ``options`` returns those of a single environment's reset from the episode's number, and
    ``unusable`` the error for one of a step or reset, in an environment or in any (None). ``seed``
    is the root of the episodes' seeds; None: resets have no seeds. ``first`` is the number of the
    first episode.

    Attributes
    ----------
    present : list of (Episode or None)
        In each environment; None: the next one has not begun.
    next_number : int
        Of the episode that begins next.
    waiting : list of int
        Environments whose last step is to be learned, in order.
    adapter : EnvironmentAdapter
        It has the rewards and ends of the last step.
    wrappers, learned : list
        Those that learn, and what they had learned when the last episode began.
    """

    _before: Any  # observations before the last step, and the latest ones
    _latest: Any
    _masks: Any = None  # of the latest observations, where environments have them

    def __init__(
        self,
        env: Any,
        learner: Any,
        seed: int | None,
        first: int,
        options: Callable[[int], dict[str, Any] | None],
        unusable: Callable[[Exception, int | None], UnusableStepError],
    ) -> None:
        self._env, self._seed, self._options = env, seed, options
        self._has_seeds = seed is not None
        self._unusable = unusable
        self.adapter = _adapter_for(env)
        self.wrappers = learning_wrappers(env)
        self.learned: list[Statistics] = []
        n = self.n_environments = self.adapter.n_environments
        self.rounds: Rounds = _rounds_of(learner, n)
        self.next_number = first
        self.present: list[Episode | None] = [None] * n
        self.waiting: list[int] = []
        self._every = list(range(n))
        self._actions: Any = [None] * n

    @property
    def learned_before(self) -> list[Statistics]:
        """Steps and episodes learned before the present episode, or the next."""
        return self.learned if any(self.present) else statistics_of(self.wrappers)

    def leave(self) -> None:
        """Begin anew in every environment with the next step, with other seeds."""
        self.adapter = _adapter_for(self._env)
        self.present[:] = [None] * self.n_environments
        self.waiting = []

    def advance(self) -> None:
        """Begin episodes where none is present, and take a step in every environment."""
        present, numbers = self.present, {}
        waiting = self.waiting = self._every.copy()
        if None in present:
            numbers = self._begin_episodes()
            waiting[:] = [i for i in waiting if present[i] is not None]
        before = self._before = self._latest
        # What _checked and _read_masks do, without their calls: this runs at every step.
        try:
            actions = self._actions = self.rounds.act(before, self._actions, waiting, self._masks)
        except ValueError as error:
            raise self._unusable(error, None) from error
        elements = self.rounds.elements(actions)
        for i in waiting:
            episode: Any = present[i]
            episode.n_steps += 1
            if self._has_seeds:
                episode.actions.append(elements[i])
        try:
            seen = self.adapter.step(elements)
        except UnusableStepError as error:
            raise self._unusable(error, None) from error
        try:
            self._latest = self.rounds.read("next_observation", seen)
            if self.adapter.masks is not None:
                self._masks = self.rounds.masks(self.adapter.masks)
        except ValueError as error:
            raise self._unusable(error, None) from error
        for i, number in numbers.items():
            if self.present[i] is None:
                self.present[i] = Episode(number)
                self.rounds.begin_episode(i)

    def learn_waiting(self, most: int, limit_bootstraps: bool, progress: list[float]) -> list[int]:
        """Learn steps that wait, none after an episode's end; return in which environments."""
        rewards, ends, cut = self.adapter.rewards, self.adapter.terminated, self.adapter.truncated
        environments = self.waiting[:most]
        for k, i in enumerate(environments, 1):
            if ends[i] or cut[i]:
                del environments[k:]
        if not limit_bootstraps:
            ends = [one or other for one, other in zip(ends, cut, strict=True)]
        before, after = self._before, self._latest
        try:
            n = self.rounds.learn(
                before, self._actions, rewards, after, ends, environments, progress, self._masks
            )
        except (ValueError, OverflowError) as error:
            raise self._unusable(error, environments[0]) from error
        del self.waiting[:n], environments[n:]
        for i in environments:
            self.present[i].sum_of_rewards += rewards[i]  # type: ignore[union-attr]
        return environments

    def _begin_episodes(self) -> dict[int, int]:
        """Begin an episode where the last one is over; return their numbers."""
        over = [i for i, episode in enumerate(self.present) if episode is None]
        numbers = {i: self.next_number + k for k, i in enumerate(over)}
        self.next_number += len(over)
        self.learned = statistics_of(self.wrappers)
        seen = self._reset(numbers)
        for i in seen:
            self.present[i] = Episode(numbers[i])
        self._put(seen)
        for i in seen:
            self.rounds.begin_episode(i)
        return numbers

    def _reset(self, numbers: Mapping[int, int]) -> dict[int, Any]:
        """Begin episodes of these numbers in some environments; return first observations."""
        seeds = {
            i: None if self._seed is None else episode_seed(self._seed, _LEARNING, number)
            for i, number in numbers.items()
        }
        return self.adapter.reset(seeds, self._options(1 + max(numbers.values())))

    def _put(self, seen: dict[int, Any]) -> None:
        """Read the observations of all, or some, environments."""
        if len(seen) == self.n_environments:
            self._latest = self._checked(self.rounds.read, "observation", list(seen.values()))
        else:
            for i, first in seen.items():
                self._latest[i] = self._checked(self.rounds.read, "observation", [first])[0]
        self._read_masks()

    def _read_masks(self) -> None:
        if self.adapter.masks is not None:
            self._masks = self._checked(self.rounds.masks, self.adapter.masks)

    def _checked(self, read: Callable[..., Any], *given: Any) -> Any:
        """Return what a function makes of what an environment gave, or raise that it cannot."""
        try:
            return read(*given)
        except ValueError as error:
            raise self._unusable(error, None) from error

    def saved(self, shape: tuple[int, ...]) -> list[SavedEpisode | None]:
        """Return the present episodes for a file; ``shape`` is an action's."""
        return [
            None
            if episode is None
            else SavedEpisode(
                number=episode.number,
                sum_of_rewards=episode.sum_of_rewards,
                actions=episode.actions.array().reshape((-1, *shape)),
                observation=self.rounds.flat(self._latest[i]),
                waits=i in self.waiting,
            )
            for i, episode in enumerate(self.present)
        ]

    def repeat(self, saved: Sequence[SavedEpisode | None]) -> None:
        """Bring every environment to where its episode was saved.

        UnrepeatedEpisodeError if an environment does not repeat its episode; ValueError if the
        environments are others, or cannot be reset one by one with seeds.
        """
        self._require_repeatable(len(saved))
        if self.wrappers and not isinstance(self.adapter, OneEnvironment) and any(saved):
            raise UnrepeatedEpisodeError(
                f"env must repeat its episodes, but {type(self.wrappers[0]).__name__} has learned"
                " from several environments at once: repeat_episodes=False begins new ones"
            )
        for i, one in enumerate(saved):
            if one is not None:
                taken = _Taken(one.actions)
                self.present[i] = Episode(one.number, taken, len(one.actions), one.sum_of_rewards)
        self._replay()
        self.waiting = [i for i, one in enumerate(saved) if one is not None and one.waits]
        for i, then in enumerate(saved):
            if then is not None:
                found = self.rounds.flat(self._latest[i])
                if not np.array_equal(found, then.observation, equal_nan=True):
                    raise UnrepeatedEpisodeError(
                        "env must repeat the episode in which the training was saved: the same"
                        f" seed and actions led to {found}, not to {then.observation}. One of"
                        f" {names_of(self._env)} draws without the seed or remembers earlier"
                        " episodes: repeat_episodes=False begins a new one"
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
        if not self.adapter.can_repeat:
            raise ValueError(
                "env must reset each of its environments with a seed of its own where episodes are"
                f" repeated, got {type(self._env.unwrapped).__name__}: repeat_episodes=False begins"
                " new ones; or take SyncVectorEnv or AsyncVectorEnv, as"
                " gymnasium.make_vec(..., vectorization_mode='sync') makes it, with shared memory"
                " or the autoreset mode DISABLED"
            )

    def _replay(self) -> None:
        """Take the actions of all present episodes again, so that all end at the same time.

        Until its own episode begins, an environment takes any actions.
        """
        present = {i: episode for i, episode in enumerate(self.present) if episode is not None}
        taken = {i: episode.actions.array() for i, episode in present.items()}
        n_rounds = max(map(len, taken.values()), default=0)
        leader = next((i for i, one in taken.items() if len(one) == n_rounds), 0)
        ended = set(self._every)
        for t in range(n_rounds + bool(taken)):
            begins = {i for i, own in taken.items() if n_rounds - len(own) == t}
            if t < n_rounds or n_rounds == 0:
                begins |= ended
            if begins:
                follows = {i for i in begins if i not in taken or n_rounds - len(taken[i]) != t}
                numbers = {i: present[leader if i in follows else i].number for i in sorted(begins)}
                self._put(self._reset(numbers))
            if t == n_rounds:  # only episodes without actions begin here
                return
            self._actions = [
                taken[i][t - n_rounds]
                if i in taken and t >= n_rounds - len(taken[i])
                else taken[leader][t]
                for i in self._every
            ]
            seen = self.adapter.step(self._actions)
            self._before = self._latest
            self._latest = self._checked(self.rounds.read, "observation", seen)
            self._read_masks()
            ends = zip(self.adapter.terminated, self.adapter.truncated, strict=True)
            ended = {i for i, (terminated, truncated) in enumerate(ends) if terminated or truncated}


def _adapter_for(env: Any) -> EnvironmentAdapter:
    """Return the adapter for an environment, or for a vector of them."""
    if not isinstance(env, gym.vector.VectorEnv):
        return OneEnvironment(env)
    from sdnn.agents.vectors import vector_adapter

    return vector_adapter(env)
