"""Readers of files in Python take whatever a file holds: an answer or a typed error, soon."""

import os

import pytest

from mutated_files import READERS, mutation_cells
from watched_cells import failures

N_MUTATIONS = int(os.environ.get("SDNN_MUTATIONS", "300"))
"""For each reader."""


@pytest.mark.parametrize("name", READERS)
def test_damaged_files_are_refused_or_read(name):
    n_cells, failed = failures(mutation_cells, name, N_MUTATIONS)
    assert n_cells > N_MUTATIONS
    assert not failed, "\n".join(failed[:20])
