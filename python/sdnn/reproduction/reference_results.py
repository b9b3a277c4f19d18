"""Reference results: more trials than a run of the paper's ten, on other seeds.

``reference-results.csv`` beside this file has the measures of each trial and the digest of its
rows. They were run by ``sdnn reproduce b --trials 100 --seed 1``, and anybody's run of it gives
them again.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from sdnn.reproduction.cases import PAPER_EPISODES
from sdnn.runs.results import STEP_MEASURES, TrialMeasures

FILE_NAME = "reference-results.csv"
HEADER = ("case", "agent", "config_hash", "root_seed", "trial", "rows_digest", *STEP_MEASURES)
"""Columns of the file: a row for each trial."""


@dataclass(frozen=True, kw_only=True)
class ReferenceResult(TrialMeasures):
    """The reference results of an agent in a case, with a digest of the rows of each trial."""

    config_hash: str
    root_seed: int
    rows_digests: tuple[str, ...]


@cache
def reference_results() -> tuple[ReferenceResult, ...]:
    """Read the reference results, those of a case and agent together."""
    text = files("sdnn.reproduction").joinpath(FILE_NAME).read_text("utf-8")
    groups: dict[tuple[str, ...], list[dict[str, str]]] = {}
    for row in csv.DictReader(text.splitlines()):
        groups.setdefault(tuple(row[name] for name in HEADER[:4]), []).append(row)
    return tuple(
        ReferenceResult(
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
