"""Draw a heat map for each agent: share solved over noise and inputs.

    sdnn sweep docs/studies/noise-surface.toml --out results
    python docs/studies/draw_noise_surface.py --kept results --out docs/explanation

A cell is the median over trials of the share of the last 50 test episodes that were solved, and
below it how many trials solve at least nine of ten. Cells without a stored trial stay empty.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from sdnn.agents.registry import title_of
from sdnn.reports.plots import png_bytes
from sdnn.reproduction.reproduce import ClaimStudy
from sdnn.runs.report import require_matplotlib
from sdnn.runs.results import SHARE_STABLE, final_share_solved
from sdnn.runs.store import ResultStore
from sdnn.runs.study import Study
from sdnn.support.files import write_whole

STUDY = Path(__file__).with_name("noise-surface.toml")


def shares(study: Study, store: ResultStore) -> dict[tuple[str, str, float], list[float]]:
    """Return the shares solved of the stored trials, by case, agent and noise."""
    stored = store.keys()
    by_cell: dict[tuple[str, str, float], list[float]] = {}
    for (case_id, variant_id), combination in study.combinations.items():
        keys = [key for key in study.keys(case_id, variant_id) if key in stored]
        spec = combination.spec
        cell = (case_id, spec.label, spec.environment.paper_settings().sensors.noise)
        by_cell[cell] = [final_share_solved(record.rows.solved) for record in store.load(keys)]
    return by_cell


def main() -> None:
    """Read the store and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--kept", type=Path, default=Path("results"), help="folder of the store")
    parser.add_argument("--out", type=Path, default=Path("docs/explanation"), help="of the figure")
    options = parser.parse_args()
    require_matplotlib()
    from matplotlib.figure import Figure

    study = ClaimStudy(STUDY)
    with ResultStore(options.kept) as store:
        by_cell = shares(study, store)
    agents = list(dict.fromkeys(agent for _, agent, _ in by_cell))
    sigmas = sorted({sigma for _, _, sigma in by_cell})
    figure = Figure(figsize=(4.2 * len(agents) + 1.6, 4.3), layout="constrained")
    panels = figure.subplots(1, len(agents), sharey=True, squeeze=False)[0]
    for agent, axes in zip(agents, panels, strict=True):
        cells = [[by_cell[case.id, agent, sigma] for sigma in sigmas] for case in study.cases]
        values = np.array([[np.median(c) if c else np.nan for c in row] for row in cells])
        image = axes.imshow(values, cmap="viridis", vmin=0, vmax=1, aspect="auto")
        for y, row in enumerate(cells):
            for x, trials in enumerate(row):
                if trials:
                    n_solved = sum(share >= SHARE_STABLE for share in trials)
                    text = f"{np.median(trials):.2f}\n{n_solved}/{len(trials)}"
                    shade = "white" if np.median(trials) < 0.6 else "black"
                    axes.text(x, y, text, ha="center", va="center", fontsize=7, color=shade)
        axes.set_title(title_of(agent), loc="left", fontsize=10.5)
        axes.set_xticks(range(len(sigmas)), [f"{sigma:g}" for sigma in sigmas])
        axes.set_xlabel("standard deviation of the noise")
    panels[0].set_yticks(range(len(study.cases)), [case.title for case in study.cases])
    figure.colorbar(image, ax=panels, label="share solved at the end")
    options.out.mkdir(parents=True, exist_ok=True)
    write_whole(options.out / "noise-surface.png", png_bytes(figure))


if __name__ == "__main__":
    main()
