"""The base of all agents: Gymnasium's spaces around the core's controller."""

from __future__ import annotations

import abc
import secrets
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.agents.episode import Transition
from sdnn.agents.files import SavedAgent
from sdnn.agents.model import Model
from sdnn.agents.spaces import (
    Actions,
    AnglePairs,
    Inputs,
    Observations,
    Ranges,
    require_unbatched,
    space_data,
    space_of_error,
)
from sdnn.agents.training import Training, TrainingResult
from sdnn.arguments import (
    argument_error,
    blamed,
    flag,
    is_of_class,
    real,
    reward_of,
    seed_of,
    shown,
    whole,
)
from sdnn.config import WARM_UP

if TYPE_CHECKING:
    from sdnn.agents.callbacks import Callback

_MOST_ENVIRONMENTS = 2**14

Approximator = TypeVar("Approximator")
Learning = TypeVar("Learning")


class Agent(SavedAgent, Model, abc.ABC, Generic[Approximator, Learning]):
    """An agent in a Gymnasium environment that learns one transition at a time.

    ``train`` is a loop over environments; a robot that brings its own loop calls `begin_episode`,
    `act` and `learn`. An agent whose observations have no known ranges begins with a *warm-up*: it
    acts at random, takes the ranges from what it saw, and then learns what it did, in order.

    Parameters
    ----------
    observation_space : gymnasium.Space
        Any that Gymnasium flattens to a vector: Box, Dict, Tuple, Discrete, ...
    action_space : gymnasium.Space
        Box with finite bounds, Discrete, MultiDiscrete or MultiBinary.
    approximator, learning : optional
        Settings of the agent's parts; sizes are taken from the spaces.
    seed : int, optional
        The root of every random stream of the agent. None: drawn, and kept as ``agent.seed``.
    observation_range : (low, high) or "adaptive", optional
        Two numbers, or two for each observed variable; values outside are clipped. By default the
        bounds of the space, and what the warm-up sees where these are infinite. ``"adaptive"``:
        what the warm-up sees of all variables but angles, without a twentieth at each end, for
        spaces whose bounds are much wider than what a policy meets.
    angles : sequence of int
        Variables that are angles: their ranges wrap around.
    angle_pairs : "none", "find" or sequence of (int, int)
        Pairs of variables that are the cosine and the sine of an angle, which becomes one input.
        ``"find"``: those that the warm-up finds on the unit circle, but for noise.
    inputs : "all", "relevant" or sequence of int
        ``"relevant"``: those that rewards or actions have to do with, by the warm-up; see
        docs/how-to/choosing-settings.md. A list: these variables in any case, and others that are
        relevant.
    warm_up_steps : int
        Transitions of the warm-up, where there is one.

    Raises
    ------
    TypeError, ValueError
        For spaces of another kind; for spaces, ranges or settings that are impossible.
    """

    learning: Learning
    _approximator: Approximator
    _controller: _core.Controller
    _tables: Sequence[NDArray[np.int8]] = ()

    def __init__(
        self,
        observation_space: gym.Space[Any],
        action_space: gym.Space[Any],
        *,
        approximator: Approximator | None = None,
        learning: Learning | None = None,
        seed: int | None = 0,
        observation_range: Ranges | None = None,
        angles: Sequence[int] = (),
        angle_pairs: AnglePairs = "none",
        inputs: Inputs = "all",
        warm_up_steps: int = WARM_UP.default,
    ) -> None:
        self._take_spaces(observation_space, action_space)
        require_unbatched(observation_space, action_space)
        try:
            space_data(observation_space)  # what could not be saved had better not be learned
        except TypeError as error:
            raise TypeError(f"observation_space {error}") from None
        self._take_settings(
            self.approximator_type() if approximator is None else approximator,
            self.learning_type() if learning is None else learning,
            seed,
            warm_up_steps,
        )
        self._observation = self._observations.config(
            observation_range, angles, angle_pairs, inputs
        )
        self._action = self._actions.config
        self._make(tables=list(self._tables))

    def _take_spaces(self, observations: gym.Space[Any], actions: gym.Space[Any]) -> None:
        self.observation_space = observations
        self.action_space = actions
        self._observations = Observations(observations)
        self._actions = Actions(actions)

    def _take_settings(self, approximator: Any, learning: Any, seed: Any, steps: Any) -> None:
        for name, part in (("approximator", approximator), ("learning", learning)):
            kind: type[Any] = getattr(self, f"{name}_type")
            if not is_of_class(part, kind):
                raise TypeError(f"{name} must be a {kind.__name__}, got {shown(part)}")
        self._approximator, self.learning = approximator, learning
        self.seed = secrets.randbits(63) if seed is None else seed_of(seed)
        self._warm_up_steps = whole("warm_up_steps", steps, int(WARM_UP.low), int(WARM_UP.high))

    def _make(self, **made_of: Any) -> None:
        """Make the core's controller."""
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
        used: Any = self._controller.approximator
        return used  # type: ignore[no-any-return]

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

    def _check_environment(self, environment: int) -> None:
        if type(environment) is not int or environment:  # most agents have no other than 0
            whole("environment", environment, 0, self.n_environments - 1)

    def begin_episode(self, environment: int = 0) -> None:
        """Note that an episode begins: `learn` never does.

        Starts the greedy first steps of an episode anew, and learns the transitions that wait.
        """
        self._check_environment(environment)
        self._controller.begin_episode(environment)

    def act(
        self, observation: Any, explore: bool = True, environment: int = 0, mask: Any = None
    ) -> Any:
        """Return the action to take, an element of the action space.

        Parameters
        ----------
        observation : element of the observation space
        explore : bool
            False: always a best action, and no effect on the agent's later learning. Several
            threads may call it so at once; `learn` waits for them.
        environment : int
            In which environment, below `n_environments`.
        mask : array_like, optional
            1 for the discrete actions that are allowed, 0 for others: of a Discrete space shape
            (n,), of others a tuple with the mask of each dimension.

        Raises
        ------
        TypeError, ValueError
            If an argument is not usable, such as an observation that holds NaN.
        """
        explore = flag("explore", explore)
        self._check_environment(environment)
        variables = self._observations.vector("observation", observation)
        allowed = self._actions.mask("mask", mask)
        taken = self._controller.act(variables, explore, environment, allowed)
        return self._actions.elements(taken)[0]

    def flat_observation(self, observation: Any) -> NDArray[np.float64]:
        """Return the observed variables as a vector, shape (n_variables,), in their own units.

        ValueError if the observation has another shape or holds NaN.
        """
        vector: NDArray[np.float64] = self._observations.rows("observation", [observation])[0]
        if np.isnan(vector).any():
            raise ValueError(f"observation must not hold NaN, got {vector}")
        return vector

    def learn(
        self,
        transition: Transition | None = None,
        environment: int = 0,
        *,
        total_timesteps: Any = None,
    ) -> None:
        """Learn one transition; ``total_timesteps`` is refused: `train` runs a whole training.

        Any action of the space can be learned, not only that of the last `act` (except by
        `FuzzyQLearning`); of a ``Box`` the nearest one is. A terminated transition begins no
        episode. With ``n_steps`` above 1 a transition waits for the next ones in its environment.
        One that does not begin where the last one ended starts anew; `begin_episode` learns what
        still waits.

        Raises
        ------
        TypeError, ValueError
            If an observation, the action, the reward (beyond +-1e300, for example) or
            ``terminated`` is not usable, or there is no such environment; nothing is learned then.
        OverflowError
            If a weight would leave its range. Earlier transitions, or other dimensions of the
            action, may have been learned: load a checkpoint.
        """
        self._check_environment(environment)
        if total_timesteps is not None:
            given = shown(total_timesteps)
            raise TypeError(
                f"total_timesteps must be None, got {given}: train(env, steps=...) learns so long"
            )
        if not isinstance(transition, Transition):
            raise TypeError(f"transition must be a Transition, got {shown(transition)}")
        observation, action, reward, next_observation, terminated, next_mask = transition
        self._controller.learn(
            self._observations.vector("observation", observation),
            self._actions.numbers(action),
            reward_of(reward),
            self._observations.vector("next_observation", next_observation),
            flag("terminated", terminated),
            environment,
            self._actions.mask("next_mask", next_mask),
        )

    def core_parts(self) -> tuple[Any, ...] | None:
        """Return the core and functions around it, unless `act` or `learn` has been replaced."""
        own = [getattr(method, "__func__", None) for method in (self.act, self.learn)]
        actions = self._actions
        parts = self._controller, self._observations.rows, actions.elements, actions.mask
        return parts if own == [Agent.act, Agent.learn] else None

    @property
    @abc.abstractmethod
    def core(self) -> Any:
        """The compiled agent, which shares all that is learned: states are in [0, 1]."""

    def _require_warm(self) -> _core.Controller:
        """Return the controller; RuntimeError while it is warming up."""
        if self.is_warming_up:
            raise RuntimeError(
                "the agent is still warming up: it has no ranges of its observations until it has"
                f" learned {self._warm_up_steps} transitions, or is given observation_range"
            )
        return self._controller

    def _state(self, observation: Any) -> NDArray[np.float64]:
        """Return the compiled agent's state for an observation."""
        return self._require_warm().state_of(self._observations.vector("observation", observation))

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

        With ``progress`` a line on a terminal shows how far it is. Without ``seed``, episodes
        follow from the agent's, and a second call has other ones. Scheduled settings such as
        ``final_learning_rate`` run through their schedule in each call.

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
        if flag("progress", progress):
            from rich.console import Console

            from sdnn.agents.callbacks import ProgressBarCallback

            callbacks = [*callbacks, ProgressBarCallback(Console(stderr=True), "learning")]
        training = Training(
            self,
            env,
            steps=steps,
            episodes=episodes,
            seed=self.seed if seed is None else seed,
            first_episode=self._next_episode if seed is None else 0,
            callbacks=callbacks,
            evaluate_every=evaluate_every,
            evaluation_env=evaluation_env,
            evaluation_episodes=evaluation_episodes,
        )
        try:
            return training.run()
        finally:
            if seed is None:
                self._next_episode = training.next_episode
