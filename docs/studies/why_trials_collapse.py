"""Show why trials collapse: measure the network, draw figures for docs/explanation/collapse.md.

    python docs/studies/why_trials_collapse.py                 # measure what is missing, draw all
    python docs/studies/why_trials_collapse.py --draw-only     # draw from what is stored

Everything measured is kept in OUT/collapse.npz, from which alone the figures are drawn. Trials are
those of Case II (4 noisy inputs) of ``sdnn reproduce b``: the same seeds, the same rows.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.reproduction.cases import EXPERIMENTS
from sdnn.reproduction.reproduce import case_spec
from sdnn.runs.results import episode_of_collapse
from sdnn.runs.spec import RunSpec
from sdnn.runs.trial import trial_seed
from sdnn.support.files import write_whole

CASE = next(case for case in EXPERIMENTS[1].cases if case.id == "s4-noise")
N_TRIALS = 10
N_NOISY = 64
"""Noisy observations of a state over which the spread of the greedy torque is taken."""
PATH = 4
"""Decisions of the path without noise whose values are recorded."""
WINDOW = 150
"""Episodes before and after a collapse that are looked at one by one."""
RECOVERY_EPISODES = 3000

Rows = dict[str, NDArray[Any]]


def spec_of(agent: str) -> RunSpec:
    """Return Case II of an agent."""
    return case_spec(replace(CASE, agents=(agent,)), agent)


class Inspector:
    """Measurements of a training agent that do not change it."""

    def __init__(self, spec: RunSpec) -> None:
        task = spec.environment.paper_settings()
        self._acrobot_config = task.acrobot
        clean = replace(task.sensors, noise=0.0)
        self._clean = _core.AcrobotSensors(clean, 0, _core.Stream.sensor_noise)
        self._noisy = _core.AcrobotSensors(task.sensors, 12345, _core.Stream.sensor_noise)

    def greedy(self, agent: Any, observation: NDArray[np.float64]) -> tuple[float, float]:
        """Return the mean of the best torques, in N m, and their value."""
        values = agent.networks[0].values(observation)
        torques = np.linspace(-10.0, 10.0, values.size)
        return float(torques[values == values.max()].mean()), float(values.max())

    def path(self, agent: Any, goal_tolerance: float) -> tuple[list[float], list[float], bool]:
        """Return torques and values of the greedy path without noise; whether it solves."""
        acrobot = _core.Acrobot(self._acrobot_config)
        torques, values = [], []
        for _ in range(PATH):
            torque, value = self.greedy(agent, self._clean.observe(acrobot.state()))
            torques.append(torque)
            values.append(value)
            _, terminated, _ = acrobot.step(torque, goal_tolerance)
            if terminated:
                return torques, values, True
        return torques, values, False

    def spread(self, agent: Any) -> float:
        """Return the standard deviation, in N m, of the first greedy torque under noise."""
        start = _core.Acrobot(self._acrobot_config).state()
        torques = [self.greedy(agent, self._noisy.observe(start))[0] for _ in range(N_NOISY)]
        return float(np.std(torques))

    def first_values(self, agent: Any) -> NDArray[np.float64]:
        """Return Q(start, a) of every action."""
        start = _core.Acrobot(self._acrobot_config).state()
        return np.asarray(agent.networks[0].values(self._clean.observe(start)))


def look(
    spec: RunSpec, number: int, episodes: Iterable[int]
) -> Iterator[tuple[int, Any, Inspector, float]]:
    """Advance a trial, stopping after the given numbers of learning episodes."""
    trial = spec.make_trial(trial_seed(0, CASE.id, number))
    goal = _core.GoalSchedule(spec.environment.paper_settings().goal)
    inspector = Inspector(spec)
    for episode in episodes:
        trial.advance(episode - trial.episode)
        yield episode, trial, inspector, goal(max(episode, 1))


def whole_trial(spec: RunSpec, number: int, step: int = 50) -> Rows:
    """Run a trial from end to end, looking into it every `step` episodes."""
    last = spec.budget.episodes or 0
    measured: dict[str, list[Any]] = {
        "episode": [],
        "q": [],
        "path": [],
        "torque": [],
        "spread": [],
    }
    trial = None
    for episode, trial, inspector, tolerance in look(spec, number, range(step, last + 1, step)):
        torques, values, _ = inspector.path(trial.agent, tolerance)
        measured["episode"].append(episode)
        measured["q"].append(inspector.first_values(trial.agent).astype(np.float32))
        measured["path"].append(values + [np.nan] * (PATH - len(values)))
        measured["torque"].append(torques + [np.nan] * (PATH - len(torques)))
        measured["spread"].append(inspector.spread(trial.agent))
    assert trial is not None
    rows = trial.test_rows()
    return {
        **{name: np.array(values) for name, values in measured.items()},
        **{f"test_{name}": column for name, column in rows.items()},
    }


def around(spec: RunSpec, number: int, middle: int) -> Rows:
    """Look at the episodes around a collapse, one by one."""
    episodes = range(middle - WINDOW, middle + WINDOW + 1)
    measurements: dict[str, list[Any]] = {"episode": [], "path": [], "torque": [], "clean": []}
    for episode, trial, inspector, tolerance in look(spec, number, episodes):
        torques, values, solved = inspector.path(trial.agent, tolerance)
        measurements["episode"].append(episode)
        measurements["path"].append(values + [np.nan] * (PATH - len(values)))
        measurements["torque"].append(torques + [np.nan] * (PATH - len(torques)))
        measurements["clean"].append(solved)
    return {name: np.array(values) for name, values in measurements.items()}


def begun_anew(spec: RunSpec, agent: Any, seed: int) -> NDArray[np.bool_]:
    """Let an agent live through the schedule's first episodes; return which tests it solved."""
    task = spec.environment.paper_settings()
    acrobot, goal = _core.Acrobot(task.acrobot), _core.GoalSchedule(task.goal)
    sensors, test_sensors = (
        _core.AcrobotSensors(task.sensors, seed, stream)
        for stream in (_core.Stream.sensor_noise, _core.Stream.evaluation_sensor_noise)
    )
    n_actions = agent.networks[0].n_actions

    def run(eyes: Any, tolerance: float, learning: bool) -> bool:
        acrobot.reset()
        agent.begin_episode()
        state = eyes.observe(acrobot.state())
        while True:
            action = agent.act(state, learning)
            torque = _core.action_value(int(action[0]), n_actions, -10.0, 10.0)
            reward, terminated, truncated = acrobot.step(torque, tolerance)
            next_observation = eyes.observe(acrobot.state())
            if learning:
                agent.learn(state, action, reward, next_observation, terminated)
            if terminated or truncated:
                return bool(terminated)
            state = next_observation

    solved = []
    for episode in range(1, RECOVERY_EPISODES + 1):
        run(sensors, goal(episode), True)
        if episode % 10 == 0:
            solved.append(run(test_sensors, goal(episode), False))
    return np.array(solved)


