"""Learners as a training calls them: one call acts or learns in all environments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn.environments.types import Array
from sdnn.training.steps import checked_outcome, copied

if TYPE_CHECKING:
    from sdnn._core import Controller


class Transition(NamedTuple):
    """A step of an environment.

    ``terminated`` is Gymnasium's: the episode ended in a terminal state. An episode cut off by a
    time limit (``truncated``) is not terminated; its last transition is learned like any other.
    ``next_mask`` has 1 for the actions that are allowed in a next state, as `Agent.act` has it.
    """

    observation: ArrayLike
    action: Any
    reward: float
    next_observation: ArrayLike
    terminated: bool
    next_mask: Any = None


class Learner(Protocol):
    """The interface of what is trained: every `sdnn.agents.Agent` has it.

    An agent that learns in one environment and is not saved needs only these methods, without the
    arguments ``environment`` and ``mask``. Where it has an attribute ``progress``, that is kept up
    to date.
    """

    def begin_episode(self) -> None:
        """Note that an episode begins."""

    def act(self, observation: Any, explore: bool = True) -> Any:
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

    def read(self, name: str, observations: Any) -> Any:
        """Return observations as `act` and `learn` take them, copied; ValueError names them."""
        return [copied(observation) for observation in observations]

    def flat(self, observation: Any) -> NDArray[np.float64]:
        """Return the numbers of an observation that was read, for a file."""
        return np.asarray(self._learner.flat_observation(observation))

    def masks(self, masks: list[Any]) -> Any:
        """Return masks of all environments as `act` and `learn` take them; ValueError names one."""
        return masks

    def act(
        self, observations: Any, actions: Sequence[Any], environments: list[int], masks: Any = None
    ) -> Any:
        """Return actions as `learn` takes them: new ones in these, the others as they were."""
        chosen = list(actions)
        for i in environments:
            mask = {} if masks is None else {"mask": masks[i]}
            chosen[i] = self._learner.act(observations[i], **self.arguments[i], **mask)
        return chosen

    def elements(self, actions: Any) -> Any:
        """Return the elements of the action space that `act` has chosen."""
        return actions

    def learn(
        self,
        observations: Any,
        actions: Any,
        rewards: list[float],
        next_observations: Any,
        terminated: list[bool],
        environments: list[int],
        progress: list[float],
        next_masks: Any = None,
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


class _CoreLearner(EachLearner):
    """An agent of the core, which acts or learns in all environments with one call."""

    def __init__(
        self,
        learner: Any,
        n_environments: int,
        core: Controller,
        read: Callable[[str, Any], NDArray[np.float64]],
        elements: Callable[[NDArray[np.float64]], Array],
        mask: Callable[[str, Any], NDArray[np.uint8] | None],
    ) -> None:
        super().__init__(learner, n_environments)
        self.progressing = self._core = core
        self._read, self._elements, self._mask = read, elements, mask
        self._n_actions = sum(core.n_actions)

    def read(self, name: str, observations: Any) -> NDArray[np.float64]:
        return self._read(name, observations)

    def flat(self, observation: Any) -> NDArray[np.float64]:
        return np.array(observation)

    def masks(self, masks: list[Any]) -> NDArray[np.uint8]:
        rows = np.ones((len(masks), self._n_actions), np.uint8)
        for i, mask in enumerate(masks):
            if (row := self._mask("action_mask", mask)) is not None:
                rows[i] = row
        return rows

    def act(
        self, observations: Any, actions: Sequence[Any], environments: list[int], masks: Any = None
    ) -> NDArray[np.float64]:
        chosen = self._core.act_each(observations, environments, masks)
        if len(environments) < len(chosen):
            for i in set(range(len(chosen))).difference(environments):
                chosen[i] = np.ravel(actions[i])  # an element of the space after a replay
        return chosen

    def elements(self, actions: NDArray[np.float64]) -> Array:
        return self._elements(actions)

    def learn(self, *outcomes: Any) -> int:
        return self._core.learn_each(*outcomes)


def each_learner(learner: Any, n_environments: int) -> EachLearner:
    """Return a learner in all environments; an agent of the core acts and learns in one call."""
    core_parts = getattr(type(learner), "core_parts", None)
    parts = core_parts and core_parts(learner)
    learner_class = _CoreLearner if parts else EachLearner
    return learner_class(learner, n_environments, *(parts or ()))
