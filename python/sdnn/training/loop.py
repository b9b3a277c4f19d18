"""The training loop: act, step, learn, evaluate.

In each round the agent acts in all environments, these step together, and the agent learns the
outcomes in the order of the environments. The loop pauses after a step that ends an episode, and
where an evaluation or a callback is due. The adapters after it call agents in C++ or in Python.
"""

from __future__ import annotations

import abc
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import ExitStack
from typing import Any, TypeAlias

import numpy as np
from numpy import ndarray
from numpy.typing import NDArray

from sdnn.environments.types import Array, Element, Elements, Mask, Masks
from sdnn.support.interrupts import Interrupts
from sdnn.training.episodes import Episodes, checked_outcome
from sdnn.training.evaluation import greedy_episodes
from sdnn.training.files import EpisodeBlock, copied, share_statistics, statistics_of
from sdnn.training.interfaces import (
    LONG,
    CoreParts,
    Learner,
    ObservingLearner,
    Transition,
    UnusableStepError,
    warn_of_horizon,
)

Row: TypeAlias = Mapping[str, Any]
"""A row of results, about an episode or an evaluation.

Episodes have ``kind``, ``step``, ``episode``, ``return``, ``length``, ``terminated``, and with
several environments ``environment``. Evaluations have ``kind``, ``step``, ``episode``,
``mean_return``, ``mean_length``, ``share_terminated``, and lists ``returns``, ``lengths``,
``terminated`` of their episodes. Steps and episodes are those learned until then.
"""


