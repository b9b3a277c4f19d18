"""Runs studies of agents, each trial in a separate process, and measures their learning curves.

The store has the rows of all evaluations, as of any trial of the engine, and the curve of each
trial: at each evaluation its steps, the processor seconds of learning until then, and the mean
return; and the bytes of the training state at the end.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Any

import gymnasium as gym
from measured import Processes, is_wanted, measured, run_missing

from sdnn.agents import Callback, Training
from sdnn.runs import RunSpec
from sdnn.runs.engine import Finished, PlannedTrial, run_to_end
from sdnn.runs.store import ResultStore
from sdnn.runs.study_file import StudyFile
from sdnn.runs.trial import TrainingTrial, TrialKey, TrialRecord, TrialRows

N_MILESTONE_EPISODES = 100
"""Least number of greedy episodes of the last evaluation, and of that at a milestone; chosen."""
MILESTONES: dict[str, int] = {}
"""Steps of a case's milestone; the modules of tasks enter them."""

Curves = Mapping[tuple[str, str], Sequence[Mapping[str, Any]]]
"""Curves of the trials by case and variant."""


class Clock(Callback):
    """Notes the curve of a training; its time stands still during evaluations.

    An evaluation has no callback at its beginning. So a wrapper of the evaluation's environment
    pauses the clock, and the row of the evaluation starts it again.
    """

    def __init__(self, training: Training, milestone: int | None = None) -> None:
        self._milestone = milestone
        self.curve: dict[str, Any] = {"steps": [], "cpu_seconds": [], "mean_return": []}
        training.callbacks = (*training.callbacks, self)
        env = training.evaluation_env
        if env.has_wrapper_attr("evaluation_steps"):  # endless, otherwise
            env = gym.wrappers.TimeLimit(env, env.get_wrapper_attr("evaluation_steps"))
        training.evaluation_env = _Pausing(env, self)
        self._usual_episodes = training.evaluation_episodes
        self._set_episodes_of_next_evaluation(training)
        self._began = time.process_time()  # later by the time of all evaluations
        self._paused: float | None = None

    def pause(self) -> None:
        """Stand still until the evaluation is noted."""
        if self._paused is None:
            self._paused = time.process_time()

    def on_row(self, training: Training, row: Mapping[str, Any]) -> None:
        """Note an evaluation."""
        if row["kind"] != "evaluation":
            return
        self.curve["steps"].append(training.n_steps)
        self.curve["cpu_seconds"].append(round(self._paused - self._began, 2))
        self.curve["mean_return"].append(round(row["mean_return"], 2))
        if training.is_finished:
            self.curve["bytes"] = n_bytes(training.agent)
        self._set_episodes_of_next_evaluation(training)
        self._began += time.process_time() - self._paused
        self._paused = None

    def _set_episodes_of_next_evaluation(self, training: Training) -> None:
        evaluated_at = min(training.n_steps + training.evaluate_every, training.steps)
        is_milestone = evaluated_at in (self._milestone, training.steps)
        n_least = N_MILESTONE_EPISODES if is_milestone else 0
        training.evaluation_episodes = max(self._usual_episodes, n_least)


class _Pausing(gym.Wrapper):
    """Pauses a clock when an evaluation begins."""

    def __init__(self, env: gym.Env, clock: Clock) -> None:
        super().__init__(env)
        self._clock = clock

    def reset(self, **options):
        self._clock.pause()
        return super().reset(**options)


def n_bytes(agent: Any) -> int:
    """Return the size of the training state: all that is needed to continue learning."""
    if hasattr(agent, "n_bytes"):
        return int(agent.n_bytes)
    return sum(array.nbytes for array in agent.state().values())


class _Clocked:
    """A specification whose trial is clocked."""

    def __init__(self, spec: RunSpec, milestone: int | None) -> None:
        self._spec, self.canonical_json = spec, spec.canonical_json
        self._milestone = milestone

    def make_trial(self, seed: int) -> TrainingTrial:
        trial = self._spec.make_trial(seed)
        self.clock = Clock(trial.training, self._milestone)
        return trial


def learn(planned: PlannedTrial, advanced: Callable[[int], None]) -> tuple[TrialRecord, Any]:
    """Run a trial; returns the record, of evaluations only, and the curve."""
    spec = _Clocked(planned.spec, MILESTONES.get(planned.key.case_id))
    for message in run_to_end(PlannedTrial(planned.key, spec)):
        if isinstance(message, Finished):
            record = message.record
        else:
            advanced(message.episode)
    table = record.rows.table
    rows = TrialRows(table[table["kind"] == "evaluation"])
    return replace(record, rows=rows), spec.clock.curve


@dataclass(frozen=True)
class _Trials:
    """Trials and their curves, as the engine sees a store."""

    store: ResultStore
    kind: str

    def keys(self) -> set[TrialKey]:
        return self.store.keys()

    def together(self) -> AbstractContextManager[None]:
        return self.store.together()

    def add(self, results: tuple[TrialRecord, Any], *, is_exact: bool) -> None:
        record, curve = results
        self.store.put(self.kind, json.dumps(record.key), {**curve, "version": record.version})
        self.store.add(record, is_exact=False)


def run_study(
    kind: str,
    study: StudyFile,
    arguments: argparse.Namespace,
) -> None:
    """Run the trials of a study that are not stored, and store their curves under a kind."""
    study.pairs = tuple(pair for pair in study.combinations if is_wanted(pair[::-1], arguments))
    if not arguments.redraw:
        executor = Processes(learn, arguments.jobs, study.tables.study.imports)
        run_missing(study.plan(), executor, arguments.folder, lambda store: _Trials(store, kind))


def curves(
    kind: str,
    study: StudyFile,
    arguments: argparse.Namespace,
) -> Curves:
    """Read the curves of a study's trials.

    Trials from before specifications were stored, which have no hash but the variant's name, are
    read where there are no others.
    """
    stored = measured(kind, arguments.folder)
    results = {}
    for (case, variant), combination in study.combinations.items():
        present = [stored[planned.key] for planned in combination.trials if planned.key in stored]
        without_hash = [
            curve for key, curve in stored.items() if (*key[:2], key[4]) == (case, variant, "")
        ]
        if present or without_hash:
            results[case, variant] = present or without_hash
    return results
