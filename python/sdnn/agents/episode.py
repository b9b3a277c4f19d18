"""Episodes of a training, one in each of its environments, and the transitions they give."""

from __future__ import annotations

import abc
import copy
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn.agents.files import SavedEpisode, Statistics, learning_wrappers, names_of, statistics_of
from sdnn.arguments import flag, real, shown

_LEARNING, EVALUATION = 0, 1
"""The kinds of episodes that `episode_seed` gives seeds to."""

_PART = 1024
"""Actions in an array."""

_OLD_API = (
    "; an environment of Gym before 0.26 can be wrapped:"
    " shimmy.GymV21CompatibilityV0(env=env), from pip install shimmy"
)

Seeds: TypeAlias = Mapping[int, int | None]
Options: TypeAlias = dict[str, Any] | None


class UnrepeatedEpisodeError(ValueError):
    """An environment does not repeat the episode in which a training was saved."""


class UnusableStepError(ValueError):
    """A step or reset of an environment cannot be used; the message names it and the reason."""


class Transition(NamedTuple):
    """One step of an environment.

    ``terminated`` is Gymnasium's: the episode ended in a terminal state. An episode cut off by a
    time limit (``truncated``) is not terminated; its last transition is learned like any other.
    """

    observation: ArrayLike
    action: Any
    reward: float
    next_observation: ArrayLike
    terminated: bool


class Learner(Protocol):
    """The interface of what is trained: every `sdnn.agents.Agent` has it.

    An agent that learns in one environment and is not saved needs only these methods, without the
    argument ``environment``. Where it has an attribute ``progress``, that is kept up to date.
    """

    def begin_episode(self) -> None:
        """Note that an episode begins."""

    def act(self, observation: Any, explore: bool = True) -> Any:
        """Choose an action; without `explore` nothing may be learned or remembered."""

    def learn(self, transition: Transition) -> None:
        """Learn a step."""


def reward_of(reward: Any) -> float:
    """Read a reward: a number of any library, an array of one or a bool; else ValueError."""
    if isinstance(reward, float):  # NumPy's, too
        return float(reward)
    is_numpy = isinstance(reward, np.ndarray | np.generic)
    if is_numpy and reward.size == 1 and reward.dtype.kind in "fiub" and not _is_masked(reward):
        reward, is_numpy = reward.item(), False
    if not is_numpy and hasattr(reward, "__float__"):
        with suppress(OverflowError, TypeError, ValueError):
            return float(reward)
    try:
        return real("reward", reward)  # for its message
    except OverflowError as error:  # which would say of `Agent.learn` that a weight left its range
        raise ValueError(str(error)) from None


def _is_masked(value: Any) -> bool:
    return isinstance(value, np.ma.MaskedArray)


def episode_seed(seed: int, kind: int, episode: int) -> int:
    """Return the seed of an episode's `reset`; learning and evaluation have their own."""
    word = np.random.SeedSequence(seed, spawn_key=(kind, episode)).generate_state(1, np.uint32)[0]
    return int(word) % 2**31  # some environments take no larger ones


# Steps in one environment, or in several at once: a round is a step in each.


class StepResult(NamedTuple):
    """The result of a step, unchecked; ``observation`` is the last of an episode that ended."""

    observation: Any
    reward: Any
    terminated: Any
    truncated: Any


def checked(outcome: StepResult) -> StepResult:
    """Return an outcome with a finite float as reward and with bools; ValueError if it has none."""
    seen, reward, terminated, truncated = outcome
    if type(reward) is not float:
        reward = reward_of(reward)
    if not math.isfinite(reward):
        raise ValueError(f"reward must be finite, got {reward}")
    if type(terminated) is bool is type(truncated):
        return StepResult(seen, reward, terminated, truncated)
    try:
        ends = flag("terminated", terminated), flag("truncated", truncated)
    except TypeError as error:
        raise ValueError(str(error)) from None
    return StepResult(seen, reward, *ends)


def reset_env(env: Any, seed: Any, options: Options) -> Any:
    """Reset an environment, or a vector; return what is observed first.

    UnusableStepError if it returns something else than an observation and a dictionary.
    """
    made = env.reset(seed=seed, options=options)
    if not (isinstance(made, tuple | list) and len(made) == 2 and isinstance(made[1], Mapping)):
        raise UnusableStepError(
            f"env.reset must return (observation, info), info a dictionary, got {shown(made)}"
            f"{_OLD_API}"
        )
    return made[0]


