"""Trials: compiled ones, trainings as trials, and their rows.

The trials of the core's agents on the acrobot are computed in C++ (``_core.AcrobotTrial`` and its
siblings), by the same protocol, bit for bit.
"""

from __future__ import annotations

import hashlib
import json
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property, lru_cache
from typing import Any, Literal, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn._core import __version__
from sdnn.agents import Evaluation, Scaling, StopTrainingOnRewardThreshold, Training
from sdnn.support.arguments import shown, whole
from sdnn.training.loop import Row

Hash: TypeAlias = "hashlib._Hash"

ROW_HEADER = (
    "case", "agent", "trial", "seed", "config_hash", "version", "episode", "steps",
    "episode_return", "solved",
)  # fmt: skip
"""Columns of the file of all test episodes."""


class TrialKey(NamedTuple):
    """The identity of a trial: it is stored once and never run again.

    ``agent`` is its label, such as ``"sdnn-c-robust"``; ``trial`` its number in the case, from 0;
    ``seed`` its own seed, see `trial_seed`.
    """

    case_id: str
    agent: str
    trial: int
    seed: int
    config_hash: str


def trial_seed(root_seed: int, case_id: str, trial: int) -> int:
    """Return the seed of a trial, the same for every agent, order of execution and number of jobs.

    All agents thus meet the same sensor noise in the same trial of a case. It is the first 64-bit
    word of ``SeedSequence(root_seed, spawn_key=(crc32(case_id), trial))`` without its lowest bit,
    because the result file's integers have a sign.

    Examples
    --------
    >>> trial_seed(0, "s4", 0) == trial_seed(0, "s4", 1)
    False
    """
    if not isinstance(case_id, str):
        raise TypeError(f"case_id must be a text, got {shown(case_id)}")
    spawn_key = (zlib.crc32(case_id.encode()), whole("trial", trial, 0, 2**32 - 1))
    entropy = whole("root_seed", root_seed, 0, 2**64 - 1)
    word = np.random.SeedSequence(entropy, spawn_key=spawn_key).generate_state(1, np.uint64)[0]
    return int(word) >> 1


Column: TypeAlias = NDArray[np.int32 | np.float64 | np.bool_]
"""A column, (n_tests,): of each evaluation its only episode's number, or the mean over episodes."""

HASH_DIGITS = 16  # hexadecimal digits kept of a text's SHA-256: 64 bits


def canonical_json(values: Mapping[str, object]) -> str:
    """Return values as one line of JSON: sorted keys, 1 for 1.0."""
    read = json.loads(json.dumps(values, allow_nan=False), parse_float=_canonical_number)
    return json.dumps(read, sort_keys=True, separators=(",", ":"))


def _canonical_number(text: str) -> int | float:
    """Read a number of JSON that has a point or exponent; a whole one becomes an int."""
    value = float(text)
    return int(value) if value.is_integer() else value


def config_hash(text: str) -> str:
    """Return the first 16 hexadecimal digits of the SHA-256 of a text.

    >>> config_hash(canonical_json({"noise": 0.0})) == config_hash(canonical_json({"noise": 0}))
    True
    """
    return hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]


@lru_cache(maxsize=1024)
def problem_of_config(config: str, expected_hash: str) -> str:
    """Return what is wrong with a stored configuration and the hash beside it, or ""."""
    if config_hash(config) != expected_hash:
        return "config does not have the hash beside it, config_hash"
    try:
        is_table = isinstance(json.loads(config), dict)
    except (RecursionError, ValueError):
        is_table = False
    return "" if is_table else "config must be a table in JSON"


ROW = np.dtype(
    [("number", "i8"), ("part", "i8"), ("kind", "U10"), ("episode", "i8"), ("step", "i8"),
     ("length", "i8"), ("return", "f8"), ("terminated", "?"), ("environment", "i8")]
)  # fmt: skip
"""A row of any run: an episode that was learned from, or one of an evaluation.

``number`` counts episodes and evaluations, ``part`` the episodes of an evaluation. ``kind`` is
``"episode"`` or ``"evaluation"``. ``episode`` is the number of a learning episode, from 0, or how
many were learned before an evaluation; ``step`` how many steps were learned by then, or `UNKNOWN`,
as in compiled trials; ``terminated`` whether the episode ended in a terminal state: the task was
solved. ``environment`` is `UNKNOWN` where there is one only.
"""

UNKNOWN = -1

_COLUMNS = {"episode": "<i4", "length": "<i4", "return": "<f8", "terminated": "u1"}
"""Columns of test episodes with the types in which, and the order in which, they are hashed."""


