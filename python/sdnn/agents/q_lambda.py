"""Q(lambda) with a linear readout of the SDNN code, for any Gymnasium environment."""

from __future__ import annotations

from sdnn import _core
from sdnn.agents.base import presets_of
from sdnn.agents.q_learning import ValueAgent
from sdnn.config import LinearSDNNConfig, QLambdaConfig
from sdnn.environments.types import Data


class SDNNQLambda(ValueAgent[LinearSDNNConfig, QLambdaConfig]):
    """An agent that learns Q(s, a) linear in the SDNN code, by true-online traces.

    Values have no range that must be chosen, nothing depends on a planned end of the training, and
    all that is learned are integers: the same on every processor.

    A ``Box`` of actions is cut evenly into ``approximator.n_actions`` actions in each dimension;
    Q(s, a) is the sum of the dimensions' parts, so the best action is exact. A ``Discrete`` of at
    most 1,536 observations has a table: weights of its own for each.

    Parameters
    ----------
    observation_space, action_space, seed, tables, observation_range, angles, warm_up_steps,
    missing
        See `Agent`.
    angle_pairs, inputs, history
        See `Agent`; by default ``"find"``, ``"relevant"`` and ``"auto"``, with the preset
        ``"paper"`` ``"none"``, ``"all"`` and ``"none"``. So the agent begins with a warm-up, unless
        there is no choice. Inputs that matter later are added after 2, 4, 8, ... times
        ``warm_up_steps``, in states without a history.
    approximator : LinearSDNNConfig, optional
        ``n_inputs`` (and ``n_actions``, unless actions are a Box) are taken from the spaces.
    learning : QLambdaConfig, optional
    preset : {"general", "paper"}
        Settings where none are given: for any task, or the paper's rule in the paper's task; see
        `presets`.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.agents import SDNNQLambda
    >>> env = gym.make("CartPole-v1")
    >>> agent = SDNNQLambda(env, seed=1)
    >>> result = agent.train(env, steps=1500, seed=1)
    >>> agent.q_values(env.reset(seed=2)[0]).shape
    (2,)
    """

    kind = "q-lambda"
    approximator_type = LinearSDNNConfig
    learning_type = QLambdaConfig
    presets = presets_of(_core.q_lambda_presets())
    """Settings by name: ``"general"`` and ``"paper"``."""

    @property
    def readout(self) -> _core.LinearSDNN:
        """The compiled readout of all dimensions of actions, which shares all that is learned.

        States are in [0, 1]; ``readout.weights()`` are in units of 2 to the power
        ``readout.exponent``. RuntimeError while the agent is warming up.
        """
        readout: _core.LinearSDNN = self.networks[0]
        return readout

    @property
    def final_epsilon(self) -> float:
        """The value that epsilon approaches with ``learning.schedule_steps``.

        By default 0; the first value where observations are symbols only, so that every one
        continues to be explored. RuntimeError while the agent is warming up.
        """
        return self._controller.final_epsilon or 0.0

    def learning_report(self) -> Data:
        """Return statistics of learning so far, to find settings that cannot work.

        Returns
        -------
        dict
            Those of all agents that learn values of actions (`ValueAgent.learning_report`), and
            ``value_unit``: the step in which values are counted; ``recent_reward``: the size of the
            largest recent reward, to a factor of 2 (with fewer than some thousand units in it,
            small rewards are rounded); both None before a reward that is not 0.

        Raises
        ------
        RuntimeError
            While the agent is warming up.
        """
        exponent, size = self.readout.exponent, self._controller.reward_size
        return super().learning_report() | {
            "value_unit": None if exponent is None else 2.0**exponent,
            "recent_reward": None if size is None else 2.0**size,
        }