class TrainingLoop(abc.ABC):
    """The loop of a training; `Training` has its arguments and its files."""

    agent: Any
    env: Any
    evaluation_env: Any
    steps: int | None
    episodes: int | None
    seed: int | None
    evaluate_every: int | None
    evaluate_every_episodes: int | None
    evaluation_episodes: int
    limit_bootstraps: bool
    callbacks: Sequence[Any]
    n_steps = 0
    n_episodes = 0
    n_rows = 0
    evaluations: list[tuple[int, float]]
    """Steps and mean returns of all evaluations so far, including those before `load`."""
    blocks: dict[int, EpisodeBlock]
    """Blocks of episodes that are compared, by their length."""
    best_blocks: frozenset[int] = frozenset()
    """Lengths of the blocks that ended with the last episode and were better than all before."""
    rows: list[Row]
    """Rows since the training was begun, or last loaded."""
    is_within_step = False
    """Whether a step is half done; if an error left it so, the training cannot be saved."""

    _episodes: Episodes
    _learner: _LearnerAdapter
    _listeners: Sequence[tuple[int, Any]]  # callbacks that are called after steps, with intervals
    _next_call: int  # number of steps at which an evaluation, a callback or the end is due next
    _stops: bool  # whether `stop` was called
    _defers = False  # whether `stop` ended an evaluation, which the next `run` makes
    _warning_step = 0  # number of steps at which to warn that no episode has terminated; 0: never

    def pieces(self, seconds: float) -> Generator[None, None, None]:
        """Learn as `run` does, in pieces of about ``seconds`` each.

        Closing the generator between two pieces stops the training there, like `stop`.
        """
        if self.is_within_step:
            raise RuntimeError("a training that was left within a step cannot be resumed: load it")
        with Interrupts(self.stop) as interrupts, ExitStack() as stack:
            # At the end, in reverse order: on_end of callbacks, warnings, statistics for the file.
            stack.callback(setattr, self, "_stops", False)
            stack.callback(self._keep_statistics)
            stack.callback(self._warn_of_problems)
            for callback in self.callbacks:
                callback.on_start(self)
                stack.callback(callback.on_end, self)
            self._begin()
            due = time.monotonic() + seconds
            while not (self.is_finished or self._stops):
                self.is_within_step = True
                try:
                    environment = self._learn_until(due)
                except Exception:  # the next `run` begins new episodes
                    self._episodes.abandon()
                    self.is_within_step = False
                    raise
                failure = self._note_outcome(environment)
                self.is_within_step = False
                if failure is not None:
                    raise failure
                if self.n_steps == self._warning_step:
                    warn_of_horizon(self.agent)
                if self._episodes.is_over(environment):
                    self._warn_of_problems()
                if time.monotonic() >= due:
                    yield
                    due = time.monotonic() + seconds
        if interrupts.received is not None:
            raise KeyboardInterrupt

    def _begin(self) -> None:
        """Prepare the loop: the first evaluation, the callbacks and the next pause."""
        if self._lacks_evaluation:
            self._report(self._evaluate())
        n_environments = self._episodes.n_environments
        if getattr(self.agent, "n_environments", 1) != n_environments and not self.is_finished:
            self.agent.n_environments = n_environments
        self._listeners = self._find_listeners()
        if self.n_steps == 0:
            self._warning_step = LONG * n_environments
        self._set_next_call()

    def _learn_until(self, due: float) -> int:
        """Act, step and learn until an episode ends, a callback is due, or a time is reached.

        Returns the environment of the last step learned, whose outcome is to be noted.
        """
        episodes, monotonic = self._episodes, time.monotonic
        while True:
            while not episodes.unlearned:  # a step of a vector may consist of resets only
                self._act_and_step()
            environment = self._learn()
            is_due = self.n_steps >= self._next_call or self._stops or monotonic() >= due
            if is_due or episodes.is_over(environment):
                return environment

    def _act_and_step(self) -> None:
        """Reset environments whose episode is over, choose actions, and step all environments."""
        episodes = self._episodes
        episodes.begin()
        try:
            actions = self._learner.act(
                episodes.observations, episodes.actions, episodes.unlearned, episodes.masks
            )
        except ValueError as error:
            raise self._unusable(error) from error
        episodes.step(actions)

    def _learn(self) -> int:
        """Learn steps of environments in order, until an episode ended or a callback is due.

        Returns the environment of the last step learned. At the end of an episode `_note_outcome`
        sets the progress, else `learn` does.
        """
        episodes, adapter = self._episodes, self._episodes.adapter
        n_steps, environments, learn = self.n_steps, episodes.unlearned, self._learner.learn
        try:
            n_learned = learn(
                episodes.previous_observations,
                episodes.actions,
                adapter.rewards,
                episodes.observations,
                episodes.terminal(self.limit_bootstraps),
                adapter.truncated,
                environments,
                self._next_call - n_steps,  # the most steps to learn
                n_steps,
                self.steps,  # the goal of the progress; None if that is in episodes
                episodes.masks,
                adapter.dts,
            )
        except (ValueError, OverflowError) as error:
            raise self._unusable(error, environments[0]) from error
        self.n_steps = n_steps + n_learned
        return episodes.note_learned(n_learned)

    def _note_outcome(self, environment: int) -> Exception | None:
        """Count an episode that ended, evaluate if that is due, and call the callbacks.

        An error of the evaluation is returned, not raised: the step itself is complete.
        """
        is_over = self._episodes.is_over(environment)
        is_called = self.n_steps >= self._next_call
        rows = [self._end_episode(environment)] if is_over else []
        self._set_progress(is_over)
        failure: Exception | None = None
        if (is_over or is_called) and self._lacks_evaluation:
            try:
                rows += self._evaluate()
            except Exception as error:
                failure = error
        self._report(rows)
        if is_called:
            for interval, callback in self._listeners:
                if self.n_steps % interval == 0:
                    callback.on_step(self)
            self._set_next_call()
        return failure

    def _end_episode(self, environment: int) -> Row:
        """Count the episode that ended in an environment, and return its row."""
        episode = self._episodes.present[environment]
        assert episode is not None
        row = self._row(
            "episode",
            episode=self.n_episodes,
            **self._learner.arguments[environment],
            **{"return": episode.sum_of_rewards},
            length=episode.n_steps,
            terminated=self._episodes.adapter.terminated[environment],
        )
        self.best_blocks = frozenset(
            block.length for block in self.blocks.values() if block.ends_best(row["return"])
        )
        self.n_episodes += 1
        self._episodes.present[environment] = None
        if self._episodes.terminal(self.limit_bootstraps)[environment]:
            self._warning_step = 0  # the warning is for trainings in which nothing terminates
        if self.evaluate_every_episodes is not None and self._lacks_evaluation:
            self._learner.begin_episode(environment)  # so that pending n-step returns are learned
        return row

    def _set_progress(self, is_episode_over: bool) -> None:
        """Set the learner's ``progress``; that in episodes changes where one is over."""
        learner = self._learner.progressing
        if learner is None:
            return
        if self.steps is not None:
            learner.progress = self.n_steps / self.steps
        elif is_episode_over and self.episodes is not None:
            learner.progress = self.n_episodes / max(self.episodes, self.n_episodes)

    def _set_next_call(self) -> None:
        """Compute the next step after which a callback, an evaluation or the end is due."""
        n = self.n_steps
        intervals = [*(interval for interval, _ in self._listeners), self.evaluate_every]
        due = [n - n % interval + interval for interval in intervals if interval]  # next multiples
        if n < self._warning_step:
            due.append(self._warning_step)  # `pieces` warns there that the training is long
        self._next_call = min([*due, 2**62 if self.steps is None else self.steps])  # 2**62: never

    @property
    def is_finished(self) -> bool:
        """Whether all steps or episodes are done, and the last evaluation."""
        goals = (self.n_steps, self.steps), (self.n_episodes, self.episodes)
        return not self._defers and any(goal is not None and n >= goal for n, goal in goals)

    def stop(self) -> None:
        """Stop after the present step, or before the first one of the next `run`."""
        self._stops = True

    @property
    def _lacks_evaluation(self) -> bool:
        """Whether an evaluation is due that has not been made yet."""
        if self.evaluate_every is not None:
            return len(self.evaluations) < self.n_steps // self.evaluate_every
        if self.evaluate_every_episodes is not None:
            return len(self.evaluations) < self.n_episodes // self.evaluate_every_episodes
        return False

    def _evaluate(self) -> list[Row]:
        """Return the row of an evaluation; none where `stop` defers it to the next `run`."""
        share_statistics(self.env, self.evaluation_env)
        evaluation = greedy_episodes(
            self.agent,
            self.evaluation_env,
            self.evaluation_episodes,
            seed=self.seed,
            options=self._episodes.options(self.n_episodes),
            should_stop=lambda: self._stops,
        )
        self._defers = evaluation is None
        if evaluation is None:
            return []
        self.evaluations.append((self.n_steps, evaluation.mean_return))
        return [self._row("evaluation", episode=self.n_episodes, **evaluation.row())]

    def _row(self, kind: str, **values: Any) -> Row:
        """Make a row, and count it."""
        self.n_rows += 1
        return {"kind": kind, "step": self.n_steps, **values}

    def _report(self, rows: list[Row]) -> None:
        """Store rows, and pass each to all callbacks."""
        for row in rows:
            self.rows.append(row)
            for callback in self.callbacks:
                callback.on_row(self, row)

    def _warn_of_problems(self) -> None:
        """Let an agent that can do so warn of rewards or histories that it could not use."""
        if hasattr(self.agent, "warn_of_problems"):
            self.agent.warn_of_problems()

    def _keep_statistics(self) -> None:
        """Store the statistics of the environment's wrappers in the agent, for its file."""
        if hasattr(self.agent, "wrappers"):
            self.agent.wrappers = statistics_of(self._episodes.wrappers)

    @abc.abstractmethod
    def _find_listeners(self) -> Sequence[tuple[int, Any]]:
        """Return the callbacks that are called after steps, each with its interval."""

    def _unusable(self, error: Exception, environment: int | None = None) -> UnusableStepError:
        """Return the error about a step or reset, which names step, episode and environment."""
        where, n_environments = "", self._episodes.n_environments
        if n_environments == 1:
            environment = 0
        episode = None if environment is None else self._episodes.present[environment]
        if episode is not None:
            where = f"step {episode.n_steps}" if episode.n_steps else "the reset"
            whose = f" in environment {environment}" if n_environments > 1 else ""
            where = f" ({where} of episode {episode.number}{whose})"
        return UnusableStepError(
            f"env gave what cannot be learned, in step {self.n_steps + 1}{where}: {error}"
        )


