"""What all agents have in common: observations in, actions out, whatever the spaces are."""

from __future__ import annotations

import abc
import copy
import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.agents.actions import Actions
from sdnn.agents.files import completed, read_agent, register
from sdnn.agents.observations import AnglePairs, Ranges, UnitObservations, without_repeats
from sdnn.agents.scaling import Scaling
from sdnn.agents.spaces import space_data, space_of
from sdnn.agents.training import Training, TrainingResult
from sdnn.agents.transition import Transition, reward_of
from sdnn.agents.warm_up import MOST_ENVIRONMENTS, WarmUp
from sdnn.arguments import flag, path_of, real, seed_of, whole
from sdnn.files import Arrays, Description, write_file

if TYPE_CHECKING:
    from typing_extensions import Self

    from sdnn.agents.callbacks import Callback

__all__ = ["Agent", "check_shape", "load_agent"]

_LARGEST_REWARD = 1e300

# Beginnings of the names of arrays that are saved.
_CORE = "agent."
_WARM_UP = "warm_up."
_TABLE = "table."
_RATE = "rate."
_TAKEN = "taken."

Approximator = TypeVar("Approximator")
Learning = TypeVar("Learning")


class Agent(abc.ABC, Generic[Approximator, Learning]):
    """An agent in a Gymnasium environment that learns one transition at a time.

    A loop over an environment, or several at once, is ``train``; a robot that brings its own loop
    calls `begin_episode`, `act` and `learn`.

    An agent whose observations have no known ranges begins with a *warm-up*: it acts at random
    for a while, takes the ranges from what it saw, and then learns what it did, in order. From
    then on the ranges stay.

    Parameters
    ----------
    observation_space : gymnasium.Space
        What Gymnasium flattens to a vector: Box, Dict, Tuple, Discrete, ...
    action_space : gymnasium.Space
        Box with finite bounds, Discrete, MultiDiscrete or MultiBinary.
    approximator, learning
        Settings of the agent's parts.
    seed : int
        The root of every random stream of the agent.
    observation_range : (low, high) or "seen", optional
        Of the observed variables, two numbers or two for each; values outside saturate. By default
        the bounds of the space, and what the warm-up sees where these are infinite. ``"seen"``:
        from the warm-up for all numbers but angles, a twentieth of what it sees left out at each
        end, for spaces whose bounds are much wider than what a policy meets.
    angles : sequence of int
        Numbers of variables that are angles: their ranges wrap around.
    angle_pairs : "none", "find" or sequence of (int, int)
        Pairs of variables that are the cosine and the sine of an angle, which becomes one input.
        ``"find"``: those that the warm-up finds on the unit circle.
    warm_up_steps : int
        Transitions of the warm-up, where there is one.

    Raises
    ------
    TypeError
        For spaces of another kind.
    ValueError
        For spaces, ranges or settings that are impossible.

    Attributes
    ----------
    observation_space, action_space : gymnasium.Space
    approximator, learning
        As used; sizes that follow from the spaces are known once the warm-up is over.
    seed : int
    """

    learns_any_transition: ClassVar[bool] = True
    """Whether transitions can be learned that do not begin with the last exploring `act`."""

    least_inputs: ClassVar[int] = 1
    """Inputs that its approximator needs."""

    codes_symbols: ClassVar[bool] = False
    """Whether a Discrete of the observations is one input of the approximator."""

    approximator_type: ClassVar[type[Any]]
    learning_type: ClassVar[type[Any]]
    """Of the settings."""

    approximator: Approximator
    learning: Learning
    _actions: Actions
    _scaling: Scaling | None = None
    _next_episode: int = 0
    """Of a `train` without a seed of its own."""
    _tables: list[NDArray[np.int8]] | None = None
    _rates: dict[str, float]
    """That were set during the warm-up: by name."""

    def __init__(
        self,
        observation_space: gym.Space[Any],
        action_space: gym.Space[Any],
        approximator: Approximator,
        learning: Learning,
        *,
        seed: int = 0,
        observation_range: Ranges | None = None,
        angles: Sequence[int] = (),
        angle_pairs: AnglePairs = "none",
        warm_up_steps: int = 1000,
    ) -> None:
        settings: tuple[tuple[str, Any, type[Any]], ...] = (
            ("approximator", approximator, self.approximator_type),
            ("learning", learning, self.learning_type),
        )
        for name, part, kind in settings:
            if not isinstance(part, kind):
                raise TypeError(f"{name} must be a {kind.__name__}, got {part!r}")
        self.observation_space = observation_space
        self.action_space = action_space
        self.approximator = approximator
        self.learning = learning
        self.seed = seed_of(seed)
        self._warm_up_steps = whole("warm_up_steps", warm_up_steps, 2, 10**7)
        self._observations = UnitObservations(
            observation_space,
            ranges=observation_range,
            angles=angles,
            angle_pairs=angle_pairs,
            symbols=self.codes_symbols,
            least_inputs=self.least_inputs,
        )
        try:
            space_data(observation_space)  # what could not be saved had better not be learned
        except TypeError as error:
            raise TypeError(f"observation_space {error}") from None
        self._actions = self._make_actions(action_space)
        self._progress = 0.0
        self._rates = {}
        self._compiled: Any = None
        self._warm_up: WarmUp | None = None
        if self._observations.is_settled:
            self._compiled = self._checked()
        else:
            self._check_settings()
            self._warm_up = self._new_warm_up()

    def _new_warm_up(self) -> WarmUp:
        return WarmUp(
            self._observations.n_variables,
            self._actions.n_dimensions,
            self._warm_up_steps,
            self.seed,
            learns_any_transition=self.learns_any_transition,
        )

    # What the kinds of agents differ in.

    @abc.abstractmethod
    def _make_actions(self, space: gym.Space[Any]) -> Actions:
        """Make the conversion of actions; ``approximator`` is known."""

    @abc.abstractmethod
    def _make(self) -> Any:
        """Make the compiled agent; the observations are settled. Fills in ``approximator``."""

    def _remember_actions(self, taken: Mapping[str, NDArray[Any]]) -> None:
        """Take up the actions that the restored agent took last, where it must know them.

        ``taken`` has those that only the agent's file knows, by the environments' numbers.
        """

    def _check_settings(self) -> None:
        """Find impossible ones before the warm-up: make an agent for as many variables."""
        trial = object.__new__(type(self))
        trial.__dict__.update(self.__dict__)
        trial._observations = copy.deepcopy(self._observations)
        trial._observations.settle(np.zeros((1, trial._observations.n_variables)))
        trial._checked()

    def _core_approximator(self) -> Any:
        """Give the core's settings of one dimension, of the memory's limit its share."""
        settings: Any = self.approximator
        n_dimensions = self._actions.n_dimensions
        if n_dimensions == 1:
            return settings
        share = settings.max_table_bytes // n_dimensions
        return settings.replace(max_table_bytes=share)

    def _checked(self) -> Any:
        """Make the compiled agent; an error about sizes says which space they follow from."""
        try:
            return self._make()
        except ValueError as error:
            reasons = {"n_inputs": "n_inputs follows from observation_space"}
            if not self._actions.is_box:
                reasons["n_actions"] = "n_actions follows from action_space"
            if self._actions.n_dimensions > 1:
                reasons["max_table_bytes"] = "for each dimension of action_space"
            found = [reason for word, reason in reasons.items() if word in str(error)]
            if not found:
                raise
            raise ValueError(f"{error} ({', '.join(found)})") from error

    @abc.abstractmethod
    def _act(self, state: NDArray[np.float64], explore: bool, environment: int) -> list[Any]:
        """Choose the numbers of an action."""

    @abc.abstractmethod
    def _learn(
        self,
        state: NDArray[np.float64],
        numbers: list[Any],
        reward: float,
        following: NDArray[np.float64],
        terminated: bool,
        environment: int,
    ) -> None:
        """Learn a transition."""

    # What users call.

    @property
    def is_warming_up(self) -> bool:
        """Whether the agent still acts at random to see the ranges of its observations."""
        return self._warm_up is not None

    @property
    def observation_range(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest values of the observed variables, shapes (n_variables,), as used.

        Raises
        ------
        RuntimeError
            If the warm-up has not found them yet.
        """
        self._born()
        return self._observations.low.copy(), self._observations.high.copy()

    @property
    def scaling(self) -> Scaling | None:
        """How its run scaled what it observes, with ``--noise`` or ``--redundant``; None: not.

        `train` and `evaluate` refuse environments that do not scale their observations then. May be
        set, and is kept in files.

        Raises
        ------
        TypeError
            If it is set to anything else.
        """
        return self._scaling

    @scaling.setter
    def scaling(self, scaling: Scaling | None) -> None:
        if not isinstance(scaling, Scaling | None):
            raise TypeError(f"scaling must be a Scaling or None, got {scaling!r}")
        self._scaling = scaling

    @property
    def progress(self) -> float:
        """How much of the learning is done, in [0, 1].

        Settings such as ``final_epsilon`` follow it; ``train`` sets it.
        """
        # Where an agent that is compiled knows it, a file may have come from C++.
        return float(getattr(self._compiled, "progress", self._progress))

    @progress.setter
    def progress(self, progress: float) -> None:
        value = real("progress", progress)
        if not 0.0 <= value <= 1.0:
            raise ValueError(f"progress must be in [0, 1], got {progress!r}")
        self._progress = value
        self._apply_progress()

    def _apply_progress(self) -> None:
        if hasattr(self._compiled, "set_progress"):
            self._compiled.set_progress(self._progress)

    @property
    def n_environments(self) -> int:
        """In how many environments at once the agent learns; may be set, from 1 to 2**14.

        They are numbered from 0. Each has an episode of its own: the transitions that wait, the
        steps counted, the random action that is kept. All else is shared. Where there are fewer
        than before, what waits in the others is learned. `train` sets it.
        """
        one: Any = self._warm_up or self._compiled
        n: int = one.n_environments
        return n

    @n_environments.setter
    def n_environments(self, n: int) -> None:
        number = whole("n_environments", n, 1, MOST_ENVIRONMENTS)
        if self._warm_up is not None:
            self._warm_up.n_environments = number
        else:
            self._compiled.set_n_environments(number)
        self._actions.forget(number)

    def _check_environment(self, environment: int) -> None:
        if type(environment) is int and environment == 0:  # most agents have no other
            return
        whole("environment", environment, 0, self.n_environments - 1)

    def begin_episode(self, environment: int = 0) -> None:
        """Note that an episode begins: `learn` never does.

        Starts the greedy first steps of an episode anew, and learns what still waits.

        Raises
        ------
        ValueError
            If there is no such environment.
        """
        self._check_environment(environment)
        if self._warm_up is not None:
            self._warm_up.begin_episode(environment)
        else:
            self._compiled.begin_episode(environment)

    def act(self, observation: Any, explore: bool = True, environment: int = 0) -> Any:
        """Choose the action to take, an element of the action space.

        Parameters
        ----------
        observation : element of the observation space
        explore : bool
            False: always a best action, and no effect on the agent's later learning.
        environment : int
            In which environment, below `n_environments`.

        Raises
        ------
        ValueError
            If the observation has another shape or holds NaN, or there is no such environment.
        TypeError
            If ``explore`` is not True or False.
        """
        if explore is not True and explore is not False:
            explore = flag("explore", explore)
        self._check_environment(environment)
        if self._warm_up is not None:
            self._observations.flat("observation", observation)
            numbers = self._warm_up.act(self._actions.random, explore, environment)
            return self._actions.element(numbers)
        numbers = self._act(self._observations("observation", observation), explore, environment)
        return (
            self._actions.take(numbers, environment) if explore else self._actions.element(numbers)
        )

    def flat_observation(self, observation: Any) -> NDArray[np.float64]:
        """Give the observed variables as a vector, shape (n_variables,), in their own units.

        Raises
        ------
        ValueError
            If the observation has another shape or holds NaN.
        """
        return self._observations.flat("observation", observation)

    def learn(self, transition: Transition, environment: int = 0) -> None:
        """Learn one transition.

        Any action of the space can be learned, not only that of the last `act` (but by
        `FuzzyQLearning`); of a ``Box`` the nearest one is. A terminated transition begins no
        episode. With ``n_steps`` above 1 a transition waits for those that follow; one that does
        not begin where the one before it ended (another ``observation`` than the last
        ``next_observation``) begins anew, and `begin_episode` learns what still waits. All this is
        within the environment that the transition comes from.

        Raises
        ------
        TypeError, ValueError
            If an observation, the action, the reward (beyond +-1e300, for example) or
            ``terminated`` is not usable, or there is no such environment; nothing is learned then.
        OverflowError
            If a weight would leave its range. What waited for this transition, or other dimensions
            of its action, may have been learned: load a checkpoint.
        """
        self._check_environment(environment)
        if not isinstance(transition, Transition):
            raise TypeError(f"transition must be a Transition, got {transition!r}")
        reward, terminated = transition.reward, transition.terminated
        if type(reward) is not float:
            reward = reward_of(reward)
        if terminated is not True and terminated is not False:
            terminated = flag("terminated", terminated)
        if self._warm_up is None:
            self._learn(
                self._observations("observation", transition.observation),
                self._actions.numbers(transition.action, environment),
                reward,
                self._observations("next_observation", transition.next_observation),
                terminated,
                environment,
            )
            return
        observation = self._observations.flat("observation", transition.observation)
        following = self._observations.flat("next_observation", transition.next_observation)
        if not abs(reward) <= _LARGEST_REWARD:
            raise ValueError(f"reward must be finite and within 1e300, got {reward}")
        values = self._actions.vector(transition.action)
        self._warm_up.learn(observation, values, reward, following, terminated, environment)
        if self._warm_up.is_over:
            self._end_warm_up(self._warm_up)

    def _end_warm_up(self, warm_up: WarmUp) -> None:
        self._observations.settle(warm_up.observations())
        self._compiled = self._make()
        self._apply_progress()
        self._warm_up = None
        self._rates = {}
        self.n_environments = warm_up.n_in_all
        if self.learns_any_transition:
            for begins, environment, step in warm_up.transitions():
                observation, action, reward, following, terminated = step
                if begins:
                    self.begin_episode(environment)
                self._learn(
                    self._observations.unit(observation),
                    self._actions.numbers(action, environment),
                    reward,
                    self._observations.unit(following),
                    terminated,
                    environment,
                )
        else:
            for environment in range(self.n_environments):
                self.begin_episode(environment)
        self.n_environments = warm_up.n_environments

    def _born(self) -> Any:
        """Give the compiled agent; RuntimeError while there is none."""
        if self._warm_up is not None:
            raise RuntimeError(
                "the agent is still warming up: it knows no ranges of its observations until it has"
                f" learned {self._warm_up_steps} transitions, or is given observation_range"
            )
        return self._compiled

    def _state(self, name: str, observation: Any) -> NDArray[np.float64]:
        """Convert an observation for the compiled agents."""
        self._born()
        return self._observations(name, observation)

    # Loops.

    def train(
        self,
        env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any],
        *,
        steps: int | None = None,
        episodes: int | None = None,
        seed: int | None = None,
        callbacks: Iterable[Callback] = (),
        progress: bool = False,
        evaluate_every: int | None = None,
        evaluation_env: gym.Env[Any, Any] | None = None,
        evaluation_episodes: int = 10,
    ) -> TrainingResult:
        """Learn in an environment, or in all of a vector; see `sdnn.agents.Training`.

        With ``progress`` a line on a terminal says how far it is. Without ``seed``, episodes follow
        from the agent's, and those of a second call are others than those of the first. But what
        falls over a training, such as ``final_learning_rate``, falls in each: where a training is
        to be looked at in between, callbacks and ``evaluate_every`` do that within one.

        Examples
        --------
        >>> import gymnasium as gym
        >>> from sdnn.agents import SDNNQLearning
        >>> env = gym.make("CartPole-v1")
        >>> agent = SDNNQLearning(env.observation_space, env.action_space, seed=1)
        >>> result = agent.train(env, steps=200)
        >>> result.n_steps
        200
        """
        own: list[Callback] | Iterable[Callback] = callbacks
        if flag("progress", progress):
            from rich.console import Console

            from sdnn.agents.callbacks import TrainingProgress

            own = [*callbacks, TrainingProgress(Console(stderr=True), "learning")]
        training = Training(
            self,
            env,
            steps=steps,
            episodes=episodes,
            seed=self.seed if seed is None else seed,
            first_episode=self._next_episode if seed is None else 0,
            callbacks=own,
            evaluate_every=evaluate_every,
            evaluation_env=evaluation_env,
            evaluation_episodes=evaluation_episodes,
        )
        try:
            return training.run()
        finally:
            if seed is None:
                self._next_episode = training.next_episode

    # Files.

    def save(self, path: str | Path) -> None:
        """Write the agent, with all that it needs to go on exactly as it would have.

        One safetensors file, there as a whole or not at all.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        write_file(path_of("path", path), "agent", self.state(), self.description())

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read an agent that `save` wrote.

        Raises
        ------
        OSError
            If the file cannot be read.
        ValueError
            If it is damaged, from a newer version, or holds another kind of agent.
        """
        agent = load_agent(path)
        if not isinstance(agent, cls):
            raise ValueError(f"{path} holds a {type(agent).__name__}, not a {cls.__name__}")
        return agent

    def description(self) -> Description:
        """Say all that is needed to make an agent like this one, as data that JSON can hold.

        Raises
        ------
        TypeError
            If a space cannot be written down.
        """
        actions = self._actions
        if actions.is_box:
            shape = list(self.action_space.shape or ())
            ends = {"low": actions.low.tolist(), "high": actions.high.tolist()}
            action = {"kind": "box", **ends, "shape": shape}
            if actions.is_whole:
                action["whole"] = True
        else:
            action = {"kind": "discrete", "start": actions.start.tolist()}
        observations = self._observations
        more: Description = {} if self.scaling is None else {"scaling": self.scaling.values()}
        if self._next_episode:
            more["next_episode"] = self._next_episode
        return {
            "class": type(self).__name__,
            "seed": self.seed,
            "progress": self.progress,
            "approximator": dataclasses.asdict(self.approximator),  # type: ignore[call-overload]
            "learning": dataclasses.asdict(self.learning),  # type: ignore[call-overload]
            "observation_space": space_data(self.observation_space),
            "action_space": space_data(self.action_space),
            "n_actions": list(getattr(actions, "n_actions", [])),
            "action": action,
            "warm_up_steps": self._warm_up_steps,
            "asked": observations.asked(),
            "observation": observations.description() if observations.is_settled else None,
            "n_tables": len(self._tables or ()),
            **more,
        }

    def state(self) -> Arrays:
        """Give all that the agent remembers, as arrays by name; with `description` all of it."""
        arrays: Arrays = {}
        if self._compiled is not None:
            arrays |= {_CORE + name: array for name, array in self._compiled.state().items()}
        if self._warm_up is not None:
            arrays |= {_WARM_UP + name: array for name, array in self._warm_up.state().items()}
            arrays |= {_RATE + name: np.array(value) for name, value in self._rates.items()}
        unclear = self._actions.unclear().items()
        arrays |= {f"{_TAKEN}{i}": np.array(numbers, np.uint64) for i, numbers in unclear}
        arrays |= {f"{_TABLE}{i}": table for i, table in enumerate(self._tables or ())}
        return arrays

    @classmethod
    def rebuild(cls, description: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Make an agent of what `description` and `state` gave.

        Raises
        ------
        ValueError
            If they do not fit; before much memory is asked for.
        """

        def part(prefix: str) -> Arrays:
            return {n.removeprefix(prefix): a for n, a in arrays.items() if n.startswith(prefix)}

        description = completed(description)
        agent = cls.__new__(cls)
        approximator = dict(description["approximator"])
        for name in {"circular", "n_symbols"} & approximator.keys():
            approximator[name] = tuple(approximator[name])
        agent.approximator = cls.approximator_type(**approximator)
        agent.learning = cls.learning_type(**description["learning"])
        if description["n_tables"]:
            agent._tables = [arrays[f"{_TABLE}{i}"] for i in range(description["n_tables"])]
        agent.observation_space = space_of(description["observation_space"])
        agent.action_space = space_of(description["action_space"])
        agent.seed = seed_of(description["seed"])
        agent._warm_up_steps = whole("warm_up_steps", description["warm_up_steps"], 2, 10**7)
        asked = description["asked"]
        low, high = ([np.nan if x is None else x for x in asked[end]] for end in ("low", "high"))
        pairs: Any = asked["angle_pairs"]
        agent._observations = UnitObservations(
            agent.observation_space,
            ranges="seen" if asked.get("sees_ranges") else (low, high),
            angles=without_repeats(asked["angles"]),  # files of loaded agents had some
            angle_pairs=pairs if pairs == "find" else without_repeats(pairs),
            symbols=bool(asked.get("symbols", False)),
            least_inputs=cls.least_inputs,
        )
        if "scaling" in description:
            n_variables = agent._observations.n_variables
            agent.scaling = Scaling.of_values(description["scaling"], n_variables)
        agent._next_episode = whole("next_episode", description.get("next_episode", 0), 0, 2**53)
        agent._actions = agent._make_actions(agent.action_space)
        agent._compiled, agent._warm_up, agent._rates = None, None, {}
        agent.progress = float(description["progress"])
        if description["observation"] is None:
            agent._warm_up = agent._new_warm_up()
            agent._warm_up.restore(part(_WARM_UP), agent._actions.check)
            for name in ("learning_rate", "epsilon"):
                if _RATE + name in arrays:
                    setattr(agent, name, float(arrays[_RATE + name]))
        else:
            agent._observations.settled_as(description["observation"])
            agent._check_state(part(_CORE))
            agent._compiled = agent._make()
            agent._compiled.restore(part(_CORE))
            agent._remember_actions(part(_TAKEN))
        return agent

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Make the kind known to files, by its name."""
        super().__init_subclass__(**kwargs)
        register(cls)

    @abc.abstractmethod
    def _check_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Compare sizes with the settings before memory is asked for; ValueError."""

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return type(self).rebuild, (self.description(), self.state())

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        copied = self.rebuild(self.description(), self.state())
        memo[id(self)] = copied
        return copied


def check_shape(state: Mapping[str, NDArray[Any]], name: str, shape: tuple[int, ...]) -> None:
    """Compare the shape of an array with what settings make of it; ValueError."""
    if name not in state or state[name].shape != shape:
        came = state[name].shape if name in state else "none"
        raise ValueError(f"{name} must have shape {shape}, got {came}")


def load_agent(path: str | Path) -> Agent[Any, Any]:
    """Read an agent of any kind that `Agent.save` wrote; see `Agent.load`."""
    agent: Agent[Any, Any] = read_agent(path_of("path", path), "agent", "training")[0]
    return agent
