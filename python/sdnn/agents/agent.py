"""The base of all agents: Gymnasium's spaces around the core's controller."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.agents.base import Approximator, BaseAgent, Learning
from sdnn.environments.types import AnyEnv, Element, Elements, Env, Mask, Space
from sdnn.support.arguments import (
    argument_error,
    blamed,
    flag,
    path_of,
    require,
    reward_of,
    shown,
    whole,
)
from sdnn.support.progress import is_shown
from sdnn.training.callbacks import ProgressBarCallback
from sdnn.training.files import read_agent
from sdnn.training.interfaces import CoreParts, Transition, explained
from sdnn.training.training import Callback, Training, TrainingResult, listed


class Agent(BaseAgent[Approximator, Learning]):
    """An agent in a Gymnasium environment that learns one transition at a time.

    ``train`` is a loop over environments; a robot that brings its own loop calls `begin_episode`,
    `act` and `learn`. An agent whose observations have no known ranges begins with a *warm-up*: it
    acts at random, takes the ranges from what it saw, and then learns what it did, in order.

    Parameters
    ----------
    observation_space : gymnasium.Space
        Any that Gymnasium flattens to a vector: Box, Dict, Tuple, Discrete, ... Or the environment,
        whose two spaces are taken: `SDNNQLambda(env)`.
    action_space : gymnasium.Space, optional
        Box with finite bounds, Discrete, MultiDiscrete or MultiBinary.
    approximator, learning : optional
        Settings of the agent's parts; sizes are taken from the spaces.
    seed : int, optional
        The root of every random stream of the agent. None: drawn, and kept as ``agent.seed``.
    observation_range : (low, high), "adaptive" or "running", optional
        Two numbers, or two for each observed variable; values outside are clipped. By default the
        bounds of the space, and what the warm-up sees where these are infinite or, in `SDNNQLambda`
        with at most four inputs, more than twice as wide. ``"adaptive"``: what the warm-up sees of
        all variables but angles, without a twentieth at each end. ``"running"``, the default of
        `SDNNActorCritic`: 2.5 standard deviations around the mean of all that was observed so far.
    angles : sequence of int
        Variables that are angles: their ranges wrap around.
    tables : sequence of array_like, shape (n_bins, n_pattern_units), optional
        Patterns for each input, of any coding; see `sdnn.approximators.SDNNC`. For agents with an
        SDNN code; with SDNN-C not where actions have several dimensions.
    preset : str, optional
        The name of settings where none are given, of the agent's `presets`.
    angle_pairs : "none", "find" or sequence of (int, int)
        Pairs of variables that are the cosine and the sine of an angle, which becomes one input.
        ``"find"``: those that the warm-up finds on the unit circle, but for noise.
    inputs : "all", "relevant" or sequence of int
        ``"relevant"``: those that rewards or actions have to do with, by the warm-up; see
        docs/how-to/choosing-settings.md. A list: these variables in any case, and others that are
        relevant.
    warm_up_steps : int
        Transitions of the warm-up, where there is one.
    missing : {"error", "hold", "code"}
        Whether an observation with readings that are NaN, infinite or masked is refused, the
        variable's last reading in its environment's episode replaces them (before the first one,
        the middle of its range, of a symbol the first one), or each input has a pattern for them
        (SDNN agents only; an angle is missing if one of its pair is).

    Raises
    ------
    TypeError, ValueError
        For spaces of another kind; for spaces, ranges or settings that are impossible.
    """

    _has_warned = False

    def _check_environment(self, environment: int) -> None:
        if type(environment) is not int or environment:  # most agents have no other than 0
            whole("environment", environment, 0, self.n_environments - 1)

    def begin_episode(self, environment: int = 0) -> None:
        """Note that an episode begins: `learn` never does.

        Starts the greedy first steps of an episode anew, and learns the transitions that wait.
        """
        self._check_environment(environment)
        self._controller.begin_episode(environment)

    def begin_greedy_episode(self) -> None:
        """Note that the next acts without ``explore`` are of another episode: `evaluate` does."""
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
            threads may call it so at once; `learn` waits for them.
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
        return self._actions.elements(numbers)[0]

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
        self._controller.learn(*self._parts_of(transition, environment))
        self.warn_of_refused_reward()

    def check(self, transition: Transition) -> None:
        """Raise what `learn` would for a transition that cannot be learned; learn nothing."""
        self._controller.check(*self._parts_of(transition, 0))

    def _parts_of(self, transition: Transition, environment: int) -> tuple[Any, ...]:
        """Return a transition as the core takes it; TypeError or ValueError if it is none."""
        if not isinstance(transition, Transition):
            raise TypeError(
                f"transition must be a Transition, got {shown(transition)}: train(env, steps=...)"
                " learns in an environment"
            )
        observation, action, reward, next_observation, terminated, next_mask = transition
        return (
            self._observations.vector("observation", observation),
            self._actions.numbers(action),
            reward_of(reward),
            self._observations.vector("next_observation", next_observation),
            flag("terminated", terminated),
            environment,
            self._actions.mask("next_mask", next_mask),
        )

    def warn_of_refused_reward(self) -> None:
        """Warn once if a reward was too large to be learned, as the glitch of a sensor is."""
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

    def core_parts(self) -> CoreParts | None:
        """Return the core and functions around it, unless `act` or `learn` has been replaced."""
        functions = [getattr(method, "__func__", None) for method in (self.act, self.learn)]
        actions = self._actions
        if functions != [Agent.act, Agent.learn]:
            return None
        return CoreParts(self._controller, self._observations.rows, actions.elements, actions.mask)

    @explained
    def predict(
        self,
        observation: Element,
        state: None = None,
        episode_start: object = None,
        deterministic: bool = True,
        action_masks: Any = None,
    ) -> tuple[Element, None]:
        """Choose as Stable-Baselines3's models do, for its tools such as ``evaluate_policy``.

        Parameters
        ----------
        observation : element of the observation space, or a batch of several
            A batch is what a vector environment gives: arrays with one axis more, the first one,
            in a Dict or Tuple where the space is one.
        state, episode_start
            Of recurrent models; not used.
        deterministic : bool
            False: explore, as `act` does, in environment 0.
        action_masks : optional
            As the mask of `act`, of a batch one for each.

        Returns
        -------
        The action, or an array of actions along the first axis, and None.
        """
        explore = not flag("deterministic", deterministic)
        several = unbatched(self.observation_space, observation)
        if several is None:
            return self._masked_action(observation, explore, action_masks), None
        require(len(several) > 0, "observation", "be at least one", observation)
        masks = [None] * len(several) if action_masks is None else action_masks
        are_as_many = hasattr(masks, "__len__") and len(masks) == len(several)
        expected = f"be one for each of {len(several)} observations"
        require(are_as_many, "action_masks", expected, action_masks)
        pairs = zip(several, masks, strict=True)
        return np.stack(
            [self._masked_action(element, explore, mask) for element, mask in pairs]
        ), None

    def _masked_action(self, observation: Element, explore: bool, mask: Mask) -> Element:
        try:
            return self.act(observation, explore, mask=mask)
        except ValueError as error:
            name, problem = blamed(error)
            if name != "mask":
                raise
            raise argument_error("action_masks", problem) from error

    @explained
    def train(
        self,
        env: AnyEnv,
        steps: int | None = None,
        *,
        episodes: int | None = None,
        seed: int | None = None,
        callbacks: Iterable[Callback] = (),
        progress: bool | None = None,
        evaluate_every: int | None = None,
        evaluation_env: Env | None = None,
        evaluation_episodes: int = 10,
    ) -> TrainingResult:
        """Learn in an environment, or in all of a vector; see `sdnn.agents.Training`.

        With ``progress`` a bar in a terminal or notebook shows how far it is, by default where the
        training takes longer than 5 s. Without ``seed``, episodes follow from the agent's, and a
        second call has other ones. Scheduled settings such as ``final_learning_rate`` run through
        their schedule in each call.

        Examples
        --------
        >>> import gymnasium as gym
        >>> from sdnn.agents import SDNNQLearning
        >>> env = gym.make("CartPole-v1")
        >>> agent = SDNNQLearning(env, seed=1)
        >>> result = agent.train(env, steps=200)
        >>> result.n_steps
        200
        """
        if progress is None or flag("progress", progress):
            bar = ProgressBarCallback("learning", seconds=0.0 if progress else None)
            callbacks = [*listed(callbacks), *([bar] if is_shown() else [])]
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


AnyAgent: TypeAlias = Agent[Any, Any]
"""An agent with any approximator and learning rule."""


@explained
def load_agent(path: str | Path) -> AnyAgent:
    """Read an agent of any kind that `Agent.save` wrote; see `Agent.load`."""
    agent: AnyAgent = read_agent(path_of("path", path), "agent", "training")[0]
    return agent


def unbatched(space: Space, observation: Element) -> Elements | None:
    """Return the elements of a batch of observations; None if it is no batch."""
    if isinstance(space, gym.spaces.Dict):
        if not isinstance(observation, Mapping) or set(observation) != set(space):
            return None
        columns = _columns((space[name], observation[name]) for name in space)
        if columns is None:
            return None
        return [dict(zip(space, row, strict=True)) for row in zip(*columns, strict=True)]
    if isinstance(space, gym.spaces.Tuple):
        if not isinstance(observation, tuple) or len(observation) != len(space):
            return None
        columns = _columns(zip(space, observation, strict=True))
        return None if columns is None else list(zip(*columns, strict=True))
    is_array = isinstance(observation, np.ndarray) and space.shape is not None
    is_batch = is_array and observation.ndim == len(space.shape or ()) + 1
    return observation if is_batch else None


def _columns(parts: Iterable[tuple[Space, Element]]) -> list[Elements] | None:
    """Return the elements of each part of a batch; None if these are not equally many."""
    columns = [unbatched(space, part) for space, part in parts]
    present = [column for column in columns if column is not None]
    is_batch = len(present) == len(columns) and len({len(column) for column in present}) == 1
    return present if is_batch else None
