"""Episodes of a training: steps of its environments, and how episodes are repeated."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np

from sdnn.environments.spaces import allows_no_action
from sdnn.environments.types import AnyEnv, Data, Element, Elements, Env, Info, Masks
from sdnn.support.arguments import flag, reward_of, shown
from sdnn.training.files import (
    MOST_RECENT,
    ActionLog,
    SavedEpisode,
    Statistics,
    copied,
    learning_wrappers,
    names_of,
    statistics_of,
)
from sdnn.training.interfaces import (
    EnvironmentAdapter,
    ObservingLearner,
    Options,
    Seeds,
    UnrepeatedEpisodeError,
    UnusableStepError,
    duration_in,
    mask_in,
    warn_of_endless_episode,
)

_LEARNING, EVALUATION = 0, 1  # purposes of episodes, for `episode_seed`
_ENDLESS = 10_000  # warn after this many steps in one episode; a chosen number

_OLD_API = (
    "; an environment of Gym before 0.26 can be wrapped:"
    " shimmy.GymV21CompatibilityV0(env=env), from pip install shimmy"
)


def announces(env: object, what: str) -> bool:
    """Return whether the metadata of an environment, or a vector, announce an entry of infos.

    ``what`` is ``"action_masks"`` or ``"durations"``.
    """
    return bool((getattr(env, "metadata", None) or {}).get(what))


def reset_env(env: AnyEnv, seed: Any, options: Options) -> tuple[Element, Info]:
    """Reset an environment, or a vector; return the first observation and the info.

    UnusableStepError if it returns something else than an observation and a dictionary.
    """
    made = env.reset(seed=seed, options=options)
    if not (isinstance(made, tuple | list) and len(made) == 2 and isinstance(made[1], Mapping)):
        raise UnusableStepError(
            f"env.reset must return (observation, info), info a dictionary, got {shown(made)}"
            f"{_OLD_API}"
        )
    return made[0], made[1]


def step_env(env: AnyEnv, action: Element) -> Sequence[Any]:
    """Step an environment, or a vector; UnusableStepError if it does not return five values."""
    made = env.step(action)
    n = len(made) if isinstance(made, (tuple, list)) else 1
    if n == 5:
        return made
    raise UnusableStepError(
        "env.step must return five values, (observation, reward, terminated, truncated, info),"
        f" got {n}{_OLD_API}"
    )


def checked_outcome(reward: Any, terminated: object, truncated: object) -> tuple[float, bool, bool]:
    """Return a finite float and bools; UnusableStepError for something else."""
    try:
        if type(reward) is not float:
            reward = reward_of(reward)
        if not math.isfinite(reward):
            raise ValueError(f"reward must be finite, got {reward}")
        terminated, truncated = flag("terminated", terminated), flag("truncated", truncated)
    except (TypeError, ValueError) as error:
        raise UnusableStepError(str(error)) from error
    return reward, terminated, truncated


class SingleEnvironment(EnvironmentAdapter):
    """A single environment."""

    n_environments = 1
    can_repeat = True

    def __init__(self, env: Env) -> None:
        self._env = env
        is_scalar = isinstance(env.action_space, gym.spaces.Box) and env.action_space.shape == ()
        # The action of a Box without dimensions is an array, which `copied` would not keep.
        self._copied: Callable[[Element], Element] = np.array if is_scalar else copied
        self.rewards, self.terminated, self.truncated = [0.0], [False], [False]
        self.masks = [None] if announces(env, "action_masks") else None
        self.dts = [1.0] if announces(env, "durations") else None

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Element]:
        """Begin an episode with the seed of environment 0."""
        first, info = reset_env(self._env, seeds[0], options)
        if self.masks is not None:
            self.masks = [mask_in(info)]
        return {0: first}

    def take(self, action: Element) -> tuple[Element, float, bool, bool]:
        """Step the environment; return observation, reward, terminated and truncated."""
        observation, reward, terminated, truncated, info = step_env(self._env, self._copied(action))
        is_usual = type(reward) is float and type(terminated) is bool is type(truncated)
        if not (is_usual and math.isfinite(reward)):  # without a call in the usual case
            reward, terminated, truncated = checked_outcome(reward, terminated, truncated)
        if self.masks is not None:
            self.masks = [None if terminated else mask_in(info)]
        if self.dts is not None:
            self.dts = [duration_in(info)]
        return observation, reward, terminated, truncated

    def step(self, actions: Elements) -> Elements:
        """Step the environment with the action of environment 0, and return a batch of one."""
        observation, self.rewards[0], self.terminated[0], self.truncated[0] = self.take(actions[0])
        return [observation]


def episode_seed(seed: int, purpose: int, episode: int) -> int:
    """Return the seed of an episode's `reset`: another one for learning than for evaluation."""
    sequence = np.random.SeedSequence(seed, spawn_key=(purpose, episode))
    word = int(sequence.generate_state(1, np.uint32)[0])
    return word % 2**31  # some environments refuse larger seeds


