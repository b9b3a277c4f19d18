"""The loop: an agent learns in an environment, can be stopped anywhere and goes on exactly."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.agents.episode import Actions, Episode
from sdnn.agents.evaluation import episode_seed, evaluate
from sdnn.agents.rounds import Outcome, rounds_in
from sdnn.agents.saved_training import (
    SavedEpisode,
    SavedTraining,
    read_training,
    write_training,
)
from sdnn.agents.spaces import require_same_kind, require_single
from sdnn.agents.transition import Transition, UnusableStepError, reward_of
from sdnn.arguments import flag, has_methods, path_of, whole
from sdnn.files import Arrays, Description
from sdnn.interrupts import Interrupts

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["Callback", "Row", "Training", "TrainingResult", "UnrepeatedEpisodeError"]

Row: TypeAlias = Mapping[str, Any]
"""What is known of an episode or an evaluation: numbers and words by name."""

_LEARNING = 0


class UnrepeatedEpisodeError(ValueError):
    """An environment does not repeat the episode in which a training was saved."""


class Callback:
    """Is told what happens in a training; every method does nothing unless overridden.

    A callback stops the training by ``training.stop()``.
    """

    def on_start(self, training: Training) -> None:
        """Before the first step, also of a training that goes on."""

    def on_step(self, training: Training) -> None:
        """After every learned step."""

    def on_row(self, training: Training, row: Row) -> None:
        """After an episode (``row["kind"] == "episode"``) and an evaluation (``"evaluation"``)."""

    def on_end(self, training: Training) -> None:
        """After the last step, also of a training that was interrupted."""


class Learner(Protocol):
    """What is trained: every `sdnn.agents.Agent`."""

    action_space: gym.Space[Any]
    progress: float
    n_environments: int

    def begin_episode(self, environment: int = 0) -> None:
        """Note that an episode begins."""

    def act(self, observation: Any, explore: bool = True, environment: int = 0) -> Any:
        """Choose an action."""

    def learn(self, transition: Transition, environment: int = 0) -> None:
        """Learn a step."""

    def flat_observation(self, observation: Any) -> NDArray[np.float64]:
        """Give the observed variables as a vector."""

    def description(self) -> Description:
        """Say what it is."""

    def state(self) -> Arrays:
        """Give what it remembers."""

    def save(self, path: str | Path) -> None:
        """Write it to a file."""


@dataclass(frozen=True, kw_only=True)
class TrainingResult:
    """What came of a training.

    Parameters
    ----------
    n_steps, n_episodes
        Learned in all, and whole episodes among them.
    rows
        Of the episodes and evaluations since it was begun, or last loaded.
    is_finished
        Whether all that was asked for is done: False if a callback stopped it.
    """

    n_steps: int
    n_episodes: int
    rows: tuple[Row, ...]
    is_finished: bool

    @property
    def returns(self) -> NDArray[np.float64]:
        """Undiscounted returns of the episodes, in order, shape (n,)."""
        return np.array([row["return"] for row in self.rows if row["kind"] == "episode"])

    @property
    def evaluations(self) -> NDArray[np.float64]:
        """Steps and mean returns of the evaluations, shape (n, 2)."""
        found = [(r["step"], r["mean_return"]) for r in self.rows if r["kind"] == "evaluation"]
        return np.array(found, np.float64).reshape(-1, 2)


class Training:
    """An agent that learns in an environment for a number of steps or episodes.

    Every episode resets the environment with a seed that follows from ``seed`` and the episode's
    number. A training can therefore go on exactly after `load`, from within an episode too: the
    episode is repeated from its reset with the actions that were taken, which gives the environment
    the state it had, whatever environment it is, as long as equal seeds and actions give equal
    episodes. Where they do not, new episodes can be begun instead.

    A *vector environment* is several environments in which one agent learns. In each round it
    chooses an action for each of them, in their order, all step together, and then it learns what
    came of it, in their order: a training with one environment has the same bits as one without a
    vector. Each episode is reset with a seed of its own, numbered as they begin. The bits do not
    depend on how environments are run: ``SyncVectorEnv`` and ``AsyncVectorEnv`` give the same, and
    so do all autoreset modes.

    A vector environment that cannot be reset one by one with seeds is seeded at the beginning only,
    and resets itself. Agents learn in it, but its episodes cannot be repeated. That is any with
    Gymnasium 1.0, and any other than these two, unless its autoreset mode is ``DISABLED`` or its
    metadata say ``"reset_mask": True``.

    Parameters
    ----------
    agent
        Learns every transition; its `progress` and its number of environments follow the training.
    env
        With the agent's spaces; those of a single environment, where it is a vector of them.
    steps, episodes
        How long: one of them. Steps are transitions learned, over all environments.
    seed
        Root of the episodes' seeds: every episode has one of its own.
    first_episode
        The number of the first episode: a second training with the same seed should begin where the
        first one ended (its ``next_episode``), so as not to meet the same episodes again.
    callbacks
        Are told what happens; see `sdnn.agents.callbacks`.
    evaluate_every
        Steps between two evaluations; None: none.
    evaluation_env
        For evaluations; needed if there are any, because an environment has one episode at a time.
    evaluation_episodes
        Greedy episodes in each, always with the same seeds.

    Raises
    ------
    TypeError, ValueError
        If not one of steps and episodes is given, something is out of range, the environments'
        spaces are not the agent's, or ``evaluation_env`` is a vector.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.agents import SDNNQLearning, Training
    >>> env = gym.make("MountainCarContinuous-v0")
    >>> agent = SDNNQLearning(env.observation_space, env.action_space, seed=1)
    >>> training = Training(agent, env, steps=500)
    >>> training.run().n_steps
    500
    >>> envs = gym.make_vec("Pendulum-v1", num_envs=4, vectorization_mode="sync")
    >>> agent = SDNNQLearning(envs.single_observation_space, envs.single_action_space, seed=1)
    >>> agent.train(envs, steps=500).n_steps
    500
    """

    def __init__(
        self,
        agent: Learner,
        env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any],
        *,
        steps: int | None = None,
        episodes: int | None = None,
        seed: int = 0,
        first_episode: int = 0,
        callbacks: Iterable[Callback] = (),
        evaluate_every: int | None = None,
        evaluation_env: gym.Env[Any, Any] | None = None,
        evaluation_episodes: int = 10,
    ) -> None:
        has_methods("agent", agent, "an agent", "act", "learn", "begin_episode")
        has_methods("env", env, "a Gymnasium environment", "reset", "step")
        if evaluation_env is not None:
            require_single("evaluation_env", evaluation_env)
            if evaluation_env is env:
                raise ValueError(
                    "evaluation_env must be another environment than env: an evaluation would end"
                    " the episode that is learned from"
                )
            require_same_kind(agent, evaluation_env)
        require_same_kind(agent, env)
        if (steps is None) == (episodes is None):
            raise ValueError(
                f"one of steps and episodes must be given, got steps={steps}, episodes={episodes}"
            )
        self.agent = agent
        self.env = env
        self.steps = None if steps is None else whole("steps", steps, 1, 2**53)
        self.episodes = None if episodes is None else whole("episodes", episodes, 1, 2**53)
        self.seed = whole("seed", seed, 0, 2**64 - 1)
        self._n_skipped = whole("first_episode", first_episode, 0, 2**53)  # numbers of episodes
        self.callbacks = _listed(callbacks)
        self.evaluate_every = (
            None if evaluate_every is None else whole("evaluate_every", evaluate_every, 1, 2**53)
        )
        if evaluate_every is not None and evaluation_env is None:
            raise ValueError("evaluation_env must be given where evaluate_every is")
        self.evaluation_env = evaluation_env
        self.evaluation_episodes = whole("evaluation_episodes", evaluation_episodes, 1, 10**9)
        self.n_steps = 0
        """Steps learned."""
        self.n_episodes = 0
        """Whole episodes."""
        self.n_rows = 0
        """Rows that the callbacks were given, since the training was begun."""
        self.evaluations: list[tuple[int, float]] = []
        """Steps and mean returns of all evaluations so far, also of those before it was loaded."""
        self._rows: list[Row] = []
        self._rounds = rounds_in(env)
        self._present: list[Episode | None] = [None] * self._rounds.n_environments
        self._first_left = 0  # the environments before it have learned this round's step
        self._stops = False
        self._is_within_step = False

    @property
    def n_environments(self) -> int:
        """In how many environments at once the agent learns."""
        return self._rounds.n_environments

    @property
    def is_within_step(self) -> bool:
        """Whether a callback's error or a second interrupt left a step half done.

        It cannot be saved then.
        """
        return self._is_within_step

    @property
    def next_episode(self) -> int:
        """The number of an episode that has not begun, nor any after it."""
        n_present = sum(episode is not None for episode in self._present)
        return self._n_skipped + self.n_episodes + n_present

    @property
    def is_finished(self) -> bool:
        """Whether all that was asked for is done."""
        if self.steps is not None:
            return self.n_steps >= self.steps
        assert self.episodes is not None
        return self.n_episodes >= self.episodes

    def stop(self) -> None:
        """Stop after the present step; `run` goes on from there."""
        self._stops = True

    def run(self) -> TrainingResult:
        """Learn until all is done, a callback stops, or the user interrupts.

        What an environment raises is raised, after the callbacks' ``on_end``, and so is
        `UnusableStepError`. What has been learned stays. The next ``run`` begins new episodes, or
        first evaluates where that failed.

        Raises
        ------
        KeyboardInterrupt
            After the end of the step in which it came and the callbacks' ``on_end``; a second one
            at once.
        UnusableStepError
            If the environment gives an observation or a reward that cannot be learned, such as NaN
            or one with which a weight would leave its range: a `ValueError` that names step and
            episode.
        RuntimeError
            If an error of a callback left a step of this training half done before.
        """
        if self._is_within_step:
            raise RuntimeError("a training that was left within a step cannot go on: load it")
        self._stops = False
        with Interrupts(self.stop) as interrupts, ExitStack() as stack:
            for callback in self.callbacks:
                callback.on_start(self)
                stack.callback(callback.on_end, self)
            if self._lacks_evaluation:
                self._tell(self._evaluation())
            while not (self.is_finished or self._stops):
                self._is_within_step = True
                if self.agent.n_environments != self.n_environments:
                    self.agent.n_environments = self.n_environments
                try:
                    learned = self._learn_step()
                except Exception:
                    self._leave_episodes()
                    self._is_within_step = False
                    raise
                failure = self._note_step(*learned)
                self._is_within_step = False
                if failure is not None:
                    raise failure
        if interrupts.received is not None:
            raise KeyboardInterrupt
        return TrainingResult(
            n_steps=self.n_steps,
            n_episodes=self.n_episodes,
            rows=tuple(self._rows),
            is_finished=self.is_finished,
        )

    def _require_repeatable(self) -> None:
        if self._rounds.can_repeat:
            return
        raise ValueError(
            "env must reset each of its environments with a seed of its own where episodes are"
            f" repeated, got {type(self.env.unwrapped).__name__}: repeat_episodes=False begins new"
            " ones; or take SyncVectorEnv or AsyncVectorEnv of Gymnasium 1.1 or newer, as"
            " gymnasium.make_vec(..., vectorization_mode='sync') makes it, with shared memory or"
            " the autoreset mode DISABLED"
        )

    def save(self, path: str | Path) -> None:
        """Write agent and training in one file, from which `load` goes on.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        saved = SavedTraining(
            steps=self.steps,
            episodes=self.episodes,
            seed=self.seed,
            n_steps=self.n_steps,
            n_episodes=self.n_episodes,
            n_rows=self.n_rows,
            n_skipped=self._n_skipped,
            evaluate_every=self.evaluate_every,
            evaluation_episodes=self.evaluation_episodes,
            evaluations=np.array(self.evaluations, np.float64).reshape(-1, 2),
            present=[None if one is None else self._saved(one) for one in self._present],
        )
        write_training(path_of("path", path), self.agent, saved)

    def _saved(self, episode: Episode) -> SavedEpisode:
        shape = (-1, *(self.agent.action_space.shape or ()))
        return SavedEpisode(
            number=episode.number,
            sum_of_rewards=episode.sum_of_rewards,
            actions=episode.actions.taken.reshape(shape),
            observation=np.asarray(self.agent.flat_observation(episode.last_observation)),
            waits=episode.outcome is not None,
        )

    @classmethod
    def load(
        cls,
        path: str | Path,
        env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any],
        *,
        callbacks: Iterable[Callback] = (),
        evaluation_env: gym.Env[Any, Any] | None = None,
        steps: int | None = None,
        episodes: int | None = None,
        repeat_episodes: bool = True,
    ) -> Self:
        """Read a training that `save` wrote, to go on exactly where it was.

        Parameters
        ----------
        path
            The file.
        env, evaluation_env
            As the training had them.
        callbacks
            As in the constructor.
        steps, episodes
            Another goal; by default as it was.
        repeat_episodes
            False: what has begun is left, and new episodes begin. For robots, which should not
            repeat what they did, and where equal seeds and actions do not give equal episodes. All
            else goes on as it was, in any number of environments; the bits are no longer those of a
            training that was not stopped.

        Raises
        ------
        OSError
            If the file cannot be read.
        UnrepeatedEpisodeError
            If the environment does not repeat the episode: a `ValueError`.
        ValueError
            If it is damaged or holds no training; if episodes are to be repeated, and the
            environment is a vector of another size, or cannot be reset one by one.
        """
        does_repeat = flag("repeat_episodes", repeat_episodes)
        agent, saved = read_training(path_of("path", path))
        has_goal = steps is not None or episodes is not None
        training = cls(
            agent,
            env,
            steps=steps if has_goal else saved.steps,
            episodes=episodes if has_goal else saved.episodes,
            seed=saved.seed,
            first_episode=saved.n_skipped,
            callbacks=callbacks,
            evaluate_every=saved.evaluate_every,
            evaluation_env=evaluation_env,
            evaluation_episodes=saved.evaluation_episodes,
        )
        training.n_steps, training.n_episodes = saved.n_steps, saved.n_episodes
        training.n_rows = saved.n_rows
        training.evaluations = [(int(step), mean) for step, mean in saved.evaluations.tolist()]
        if not does_repeat:
            training._n_skipped += sum(episode is not None for episode in saved.present)
            return training
        if len(saved.present) != training.n_environments:
            raise ValueError(
                f"env must have {len(saved.present)} environments, as the training had,"
                f" got {training.n_environments}"
            )
        training._require_repeatable()
        for number, episode in enumerate(saved.present):
            if episode is not None:
                training._present[number] = Episode(
                    episode.number, None, Actions(episode.actions), episode.sum_of_rewards
                )
        training._repeat_episodes([one is not None and one.waits for one in saved.present])
        for now, then in zip(training._present, saved.present, strict=True):
            if now is not None and then is not None:
                training._check_repeated(now, then.observation)
        return training

    def _repeat_episodes(self, waits: list[bool]) -> None:
        """Bring every environment to where its episode was saved: all end at the same time.

        Until its own episode begins, an environment does anything.
        """
        present = {i: episode for i, episode in enumerate(self._present) if episode is not None}
        n_rounds = max((len(episode.actions) for episode in present.values()), default=0)
        longest = next((e for e in present.values() if len(e.actions) == n_rounds), None)
        seeds = {i: self._seed_of(present[i].number if i in present else 0) for i in self._numbers}
        ended = set(self._numbers)
        for t in range(n_rounds):
            assert longest is not None
            starts = {i for i, e in present.items() if n_rounds - len(e.actions) == t}
            seen = self._rounds.reset({i: seeds[i] for i in sorted(starts | ended)})
            for i in starts:
                present[i].observation = seen[i]
            actions = [
                present[i].actions.taken[t - n_rounds]
                if i in present and t >= n_rounds - len(present[i].actions)
                else longest.actions.taken[t]
                for i in self._numbers
            ]
            outcomes = self._rounds.step(actions)
            ended = {i for i, outcome in enumerate(outcomes) if outcome.ends}
            for i, episode in present.items():
                if t < n_rounds - 1 or not waits[i]:
                    episode.observation = outcomes[i].observation
                else:
                    episode.outcome = outcomes[i]

    def _check_repeated(self, episode: Episode, observation: NDArray[np.float64]) -> None:
        found = self.agent.flat_observation(episode.last_observation)
        if not np.array_equal(found, observation):
            raise UnrepeatedEpisodeError(
                "env must repeat the episode in which the training was saved: the same seed and"
                f" actions led to {found}, not to {observation}"
            )

    @property
    def _numbers(self) -> range:
        return range(self.n_environments)

    def _seed_of(self, episode: int) -> int:
        return episode_seed(self.seed, _LEARNING, episode)

    def _leave_episodes(self) -> None:
        """Begin anew in every environment with the next step; what has been learned stays.

        With other seeds, as what failed may do so again: none of the numbers is given again that
        might have been.
        """
        self._n_skipped += self.n_environments
        self._rounds = rounds_in(self.env)
        self._present = [None] * self.n_environments

    def _begin_episode(self, environment: int, number: int, observation: Any) -> None:
        self._present[environment] = Episode(number, observation)
        self.agent.begin_episode(environment)

    def _begin_round(self) -> None:
        """Take a step in every environment, and begin an episode where the last one is over."""
        over = [i for i, episode in enumerate(self._present) if episode is None]
        numbers = {i: self.next_episode + k for k, i in enumerate(over)}
        first = self._rounds.reset({i: self._seed_of(number) for i, number in numbers.items()})
        for i, observation in first.items():
            self._begin_episode(i, numbers[i], observation)
        actions = [
            None if episode is None else self._action(i, episode)
            for i, episode in enumerate(self._present)
        ]
        for i, outcome in enumerate(self._rounds.step(actions)):
            episode = self._present[i]
            if episode is None:
                self._begin_episode(i, numbers[i], outcome.observation)
            else:
                episode.actions.append(actions[i])
                episode.outcome = outcome

    def _action(self, environment: int, episode: Episode) -> Any:
        try:
            return self.agent.act(episode.observation, environment=environment)
        except ValueError as error:
            raise self._unusable(error, environment, episode) from error

    def _unusable(self, error: Exception, environment: int, episode: Episode) -> UnusableStepError:
        where = f"step {len(episode.actions)}" if episode.actions else "the reset"
        whose = f" in environment {environment}" if self.n_environments > 1 else ""
        return UnusableStepError(
            f"env gave what cannot be learned, in step {self.n_steps + 1} ({where} of episode"
            f" {episode.number}{whose}): {error}"
        )

    def _next_outcome(self) -> tuple[int, Episode, Outcome]:
        """Find the first environment whose last step is still to be learned."""
        while True:
            for i in range(self._first_left, self.n_environments):
                episode = self._present[i]
                if episode is not None and episode.outcome is not None:
                    self._first_left = i
                    return i, episode, episode.outcome
            self._begin_round()
            self._first_left = 0

    def _learn_step(self) -> tuple[int, Episode, Outcome]:
        i, episode, outcome = self._next_outcome()
        following, told, terminated, _ = outcome
        try:
            reward = reward_of(told)
            self.agent.learn(
                Transition(
                    episode.observation, episode.actions.taken[-1], reward, following, terminated
                ),
                environment=i,
            )
        except (ValueError, OverflowError) as error:
            raise self._unusable(error, i, episode) from error
        episode.observation, episode.outcome = following, None
        episode.sum_of_rewards += reward
        self.n_steps += 1
        return i, episode, outcome

    def _note_step(self, i: int, episode: Episode, outcome: Outcome) -> Exception | None:
        """Count what ends with the step, evaluate where it is due, and tell the callbacks.

        Gives the error of an evaluation, without which the step is whole.
        """
        agent = self.agent
        rows: list[Row] = []
        failure: Exception | None = None
        if outcome.ends:
            where = {"environment": i} if self.n_environments > 1 else {}
            rows.append(
                self._row(
                    "episode",
                    episode=self.n_episodes,
                    **where,
                    **{"return": episode.sum_of_rewards},
                    length=len(episode.actions),
                    terminated=outcome.terminated,
                )
            )
            self.n_episodes += 1
            self._present[i] = None
        if self.steps is not None:
            agent.progress = self.n_steps / max(self.steps, self.n_steps)
        elif outcome.ends and self.episodes is not None:
            agent.progress = self.n_episodes / max(self.episodes, self.n_episodes)
        if self._lacks_evaluation:
            try:
                rows.append(self._evaluation())
            except Exception as error:
                failure = error
        self._tell(*rows, is_step=True)
        return failure

    def _tell(self, *rows: Row, is_step: bool = False) -> None:
        for callback in self.callbacks:
            for row in rows:
                callback.on_row(self, row)
            if is_step:
                callback.on_step(self)
        self._rows += rows

    @property
    def _lacks_evaluation(self) -> bool:
        """Whether one is due after this number of steps, and not made."""
        if self.evaluate_every is None or self.n_steps == 0 or self.n_steps % self.evaluate_every:
            return False
        return not self.evaluations or self.evaluations[-1][0] != self.n_steps

    def _evaluation(self) -> Row:
        assert self.evaluation_env is not None
        began = time.perf_counter()
        found = evaluate(self.agent, self.evaluation_env, self.evaluation_episodes, seed=self.seed)
        self.evaluations.append((self.n_steps, found.mean_return))
        return self._row(
            "evaluation",
            mean_return=found.mean_return,
            returns=found.returns.tolist(),
            mean_length=float(found.lengths.mean()),
            share_terminated=float(found.terminated.mean()),
            seconds=round(time.perf_counter() - began, 3),
        )

    def _row(self, kind: str, **values: Any) -> Row:
        self.n_rows += 1
        return {"kind": kind, "step": self.n_steps, **values}


def _listed(callbacks: Iterable[Callback]) -> tuple[Callback, ...]:
    try:
        listed = tuple(callbacks)
    except TypeError:
        raise TypeError(f"callbacks must be a list of callbacks, got {callbacks!r}") from None
    for callback in listed:
        has_methods("callbacks", callback, "callbacks", "on_start", "on_step", "on_row", "on_end")
    return listed
