"""Agents as trainings and robots call them: Gymnasium's spaces around the core's controller."""

from __future__ import annotations

import abc
import secrets
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, Generic, TypeVar, cast

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.agents.presets import Preset
from sdnn.agents.scaling import Scaling
from sdnn.approximators.sdnn_c import pattern_tables
from sdnn.config import WARM_UP, values_of
from sdnn.environments.space_kinds import (
    Observed,
    require_same_variables,
    require_unbatched,
    space_data,
    spaces_of,
)
from sdnn.environments.spaces import (
    Actions,
    AnglePairs,
    History,
    Inputs,
    Missing,
    Observations,
    Ranges,
    controller_error,
)
from sdnn.environments.types import Element, Mask, Space
from sdnn.support.arguments import (
    choice,
    duration_of,
    flag,
    is_of_class,
    path_of,
    real,
    require,
    reward_of,
    seed_of,
    shown,
    whole,
)
from sdnn.support.files import Arrays, Description, write_file
from sdnn.training.files import CLASSES, Statistics
from sdnn.training.interfaces import Advised, CoreParts, Transition, explained

_MOST_ENVIRONMENTS = 2**14

Approximator = TypeVar("Approximator")
Learning = TypeVar("Learning")


def presets_of(listed: Mapping[str, tuple[Any, ...]]) -> Mapping[str, Preset]:
    """Make presets from those of the core, by name.

    Each is a tuple of title, approximator, learning and perhaps settings of observations.
    """
    presets = {}
    for name, settings in listed.items():
        observed = settings[3] if len(settings) > 3 else _core.ObservationConfig()
        presets[name] = Preset(*settings[:3])._replace(
            angle_pairs="find" if observed.find_angle_pairs else "none",
            inputs="relevant" if observed.relevant_only else "all",
            history=observed.history,
            observation_range="running" if observed.running else None,
            narrows_ranges=observed.narrowed,
        )
    return MappingProxyType(presets)


