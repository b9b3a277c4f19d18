"""Let agents learn in random spaces with random settings: python tests/robustness/soak.py.

A life is an agent with its space and settings, all drawn by the number of the life (see
random_lives.py). ``--first NUMBER --lives 1`` repeats a life. ``nox -s soak-weekly`` runs lives
under sanitizers.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "python" / "reference"))

from random_lives import soak_cells
from watched_cells import failures


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--first", type=int, default=0, help="number of the first life")
    parser.add_argument("--lives", type=int, default=60)
    options = parser.parse_args()
    n_lives, faults = failures(soak_cells, options.first, options.lives)
    print(*faults, f"{n_lives} lives, {len(faults)} faults", sep="\n")
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
