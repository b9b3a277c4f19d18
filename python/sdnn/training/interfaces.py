"""Interfaces of environments and learners: what they are called with, and what they return."""

from __future__ import annotations

import abc
import inspect
import math
import warnings
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn._core import Controller
from sdnn.config import fields_of
from sdnn.environments.types import Array, Data, Element, Elements, Info, Mask, Masks
from sdnn.support.arguments import duration_of, explains_names, shown
from sdnn.support.habits import advice

Seeds: TypeAlias = Mapping[int, int | None]
"""The seed of a reset in each environment that is reset; None: a reset without a seed."""
Options: TypeAlias = Data | None
"""The options of a reset."""

LONG = 2_000
"""Steps in each environment after which a training without a terminated episode is a long one."""
_LARGEST_DISCOUNT = 0.998
"""Largest discount with which values are learned reliably where nothing terminates.

Chosen below 0.999, with which Pendulum's median return of five seeds after 60,000 steps fell from
-173 (0.99) to -286; docs/how-to/choosing-settings.md.
"""


class UnusableStepError(ValueError):
    """A step or reset of an environment cannot be used; the message names it and the reason."""


class UnrepeatedEpisodeError(ValueError):
    """An environment does not repeat the episode in which a training was saved."""


_ANNOUNCED_BY = {"action_mask": "action_masks", "dt": "durations"}
"""The key of the metadata that announces a key of every info."""


def missing_in_info(key: str, keys: Iterable[object], where: str = "info") -> UnusableStepError:
    """Return the error about an info that lacks a key which the metadata announce."""
    meaning = ", the duration of the step in usual steps" if key == "dt" else ""
    return UnusableStepError(
        f"{where} must have {key!r}{meaning}, as metadata[{_ANNOUNCED_BY[key]!r}] of env is True,"
        f" got {shown(sorted(map(str, keys)))}"
    )


def duration_in(info: Info) -> float:
    """Return the duration of a step in an info; UnusableStepError if there is none."""
    if "dt" not in info:
        raise missing_in_info("dt", info)
    try:
        dt = duration_of(info["dt"])
    except ValueError as error:
        raise UnusableStepError(str(error)) from error
    if not math.isfinite(dt):
        raise UnusableStepError(f"dt must be finite, got {dt}")
    return dt


def mask_in(info: Info) -> Mask:
    """Return the mask in an info; UnusableStepError if there is none."""
    if "action_mask" not in info:
        raise missing_in_info("action_mask", info)
    mask: Mask = info["action_mask"]
    return mask


class EnvironmentAdapter(abc.ABC):
    """The interface of all environments, single and vectorized.

    Lists have an entry for each environment.
    """

    n_environments: int
    can_repeat: bool
    """Whether each environment can be reset at any time, with a separate seed."""
    rewards: list[float]
    """Rewards of the last step, finite."""
    terminated: list[bool]
    truncated: list[bool]
    masks: list[Mask] | None
    """Masks of the actions that are allowed after the last step or reset, None in terminal states.

    None altogether where the environment's metadata have no ``"action_masks"``.
    """
    dts: list[float] | None
    """Durations of the last step; None altogether without ``"durations"`` in the metadata."""

    @abc.abstractmethod
    def __init__(self, env: Any) -> None: ...

    @abc.abstractmethod
    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Element]:
        """Begin episodes in some environments, with seeds; return their first observations.

        Where an observation is missing, the episode begins with the next `step`, which returns it.
        """

    @abc.abstractmethod
    def step(self, actions: Elements) -> Elements:
        """Step all environments; the action has no effect where the episode has not begun.

        Returns the observations; where an episode ends, its last one.
        """


