"""The settings and the state of all agents, and the files of agents and trainings."""

from __future__ import annotations

import abc
import secrets
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, NamedTuple, TypeVar, cast

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.agents.scaling import Scaling
from sdnn.approximators.sdnn_c import pattern_tables
from sdnn.config import WARM_UP, values_of
from sdnn.environments.space_kinds import (
    Observed,
    require_same_variables,
    require_unbatched,
    space_data,
    space_of,
    spaces_of,
)
from sdnn.environments.spaces import (
    Actions,
    AnglePairs,
    Inputs,
    Missing,
    Observations,
    Ranges,
    action_space_of,
    observation_space_of,
    space_of_error,
)
from sdnn.environments.types import Array, Data, Element, Space
from sdnn.support.arguments import (
    argument_error,
    blamed,
    choice,
    is_of_class,
    path_of,
    real,
    require,
    seed_of,
    whole,
)
from sdnn.support.display import Displayed
from sdnn.support.state_files import Arrays, Description, write_file
from sdnn.training.files import CLASSES, Statistics, read_agent, read_statistics
from sdnn.training.interfaces import explained

if TYPE_CHECKING:
    from typing import Self

_MOST_ENVIRONMENTS = 2**14

Approximator = TypeVar("Approximator")
Learning = TypeVar("Learning")


class Preset(NamedTuple):
    """Settings that belong together, with a title of a few words."""

    title: str
    approximator: Any
    learning: Any
    angle_pairs: AnglePairs = "none"
    inputs: Inputs = "all"


def presets_of(listed: Mapping[str, Any], **more: Mapping[str, Any]) -> Mapping[str, Preset]:
    """Return the settings that the core lists, by name, with more of some of them."""
    return MappingProxyType(
        {name: Preset(*settings, **more.get(name, {})) for name, settings in listed.items()}
    )