def end_of_mastery(rows: Rows) -> float:
    """Return the measure "episode of collapse" of the reports."""
    return episode_of_collapse(rows["test_episode"], rows["test_steps"])


def last_success(rows: Rows) -> float:
    """Return the same with runs of ten tests: where the agent still did it for a last time."""
    return episode_of_collapse(rows["test_episode"], rows["test_steps"], window=10)


class Kept:
    """The file of everything measured; what is there is not measured again."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._arrays: Rows = dict(np.load(path)) if path.exists() else {}

    def rows(self, name: str, measure: Callable[[], Rows] | None = None) -> Rows:
        """Return the rows of that name, measured if they are missing."""
        rows = {k.split("/")[1]: v for k, v in self._arrays.items() if k.split("/")[0] == name}
        if rows or measure is None:
            return rows
        print(f"measuring {name}", flush=True)
        rows = measure()
        self._arrays |= {f"{name}/{key}": value for key, value in rows.items()}
        buffer = BytesIO()
        np.savez_compressed(buffer, **self._arrays)
        write_whole(self.path, buffer.getvalue())
        return rows


def measure(kept: Kept, n_trials: int) -> None:
    """Measure all that the figures need."""
    for agent in ("sdnn-c", "sdnn-c-robust"):
        config = spec_of(agent)
        for number in range(n_trials):
            kept.rows(f"{agent}:{number}", lambda c=config, n=number: whole_trial(c, n))  # type: ignore[misc]
    paper = spec_of("sdnn-c")
    for number in range(n_trials):
        rows = kept.rows(f"sdnn-c:{number}")
        if not WINDOW < end_of_mastery(rows) < 14_000:
            continue
        middle = int(min(last_success(rows), 14_000))
        kept.rows(f"around:{number}", lambda n=number, m=middle: around(paper, n, m))  # type: ignore[misc]

        def recover(n: int = number) -> Rows:
            seed = trial_seed(0, CASE.id, n)
            old, new = paper.make_trial(seed), paper.make_trial(seed)
            old.advance(paper.budget.episodes or 0)
            return {
                "collapsed": begun_anew(paper, old.agent, seed),  # type: ignore[attr-defined]
                "fresh": begun_anew(paper, new.agent, seed),  # type: ignore[attr-defined]
            }

        kept.rows(f"recovery:{number}", recover)


INK, FAINT = "#2b2b2b", "#8a8a8a"
BLUE, RED, GREEN = "#1f5a96", "#c2542d", "#3c7d4b"
STEP_COLORS = ("#1f5a96", "#3c7d4b", "#d9a441", "#c2542d")


def numbers(kept: Kept, prefix: str, n_trials: int) -> dict[int, Rows]:
    """Return stored rows of one kind, by the number of the trial."""
    rows_of_trials = {n: kept.rows(f"{prefix}:{n}") for n in range(n_trials)}
    return {n: rows for n, rows in rows_of_trials.items() if rows}


def final_share(rows: Rows) -> float:
    """Return the share of the last 100 tests that were solved."""
    return float(rows["test_solved"][-100:].mean())


def examples(kept: Kept, n_trials: int) -> list[tuple[str, Rows]]:
    """Choose a trial that collapses, the paper's best one at the end, and a robust one."""
    paper = numbers(kept, "sdnn-c", n_trials)
    collapsing = min(
        (n for n in paper if np.isfinite(end_of_mastery(paper[n]))),
        key=lambda n: abs(end_of_mastery(paper[n]) - 7500),
    )
    best = max(paper, key=lambda n: final_share(paper[n]))
    robust = numbers(kept, "sdnn-c-robust", n_trials)
    first = min(robust)
    return [
        (f"paper's settings, trial {collapsing + 1}: collapses", paper[collapsing]),
        (f"paper's settings, trial {best + 1}: survives", paper[best]),
        (f"robust, trial {first + 1}", robust[first]),
    ]


