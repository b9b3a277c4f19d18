"""The trials that a study or a reproduction needs: their seeds, keys and specifications."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

from sdnn.runs.records import TrialKey
from sdnn.runs.registry import title_of
from sdnn.runs.spec import RunSpec

__all__ = ["PlannedTrial", "describe", "trial_seed"]


def trial_seed(root_seed: int, case_id: str, trial: int) -> int:
    """Return the seed of a trial, the same for every agent, order of execution and number of jobs.

    All agents thus meet the same sensor noise in the same trial of a case.

    It is the first 64-bit word of ``SeedSequence(root_seed, spawn_key=(crc32(case_id), trial))``
    without its lowest bit, because the result file's integers have a sign.

    Parameters
    ----------
    root_seed
        The run's seed, not negative.
    case_id
        Id of the case.
    trial
        Number of the trial, from 0.

    Examples
    --------
    >>> trial_seed(0, "s4", 0) == trial_seed(0, "s4", 1)
    False
    """
    spawn_key = (zlib.crc32(case_id.encode()), trial)
    word = np.random.SeedSequence(root_seed, spawn_key=spawn_key).generate_state(1, np.uint64)[0]
    return int(word) >> 1


def describe(key: TrialKey) -> str:
    """Name a trial for a reader; trials count from 1.

    Examples
    --------
    >>> describe(TrialKey("s4", "sdnn-c", 0, 1, ""))
    'SDNN-C s4, trial 1'
    """
    return f"{title_of(key.agent)} {key.case_id}, trial {key.trial + 1}"


@dataclass(frozen=True)
class PlannedTrial:
    """A trial that a run needs.

    Parameters
    ----------
    key
        Where its result is stored.
    spec
        What is run; the seed is that of the key.
    """

    key: TrialKey
    spec: RunSpec

    @property
    def title(self) -> str:
        """Its name for a reader."""
        return describe(self.key)