class BaseAgent(Displayed, abc.ABC, Generic[Approximator, Learning]):
    """The settings and the state of an agent, and its files; `Agent` adds acting and learning."""

    kind: ClassVar[str]
    """The word for this approximator and learning rule in files."""
    approximator_type: ClassVar[type[Any]]
    learning_type: ClassVar[type[Any]]
    presets: ClassVar[Mapping[str, Preset]]
    """Settings by name."""
    default_preset: ClassVar[str] = "general"
    default_range: ClassVar[Literal["running"] | None] = None
    """The rule for ranges of observations where none are given."""
    narrows_ranges: ClassVar[bool] = False
    """Whether a warm-up narrows bounds of the space that are far wider than what it sees."""
    wrappers: Sequence[Statistics] = ()
    """Statistics of the wrappers of its training's environment; kept in files."""
    learning: Learning
    _approximator: Approximator
    _controller: _core.Controller
    _scaling: Scaling | None = None
    _next_episode = 0  # of `train` without a seed
    has_bounds = True
    """Whether its spaces are those of an environment: else it was made in C++, of ranges."""

    @explained
    def __init__(
        self,
        observation_space: Observed,
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
    ) -> None:
        chosen = choice("preset", self.default_preset if preset is None else preset, self.presets)
        made_of = () if tables is None else pattern_tables(tables)
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
        self._observation = self._observations.config(
            self.default_range if observation_range is None else observation_range,
            angles,
            chosen.angle_pairs if angle_pairs is None else angle_pairs,
            chosen.inputs if inputs is None else inputs,
            missing=missing,
            narrows=self.narrows_ranges,
        )
        self._action = self._actions.config
        self._make(tables=list(made_of))

    def _take_spaces(self, observations: Space, actions: Space) -> None:
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
        for name, part in (("approximator", approximator), ("learning", learning)):
            kind: type[Any] = getattr(self, f"{name}_type")
            require(is_of_class(part, kind), name, f"be a {kind.__name__}", part, TypeError)
        self._approximator, self.learning = approximator, learning
        self.seed = secrets.randbits(63) if seed is None else seed_of(seed)
        self._warm_up_steps = whole("warm_up_steps", steps, int(WARM_UP.low), int(WARM_UP.high))

    def _make(self, **made_of: Any) -> None:
        approximator: Any = self._approximator
        learning: Any = self.learning
        try:
            self._controller = _core.Controller(
                approximator=approximator,
                learning=learning,
                seed=self.seed,
                observation=self._observation,
                action=self._action,
                warm_up_steps=self._warm_up_steps,
                **made_of,
            )
        except ValueError as error:
            reason = space_of_error(error, self._observations, self._actions)
            if not reason:
                raise
            argument, problem = blamed(error)
            raise argument_error(argument, f"{problem} ({reason})") from error

    @property
    def approximator(self) -> Approximator:
        """Settings as used; sizes that follow from the spaces are known after the warm-up."""
        return cast(Approximator, self._controller.approximator)

    @property
    def is_warming_up(self) -> bool:
        """Whether the agent still acts at random to see the ranges of its observations."""
        return self._controller.is_warming_up

    @property
    def observation_range(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest values of the observed variables, shapes (n_variables,), as used.

        RuntimeError if the warm-up has not found them yet.
        """
        self._require_warm()
        return self._controller.ranges

    @property
    def inputs(self) -> list[tuple[str, list[int]]]:
        """Kinds of the inputs of a state, with the numbers of observed variables.

        ``("variable", [i])``, ``("circular", [i])``, ``("angle", [cosine, sine])`` or
        ``("symbol", [first, n])``. Empty until a warm-up is over.
        """
        return self._controller.inputs

    @property
    def has_running_ranges(self) -> bool:
        """Whether ranges of observations follow what is observed."""
        return self._observation.running

    @property
    def missing(self) -> str:
        """The treatment of missing readings: ``"error"``, ``"hold"`` or ``"code"``."""
        return self._observation.missing

    @property
    def progress(self) -> float:
        """The part of the learning that is done, in [0, 1]; ``train`` sets it.

        Settings such as ``final_epsilon`` follow it.
        """
        return self._controller.progress

    @progress.setter
    def progress(self, progress: float) -> None:
        self._controller.progress = real("progress", progress)

    @property
    def n_environments(self) -> int:
        """Number of environments in which the agent learns at once, from 1 to 2**14; may be set.

        Each, from number 0, has an episode of its own; all else is shared. Where there are fewer
        than before, the transitions that wait in the others are learned. `train` sets it.
        """
        return self._controller.n_environments

    @n_environments.setter
    def n_environments(self, n: int) -> None:
        self._controller.n_environments = whole("n_environments", n, 1, _MOST_ENVIRONMENTS)

    def _require_warm(self) -> _core.Controller:
        """Return the controller; RuntimeError while it is warming up."""
        if self.is_warming_up:
            raise RuntimeError(
                "the agent is still warming up: it has no ranges of its observations until it has"
                f" learned {self._warm_up_steps} transitions, or is given observation_range"
            )
        return self._controller

    def _values(self, observation: Element, dimension: int) -> NDArray[np.float64]:
        """Return the values of a dimension's actions, or of fuzzy rules that of the observation."""
        variables = self._observations.vector("observation", observation)
        return self._require_warm().values(variables, dimension)

    @property
    def n_dimensions(self) -> int:
        """Dimensions of an action."""
        return len(self._action.low)

    def _dimension(self, dimension: int) -> int:
        return whole("dimension", dimension, 0, self.n_dimensions - 1)

    def _facts(self) -> dict[str, object]:
        inputs = "found in the warm-up" if self.is_warming_up else len(self.inputs)
        return {
            "observation": self.observation_space,
            "action": self.action_space,
            "inputs": inputs,
            "seed": self.seed,
        }

    @property
    def scaling(self) -> Scaling | None:
        """Scaling of the run's observations, with ``--noise`` or ``--redundant``; None without.

        May be set, and is kept in files. `train` and `evaluate` refuse environments that do not
        scale their observations then.
        """
        return self._scaling

    @scaling.setter
    def scaling(self, scaling: Scaling | None) -> None:
        is_one = isinstance(scaling, Scaling | None)
        require(is_one, "scaling", "be a Scaling or None", scaling, TypeError)
        self._scaling = scaling

    def save(self, path: str | Path) -> None:
        """Write the whole state as one safetensors file; OSError if it cannot be written."""
        write_file(path_of("path", path), "agent", self.state(), self.description())

    @classmethod
    @explained
    def load(cls, path: str | Path) -> Self:
        """Read an agent that `save` wrote.

        OSError if the file cannot be read; ValueError if it is damaged, of another format, or holds
        another kind of agent.
        """
        agent: object = read_agent(path_of("path", path), "agent", "training")[0]
        if not is_of_class(agent, cls):
            raise ValueError(f"{path} holds a {type(agent).__name__}, not a {cls.__name__}")
        return cast("Self", agent)

    def description(self) -> Description:
        """Return the settings, from which `rebuild` makes an agent like this one."""
        more: Description = {} if self.scaling is None else {"scaling": self.scaling.values()}
        if self.wrappers:
            more["wrappers"] = msgspec.to_builtins(self.wrappers)
        if self._next_episode:
            more["next_episode"] = self._next_episode
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

    def _state_of(self, part: str) -> Arrays:
        """Return the arrays of a part, such as ``"agent"``, by their names in it."""
        arrays, prefix = self.state().items(), f"{part}."
        return {name.removeprefix(prefix): a for name, a in arrays if name.startswith(prefix)}

    def _restore(self, **parts: Mapping[str, Array]) -> None:
        """Replace parts of the state; ValueError if they do not fit, and nothing changes."""
        kept = {k: a for k, a in self.state().items() if k.partition(".")[0] not in parts}
        new = {f"{part}.{name}": a for part, state in parts.items() for name, a in state.items()}
        self._controller.restore(kept | new)

    @classmethod
    def rebuild(cls, description: Data, arrays: Mapping[str, Array]) -> Self:
        """Make an agent from its `description` and `state`; ValueError if they do not fit."""
        agent = cls.__new__(cls)
        agent._observation = _core.ObservationConfig(**description["observation"])
        agent._action = _core.ActionConfig(**description["action"])
        if "observation_space" in description:
            observations = space_of(description["observation_space"])
            actions = space_of(description["action_space"])
        else:  # it was made in C++
            observations = observation_space_of(agent._observation)
            actions = action_space_of(agent._action)
            agent.has_bounds = False
        agent._take_spaces(observations, actions)
        agent._take_settings(
            cls.approximator_type(**description["approximator"]),
            cls.learning_type(**description["learning"]),
            description["seed"],
            description["warm_up_steps"],
        )
        agent._make(state=dict(arrays))
        n_variables = Observations(observations).n_variables
        if agent._controller.n_variables != n_variables:
            raise ValueError(f"observation must be of {n_variables} variables")
        if "action_space" in description and agent._action != Actions(actions).config:
            raise ValueError(f"action must be of {agent.action_space}, got {agent._action}")
        if "wrappers" in description:
            agent.wrappers = read_statistics(description["wrappers"])
        if "scaling" in description:
            agent.scaling = Scaling.of_values(description["scaling"], n_variables)
        agent._next_episode = whole("next_episode", description.get("next_episode", 0), 0, 2**53)
        return agent

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

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return type(self).rebuild, (self.description(), self.state())
