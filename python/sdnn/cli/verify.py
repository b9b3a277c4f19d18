"""The command ``sdnn verify``: reported results are run again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sdnn.cli.common import NEW_FILE, SEED, exit_interrupted, json_option, json_text, run_command

if TYPE_CHECKING:
    from sdnn.runs.reported import Consent, Reports
    from sdnn.runs.verification import Verification

MOST_NOTES = 8  # largest number of settings that are listed as other than the paper's


@click.command(short_help="Run trials of someone's results again, and compare every bit.")
@click.argument("source", required=False, type=click.Path(exists=True, path_type=Path))
@click.option(
    "--trials",
    "n_trials",
    type=click.IntRange(1, 100_000),
    default=10,
    show_default=True,
    help="Trials to run again, drawn at random.",
)
@click.option("--all", "runs_all", is_flag=True, help="Run all trials again.")
@click.option("--case", "cases", metavar="ID", multiple=True, help="Only trials of this case.")
@click.option("--seed", type=SEED, help="Seed of the draw.  [default: another draw each time]")
@click.option(
    "--import", "modules", metavar="MODULE", multiple=True,
    help="A module that may be imported, for agents and environments; may be repeated.",
)  # fmt: skip
@click.option(
    "--certificate",
    metavar="FILE",
    type=NEW_FILE,
    help="Write the digests of equal trials, with configurations and versions, as a .json file.",
)
@click.option(
    "--jobs", type=click.IntRange(1, 10_000), help="Trials at the same time.  [default: all cores]"
)
@json_option
def verify(
    source: Path | None, n_trials: int, runs_all: bool, cases: tuple[str, ...], seed: int | None,
    modules: tuple[str, ...], certificate: Path | None, jobs: int | None, as_json: bool,
) -> None:  # fmt: skip
    """Run trials of SOURCE again on this machine, and compare their rows bit by bit.

    SOURCE is a folder of `reproduce`, `sweep` or `train`, a certificate of this command (.json) or
    a file of reference results (.csv); by default the reference results of this library. Nothing is
    written to it.

    The exit code is 0 if all are equal, and 1 if a trial differs or cannot be run. SOURCE need not
    be trusted: code is imported from Gymnasium, this library and the modules of --import only.
    """
    from rich.console import Console

    from sdnn.runs.engine import ThreadExecutor, TrialBars
    from sdnn.runs.reported import Consent
    from sdnn.runs.verification import verify as run_again

    if certificate is not None and certificate.suffix != ".json":
        raise click.UsageError(f"--certificate must end in .json, got {certificate}")
    if certificate is not None and not certificate.absolute().parent.is_dir():
        raise click.UsageError(f"--certificate must be in a folder that exists, got {certificate}")
    consent = Consent(modules)
    with run_command(lambda error: f"--{error}" if error.key == "case" else str(error)):
        consent.import_modules()
        reports = _reports(source, consent)
        with TrialBars(Console(stderr=True)) as observer:
            verification = run_again(
                reports,
                n_trials=None if runs_all else n_trials,
                cases=cases,
                seed=seed,
                consent=consent,
                executor=ThreadExecutor(jobs),
                observer=observer,
            )
        _show(verification, as_json)
        if verification.signal is not None:
            done = f"{len(verification.equal)} of {verification.n_chosen} trials are equal so far"
            exit_interrupted(f"; {done}", verification.signal)
        if not verification.is_equal:
            if certificate is not None:
                click.echo(f"no certificate: {certificate} is not written", err=True)
            raise click.exceptions.Exit(1)
        if certificate is not None:
            from sdnn.runs.certificates import certify, write_certificate

            write_certificate(certify(verification.equal), certificate)
            click.echo(f"wrote {certificate}", err=as_json)


def _reports(source: Path | None, consent: Consent) -> Reports:
    """Return what SOURCE reports: a folder's store, a CSV of reference results, or certificates."""
    if source is not None and source.is_dir():
        from sdnn.runs.reported import StoredReports

        return StoredReports(source, consent)
    if source is None or source.suffix == ".csv":
        from sdnn.reproduction.reference import ReferenceReports

        return ReferenceReports(source)
    from sdnn.runs.certificates import CertifiedReports
    from sdnn.runs.run import CONFIG
    from sdnn.runs.store import STORE_NAME

    if source.suffix != ".json" or source.name == CONFIG:
        problem = f"SOURCE must be a folder, or a file .json or .csv, got {source}"
        if (source.parent / STORE_NAME).exists():
            problem = (
                f"SOURCE must be the folder of results, got a file in it: give {source.parent}"
            )
        raise click.UsageError(problem)
    return CertifiedReports(source)


def _show(verification: Verification, as_json: bool) -> None:
    """Print what was repeated and what differs, as text or as JSON."""
    notes = _notes(verification)
    if as_json:
        values = {
            "title": verification.title,
            "instruction_set": verification.instruction_set,
            "n_reported": verification.n_reported,
            "n_unfinished": verification.n_unfinished,
            "n_chosen": verification.n_chosen,
            "digest": verification.digest,
            "equal": [trial.key._asdict() for trial, _ in verification.equal],
            "differences": [
                {**d.key._asdict(), "problem": d.problem, "details": d.details}
                for d in verification.differences
            ],
            "notes": notes,
        }
        click.echo(json_text(values))
        return
    for difference in verification.differences:
        key = difference.key
        click.echo(f"{key.agent} {key.case_id}, trial {key.trial + 1}: {difference.problem}")
        for line in difference.details:
            click.echo(f"  {line}")
    for note in notes:
        click.echo(f"note: {note}", err=True)
    if verification.signal is None:
        click.echo(str(verification))


def _notes(verification: Verification) -> list[str]:
    """Return what else readers of the result should know, a line each."""
    from sdnn.reproduction.reference import differences_from_paper

    notes: dict[str, None] = {}
    for trial, _ in verification.equal:
        key = trial.key
        for name, (value, paper) in differences_from_paper(trial).items():
            notes[f"{key.agent} {key.case_id}: {name} is {value}, the paper's is {paper}"] = None
    shown = list(notes)[:MOST_NOTES]
    if len(notes) > len(shown):
        shown.append(f"{len(notes) - len(shown)} more settings are not the paper's")
    if verification.n_unfinished:
        shown.append(f"{verification.n_unfinished} unfinished trials are left out")
    return shown