class _LearnerAdapter(ObservingLearner):
    """Calls a learner for each environment, with the methods that the loop and `Episodes` need."""

    def __init__(self, learner: Any, n_environments: int) -> None:
        self._learner = learner
        self.progressing: Any = learner if hasattr(learner, "progress") else None
        """The object whose ``progress`` follows that of the training."""
        self.arguments: list[dict[str, int]] = [{}]
        """Arguments that name an environment, where there are several."""
        if n_environments > 1:
            self.arguments = [{"environment": i} for i in range(n_environments)]

    def begin_episode(self, environment: int) -> None:
        self._learner.begin_episode(**self.arguments[environment])

    def read(self, name: str, observations: Elements, /) -> Elements:
        return [copied(observation) for observation in observations]

    def flat(self, observation: Element) -> NDArray[np.float64]:
        return np.asarray(self._learner.flat_observation(observation))

    def masks(self, masks: list[Mask]) -> Masks:
        return masks

    def act(
        self,
        observations: Elements,
        actions: Elements,
        environments: list[int],
        masks: Masks | None = None,
    ) -> Elements:
        """Return ``actions`` with new entries for these environments."""
        chosen = list(actions)
        for i in environments:
            mask = {} if masks is None else {"mask": masks[i]}
            chosen[i] = self._learner.act(observations[i], **self.arguments[i], **mask)
        return chosen

    def learn(
        self,
        observations: Elements,
        actions: Elements,
        rewards: list[float],
        next_observations: Elements,
        terminated: list[bool],
        truncated: list[bool],
        environments: list[int],
        most: int,
        n_steps: int,
        goal: int | None,
        next_masks: Masks | None = None,
        dts: list[float] | None = None,
    ) -> int:
        """Learn the last step in the first of ``environments``; return the number learned, 1.

        Observations, actions and outcomes are lists with an entry for each environment of the
        training. Before the step, the training had ``n_steps`` of ``goal``; the learner's
        ``progress`` follows, unless the episode is over. Subclasses may learn in ``most`` of
        ``environments`` at once, in order, up to the end of an episode.
        """
        i = environments[0]
        reward, terminates, _ = checked_outcome(rewards[i], terminated[i], False)
        mask = None if next_masks is None or terminates else next_masks[i]
        dt = 1.0 if dts is None else dts[i]
        step = Transition(
            observations[i], actions[i], reward, next_observations[i], terminates, mask, dt
        )
        self._learner.learn(step, **self.arguments[i])
        if not (goal is None or self.progressing is None or terminated[i] or truncated[i]):
            self.progressing.progress = (n_steps + 1) / goal
        return 1


