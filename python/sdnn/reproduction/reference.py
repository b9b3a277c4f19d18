"""The reference results as reported trials, and what differs from the paper's configurations."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from sdnn._core import __version__
from sdnn.environments.paper_acrobot import PAPER_ACROBOT
from sdnn.reproduction.cases import MOST_EPISODES, PAPER_CASES, PAPER_EPISODES, PAPER_INTERVAL
from sdnn.reproduction.claims import FILE_NAME, HEADER
from sdnn.reproduction.reproduce import case_spec
from sdnn.runs.errors import RunError
from sdnn.runs.reported import Consent, ReportedTrial, changed_settings
from sdnn.runs.spec import RunSpec
from sdnn.runs.trial import TrialKey, trial_seed
from sdnn.support.arguments import shown
from sdnn.support.files import read_bytes

MOST_BYTES = 2**26  # largest file of reference results


class ReferenceReports:
    """The trials of a file of reference results, by default that of this library.

    The file has the digest of each trial's test episodes; configurations are the paper's. RunError
    if the file is none of reference results, or its values cannot be used.
    """

    n_unfinished = 0
    machine = ""

    def __init__(self, path: Path | None = None) -> None:
        self.title = "the reference results" if path is None else str(path)
        if path is None:
            text = files("sdnn.reproduction").joinpath(FILE_NAME).read_text("utf-8")
        else:
            try:
                text = read_bytes(path, MOST_BYTES).decode()
            except ValueError as error:
                raise RunError(f"{path} must be a text: {error}") from error
        lines = text.splitlines()
        if tuple(lines[0].split(",") if lines else ()) != HEADER:
            raise RunError(f"{self.title} must have the columns {','.join(HEADER)}")
        self._digests: dict[TrialKey, str] = {}
        for number, row in enumerate(csv.DictReader(lines), 2):
            key = self._key(number, row)
            if key in self._digests:
                raise RunError(f"{self.title}:{number}: trial: is there twice")
            self._digests[key] = row["rows_digest"]
        self.keys = sorted(self._digests)

    def _key(self, number: int, row: dict[str, str]) -> TrialKey:
        """Return the key of the trial in a numbered line; RunError if a value is impossible."""
        for name, pattern in (
            ("trial", r"\d{1,6}"), ("root_seed", r"\d{1,19}"), ("config_hash", "[0-9a-f]{16}"),
            ("rows_digest", "[0-9a-f]{16,64}"),
        ):  # fmt: skip
            if not re.fullmatch(pattern, row[name] or "", re.ASCII):
                problem = f"must match {pattern}, got {shown(row[name])}"
                raise RunError(f"{self.title}:{number}: {name}: {problem}")
        if row["case"] not in PAPER_CASES:
            known = ", ".join(PAPER_CASES)
            problem = f"must be one of {known}, got {shown(row['case'])}"
            raise RunError(f"{self.title}:{number}: case: {problem}")
        trial = int(row["trial"])
        seed = trial_seed(int(row["root_seed"]), row["case"], trial)
        return TrialKey(row["case"], row["agent"], trial, seed, row["config_hash"])

    def load(self, keys: Collection[TrialKey]) -> Iterator[ReportedTrial]:
        """Return the trials of the given keys, with the configurations of the paper's cases."""
        for key in keys:
            try:
                paper = _paper_spec(key.case_id, key.agent)
            except ValueError as error:
                raise RunError(f"{self.title}: {error}") from error
            is_of_paper = key.config_hash == paper.config_hash
            problem = f"its configuration is {key.config_hash}, the paper's is {paper.config_hash}"
            yield ReportedTrial(
                key=key,
                config=paper.canonical_json(),
                version=__version__,
                digest=self._digests[key],
                covers_tests=True,
                problem="" if is_of_paper else problem,
            )

    def check(self, keys: Iterable[TrialKey]) -> Iterator[bool]:
        """Yield True for each key: trials have no rows here."""
        return (True for _ in keys)


def _paper_spec(case_id: str, agent: str, n_episodes: int = PAPER_EPISODES) -> RunSpec:
    """Return the specification of any agent in a case of the paper."""
    return case_spec(replace(PAPER_CASES[case_id], agents=(agent,)), agent, n_episodes)


def differences_from_paper(trial: ReportedTrial) -> dict[str, tuple[str, str]]:
    """Return the settings in which a trial of a paper's case differs from the paper's.

    Values are pairs: of the trial, of the paper. The number of episodes may differ. Nothing is
    returned for trials of other tasks.
    """
    task = json.loads(trial.config)["environment"]["id"]
    if trial.key.case_id not in PAPER_CASES or task != PAPER_ACROBOT:
        return {}
    episodes = trial.spec(Consent()).budget.episodes or 0
    if not PAPER_INTERVAL <= episodes <= MOST_EPISODES:
        return {}
    paper = _paper_spec(trial.key.case_id, trial.key.agent, episodes)
    return changed_settings(trial.config, paper.canonical_json())