@dataclass(slots=True, eq=False)
class Episode:
    """The state of an episode; ``actions`` are kept where it may be repeated."""

    number: int
    actions: ActionLog = field(default_factory=ActionLog)
    n_steps: int = 0
    sum_of_rewards: float = 0.0


class Episodes:
    """The episodes in all environments of a training: begins, steps and repeats them.

    ``seed`` is the root of the episodes' seeds; None: resets have no seeds. ``first`` is the number
    of the first episode, from 0. ``unusable`` makes the error about a step or reset from its cause
    and from the environment, None if any may be the cause.

    Attributes
    ----------
    present : list of (Episode or None)
        In each environment; None: the next one has not begun.
    next_number : int
        The number of the episode that begins next.
    unlearned : list of int
        Environments whose last step is to be learned, in order.
    observations, previous_observations, actions, masks
        The latest observations, those before the last step, the actions of that step, and the masks
        of the latest observations where environments have them, as the learner reads them.
    options : callable
        Returns the options of a reset from the number of the episode, counted from 1.
    adapter : EnvironmentAdapter
        Has the outcome of the last step: rewards, ends, durations.
    wrappers, learned : list
        The wrappers that learn, and what they had learned when the last episode began.
    """

    observations: Elements
    previous_observations: Elements

    def __init__(
        self,
        env: AnyEnv,
        adapter: EnvironmentAdapter,
        learner: ObservingLearner,
        seed: int | None,
        first: int,
        options: Callable[[int], Data | None],
        unusable: Callable[[Exception, int | None], UnusableStepError],
    ) -> None:
        self._env, self._seed, self.options = env, seed, options
        self._unusable, self._learner = unusable, learner
        self.adapter = adapter
        self.wrappers = learning_wrappers(env)
        self.learned: list[Statistics] = []
        n = self.n_environments = adapter.n_environments
        self.next_number = first
        self.present: list[Episode | None] = [None] * n
        self.unlearned: list[int] = []
        self.actions: Elements = [None] * n
        self.masks: Masks | None = None
        self._environments = list(range(n))
        self._begins_with_step: dict[int, int] = {}
        """Numbers of the episodes that begin with the next step, by environment."""
        self._n_unpacked = 0
        """Rounds of steps since recent actions were packed; see `ActionLog`."""

    @property
    def learned_before(self) -> list[Statistics]:
        """Statistics of the wrappers before the present episodes began, if there are any."""
        return self.learned if any(self.present) else statistics_of(self.wrappers)

    def abandon(self) -> None:
        """Abandon all present episodes: the next step begins new ones, with other seeds."""
        self.adapter = type(self.adapter)(self._env)  # without the outcome of the last step
        self.present[:] = [None] * self.n_environments
        self.unlearned = []
        self._begins_with_step = {}

    def begin(self) -> None:
        """Begin episodes where none is present.

        Some vectors begin them with their next step only.
        """
        present = self.present
        self.unlearned = self._environments.copy()
        if None not in present:
            return
        over = [i for i, episode in enumerate(present) if episode is None]
        numbers = {i: self.next_number + k for k, i in enumerate(over)}
        self.next_number += len(over)
        self.learned = statistics_of(self.wrappers)
        first_observations = self._reset(numbers)
        for i in first_observations:
            present[i] = Episode(numbers.pop(i))
        self._store_first_observations(first_observations)
        for i in first_observations:
            self._learner.begin_episode(i)
        self._begins_with_step = numbers  # those without a first observation yet
        self.unlearned = [i for i in self._environments if present[i] is not None]

    def step(self, actions: Elements) -> None:
        """Step every environment; begin the episodes that some vectors begin with the step."""
        self.actions, self.previous_observations = actions, self.observations
        has_seeds = self._seed is not None
        for i in self.unlearned:
            episode: Any = self.present[i]
            episode.n_steps += 1
            if has_seeds:
                episode.actions.recent.append(actions[i])
        self._n_unpacked += 1
        if self._n_unpacked == MOST_RECENT:
            self._n_unpacked = 0
            for present in filter(None, self.present):
                present.actions.pack()
        try:
            observations = self.adapter.step(actions)
        except UnusableStepError as error:
            raise self._unusable(error, None) from error
        self.observations = self._read("next_observation", observations)
        if self._begins_with_step:
            for i, number in self._begins_with_step.items():
                self.present[i] = Episode(number)
                self._learner.begin_episode(i)
            self._begins_with_step = {}

    def is_over(self, environment: int) -> bool:
        """Return whether the last step has ended the episode of an environment."""
        return self.adapter.terminated[environment] or self.adapter.truncated[environment]

    def terminal(self, limit_bootstraps: bool) -> list[bool]:
        """Return in which environments the last step is learned without a value that follows it.

        These are steps that terminated an episode, those that truncated it in a state in which no
        action is allowed, and unless ``limit_bootstraps`` all that truncated it.
        """
        terminated, truncated = self.adapter.terminated, self.adapter.truncated
        if not any(truncated):
            return terminated
        return [
            terminated[i] or (truncated[i] and not (limit_bootstraps and self._can_act(i)))
            for i in self._environments
        ]

    def _can_act(self, environment: int) -> bool:
        """Return whether an action is allowed in the latest state of an environment."""
        masks = self.adapter.masks
        if masks is None:
            return True
        space = getattr(self._env, "single_action_space", self._env.action_space)
        try:
            return not allows_no_action(space, "action_mask", masks[environment])
        except ValueError:  # the learner refuses the mask, or it has masks of another form
            return True

    def note_learned(self, n: int) -> int:
        """Remove n environments from the beginning of `unlearned`; return the last of them.

        Their rewards are added to those of their episodes.
        """
        environments, rewards = self.unlearned[:n], self.adapter.rewards
        del self.unlearned[:n]
        for i in environments:
            episode: Any = self.present[i]
            episode.sum_of_rewards += rewards[i]
            if episode.n_steps == _ENDLESS and not self.is_over(i):
                warn_of_endless_episode(_ENDLESS)
        return environments[-1]

    def _reset(self, numbers: Mapping[int, int]) -> dict[int, Element]:
        """Reset environments (keys) for episodes of these numbers; return first observations."""
        seeds = {
            i: None if self._seed is None else episode_seed(self._seed, _LEARNING, number)
            for i, number in numbers.items()
        }
        return self.adapter.reset(seeds, self.options(1 + max(numbers.values())))

    def _store_first_observations(self, first_observations: dict[int, Element]) -> None:
        """Store the first observations of episodes that have begun, as the learner reads them."""
        if len(first_observations) == self.n_environments:
            observations = list(first_observations.values())
            self.observations = self._read("observation", observations)
        else:
            for i, first in first_observations.items():
                self.observations[i] = self._read("observation", [first])[0]

    def _read(self, name: str, observations: Elements) -> Elements:
        """Read observations and all masks; a ValueError becomes an error that names the step."""
        read = self._learner.read
        try:
            rows = read(name, observations)
            if self.adapter.masks is not None:
                self.masks = self._learner.masks(self.adapter.masks)
        except ValueError as error:
            raise self._unusable(error, None) from error
        return rows

    def saved(self, shape: tuple[int, ...]) -> list[SavedEpisode | None]:
        """Return the present episodes for a file; ``shape`` is the shape of an action."""
        saved: list[SavedEpisode | None] = [None] * self.n_environments
        for i, episode in enumerate(self.present):
            if episode is not None:
                saved[i] = SavedEpisode(
                    number=episode.number,
                    sum_of_rewards=episode.sum_of_rewards,
                    actions=episode.actions.array().reshape((-1, *shape)),
                    observation=self._learner.flat(self.observations[i]),
                    waits=i in self.unlearned,
                )
        return saved

    def repeat(self, saved: Sequence[SavedEpisode | None]) -> None:
        """Replay saved episodes, so that every environment is in the state in which it was saved.

        UnrepeatedEpisodeError if an environment does not repeat its episode; ValueError if the
        environments are others, or cannot be reset one by one with seeds.
        """
        self._require_repeatable(len(saved))
        if self.wrappers and not isinstance(self.adapter, SingleEnvironment) and any(saved):
            raise UnrepeatedEpisodeError(
                f"env must repeat its episodes, but {type(self.wrappers[0]).__name__} has learned"
                " from several environments at once: repeat_episodes=False begins new ones"
            )
        for i, episode in enumerate(saved):
            if episode is not None:
                actions = ActionLog(episode.actions)
                self.present[i] = Episode(
                    episode.number, actions, len(episode.actions), episode.sum_of_rewards
                )
        self._replay()
        self.unlearned = [i for i, e in enumerate(saved) if e is not None and e.waits]
        for i, episode in enumerate(saved):
            if episode is None:
                continue
            observation = self._learner.flat(self.observations[i])
            if not np.array_equal(observation, episode.observation, equal_nan=True):
                raise UnrepeatedEpisodeError(
                    "env must repeat the episode in which the training was saved: the same seed"
                    f" and actions led to {observation}, not to {episode.observation}. One of"
                    f" {names_of(self._env)} draws without the seed or remembers earlier episodes:"
                    " repeat_episodes=False begins a new one"
                )

    def _require_repeatable(self, n_saved: int) -> None:
        """Refuse to repeat episodes in an environment where they could differ."""
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
        """Take the actions of all present episodes again, so that all end with the same step.

        A vector steps all environments at once, so shorter episodes begin later. With episodes of 5
        and 2 steps there are 5 rounds: in rounds 0 to 2 environment 1 takes part with a copy of the
        longest episode; before round 3 it is reset with the seed of its own episode.
        """
        present = {i: episode for i, episode in enumerate(self.present) if episode is not None}
        if not present:
            return
        actions = {i: episode.actions.array() for i, episode in present.items()}
        n_rounds = max(map(len, actions.values()))
        first_round = {i: n_rounds - len(array) for i, array in actions.items()}
        longest = next(i for i, first in first_round.items() if first == 0)
        over = set(self._environments)
        for t in range(n_rounds + 1):  # episodes without actions begin after the last round
            numbers = {i: present[i].number for i, first in first_round.items() if first == t}
            if t < n_rounds or n_rounds == 0:
                numbers = dict.fromkeys(over, present[longest].number) | numbers
            if numbers:
                self._store_first_observations(self._reset(dict(sorted(numbers.items()))))
            if t == n_rounds:
                return
            self.actions = [
                actions[i][t - first_round[i]]
                if i in present and t >= first_round[i]
                else actions[longest][t]
                for i in self._environments
            ]
            observations = self.adapter.step(self.actions)
            self.previous_observations = self.observations
            self.observations = self._read("next_observation", observations)
            over = {i for i in self._environments if self.is_over(i)}