def draw_inside(kept: Kept, n_trials: int) -> Any:
    """Draw three trials: tests, Q of every torque at the start, values along the path."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 7.6), layout="constrained")
    grid = figure.subplots(3, 3, sharex=True, sharey="row")
    for column, (title, rows) in enumerate(examples(kept, n_trials)):
        tests, values, path = grid[:, column]
        solved = rows["test_solved"].astype(bool)
        for mask, color in ((solved, BLUE), (~solved, RED)):
            tests.plot(rows["test_episode"][mask], rows["test_steps"][mask], ".", ms=2, color=color)
        tests.set_title(title, loc="left", fontsize=10, color=INK)
        image = values.imshow(
            rows["q"].T, aspect="auto", origin="lower", cmap="RdBu", vmin=-10, vmax=10,
            extent=(rows["episode"][0], rows["episode"][-1], -10, 10), interpolation="nearest",
        )  # fmt: skip
        values.plot(rows["episode"], rows["torque"][:, 0], ".", ms=1.5, color="black")
        for step in range(PATH):
            path.plot(
                rows["episode"], rows["path"][:, step], lw=0.8, color=STEP_COLORS[step],
                label=f"step {step + 1}",
            )  # fmt: skip
        path.axhline(0, lw=0.6, color=FAINT)
        path.set_xlabel("learning episodes")
    grid[0, 0].set_ylabel("steps per test episode")
    grid[1, 0].set_ylabel("first torque [N m]")
    grid[2, 0].set_ylabel("max Q along the greedy path")
    grid[2, 0].legend(frameon=False, fontsize=8, ncols=2)
    figure.colorbar(image, ax=grid[1, :], shrink=0.9, label="Q(start, torque)")
    return figure


def draw_around(kept: Kept, n_trials: int) -> Any:
    """Draw the episodes around collapses: values along the path, whether it ends in the goal."""
    from matplotlib.figure import Figure

    rows_of_trials = list(numbers(kept, "around", n_trials).items())[:4]
    figure = Figure(figsize=(11.5, 5.6), layout="constrained")
    grid = figure.subplots(2, len(rows_of_trials), sharey="row", squeeze=False)
    for column, (number, rows) in enumerate(rows_of_trials):
        values, torques = grid[:, column]
        x = rows["episode"] - rows["episode"][WINDOW]
        clean = rows["clean"].astype(bool)
        for step in range(PATH):
            values.plot(x, rows["path"][:, step], lw=0.8, color=STEP_COLORS[step],
                        label=f"step {step + 1}")  # fmt: skip
            torques.plot(x, rows["torque"][:, step], ".", ms=2, color=STEP_COLORS[step])
        values.plot(x[clean], np.full(clean.sum(), 11.5), "|", ms=5, color=BLUE)
        values.axhline(0, lw=0.6, color=FAINT)
        for axes in (values, torques):
            axes.axvline(0, lw=0.8, ls=":", color=INK)
        values.set_title(
            f"trial {number + 1}, episode {rows['episode'][WINDOW]}", loc="left", fontsize=10
        )
        torques.set_xlabel("episodes from the last mastered one")
    grid[0, 0].set_ylabel("max Q along the greedy path")
    grid[1, 0].set_ylabel("greedy torque [N m]")
    grid[0, 0].legend(frameon=False, fontsize=8, ncols=2)
    return figure


def draw_spread(kept: Kept, n_trials: int) -> Any:
    """Draw how much noise moves the first torque, against what is solved."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.subplots()
    for agent, title, color, marker in (
        ("sdnn-c", "paper's settings", RED, "o"),
        ("sdnn-c-robust", "robust", GREEN, "s"),
    ):
        trials = numbers(kept, agent, n_trials).values()
        late = [rows["episode"] > 14_000 for rows in trials]
        spread = [float(np.median(r["spread"][mask])) for r, mask in zip(trials, late, strict=True)]
        share = [final_share(rows) for rows in trials]
        axes.plot(spread, share, marker, color=color, label=title, ms=7, alpha=0.8)
    axes.set_xscale("symlog", linthresh=0.03)
    axes.set_xlabel("spread of the first greedy torque over noisy observations [N m]")
    axes.set_ylabel("share solved, last 1,000 episodes")
    axes.legend(frameon=False)
    return figure


