"""Makes the paper's transcription from what the core has drawn at random."""

from __future__ import annotations

import paper_transcription as paper
from sdnn import _core


def transcribe(core: _core.SDNNC) -> paper.SDNNC:
    """The transcription with the core's code books, permutations, weights and thresholds."""
    config = core.config
    inputs = range(config.n_inputs)
    return paper.SDNNC(
        code_books=[core.table(mu) for mu in inputs],
        permutations={pair: core.permutation(*pair) for pair in core.pairs},
        weights=core.weights(),
        thresholds=core.thresholds(),
        n_active_units=config.n_active_units,
        first_units=paper.evenly_spread_windows(
            config.n_hidden_units,
            config.n_active_units,
            config.n_actions or config.n_hidden_units - config.n_active_units + 1,
        ),
        u_low=config.n_active_units // 15 if config.u_low is None else config.u_low,
        u_high=(
            config.n_active_units - config.n_active_units // 15
            if config.u_high is None
            else config.u_high
        ),
        q_low=config.q_low,
        q_high=config.q_high,
        step=config.lattice,
        always_moves=config.rounding == _core.Rounding.away,
    )
