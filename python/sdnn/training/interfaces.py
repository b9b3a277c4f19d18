"""Environments and learners as a training calls them, and arguments that users expect elsewhere."""

from __future__ import annotations

import abc
import copy
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn.environments.types import AnyEnv, Array, Data, Element, Elements, Env, Info, Mask, Masks
from sdnn.support.arguments import flag, has_methods, reward_of, shown

if TYPE_CHECKING:
    from sdnn._core import Controller


import inspect

from sdnn.config import fields_of
from sdnn.support.arguments import explains_names

Seeds: TypeAlias = Mapping[int, int | None]
Options: TypeAlias = Data | None

_SCALARS = (np.generic, int, float)

_OLD_API = (
    "; an environment of Gym before 0.26 can be wrapped:"
    " shimmy.GymV21CompatibilityV0(env=env), from pip install shimmy"
)


def require_single(name: str, env: object) -> None:
    """Check that a value is one environment; TypeError that names the argument."""
    has_methods(name, env, "an environment, as of gymnasium.make(id)", "reset", "step")
    if isinstance(env, gym.vector.VectorEnv):
        raise TypeError(
            f"{name} must be a single environment, got a vector of them, {type(env).__name__}"
        )


class UnusableStepError(ValueError):
    """A step or reset of an environment cannot be used; the message names it and the reason."""


def has_action_masks(env: object) -> bool:
    """Return whether an environment, or a vector, tells which actions are allowed."""
    return bool((getattr(env, "metadata", None) or {}).get("action_masks"))


def mask_in(info: Info) -> Mask:
    """Return the mask in an info; UnusableStepError if there is none."""
    if "action_mask" not in info:
        raise UnusableStepError(
            "info must have 'action_mask', as metadata['action_masks'] of env is True,"
            f" got {shown(sorted(map(str, info)))}"
        )
    mask: Mask = info["action_mask"]
    return mask


