"""Trials that are kept with the library: more than a run of the paper's ten, on other seeds.

``kept-trials.csv`` beside this file has the measures of each, and the digest of its rows. They were
run by ``sdnn reproduce b --trials 100 --seed 1``, and anybody's run of it gives them again.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from sdnn.reproduction.cases import PAPER_EPISODES
from sdnn.reproduction.results import CaseSummary, TrialMeasures
from sdnn.runs.measures import STEP_MEASURES
from sdnn.whole_files import csv_bytes

FILE_NAME = "kept-trials.csv"
HEADER = ("case", "agent", "config_hash", "root_seed", "trial", "rows_digest", *STEP_MEASURES)
"""Columns of the file: a row for each trial."""


@dataclass(frozen=True)
class KeptTrials(TrialMeasures):
    """The kept trials of an agent in a case.

    Parameters
    ----------
    config_hash
        Hash of their settings.
    root_seed
        Root of their seeds.
    rows_digests
        Digest of the rows of each.
    """

    config_hash: str
    root_seed: int
    rows_digests: tuple[str, ...]


@cache
def kept_trials() -> tuple[KeptTrials, ...]:
    """Read the trials that are kept with the library, those of a case and agent together."""
    text = files("sdnn.reproduction").joinpath(FILE_NAME).read_text("utf-8")
    rows = csv.DictReader(text.splitlines())
    groups: dict[tuple[str, str, str, str], list[dict[str, str]]] = {}
    for row in rows:
        key = (row["case"], row["agent"], row["config_hash"], row["root_seed"])
        groups.setdefault(key, []).append(row)
    return tuple(
        KeptTrials(
            case_id=case_id,
            agent=agent,
            last_episode=PAPER_EPISODES,
            values={name: np.array([float(row[name]) for row in own]) for name in STEP_MEASURES},
            config_hash=config_hash,
            root_seed=int(root_seed),
            rows_digests=tuple(row["rows_digest"] for row in own),
        )
        for (case_id, agent, config_hash, root_seed), own in groups.items()
    )


def kept_csv(summaries: Iterable[CaseSummary], root_seed: int) -> bytes:
    """Make the file's content of trials that were run.

    Parameters
    ----------
    summaries
        Their measures.
    root_seed
        Root of their seeds.

    Raises
    ------
    ValueError
        If the trials have another length than those that are kept.
    """
    rows = []
    for summary in summaries:
        if summary.last_episode != PAPER_EPISODES:
            raise ValueError(
                f"kept trials have {PAPER_EPISODES} learning episodes, those of {summary.agent} in"
                f" {summary.case_id} have {summary.last_episode}"
            )
        for number, record in enumerate(summary.result.records):
            measures = (f"{summary.values[name][number]:g}" for name in STEP_MEASURES)
            digest = record.rows.digest()[:16]
            key = record.key
            rows.append(
                (key.case_id, key.agent, key.config_hash, root_seed, key.trial, digest, *measures)
            )
    return csv_bytes(HEADER, rows)