def draw_recovery(kept: Kept, n_trials: int) -> Any:
    """Draw the schedule anew: networks that had collapsed, and new ones of the same seeds."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.subplots()
    rows_of_trials = list(numbers(kept, "recovery", n_trials).values())
    x = 10 * np.arange(1, RECOVERY_EPISODES // 10 + 1)
    for name, color in (("fresh", BLUE), ("collapsed", RED)):
        shares = np.mean([rows[name].astype(float) for rows in rows_of_trials], axis=0)
        smooth = np.convolve(shares, np.full(10, 0.1), "valid")
        axes.plot(x[9:], smooth, color=color, label=f"{name}, {len(rows_of_trials)} networks")
    axes.set_ylim(0, 1.02)
    axes.set_xlabel("learning episodes from where the goal is wide again")
    axes.set_ylabel("share of tests solved (mean over ten tests)")
    axes.legend(frameon=False)
    return figure


FIGURES: dict[str, Callable[[Kept, int], Any]] = {
    "collapse-inside": draw_inside,
    "collapse-around": draw_around,
    "collapse-spread": draw_spread,
    "collapse-recovery": draw_recovery,
}


def table(kept: Kept, n_trials: int) -> Iterator[str]:
    """Tell the numbers behind the figures, a line a trial."""
    yield "agent          trial  solved  mastered to  spread  value of start  steps"
    for agent in ("sdnn-c", "sdnn-c-robust"):
        for number, rows in numbers(kept, agent, n_trials).items():
            late = rows["episode"] > 14_000
            yield (
                f"{agent:14s} {number + 1:5d}  {final_share(rows):6.2f}"
                f"  {end_of_mastery(rows):11.0f}  {np.median(rows['spread'][late]):6.3f}"
                f"  {np.median(rows['path'][late, 0]):14.1f}"
                f"  {np.median(rows['test_steps'][-100:]):5.1f}"
            )


def main() -> None:
    """Measure and draw."""
    from sdnn.reports.plots import png_bytes

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--out", type=Path, default=Path("docs/explanation"), help="of the figures")
    parser.add_argument("--kept", type=Path, default=Path("results"), help="folder of the rows")
    parser.add_argument("--trials", type=int, default=N_TRIALS)
    parser.add_argument("--draw-only", action="store_true")
    options = parser.parse_args()
    options.kept.mkdir(parents=True, exist_ok=True)
    options.out.mkdir(parents=True, exist_ok=True)
    kept = Kept(options.kept / "collapse.npz")
    if not options.draw_only:
        measure(kept, options.trials)
    for name, draw in FIGURES.items():
        write_whole(options.out / f"{name}.png", png_bytes(draw(kept, options.trials)))
    print("\n".join(table(kept, options.trials)))


if __name__ == "__main__":
    main()