def reset_env(env: AnyEnv, seed: Any, options: Options) -> tuple[Element, Info]:
    """Reset an environment, or a vector; return what is observed first, and the info.

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
    if not (isinstance(made, (tuple, list)) and len(made) == 5):
        n = len(made) if isinstance(made, (tuple, list)) else 1
        raise UnusableStepError(
            "env.step must return five values, (observation, reward, terminated, truncated, info),"
            f" got {n}{_OLD_API}"
        )
    return made


def checked_outcome(reward: Any, terminated: object, truncated: object) -> tuple[float, bool, bool]:
    """Return a finite float and bools; UnusableStepError for something else."""
    try:
        if type(reward) is not float:
            reward = reward_of(reward)
        if not math.isfinite(reward):
            raise ValueError(f"reward must be finite, got {reward}")
        if not type(terminated) is bool is type(truncated):
            terminated, truncated = flag("terminated", terminated), flag("truncated", truncated)
    except (TypeError, ValueError) as error:
        raise UnusableStepError(str(error)) from error
    return reward, terminated, truncated


def copied(value: Element) -> Element:
    """Copy what others may write to: environments may keep their state, or change an action."""
    if type(value) is np.ndarray:
        return value.copy()
    return value if isinstance(value, _SCALARS) else copy.deepcopy(value)


class EnvironmentAdapter(abc.ABC):
    """The interface of all environments, single and vectorized.

    ``can_repeat`` is whether each environment can be reset at any time, with a seed of its own.
    ``rewards``, ``terminated`` and ``truncated`` are those of the last step in each. ``masks`` are
    those of the actions allowed after the last reset or step in each, None where it has none; None
    altogether where `has_action_masks` is False.
    """

    n_environments: int
    can_repeat: bool
    rewards: list[float]
    terminated: list[bool]
    truncated: list[bool]
    masks: list[Mask] | None

    @abc.abstractmethod
    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Element]:
        """Begin episodes in some environments, with seeds; return their first observations.

        Where one is missing, the episode begins with the next `step`, which returns it.
        """

    @abc.abstractmethod
    def step(self, actions: Elements) -> Elements:
        """Take an action in each, any one where the episode has not begun.

        Returns what is observed, in an array or a list: the last observations where episodes end.
        """


class OneEnvironment(EnvironmentAdapter):
    """A single environment."""

    n_environments = 1
    can_repeat = True

    def __init__(self, env: Env) -> None:
        self._env = env
        self.rewards, self.terminated, self.truncated = [0.0], [False], [False]
        self.masks = [None] if has_action_masks(env) else None

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Element]:
        """Begin its episode."""
        first, info = reset_env(self._env, seeds[0], options)
        if self.masks is not None:
            self.masks = [mask_in(info)]
        return {0: first}

    def take(self, action: Element) -> tuple[Element, float, bool, bool]:
        """Take an action; return what a step gives but for the info."""
        observation, reward, terminated, truncated, info = step_env(self._env, copied(action))
        reward, terminated, truncated = checked_outcome(reward, terminated, truncated)
        if self.masks is not None:
            self.masks = [None if terminated else mask_in(info)]
        return observation, reward, terminated, truncated

    def step(self, actions: Elements) -> Elements:
        """Take the only action."""
        observation, self.rewards[0], self.terminated[0], self.truncated[0] = self.take(actions[0])
        return observation[np.newaxis] if type(observation) is np.ndarray else [observation]


class Transition(NamedTuple):
    """A step of an environment.

    ``terminated`` is Gymnasium's: the episode ended in a terminal state. An episode cut off by a
    time limit (``truncated``) is not terminated; its last transition is learned like any other.
    ``next_mask`` has 1 for the actions that are allowed in a next state, as `Agent.act` has it.
    """

    observation: ArrayLike
    action: Element
    reward: float
    next_observation: ArrayLike
    terminated: bool
    next_mask: Mask = None


class Learner(Protocol):
    """The interface of what is trained: every `sdnn.agents.Agent` has it.

    An agent that learns in one environment and is not saved needs only these methods, without the
    arguments ``environment`` and ``mask``. Where it has an attribute ``progress``, that is kept up
    to date.
    """

    def begin_episode(self) -> None:
        """Note that an episode begins."""

    def act(self, observation: Element, explore: bool = True) -> Element:
        """Choose an action; without `explore` nothing may be learned or remembered."""

    def learn(self, transition: Transition) -> None:
        """Learn a step."""


class EachLearner:
    """A learner in all environments of a training: it acts and learns in one after the other."""

    def __init__(self, learner: Any, n_environments: int) -> None:
        self._learner = learner
        self.progressing: Any = learner if hasattr(learner, "progress") else None
        """The object whose ``progress`` follows that of the training."""
        self.arguments: list[dict[str, int]] = [{}]
        """Arguments that name an environment, where there are several."""
        if n_environments > 1:
            self.arguments = [{"environment": i} for i in range(n_environments)]

    def begin_episode(self, environment: int) -> None:
        """Note that an episode begins."""
        self._learner.begin_episode(**self.arguments[environment])

    def read(self, name: str, observations: Elements) -> Elements:
        """Return observations as `act` and `learn` take them, copied; ValueError names them."""
        return [copied(observation) for observation in observations]

    def flat(self, observation: Element) -> NDArray[np.float64]:
        """Return the numbers of an observation that was read, for a file."""
        return np.asarray(self._learner.flat_observation(observation))

    def masks(self, masks: list[Mask]) -> Masks:
        """Return masks of all environments as `act` and `learn` take them; ValueError names one."""
        return masks

    def act(
        self,
        observations: Elements,
        actions: Elements,
        environments: list[int],
        masks: Masks | None = None,
    ) -> Elements:
        """Return actions as `learn` takes them: new ones in these, the others as they were."""
        chosen = list(actions)
        for i in environments:
            mask = {} if masks is None else {"mask": masks[i]}
            chosen[i] = self._learner.act(observations[i], **self.arguments[i], **mask)
        return chosen

    def elements(self, actions: Elements) -> Elements:
        """Return the elements of the action space that `act` has chosen."""
        return actions

    def learn(
        self,
        observations: Elements,
        actions: Elements,
        rewards: list[float],
        next_observations: Elements,
        terminated: list[bool],
        environments: list[int],
        progress: list[float],
        next_masks: Masks | None = None,
    ) -> int:
        """Learn steps in the first of these environments or more; return in how many.

        ``progress`` is the learner's between two of them; it may be empty.
        """
        i = environments[0]
        reward, terminates, _ = checked_outcome(rewards[i], terminated[i], False)
        mask = None if next_masks is None else next_masks[i]
        step = Transition(
            observations[i], actions[i], reward, next_observations[i], terminates, mask
        )
        self._learner.learn(step, **self.arguments[i])
        return 1


class CoreParts(NamedTuple):
    """The core of an agent, and functions around it."""

    core: Controller
    read: Callable[[str, Elements], NDArray[np.float64]]
    elements: Callable[[NDArray[np.float64]], Array]
    mask: Callable[[str, Mask], NDArray[np.uint8] | None]


class _CoreLearner(EachLearner):
    """An agent of the core, which acts or learns in all environments with one call."""

    def __init__(self, learner: Learner, n_environments: int, parts: CoreParts) -> None:
        super().__init__(learner, n_environments)
        self.progressing = self._core = parts.core
        self._read, self._elements, self._mask = parts.read, parts.elements, parts.mask
        self._n_actions = sum(parts.core.n_actions)

    def read(self, name: str, observations: Elements) -> NDArray[np.float64]:
        return self._read(name, observations)

    def flat(self, observation: Element) -> NDArray[np.float64]:
        return np.array(observation)

    def masks(self, masks: list[Mask]) -> NDArray[np.uint8]:
        rows = np.ones((len(masks), self._n_actions), np.uint8)
        for i, mask in enumerate(masks):
            if (row := self._mask("action_mask", mask)) is not None:
                rows[i] = row
        return rows

    def act(
        self,
        observations: Elements,
        actions: Elements,
        environments: list[int],
        masks: Any = None,
    ) -> NDArray[np.float64]:
        chosen = self._core.act_each(observations, environments, masks)
        if len(environments) < len(chosen):
            for i in set(range(len(chosen))).difference(environments):
                chosen[i] = np.ravel(actions[i])  # an element of the space after a replay
        return chosen

    def elements(self, actions: Any) -> Array:
        return self._elements(actions)

    def learn(self, *outcomes: Any) -> int:
        return self._core.learn_each(*outcomes)


def each_learner(learner: Learner, n_environments: int) -> EachLearner:
    """Return a learner in all environments; an agent of the core acts and learns in one call."""
    core_parts: Callable[..., CoreParts | None] | None = getattr(type(learner), "core_parts", None)
    if core_parts and (parts := core_parts(learner)):
        return _CoreLearner(learner, n_environments, parts)
    return EachLearner(learner, n_environments)


_OF_TRAIN = (
    "steps", "episodes", "callbacks", "progress", "evaluate_every", "evaluation_env",
    "evaluation_episodes",
)  # fmt: skip


def _elsewhere(agent: Any) -> Mapping[str, str]:
    """Return the settings of an agent or a class of agents, and how they are written."""
    spellings = {name: f"train(env, {name}=...)" for name in _OF_TRAIN}
    agent_class = agent if isinstance(agent, type) else type(agent)
    if not hasattr(agent_class, "learning_type"):
        return spellings
    for part in ("approximator", "learning"):
        config_type = getattr(agent_class, f"{part}_type")
        for field in fields_of(config_type):
            meaning = field.doc.partition(".")[0]
            inner = f"{part}={config_type.__name__}({field.name}=...)"
            spellings[field.name] = f"{agent_class.__name__}(env, {inner}) ({meaning})"
    for name in inspect.signature(agent_class).parameters:
        spellings.setdefault(name, f"{agent_class.__name__}(env, {name}=...)")
    return spellings


explained = explains_names(_elsewhere)
"""Decorator of agents' functions, which explains arguments that they do not have."""
