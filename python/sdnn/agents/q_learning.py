"""Q-learning, for any Gymnasium environment."""

from __future__ import annotations

import abc
from typing import Any, Generic

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.agents.agent import Agent
from sdnn.agents.base import Approximator, Learning, presets_of
from sdnn.config import QLearningConfig, RBFNetworkConfig, SDNNCConfig
from sdnn.environments.types import Array, Data
from sdnn.support.arguments import real


class ValueAgent(Agent[Approximator, Learning], abc.ABC, Generic[Approximator, Learning]):
    """An agent that learns the values of actions, with any approximator."""

    @property
    def learning_rate(self) -> float:
        """Alpha as it is now: as it was set, or as `progress` makes it.

        May be set, to a number in (0, 1]: it then stays, whatever the progress, also in a saved
        agent. None: it follows the progress again.
        """
        return self._controller.learning_rate

    @learning_rate.setter
    def learning_rate(self, rate: float | None) -> None:
        self._controller.learning_rate = None if rate is None else real("learning_rate", rate)

    @property
    def epsilon(self) -> float:
        """The probability of a random action as it is now; may be set, like `learning_rate`."""
        return self._controller.epsilon

    @epsilon.setter
    def epsilon(self, epsilon: float | None) -> None:
        self._controller.epsilon = None if epsilon is None else real("epsilon", epsilon)

    @property
    def networks(self) -> list[Any]:
        """The compiled network of each dimension of actions, which shares all that is learned.

        States are in [0, 1]. Networks have ``values(state)``, ``weights()`` and, by class, more.
        RuntimeError while the agent is warming up.
        """
        return self._require_warm().networks

    @property
    def n_actions(self) -> int | list[int]:
        """Number of actions the agent chooses from, of each dimension where there are several."""
        n_actions = self._controller.n_actions
        return n_actions[0] if len(n_actions) == 1 else n_actions

    @property
    def actions(self) -> Array:
        """The actions of the first dimension in the order of ``q_values``, shape (n_actions,)."""
        return self.actions_of(0)

    def actions_of(self, dimension: int) -> Array:
        """Return the actions of a dimension in order, shape (n_actions[dimension],)."""
        n = self._controller.n_actions[self._dimension(dimension)]
        values = [self._controller.action_of(index, dimension) for index in range(n)]
        return np.array(values, np.float64 if self._actions.is_box else np.int64)

    def q_values(self, observation: ArrayLike, dimension: int = 0) -> NDArray[np.float64]:
        """Return Q(observation, a) of every action of a dimension, shape (n_actions[dimension],).

        Of several dimensions, Q of the whole action is the mean of these, of `SDNNQLambda` the sum.
        Greedy actions follow these values, from the averaged weights where there are any. Several
        threads may call it at once; `learn` waits for them.

        Raises
        ------
        RuntimeError, ValueError
            While the agent is warming up; for arguments that are not usable.
        """
        return self._values(observation, self._dimension(dimension))

    def learning_report(self) -> Data:
        """Return statistics of learning so far, to find settings that cannot work.

        Returns
        -------
        dict
            ``left_out``: numbers of the observed variables that are in no input, as neither rewards
            nor actions have to do with them; ``fitted``: those whose ranges the warm-up fitted;
            ``share_of_range``: for each observed variable the part of its range in which nine
            tenths of the last 2,048 observations or so were (a small one: ranges are too wide);
            ``share_beyond_range``: the share of them outside (a large one: too narrow). Both are
            None for angles, symbols and variables that are left out, and until there were about
            160 observations.

        Raises
        ------
        RuntimeError
            While the agent is warming up.
        """
        controller = self._require_warm()
        use = controller.range_use()
        read: set[int] = set()  # numbers of the variables in inputs
        for kind, variables in controller.inputs:
            if kind == "symbol":
                first, n_variables = variables
                read.update(range(first, first + n_variables))
            else:
                read.update(variables)
        ranges = zip(*controller.ranges, strict=True)
        declared = list(zip(self._observation.low, self._observation.high, strict=True))
        return {
            "left_out": [i for i in range(len(use)) if i not in read],
            "fitted": []
            if self.has_running_ranges
            else [i for i, ends in enumerate(ranges) if ends != declared[i]],
            "share_of_range": [shares and shares[0] for shares in use],
            "share_beyond_range": [shares and shares[1] for shares in use],
        }