def step_env(env: Any, action: Any) -> tuple[Any, Any, Any, Any, Any]:
    """Step an environment, or a vector; UnusableStepError if it does not return five values."""
    made = env.step(action)
    if not (isinstance(made, tuple | list) and len(made) == 5):
        n = len(made) if isinstance(made, tuple | list) else 1
        raise UnusableStepError(
            "env.step must return five values, (observation, reward, terminated, truncated, info),"
            f" got {n}{_OLD_API}"
        )
    seen, reward, terminated, truncated, info = made
    return seen, reward, terminated, truncated, info


def own_copy(value: Any) -> Any:
    """Copy what others may write to: environments may keep their state, or change an action."""
    if type(value) is np.ndarray:
        return value.copy()
    return value if isinstance(value, np.generic | int | float) else copy.deepcopy(value)


class EnvironmentAdapter(abc.ABC):
    """The interface of all environments, single and vectorized.

    ``can_repeat`` is whether each environment can be reset at any time, with a seed of its own.
    """

    n_environments: int
    can_repeat: bool

    @abc.abstractmethod
    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Any]:
        """Begin episodes in some environments, with seeds; return their first observations.

        Where one is missing, the episode begins with the next `step`, which returns it.
        """

    @abc.abstractmethod
    def step(self, actions: Sequence[Any]) -> list[StepResult]:
        """Take an action in each; None in those whose episodes have not begun."""


class OneEnvironment(EnvironmentAdapter):
    """A single environment."""

    n_environments = 1
    can_repeat = True

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        self._env = env

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Any]:
        """Begin its episode."""
        return {i: own_copy(reset_env(self._env, seed, options)) for i, seed in seeds.items()}

    def step(self, actions: Sequence[Any]) -> list[StepResult]:
        """Take the only action."""
        return [self.step_one(actions[0])]

    def step_one(self, action: Any) -> StepResult:
        """Take an action."""
        taken = action.copy() if type(action) is np.ndarray else own_copy(action)
        seen, reward, terminated, truncated, _ = step_env(self._env, taken)
        seen = seen.copy() if type(seen) is np.ndarray else own_copy(seen)
        return StepResult(seen, reward, terminated, truncated)


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
    """The state of an episode.

    ``outcome`` is that of the last action while it is still to be learned; ``observation`` is the
    one before it then, else the last. ``actions`` are kept where the episode may be repeated.
    """

    number: int
    observation: Any
    actions: _Taken = field(default_factory=_Taken)
    n_steps: int = 0
    action: Any = None
    sum_of_rewards: float = 0.0
    outcome: StepResult | None = None

    @property
    def last_observation(self) -> Any:
        """The last observation, learned or not."""
        return self.observation if self.outcome is None else self.outcome.observation