class BaseAgent(Advised, abc.ABC, Generic[Approximator, Learning]):
    """An agent that acts, learns and can be saved; `Agent` adds trainings and properties."""

    kind: ClassVar[str]
    """The name of this approximator and learning rule in files."""
    approximator_type: ClassVar[type[Any]]
    learning_type: ClassVar[type[Any]]
    presets: ClassVar[Mapping[str, Preset]]
    """Settings by name."""
    default_preset: ClassVar[str] = "general"
    wrappers: Sequence[Statistics] = ()
    """Statistics of the wrappers of the training environment; kept in the agent's file."""
    learning: Learning
    _approximator: Approximator
    _controller: _core.Controller
    _scaling: Scaling | None = None
    _next_episode = 0  # number of the next episode of `train` without a seed
    _has_warned = False  # whether a warning named a refused reward
    has_bounds = True
    """Whether the spaces have an environment's bounds; False for agents made in C++ from ranges."""

    @explained
    def __init__(
        self,
        observation_space: Observed | str,
        action_space: Space | None = None,
        *,
        approximator: Approximator | None = None,
        learning: Learning | None = None,
        seed: int | None = 0,
        tables: Sequence[ArrayLike] | None = None,
        preset: str | None = None,
        observation_range: Ranges | None = None,
        angles: Sequence[int] = (),
        angle_pairs: AnglePairs | None = None,
        inputs: Inputs | None = None,
        warm_up_steps: int = WARM_UP.default,
        missing: Missing = "error",
        history: History | None = None,
    ) -> None:
        chosen = choice("preset", self.default_preset if preset is None else preset, self.presets)
        observations, actions = spaces_of(observation_space, action_space)
        self._take_spaces(observations, actions)
        require_unbatched(observations, actions)
        try:
            space_data(observations)  # refuse spaces that cannot be saved
        except TypeError as error:
            raise TypeError(f"observation_space {error}") from None
        self._take_settings(
            chosen.approximator if approximator is None else approximator,
            chosen.learning if learning is None else learning,
            seed,
            warm_up_steps,
        )
        codes_missing = isinstance(missing, str) and missing == "code"
        default_history = "none" if codes_missing else chosen.history
        self._observation = self._observations.config(
            chosen.observation_range if observation_range is None else observation_range,
            angles,
            chosen.angle_pairs if angle_pairs is None else angle_pairs,
            chosen.inputs if inputs is None else inputs,
            missing=missing,
            history=default_history if history is None else history,
            narrows=chosen.narrows_ranges,
        )
        self._action = self._actions.config
        self._make_controller(tables=[] if tables is None else list(pattern_tables(tables)))

    def _take_spaces(self, observations: Space, actions: Space) -> None:
        """Store the spaces; TypeError or ValueError if agents cannot use them."""
        self._observations = Observations(observations)
        self._actions = Actions(actions)

    @property
    def observation_space(self) -> Space:
        """The space of the observations, whose bounds environments must have.

        May be set to one with other bounds, where the units are the same: ranges stay.
        """
        return self._observations.space

    @observation_space.setter
    def observation_space(self, space: Space) -> None:
        observations = Observations(space)
        require_same_variables(self.observation_space, space)
        self._observations, self.has_bounds = observations, True

    @property
    def action_space(self) -> Space:
        """The space of the actions."""
        return self._actions.space

    def _take_settings(self, approximator: Any, learning: Any, seed: Any, steps: Any) -> None:
        """Check and store the arguments of the constructor that are no spaces."""
        for name, config in (("approximator", approximator), ("learning", learning)):
            cls: type[Any] = getattr(self, f"{name}_type")
            require(is_of_class(config, cls), name, f"be a {cls.__name__}", config, TypeError)
        self._approximator, self.learning = approximator, learning
        self.seed = secrets.randbits(63) if seed is None else seed_of(seed)
        self._warm_up_steps = whole("warm_up_steps", steps, int(WARM_UP.low), int(WARM_UP.high))

    def _make_controller(self, **made_of: Any) -> None:
        """Make the compiled agent, from pattern tables or from a saved state (`made_of`)."""
        try:
            self._controller = _core.Controller(
                approximator=cast(Any, self._approximator),
                learning=cast(Any, self.learning),
                seed=self.seed,
                observation=self._observation,
                action=self._action,
                warm_up_steps=self._warm_up_steps,
                **made_of,
            )
        except ValueError as error:
            raise controller_error(error, self._observations, self._actions) from None

    @property
    def approximator(self) -> Approximator:
        """Settings as used; sizes that follow from the spaces are known after the warm-up."""
        return cast(Approximator, self._controller.approximator)

    @property
    def is_warming_up(self) -> bool:
        """Whether the agent still acts at random to see the ranges of its observations."""
        return self._controller.is_warming_up

    @property
    def missing(self) -> str:
        """The treatment of missing readings: ``"error"``, ``"hold"`` or ``"code"``."""
        return self._observation.missing

    @property
    def history(self) -> str:
        """The part of earlier observations in states; ``"auto"`` until the warm-up chose it."""
        if self.is_warming_up:
            return self._observation.history
        return self._controller.history

    @property
    def finds_history(self) -> bool:
        """Whether the warm-up decides what states have of earlier observations."""
        return self._observation.history == "auto" and self._controller.has_warm_up

    @property
    def progress(self) -> float:
        """The part of the learning that is done, in [0, 1], for schedules; ``train`` sets it."""
        return self._controller.progress

    @progress.setter
    def progress(self, progress: float) -> None:
        self._controller.progress = real("progress", progress)

    @property
    def n_environments(self) -> int:
        """Number of environments in which the agent learns at once, from 1 to 2**14; may be set.

        Each, from number 0, has a separate episode; everything else is shared. Pending transitions
        of removed environments are learned first. `train` sets it.
        """
        return self._controller.n_environments

    @n_environments.setter
    def n_environments(self, n: int) -> None:
        self._controller.n_environments = whole("n_environments", n, 1, _MOST_ENVIRONMENTS)

    def _check_environment(self, environment: int) -> None:
        """Raise ValueError unless there is an environment of this number."""
        if type(environment) is not int or environment:  # fast path: most agents have only 0
            whole("environment", environment, 0, self.n_environments - 1)

    def begin_episode(self, environment: int = 0) -> None:
        """Begin an episode; `learn` begins none, even after a terminated transition.

        Resets the count of greedy first steps, and learns the pending transitions.
        """
        self._check_environment(environment)
        self._controller.begin_episode(environment)

    def begin_greedy_episode(self) -> None:
        """Note that a greedy episode begins; `evaluate` calls this before each episode."""
        self._controller.begin_greedy_episode()

    @explained
    def act(
        self, observation: Element, explore: bool = True, environment: int = 0, mask: Mask = None
    ) -> Element:
        """Return the action to take, an element of the action space.

        Parameters
        ----------
        observation : element of the observation space
        explore : bool
            False: always a best action, and no effect on the agent's later learning. Several
            threads may do so at the same time; `learn` waits for them.
        environment : int
            In which environment, below `n_environments`.
        mask : array_like, optional
            1 for the discrete actions that are allowed, 0 for others: of a Discrete space shape
            (n,), of others a tuple with the mask of each dimension.

        Raises
        ------
        TypeError, ValueError
            If an argument is not usable, such as an observation that holds NaN; see
            ``missing``.
        """
        explore = flag("explore", explore)
        self._check_environment(environment)
        variables = self._observations.vector("observation", observation)
        allowed = self._actions.mask("mask", mask)
        numbers = self._controller.act(variables, explore, environment, allowed)
        self._actions.has_masks |= explore and allowed is not None
        return self._actions.element(numbers)

    def flat_observation(self, observation: Element) -> NDArray[np.float64]:
        """Return the observed variables as a vector, shape (n_variables,), in their own units.

        Missing readings are NaN. ValueError if the observation has another shape, or holds some
        that the agent refuses.
        """
        vector: NDArray[np.float64] = self._observations.rows("observation", [observation])[0]
        is_read = np.isfinite(vector)
        if self.missing == "error":
            require(is_read.all(), "observation", "be finite", vector)
        return np.where(is_read, vector, np.nan)

    @explained
    def learn(self, transition: Transition, environment: int = 0) -> None:
        """Learn one transition; `train` runs a whole training.

        Any action of the space can be learned, not only that of the last `act` (except by
        `FuzzyQLearning`); of a ``Box`` the nearest one is. A terminated transition begins no
        episode. With ``n_steps`` above 1 a transition is pending until the next ones are known.
        If a transition does not begin where the last one ended, or at `begin_episode`, the pending
        ones are learned first.

        Raises
        ------
        TypeError, ValueError
            If an observation, the action, the reward (beyond +-1e300, for example), ``terminated``
            or ``dt`` is not usable, or there is no such environment; nothing is learned then.
        OverflowError
            If a weight would leave its range. Earlier transitions, or other dimensions of the
            action, may have been learned: load a checkpoint.
        """
        parts = self._parts_of(transition, environment)
        self._check_environment(environment)
        self._controller.learn(*parts)
        self._actions.has_masks |= transition.next_mask is not None
        self.warn_of_problems()

    def check(self, transition: Transition) -> None:
        """Raise what `learn` would for a transition that cannot be learned; learn nothing."""
        self._controller.check(*self._parts_of(transition, 0))

    def _parts_of(self, transition: Transition, environment: int) -> tuple[Any, ...]:
        """Convert a transition to the core's arguments; TypeError or ValueError if that fails."""
        if not isinstance(transition, Transition):
            raise TypeError(
                f"transition must be a Transition, got {shown(transition)}: train(env, steps=...)"
                " learns in an environment"
            )
        observation, action, reward, next_observation, terminated, next_mask, dt = transition
        return (
            self._observations.vector("observation", observation),
            self._actions.numbers(action),
            reward_of(reward),
            self._observations.vector("next_observation", next_observation),
            flag("terminated", terminated),
            environment,
            self._actions.mask("next_mask", next_mask),
            duration_of(dt),
        )

    def warn_of_problems(self) -> None:
        """Warn once of a reward that was too large to be learned, and of an impossible history."""
        if self._observation.history == "observer":
            self._warn_of_history()
        refused = self._controller.refused_reward
        if refused is None or self._has_warned:
            return
        self._has_warned = True
        reward, number = refused
        warnings.warn(
            f"reward {reward:g} of transition {number} is more than 65,536 times as large as all"
            " recent ones: it was not learned. If such rewards are true and recur, they will be",
            stacklevel=2,
        )

    @abc.abstractmethod
    def _warn_of_history(self) -> None:
        """Warn once if the warm-up could not fit the observer that was asked for."""

    def core_parts(self) -> CoreParts | None:
        """Return what the training loop needs to call the core directly, which is faster.

        None where a subclass or user has replaced `act` or `learn`, which must be called then.
        """
        # A bound method has its function in `__func__`; something that a user has set may lack it.
        functions = [getattr(method, "__func__", None) for method in (self.act, self.learn)]
        if functions != [BaseAgent.act, BaseAgent.learn]:
            return None
        read, actions = self._observations.rows, self._actions
        return CoreParts(self._controller, read, actions.batch, actions.learned_mask)

    @property
    def scaling(self) -> Scaling | None:
        """Scaling of observations in a run with ``--noise`` or ``--redundant``; else None.

        May be set, and is kept in files. `train` and `evaluate` refuse environments that do not
        scale their observations then.
        """
        return self._scaling

    @scaling.setter
    def scaling(self, scaling: Scaling | None) -> None:
        is_scaling = isinstance(scaling, Scaling | None)
        require(is_scaling, "scaling", "be a Scaling or None", scaling, TypeError)
        self._scaling = scaling

    def save(self, path: str | Path) -> None:
        """Write the whole state as one safetensors file; OSError if it cannot be written."""
        write_file(path_of("path", path), "agent", self.state(), self.description())

    def description(self) -> Description:
        """Return the settings; `rebuild` makes an equal agent from them and `state`."""
        more: Description = {} if self.scaling is None else {"scaling": self.scaling.values()}
        if self.wrappers:
            more["wrappers"] = msgspec.to_builtins(self.wrappers)
        if self._next_episode:
            more["next_episode"] = self._next_episode
        if self._actions.has_masks:
            more["action_masks"] = True
        if self.has_bounds:
            more["observation_space"] = space_data(self.observation_space)
            more["action_space"] = space_data(self.action_space)
        return {
            "class": type(self).__name__,
            "kind": self.kind,
            "seed": self.seed,
            "approximator": values_of(self._approximator),
            "learning": values_of(self.learning),
            "observation": values_of(self._observation),
            "action": values_of(self._action),
            "warm_up_steps": self._warm_up_steps,
            **more,
        }

    def state(self) -> Arrays:
        """Return all that the agent remembers, as arrays by name."""
        return self._controller.state()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Make the class known to files, by its name.

        A class that is defined again, as in a notebook or by a script that is imported too,
        replaces the one before. TypeError for the name of a class of this package, which files
        could confuse.
        """
        super().__init_subclass__(**kwargs)
        known = CLASSES.get(cls.__name__, cls)
        is_ours = known.__module__.partition(".")[0] == "sdnn"
        if is_ours and known.__module__ != cls.__module__:
            raise TypeError(
                f"an agent's class needs a name of its own, for its files: {cls.__name__} is that"
                f" of {known.__module__}.{known.__qualname__}"
            )
        CLASSES[cls.__name__] = cls
