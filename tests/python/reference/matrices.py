"""All matrices of bad values: tests/robustness runs every cell, the other tests a sample.

A row is a function that yields cells, and its arguments; `watched_cells.failures` runs the cells.
"""

import itertools

import bad_inputs
import bad_options
import core_cells
import damaged_files
import incomplete_samples
import logged_data
import public_cells
import random_lives

AGENTS = [agent_class.__name__ for agent_class in bad_inputs.SETTINGS]
N_MUTATIONS = 300
"""Mutations of each kind of file."""

MATRICES = {
    "agents": [
        *((bad_inputs.constructor_cells, name) for name in AGENTS),
        *((bad_inputs.setting_cells, name) for name in AGENTS),
        *((bad_inputs.transition_cells, case) for case in bad_inputs.AGENT_CASES),
        *((bad_inputs.method_cells, case) for case in bad_inputs.AGENT_CASES),
        *((bad_inputs.file_cells, name) for name in AGENTS),
        (bad_inputs.loop_cells,),
        (random_lives.single_input_cells,),
        (logged_data.log_cells,),
        (random_lives.missing_reading_cells,),
    ],
    "core": [(core_cells.never_made_cells,), (core_cells.argument_cells,)],
    "classes": [
        (public_cells.estimator_cells,),
        (public_cells.coding_cells,),
        (public_cells.environment_cells,),
        (public_cells.experiment_cells,),
        (public_cells.function_cells,),
        (incomplete_samples.weight_cells,),
        (incomplete_samples.missing_cells,),
    ],
    "commands": [(bad_options.command_cells, name) for name in bad_options.COMMANDS],
    "files": [
        *((damaged_files.mutation_cells, name, 0, N_MUTATIONS) for name in damaged_files.MUTATED),
        *((damaged_files.damage_cells, name) for name in damaged_files.READERS),
        *((damaged_files.header_cells, "estimator", number) for number in range(3)),
        *((damaged_files.header_cells, "agent", number) for number in (0, 5)),
        (damaged_files.header_cells, "training", 0),
    ],
}
ROWS = [row for rows in MATRICES.values() for row in rows]


def name_of(row):
    """Return the name of a row for the ids of tests."""
    return "-".join([row[0].__name__, *map(str, row[1:])])


def sample_cells(rows, every):
    """Yield every n-th cell of the rows."""
    cells = (cell for make_cells, *arguments in rows for cell in make_cells(*arguments))
    yield from itertools.islice(cells, 0, None, every)