class Episodes:
    """Begins episodes in all environments of a training, steps them, and can repeat them.

    Parameters
    ----------
    env
        An environment, or a vector of them.
    adapter_for
        Returns the adapter for it.
    seed
        Root of the episodes' seeds; None: resets have no seeds.
    first
        The number of the first episode.
    options
        Returns the options of the reset of the single environment from an episode's number.

    Attributes
    ----------
    n_environments : int
    present : list of (Episode or None)
        In each environment; None: the next one has not begun.
    next_number : int
        Of the episode that begins next.
    wrappers, learned : list
        Those that learn, and what they had learned when the last episode began.
    """

    def __init__(
        self,
        env: Any,
        adapter_for: Callable[[Any], EnvironmentAdapter],
        seed: int | None,
        first: int,
        options: Callable[[int], dict[str, Any] | None],
    ) -> None:
        self._env, self._seed, self._options = env, seed, options
        self._adapter_for = adapter_for
        self._adapter = adapter_for(env)
        self.wrappers = learning_wrappers(env)
        self.learned: list[Statistics] = []
        self.n_environments = self._adapter.n_environments
        self.next_number = first
        self.present: list[Episode | None] = [None] * self.n_environments
        self._first_left = 0  # the environments before it have learned this round's step

    @property
    def learned_before(self) -> list[Statistics]:
        """Steps and episodes learned before the present episode, or the next."""
        return self.learned if any(self.present) else statistics_of(self.wrappers)

    def leave(self) -> None:
        """Begin anew in every environment with the next round, with other seeds."""
        self._adapter = self._adapter_for(self._env)
        self.present[:] = [None] * self.n_environments

    def outcomes(
        self, begin: Callable[[int], None], act: Callable[[int, Episode], Any]
    ) -> Iterator[tuple[int, Episode, StepResult]]:
        """Yield the outcomes of steps, in the order of environments; each is to be learned.

        When those of a round are learned, a step is taken in every environment. ``begin`` is called
        with an environment whose episode has begun; ``act`` returns the action in an environment.
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
            numbers = self._begin_episodes(begin) if None in present else {}
            actions = [None if one is None else act(i, one) for i, one in enumerate(present)]
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
        """Yield the same of a single environment, with less work for each step."""
        present, has_seeds, step = self.present, self._seed is not None, env.step_one
        while True:
            episode = present[0]
            if episode is None:
                self._begin_episodes(begin)
                episode = present[0]
                assert episode is not None
            outcome = episode.outcome
            if outcome is None:
                action = act(0, episode)
                episode.outcome = outcome = step(action)
                episode.action = action
                episode.n_steps += 1
                if has_seeds:
                    episode.actions.append(action)
            yield 0, episode, outcome

    def _begin_episodes(self, begin: Callable[[int], None]) -> dict[int, int]:
        """Begin an episode where the last one is over; return their numbers."""
        over = [i for i, episode in enumerate(self.present) if episode is None]
        numbers = {i: self.next_number + k for k, i in enumerate(over)}
        self.next_number += len(over)
        self.learned = statistics_of(self.wrappers)
        for i, observation in self._reset(numbers).items():
            self.present[i] = Episode(numbers[i], observation)
            begin(i)
        return numbers

    def _reset(self, numbers: Mapping[int, int]) -> dict[int, Any]:
        """Begin episodes of these numbers in some environments; return first observations."""
        seeds = {
            i: None if self._seed is None else episode_seed(self._seed, _LEARNING, number)
            for i, number in numbers.items()
        }
        return self._adapter.reset(seeds, self._options(1 + max(numbers.values())))

    def saved(
        self, shape: tuple[int, ...], flat: Callable[[Any], NDArray[np.float64]]
    ) -> list[SavedEpisode | None]:
        """Return the present episodes for a file; ``shape`` is an action's, ``flat`` flattens."""
        return [
            None
            if episode is None
            else SavedEpisode(
                number=episode.number,
                sum_of_rewards=episode.sum_of_rewards,
                actions=episode.actions.array().reshape((-1, *shape)),
                observation=np.asarray(flat(episode.last_observation)),
                waits=episode.outcome is not None,
            )
            for episode in self.present
        ]

    def repeat(
        self, saved: Sequence[SavedEpisode | None], flat: Callable[[Any], NDArray[np.float64]]
    ) -> None:
        """Bring every environment to where its episode was saved.

        UnrepeatedEpisodeError if an environment does not repeat its episode; ValueError if the
        environments are others, or cannot be reset one by one with seeds.
        """
        self._require_repeatable(len(saved))
        if self.wrappers and not isinstance(self._adapter, OneEnvironment) and any(saved):
            raise UnrepeatedEpisodeError(
                f"env must repeat its episodes, but {type(self.wrappers[0]).__name__} has learned"
                " from several environments at once: repeat_episodes=False begins new ones"
            )
        for i, one in enumerate(saved):
            if one is not None:
                n = len(one.actions)
                last = one.actions[-1] if n else None
                self.present[i] = Episode(
                    one.number, None, _Taken(one.actions), n, last, one.sum_of_rewards
                )
        self._replay({i for i, one in enumerate(saved) if one is not None and one.waits})
        for now, then in zip(self.present, saved, strict=True):
            if now is not None and then is not None:
                found = flat(now.last_observation)
                if not np.array_equal(found, then.observation):
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
        if not self._adapter.can_repeat:
            raise ValueError(
                "env must reset each of its environments with a seed of its own where episodes are"
                f" repeated, got {type(self._env.unwrapped).__name__}: repeat_episodes=False begins"
                " new ones; or take SyncVectorEnv or AsyncVectorEnv, as"
                " gymnasium.make_vec(..., vectorization_mode='sync') makes it, with shared memory"
                " or the autoreset mode DISABLED"
            )

    def _replay(self, waiting: Iterable[int]) -> None:
        """Take the actions of all present episodes again, so that all end at the same time.

        Until its own episode begins, an environment takes any actions.
        """
        present = {i: episode for i, episode in enumerate(self.present) if episode is not None}
        taken = {i: episode.actions.array() for i, episode in present.items()}
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
            outcomes = [checked(outcome) for outcome in self._adapter.step(actions)]
            ended = {i for i, one in enumerate(outcomes) if one.terminated or one.truncated}
            for i, episode in present.items():
                if t < n_rounds - 1 or i not in waiting:
                    episode.observation = outcomes[i].observation
                else:
                    episode.outcome = outcomes[i]