class _CoreLearnerAdapter(_LearnerAdapter):
    """Acts and learns in all environments by one call of an agent's core in C++ each."""

    read: Callable[[str, Elements], NDArray[np.float64]]
    learn: Callable[..., int]  # the core's `learn_each`, with the arguments of the method above

    def __init__(self, learner: Learner, n_environments: int, parts: CoreParts) -> None:
        super().__init__(learner, n_environments)
        self.progressing = self._core = parts.core
        self.read, self._batch, self._mask = parts.read, parts.batch, parts.mask
        self.learn = parts.core.learn_each
        self._n_actions = sum(parts.core.n_actions)

    def flat(self, observation: Element) -> NDArray[np.float64]:
        return np.array(observation)

    def masks(self, masks: list[Mask]) -> NDArray[np.uint8]:
        """Return the masks as rows of flags, shape (n_environments, n_actions of all dimensions).

        None allows all actions.
        """
        rows = np.ones((len(masks), self._n_actions), np.uint8)
        for i, mask in enumerate(masks):
            if (row := self._mask("action_mask", mask)) is not None:
                rows[i] = row
        return rows

    def act(
        self,
        observations: Elements,
        actions: Elements,
        environments: list[int],
        masks: Any = None,
    ) -> Array:
        """Return ``actions`` as an array with new rows for these environments."""
        # A list comes from the beginning of a training, or a repeated episode.
        chosen = actions.copy() if type(actions) is ndarray else self._batch(actions)
        self._core.act_each(observations, environments, chosen, masks)
        return chosen


def learner_adapter(learner: Learner, n_environments: int) -> _LearnerAdapter:
    """Return the adapter for a learner: an agent in C++ is called once for all environments.

    An agent whose ``act`` or ``learn`` is replaced has no core parts, and is called for each.
    """
    core_parts: Callable[..., CoreParts | None] | None = getattr(type(learner), "core_parts", None)
    if core_parts and (parts := core_parts(learner)):
        return _CoreLearnerAdapter(learner, n_environments, parts)
    return _LearnerAdapter(learner, n_environments)
