"""The base of all agents: how they are trained, inspected and read from files."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.agents.base import Approximator, BaseAgent, Learning
from sdnn.agents.scaling import Scaling
from sdnn.environments.space_kinds import opened, space_of, space_words, unbatched
from sdnn.environments.spaces import Actions, Observations, action_space_of, observation_space_of
from sdnn.environments.types import AnyEnv, Array, Data, Element, Elements, Env, Mask
from sdnn.support.arguments import (
    argument_error,
    blamed,
    flag,
    is_of_class,
    path_of,
    require,
    whole,
)
from sdnn.support.display import Displayed
from sdnn.support.files import Arrays
from sdnn.training.callbacks import ProgressBarCallback
from sdnn.training.files import read_agent, read_statistics
from sdnn.training.interfaces import Transition, explained
from sdnn.training.training import (
    Callback,
    Training,
    TrainingResult,
    checked_callbacks,
    returns_of,
    shows_bar,
)

if TYPE_CHECKING:
    from sdnn.reports.plots import Figure

_MOST_OBSERVED = 16  # the most numeric inputs of an observer


class Agent(Displayed, BaseAgent[Approximator, Learning]):
    """An agent in a Gymnasium environment that learns one transition at a time.

    ``train`` is a loop over environments; a robot that brings its own loop calls `begin_episode`,
    `act` and `learn`. An agent whose observations have no known ranges begins with a *warm-up*: it
    acts at random, takes the ranges from what it saw, and then learns what it did, in order.

    Parameters
    ----------
    observation_space : gymnasium.Space
        Any that Gymnasium flattens to a vector: Box, Dict, Tuple, Discrete, ... Or the environment
        or its id, whose two spaces are taken: `SDNNQLambda(env)`, `SDNNQLambda("CartPole-v1")`.
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
    history : {"none", "differences", "averages", "observer", "auto"}, optional
        The part of earlier observations in states. ``"differences"``: the change of each input in
        the last step, as a further input, for tasks whose observations lack velocities.
        ``"averages"``: two running averages of each input, as further inputs. ``"observer"``: an
        estimate in place of each input, for noisy sensors, from a model that is fitted in the
        warm-up (at most 16 inputs). These three need a warm-up, and observations must be those of
        one episode, in order. ``"auto"``, the default of `SDNNQLambda` and `SDNNActorCritic`: what
        the warm-up finds useful, or nothing, as without a warm-up or with ``missing="code"``. By
        default ``"none"`` in other agents.

    Raises
    ------
    TypeError, ValueError
        For spaces of another kind; for spaces, ranges or settings that are impossible.
    """

    _has_warned_of_history = False
    _returns: Sequence[float] = ()  # of the episodes of all calls of `train`; not saved in files

    @property
    def observation_range(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest values that states can code, each of shape (n_variables,).

        RuntimeError if the warm-up has not found them yet.
        """
        self._require_warm()
        return self._controller.ranges

    @property
    def inputs(self) -> list[tuple[str, list[int]]]:
        """The inputs of a state, each with its type and the numbers of the observed variables.

        ``("variable", [i])``, ``("circular", [i])``, ``("angle", [cosine, sine])`` or
        ``("symbol", [first, n])``. Empty until a warm-up is over.
        """
        return self._controller.inputs

    @property
    def has_running_ranges(self) -> bool:
        """Whether the ranges of observations are adapted to each new observation."""
        return self._observation.running

    @property
    def n_learned(self) -> int:
        """Number of steps learned or imitated in all, also before a save; not those of excursions.

        On-policy agents learn no warm-up. Others count refused rewards in it; SDNN-C always.
        """
        return self._controller.n_learned

    @property
    def n_dimensions(self) -> int:
        """Dimensions of an action."""
        return len(self._action.low)

    def _dimension(self, dimension: int) -> int:
        """Return the number of a dimension of actions as an int; ValueError if there is none."""
        return whole("dimension", dimension, 0, self.n_dimensions - 1)

    def _warn_of_history(self) -> None:
        """Warn once if the warm-up could not fit the observer that was asked for."""
        is_missing = self._observation.history == "observer" and self.history == "none"
        if not is_missing or self._has_warned_of_history:
            return
        self._has_warned_of_history = True
        n_numbers = sum(kind != "symbol" for kind, _ in self._controller.inputs)
        reason = (
            f"{n_numbers} numeric inputs are more than {_MOST_OBSERVED}"
            if n_numbers > _MOST_OBSERVED
            else "the warm-up had fewer than 100 transitions"
        )
        warnings.warn(
            f"history='observer' was not possible, as {reason}: states have no history",
            stacklevel=2,
        )

    def _imitate_step(self, transition: Transition, value: float, margin: float) -> None:
        """Learn that a teacher chose an action whose return was `value`; `imitate` calls it.

        With Q(lambda) the values of other actions become lower by `margin` at least, in the unit of
        the rewards. RuntimeError while the agent is warming up; ValueError for bad arguments and
        for agents without a linear readout.
        """
        observation, action, *_ = self._parts_of(transition, 0)
        self._require_warm().imitate(observation, action, value, margin)

    def _follow_teacher(self, transition: Transition) -> None:
        """Continue an episode with a teacher's action, so that histories know it; learn nothing."""
        observation, action, *_ = self._parts_of(transition, 0)
        self._require_warm().follow_teacher(observation, action)

    @property
    def _remembers(self) -> bool:
        """Whether a state depends on earlier observations of its episode."""
        return self.history != "none" or self.missing == "hold"

    @property
    def _n_warm_up_steps_left(self) -> int:
        """Number of transitions until the warm-up is over, while the agent is warming up."""
        return self._warm_up_steps - len(self.state()["warm_up.rewards"])

    def _end_warm_up_of_teacher(self) -> None:
        """End a warm-up from a teacher's log: ranges become at least three times as wide."""
        self._controller.end_warm_up_of_teacher()
        self._warn_of_history()

    def _require_warm(self) -> _core.Controller:
        """Return the core's controller; RuntimeError while the agent is warming up."""
        if self.is_warming_up:
            raise RuntimeError(
                "the agent is still warming up: it has no ranges of its observations until it has"
                f" learned {self._warm_up_steps} transitions, or is given observation_range"
            )
        return self._controller

    def _values(self, observation: Element, dimension: int) -> NDArray[np.float64]:
        """Return the values of a dimension's actions, or an actor-critic's probabilities.

        Shape (n_actions[dimension],); fuzzy rules give the observation's value, shape (1,).
        """
        variables = self._observations.vector("observation", observation)
        return self._require_warm().values(variables, dimension)

    def _facts(self) -> dict[str, object]:
        """Return the facts that ``repr`` and notebooks display, by their labels."""
        facts: dict[str, object] = {
            "observation": space_words(self.observation_space),
            "action": space_words(self.action_space),
            "inputs": "found in the warm-up" if self.is_warming_up else len(self.inputs),
            "seed": self.seed,
        }
        if self.n_learned:
            facts["observed" if self.is_warming_up else "learned"] = f"{self.n_learned:,} steps"
        if self._returns:
            facts["last return"] = f"{self._returns[-1]:.5g}"
        return facts

    def _curve(self) -> Sequence[float]:
        return self._returns

    @explained
    def predict(
        self,
        observation: Element,
        state: None = None,
        episode_start: object = None,
        deterministic: bool = True,
        action_masks: Any = None,
    ) -> tuple[Element, None]:
        """Choose actions with the interface of Stable-Baselines3's models, such as for its tools.

        Parameters
        ----------
        observation : element of the observation space, or a batch of several
            A batch is what a vector environment gives: arrays with one axis more, the first one,
            in a Dict or Tuple where the space is one.
        state, episode_start
            Not used: Stable-Baselines3 has them for recurrent models.
        deterministic : bool
            False: explore, as `act` does, in environment 0.
        action_masks : optional
            The mask of `act`, or for a batch a mask for each observation.

        Returns
        -------
        The action, or an array of actions along the first axis, and None.
        """
        explore = not flag("deterministic", deterministic)
        batch = unbatched(self.observation_space, observation)
        if batch is None:  # a single observation
            return self._masked_action(observation, explore, action_masks), None
        require(len(batch) > 0, "observation", "be at least one", observation)
        masks = [None] * len(batch) if action_masks is None else action_masks
        has_all_masks = hasattr(masks, "__len__") and len(masks) == len(batch)
        expected = f"be one for each of {len(batch)} observations"
        require(has_all_masks, "action_masks", expected, action_masks)
        pairs = zip(batch, masks, strict=True)
        actions = [self._masked_action(element, explore, mask) for element, mask in pairs]
        return np.stack(actions), None

    def _masked_action(self, observation: Element, explore: bool, mask: Mask) -> Element:
        """Choose an action as `act` does; errors about the mask name the argument of `predict`."""
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
        env: AnyEnv | str,
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

        An id, such as ``"CartPole-v1"``, stands for the environment that `gymnasium.make` gives.

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
            callbacks = [*checked_callbacks(callbacks), *([bar] if shows_bar() else [])]
        with opened("env", env) as learned_env:
            training = Training(
                self,
                learned_env,
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
                self._returns = (*self._returns, *returns_of(training.rows))

    @explained
    def plot_values(
        self, source: Env | Elements, *, inputs: Sequence[str | int] | None = None, seed: int = 0
    ) -> Figure:
        """Draw the values of states over one or two inputs, the others at their median.

        The figure is one of Matplotlib, as with `plot_policy` and `plot_inputs`.

        Parameters
        ----------
        source : environment, or list of observations
            Where states are met: in greedy episodes with a tenth of random actions, or given.
        inputs : list of one or two, optional
            Names of inputs, or numbers of observed variables; by default the most influential ones.
        seed : int
            Of the episodes and of the shuffling.
        """
        from sdnn.agents.inspection_figures import plot_values

        return plot_values(self, source, inputs, seed)

    @explained
    def plot_policy(
        self, source: Env | Elements, *, inputs: Sequence[str | int] | None = None, seed: int = 0
    ) -> Figure:
        """Draw greedy actions over one or two inputs; arguments are those of `plot_values`."""
        from sdnn.agents.inspection_figures import plot_policy

        return plot_policy(self, source, inputs, seed)

    @explained
    def plot_inputs(self, source: Env | Elements, *, seed: int = 0) -> Figure:
        """Draw how far values and greedy actions change where an input is shuffled among states.

        Arguments are those of `plot_values`.
        """
        from sdnn.agents.inspection_figures import plot_inputs

        return plot_inputs(self, source, seed)

    def _state_of(self, part: str) -> Arrays:
        """Return the arrays of a part of the state, such as ``"agent"``, by name."""
        arrays, prefix = self.state().items(), f"{part}."
        return {name.removeprefix(prefix): a for name, a in arrays if name.startswith(prefix)}

    def _restore(self, **parts: Mapping[str, Array]) -> None:
        """Replace parts of the state; ValueError if they do not fit, and nothing changes."""
        others = {k: a for k, a in self.state().items() if k.partition(".")[0] not in parts}
        new = {f"{part}.{name}": a for part, state in parts.items() for name, a in state.items()}
        self._controller.restore(others | new)

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

    @classmethod
    def rebuild(cls, description: Data, arrays: Mapping[str, Array]) -> Self:
        """Make an agent from its `description` and `state`; ValueError if they do not fit."""
        agent = cls.__new__(cls)
        agent._observation = _core.ObservationConfig(**description["observation"])
        agent._action = _core.ActionConfig(**description["action"])
        if "observation_space" in description:
            observations = space_of(description["observation_space"])
            actions = space_of(description["action_space"])
        else:  # the agent was made in C++
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
        agent._make_controller(state=dict(arrays))
        n_variables = Observations(observations).n_variables
        if agent._controller.n_variables != n_variables:
            raise ValueError(f"observation must be of {n_variables} variables")
        if "action_space" in description and agent._action != Actions(actions).config:
            raise ValueError(f"action must be of {agent.action_space}, got {agent._action}")
        if "wrappers" in description:
            agent.wrappers = read_statistics(description["wrappers"])
        if "scaling" in description:
            agent.scaling = Scaling.of_values(description["scaling"], n_variables)
        agent._actions.has_masks = flag("action_masks", description.get("action_masks", False))
        agent._next_episode = whole("next_episode", description.get("next_episode", 0), 0, 2**53)
        return agent

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return type(self).rebuild, (self.description(), self.state())


AnyAgent: TypeAlias = Agent[Any, Any]
"""An agent with any approximator and learning rule."""


@explained
def load_agent(path: str | Path) -> AnyAgent:
    """Read an agent of any kind that `Agent.save` wrote; see `Agent.load`."""
    agent: AnyAgent = read_agent(path_of("path", path), "agent", "training")[0]
    return agent