@dataclass(frozen=True, eq=False)
class TrialRows:
    """The rows of a run, and its evaluations as columns.

    An evaluation of one episode is a test episode of the paper. Columns of larger ones are means.

    ``table`` has all rows in order, (n,) ROW.
    """

    table: NDArray[np.void]

    @classmethod
    def of_tests(
        cls, episode: ArrayLike, steps: ArrayLike, episode_return: ArrayLike, solved: ArrayLike
    ) -> TrialRows:
        """Make rows from the columns of a compiled trial's test episodes, each (n_tests,)."""
        columns = dict(zip(_COLUMNS, (episode, steps, episode_return, solved), strict=True))
        shapes = set(map(np.shape, columns.values()))
        if shapes != {(np.size(episode),)}:
            raise ValueError(f"test rows must be columns of one length, got shapes {shapes}")
        table = np.zeros(np.size(episode), ROW)
        table["number"], table["kind"] = np.arange(table.size), "evaluation"
        table["step"] = table["environment"] = UNKNOWN
        for name, column in columns.items():
            table[name] = column
        return cls(table)

    @classmethod
    def from_training(cls, rows: Sequence[Row], first: int = 0) -> TrialRows:
        """Make rows from those of a `sdnn.agents.Training`, numbered from ``first`` on."""
        listed: list[tuple[object, ...]] = []
        for number, row in enumerate(rows, first):
            start = (row["kind"], row["episode"], row["step"])
            if row["kind"] == "episode":
                end = row["length"], row["return"], row["terminated"]
                listed.append((number, 0, *start, *end, row.get("environment", UNKNOWN)))
            else:
                parts = zip(row["lengths"], row["returns"], row["terminated"], strict=True)
                listed += [(number, k, *start, *end, UNKNOWN) for k, end in enumerate(parts)]
        return cls(np.array(listed, ROW))

    def to_training(self) -> list[Row]:
        """Return the rows in the form of a `sdnn.agents.Training`; inverts `from_training`."""
        rows: list[Row] = []
        starts = np.flatnonzero(self.table["part"] == 0)
        for episodes in np.split(self.table, starts[1:]) if len(starts) else []:
            first = episodes[0]  # the only one, unless it is a larger evaluation
            row: dict[str, object] = {
                "kind": str(first["kind"]), "step": int(first["step"]),
                "episode": int(first["episode"]),
            }  # fmt: skip
            if row["kind"] == "episode":
                if first["environment"] != UNKNOWN:
                    row["environment"] = int(first["environment"])
                row["return"] = float(first["return"])
                row["length"] = int(first["length"])
                row["terminated"] = bool(first["terminated"])
            else:
                returns, lengths = episodes["return"].copy(), episodes["length"].copy()
                terminated = episodes["terminated"].copy()
                row |= Evaluation(returns=returns, lengths=lengths, terminated=terminated).row()
            rows.append(row)
        return rows

    @cached_property
    def _tests(self) -> tuple[NDArray[np.void], NDArray[np.int64]]:
        """The rows of evaluations, and where each begins."""
        tests = self.table[self.table["kind"] == "evaluation"]
        return tests, np.flatnonzero(tests["part"] == 0)

    def _column(self, name: str, dtype: type[np.generic]) -> Column:
        """Return a column of the tests; where a test had several episodes, their mean."""
        tests, starts = self._tests
        if len(starts) == len(tests):
            return tests[name].astype(dtype)
        sums = np.add.reduceat(tests[name].astype(np.float64), starts)
        return np.asarray(sums / np.diff([*starts, len(tests)]))

    @cached_property
    def episode(self) -> Column:
        """Learning episodes done before each evaluation, (n_tests,) int32."""
        tests, starts = self._tests
        return tests["episode"][starts].astype(np.int32)

    @cached_property
    def steps(self) -> Column:
        """Decisions until the goal, or the limit where it was not reached, (n_tests,) int32."""
        return self._column("length", np.int32)

    @cached_property
    def episode_return(self) -> Column:
        """Sum of rewards, (n_tests,) float64."""
        return self._column("return", np.float64)

    @cached_property
    def solved(self) -> Column:
        """Whether the goal was reached, (n_tests,) bool; of larger evaluations the share."""
        return self._column("terminated", np.bool_)

    @property
    def n_evaluated(self) -> int:
        """Decisions in evaluations."""
        return int(self._tests[0]["length"].sum())

    def digest(self) -> str:
        """Return the SHA-256 of the test episodes, independent of the machine's byte order."""
        tests, _ = self._tests
        sha = hashlib.sha256()
        for name, dtype in _COLUMNS.items():
            sha.update(tests[name].astype(dtype).tobytes())
        return sha.hexdigest()

    def checksum(self) -> str:
        """Return the SHA-256 of all rows."""
        return str(self.hashed().hexdigest())

    def hashed(self, before: Hash | None = None) -> Hash:
        """Return the hash whose digest is `checksum`; ``before`` is the hash of earlier rows."""
        sha = hashlib.sha256() if before is None else before.copy()
        sha.update(self.table.astype(ROW.newbyteorder("<")).tobytes())
        return sha