class Transition(NamedTuple):
    """A step of an environment.

    ``terminated`` is Gymnasium's: the episode ended in a terminal state. An episode cut off by a
    time limit (``truncated``) is not terminated; its last transition is learned like any other.
    ``next_mask`` has 1 for the actions that are allowed in a next state, as `Agent.act` has it.
    Where an episode is cut off in a state in which no action is allowed, no value can follow:
    ``terminated`` must be True then, as `Agent.train`, `learn_from` and `imitate` make it.
    ``dt`` is the step's duration in usual steps, from 0.001 to 1,000,000: the discount of the next
    state's value is ``discount ** dt``.
    """

    observation: ArrayLike
    action: Element
    reward: float
    next_observation: ArrayLike
    terminated: bool
    next_mask: Mask = None
    dt: float = 1.0


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


class ObservingLearner(Protocol):
    """The methods that `Episodes` calls of a learner in several environments."""

    def begin_episode(self, environment: int) -> None:
        """Note that an episode begins."""

    def read(self, name: str, observations: Elements, /) -> Elements:
        """Return observations as `act` and `learn` take them, copied; ValueError names them."""

    def flat(self, observation: Element) -> NDArray[np.float64]:
        """Return the numbers of an observation that was read, for a file."""

    def masks(self, masks: list[Mask]) -> Masks:
        """Return masks of all environments as `act` and `learn` take them; ValueError names one."""


class CoreParts(NamedTuple):
    """The C++ object of an agent, and the functions that make what it takes.

    ``read`` makes rows of observed variables from observations, and ``mask`` flags from a mask; the
    name before them is for errors. ``batch`` makes an array of actions, with zeros for None.
    """

    core: Controller
    read: Callable[[str, Elements], NDArray[np.float64]]
    batch: Callable[[Elements], Array]
    mask: Callable[[str, Mask], NDArray[np.uint8] | None]


_OF_TRAIN = (
    "steps", "episodes", "callbacks", "progress", "evaluate_every", "evaluation_env",
    "evaluation_episodes",
)  # fmt: skip


def _spellings(agent: Any) -> Mapping[str, str]:
    """Return how to write each argument that belongs to another call, such as `train`."""
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


explained = explains_names(_spellings)
"""Decorator for functions of agents: errors about unknown arguments say where these belong."""


class Advised:
    """An agent whose missing attributes are explained where other libraries have them."""

    if not TYPE_CHECKING:  # type checkers would accept every name

        def __getattr__(self, name: str) -> object:
            """Suggest the right name for an attribute that other libraries' agents have."""
            agent_class = type(self)
            if not name.startswith("_") and not hasattr(agent_class, name):
                elsewhere = {
                    field.name: f"{part}.{field.name}"
                    for part in ("approximator", "learning")
                    for field in fields_of(getattr(agent_class, f"{part}_type"))
                }
                elsewhere |= {public: public for public in dir(agent_class) if public[0] != "_"}
                # Names like `progress_bar` must not lead to the progress of schedules.
                del elsewhere["progress"]
                if hint := advice(name, (), elsewhere):
                    raise AttributeError(f"{agent_class.__name__} has no {name}: {hint}")
            return object.__getattribute__(self, name)  # raises its own error


def warn_of_endless_episode(n_steps: int) -> None:
    """Warn that an episode has had a number of steps and continues."""
    warnings.warn(
        f"an episode has had {n_steps:,} steps and continues. If the task can begin anew, end"
        " episodes by a time limit (max_episode_steps): an agent that stays in a few states learns"
        " little of all others, unless it makes excursions like SDNNQLambda, and a greedy episode"
        " may never end",
        RuntimeWarning,
        stacklevel=3,
    )


def warn_of_horizon(agent: Any) -> None:
    """Warn of a discount near 1 in a long training in which no episode has terminated."""
    discount = getattr(getattr(agent, "learning", None), "discount", 0.0)
    if discount > _LARGEST_DISCOUNT:
        warnings.warn(
            f"no episode of this training has terminated in {LONG:,} steps: with a discount of"
            f" {discount:g} values become so large that differences between actions are hardly"
            " learned. Unless episodes"
            f" will terminate, take learning.discount=0.99, or at most {_LARGEST_DISCOUNT}",
            RuntimeWarning,
            stacklevel=3,
        )
