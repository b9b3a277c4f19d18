"""Draw patterns and selective desensitization for docs/explanation/how-it-works.md."""

from pathlib import Path

import numpy as np

from sdnn.coding import Anchor

FOLDER = Path(__file__).parent
N_UNITS = 48
CELL = 12  # pixels
LABEL = 150  # pixels left of a row
COLORS = {1: "#1f4e9c", 0: "#c9c9c9", -1: "#f3e2b3"}


def row(units, top):
    """Return the cells of one pattern."""
    cells = {}
    for k, unit in enumerate(units):
        cell = f"M{LABEL + k * CELL} {top}h{CELL - 1}v{CELL - 1}h-{CELL - 1}z"
        cells[int(unit)] = cells.get(int(unit), "") + cell
    return [f'<path fill="{COLORS[unit]}" d="{path}"/>' for unit, path in sorted(cells.items())]


def svg(rows):
    """Return a picture of labelled patterns, of (label, units); None is a gap."""
    top, parts = 4, []
    for content in rows:
        if content is not None:
            label, units = content
            text = f'<text x="{LABEL - 8}" y="{top + CELL - 2}" text-anchor="end">{label}</text>'
            parts += [text, *row(units, top)]
        top += CELL + 2
    style = 'font-family="sans-serif" font-size="12" fill="#777"'
    size = f'viewBox="0 0 {LABEL + N_UNITS * CELL + 4} {top}"'
    body = "\n".join(parts)
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} {style}>\n{body}\n</svg>\n'


def main():
    """Write both pictures."""
    coding = Anchor(low=0.0, high=1.0).fit(np.array([0.0, 1.0]), N_UNITS)
    first, second = coding.patterns(N_UNITS, 1), coding.patterns(N_UNITS, 2)
    order = np.random.default_rng(3).permutation(N_UNITS)

    def pattern(patterns, value):
        return patterns[coding.bins(np.array([value]))[0]]

    values = np.arange(0.20, 0.601, 0.02)
    picture = svg([(f"x = {value:.2f}", pattern(first, value)) for value in values])
    (FOLDER / "patterns.svg").write_text(picture, "utf-8")

    rows = []
    for x, y in ((0.30, 0.20), (0.30, 0.70), (0.34, 0.70)):
        gate = pattern(second, y)[order]
        rows += [
            (f"x = {x:.2f}", pattern(first, x)),
            (f"y = {y:.2f}, permuted", gate),
            ("x desensitized by y", pattern(first, x) * (gate > 0)),
            None,
        ]
    (FOLDER / "desensitization.svg").write_text(svg(rows[:-1]), "utf-8")


if __name__ == "__main__":
    main()