@dataclass(frozen=True, kw_only=True)
class TrialRecord:
    """A finished trial.

    ``config`` is the canonical JSON of its settings, ``n_decisions`` counts learning and test
    episodes, ``seconds`` is processor time, ``finished_at`` ISO 8601, UTC. ``rows`` of a run in
    progress that is finished by this record are those not yet stored.
    """

    key: TrialKey
    config: str
    version: str = __version__
    n_decisions: int
    seconds: float
    finished_at: str = field(
        default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds")
    )
    rows: TrialRows


def records_digest(records: Iterable[TrialRecord]) -> str:
    """Return the SHA-256 of the results of trials, to compare runs.

    It covers cases, trials, seeds, decisions and rows, sorted, so runs with other jobs,
    interruptions, order, names or settings agree.
    """
    parts = sorted(
        (r.key.case_id, r.key.trial, r.key.seed, r.n_decisions, r.rows.digest()) for r in records
    )
    return hashlib.sha256("".join(map(repr, parts)).encode()).hexdigest()


def trial_rows(records: Iterable[TrialRecord]) -> Iterator[tuple[object, ...]]:
    """Yield the test episodes of trials without duplicates, as rows under `ROW_HEADER`."""
    for record in records:
        key, rows = record.key, record.rows
        start = (key.case_id, key.agent, key.trial, key.seed, key.config_hash, record.version)
        columns = (rows.episode, rows.steps, rows.episode_return, rows.solved.astype(int))
        for row in zip(*(column.tolist() for column in columns), strict=True):
            yield (*start, *row)


Trial: TypeAlias = _core.AcrobotTrial
"""A compiled trial; its outcome does not depend on the steps in which it advances."""

_AnyTrial = TypeVar("_AnyTrial")


@contextmanager
def opened(trial: _AnyTrial) -> Iterator[_AnyTrial]:
    """Close a trial's environments at the end of the block; trials in C++ have none."""
    try:
        yield trial
    finally:
        if hasattr(trial, "close"):
            trial.close()


Reason: TypeAlias = Literal["done", "target", "stopped"]


def rows_of(trial: Trial | TrainingTrial) -> TrialRows:
    """Return the rows of a trial so far; compiled trials have rows of test episodes only."""
    if isinstance(trial, TrainingTrial):
        return trial.rows()
    return TrialRows.of_tests(**trial.test_rows())


@dataclass(frozen=True, kw_only=True)
class RunOutcome:
    """The result of training a run.

    ``learning_report``: see `sdnn.agents.SDNNQLearning`, None for fuzzy agents and while one is
    warming up; ``is_solved``: whether the last evaluation reached the environment's reward
    threshold; ``has_pictures``: whether `record` can render the environment; ``history``: the part
    of earlier observations in states.
    """

    n_steps: int
    n_episodes: int
    reason: Reason
    last_evaluation: Row | None
    learning_report: Mapping[str, Any] | None
    is_warming_up: bool
    is_solved: bool
    has_pictures: bool
    scaling: Scaling | None
    history: str
    finds_history: bool


@dataclass(frozen=True, kw_only=True)
class RunEvaluation(Evaluation):
    """The result of greedy episodes; ``is_warming_up``: all actions of the agent are random."""

    is_warming_up: bool


class TrainingTrial:
    """A `sdnn.agents.Training` as a trial; its evaluations are the test episodes.

    ``environments`` closes them at the end. It is finished when ``target``, one of the training's
    callbacks, is reached, too.
    """

    def __init__(
        self,
        training: Training,
        environments: ExitStack,
        target: StopTrainingOnRewardThreshold | None = None,
    ) -> None:
        self.training = training
        self._environments = environments
        self._target = target

    @property
    def episode(self) -> int:
        """Learning episodes done."""
        return self.training.n_episodes

    @property
    def done(self) -> int:
        """Learning episodes or steps done, whichever the budget counts."""
        return self.training.n_episodes if self.training.steps is None else self.training.n_steps

    @property
    def reason(self) -> Reason:
        """Why the trial ended."""
        if self._target is not None and self._target.is_reached(self.training):
            return "target"
        return "done" if self.training.is_finished else "stopped"

    @property
    def finished(self) -> bool:
        """Whether the budget is used up, or the target is reached."""
        return self.reason != "stopped"

    @property
    def n_decisions(self) -> int:
        """Decisions made so far, in learning and test episodes."""
        return self.training.n_steps + self.rows().n_evaluated

    def advance(self, n_episodes: int, /) -> None:
        """Run ``n_episodes`` more learning episodes and the evaluations due among them."""
        last = self.episode + whole("n_episodes", n_episodes, 0, 2**53)
        if n_episodes:
            for _ in self.training.pieces(0.0):
                if self.episode >= last:
                    break

    def rows(self) -> TrialRows:
        """Return all rows so far: learning episodes and evaluations."""
        return TrialRows.from_training(self.training.rows)

    def close(self) -> None:
        """Close the environments, if they are still open."""
        self._environments.close()