class SDNNQLearning(ValueAgent[SDNNCConfig, QLearningConfig]):
    """An agent that learns Q(s, a) with SDNN-C, one transition at a time.

    A ``Box`` of actions is cut evenly into the network's actions, 5 in each dimension by default;
    a ``Discrete`` space gives one window of hidden units per action. Actions of several dimensions
    have a network each, and Q(s, a) is the mean of their values: the best action is exact, one pass
    per dimension; see docs/how-to/agents.md.

    Parameters
    ----------
    observation_space, action_space, seed, tables, observation_range, angles, angle_pairs, inputs, \
warm_up_steps, missing, history
        See `Agent`.
    approximator : SDNNCConfig, optional
        ``n_inputs`` (and ``n_actions``, unless actions are a Box) are taken from the spaces.
    learning : QLearningConfig, optional
    preset : {"general", "small", "robust", "paper"}, optional
        Settings where none are given: for any task, the same with a network for small processors,
        those that stay steady in the paper's task, or the paper's; see `presets`.

    Examples
    --------
    >>> import gymnasium as gym, sdnn
    >>> from sdnn.agents import SDNNQLearning, Transition
    >>> env = gym.make("sdnn.environments:sdnn/AcrobotSwingUp-v0")
    >>> agent = SDNNQLearning(env, seed=1)
    >>> observation, _ = env.reset(seed=1)
    >>> agent.begin_episode()
    >>> for _ in range(3):
    ...     action = agent.act(observation)
    ...     next_observation, reward, terminated, truncated, _ = env.step(action)
    ...     agent.learn(Transition(observation, action, reward, next_observation, terminated))
    ...     observation = next_observation
    >>> agent.q_values(observation).shape
    (5,)
    """

    kind = "sdnn-c"
    approximator_type = SDNNCConfig
    learning_type = QLearningConfig
    presets = presets_of(_core.presets())
    """Settings by name: ``"paper"``, ``"general"``, ``"robust"`` and ``"small"``."""

    def learning_report(self) -> Data:
        """Return statistics of learning so far, to find settings that cannot work.

        Returns
        -------
        dict
            Those of all agents that learn values of actions (`ValueAgent.learning_report`), and
            ``n_corrections``: transitions learned, times dimensions; ``share_changed``: those that
            changed weights; ``share_rounded_away``: those whose target was between two values of
            the network, nearer to the present one (a larger ``learning_rate``, more units or
            another ``rounding`` help); ``share_out_of_range``: those with targets outside
            ``q_range`` (a wider range, or ``value_range="adaptive"``); ``q_range``: (low, high) as
            it is; ``value_step``: how far two neighbouring values of the network are apart;
            ``mean_error``: how far the last 1,000 targets or so, clipped to the range, were from
            their values (much less than a step: rounding hides what is left to learn).

        Raises
        ------
        RuntimeError
            While the agent is warming up.
        """
        networks = self.networks
        changed, rounded_away, out_of_range, n_all = np.sum(
            [network.correction_counts for network in networks], axis=0
        ).tolist()
        return super().learning_report() | {
            "n_corrections": n_all,
            "share_changed": changed / max(n_all, 1),
            "share_rounded_away": rounded_away / max(n_all, 1),
            "share_out_of_range": out_of_range / max(n_all, 1),
            "q_range": networks[0].output_range,
            "value_step": networks[0].value_step,
            "mean_error": float(np.mean([network.mean_error for network in networks])),
        }


class RBFQLearning(ValueAgent[RBFNetworkConfig, QLearningConfig]):
    """An agent that learns Q(s, a) with an RBF network, one transition at a time.

    It is the baseline whose cost the paper quotes: normalized Gaussians on an even grid over state
    and action, linear weights, gradient Q-learning. Observations and actions are treated as by
    `SDNNQLearning`; the actions of a ``Discrete`` space are taken as evenly spaced.

    Parameters are those of `Agent`; there are no ``tables``. An angle is scaled like any other
    variable: the bases know no circle. ValueError for more weights than
    ``approximator.max_table_bytes`` allows.

    Examples
    --------
    >>> import gymnasium as gym, sdnn
    >>> from sdnn.agents import RBFQLearning
    >>> env = gym.make("sdnn.environments:sdnn/AcrobotSwingUp-v0")
    >>> agent = RBFQLearning(env, seed=1)
    >>> agent.train(env, steps=3).n_steps
    3
    >>> observation, _ = env.reset(seed=1)
    >>> agent.q_values(observation).shape
    (601,)
    """

    kind = "rbf"
    approximator_type = RBFNetworkConfig
    learning_type = QLearningConfig
    presets = presets_of({"paper": ("paper", RBFNetworkConfig(), QLearningConfig())})
    default_preset = "paper"
