"""Certificates: digests of trials that were run again, in a file that can be verified, too."""

from __future__ import annotations

import platform
from collections.abc import Collection, Iterable, Iterator
from importlib import metadata
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from sdnn._core import __version__
from sdnn.runs.errors import ConfigError, RunError
from sdnn.runs.reported import ReportedTrial
from sdnn.runs.run import Goal
from sdnn.runs.study_file import MOST_TRIALS
from sdnn.runs.trial import TrialKey, TrialRecord, canonical_json, config_hash
from sdnn.support.files import read_bytes, write_whole
from sdnn.support.machine import instruction_set

MOST_BYTES = 2**26  # size of the largest file

Word = Annotated[str, Meta(max_length=1000)]
"""A short text: certificates of others are not trusted, and their sizes are limited."""


class CertifiedTrial(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A trial of a certificate, with the SHA-256 of all of its rows."""

    case: Word
    agent: Word
    trial: Annotated[int, Meta(ge=0, le=2**32 - 1)]
    seed: Annotated[int, Meta(ge=0)]
    config_hash: Annotated[str, Meta(pattern="^[0-9a-f]{16}$")]
    version: Word
    decisions: Annotated[int, Meta(ge=0, le=2**53)]
    digest: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
    goals: Annotated[tuple[Goal, ...], Meta(max_length=1000)] = ()

    @property
    def key(self) -> TrialKey:
        """The key of the trial in a store."""
        return TrialKey(self.case, self.agent, self.trial, self.seed, self.config_hash)


class Certificate(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Trials that were run again, their configurations, and the versions and machine that ran them.

    It names neither a computer nor a user.
    """

    format: Literal["sdnn-certificate-1"] = "sdnn-certificate-1"
    version: Word
    packages: dict[Word, Word]
    instruction_set: Word
    platform: Word
    configurations: dict[str, dict[str, object]]
    trials: Annotated[tuple[CertifiedTrial, ...], Meta(max_length=MOST_TRIALS)]


def certify(trials: Iterable[tuple[ReportedTrial, TrialRecord]]) -> Certificate:
    """Make the certificate of trials that were run again here, with their records."""
    pairs = sorted(trials, key=lambda pair: pair[0].key)
    return Certificate(
        version=__version__,
        packages={name: metadata.version(name) for name in ("numpy", "gymnasium")},
        instruction_set=instruction_set(),
        platform=f"{platform.system()} {platform.machine()}",
        configurations={
            reported.key.config_hash: msgspec.json.decode(reported.config) for reported, _ in pairs
        },
        trials=tuple(
            CertifiedTrial(
                case=reported.key.case_id,
                agent=reported.key.agent,
                trial=reported.key.trial,
                seed=reported.key.seed,
                config_hash=reported.key.config_hash,
                version=record.version,
                decisions=record.n_decisions,
                digest=record.rows.checksum(),
                goals=reported.goals,
            )
            for reported, record in pairs
        ),
    )


def write_certificate(certificate: Certificate, path: Path) -> None:
    """Write a certificate as JSON; OSError if that is impossible."""
    write_whole(path, msgspec.json.format(msgspec.json.encode(certificate), indent=2) + b"\n")


class CertifiedReports:
    """The trials of a certificate.

    RunError if the file is no certificate, or its configurations do not fit their hashes.
    """

    n_unfinished = 0

    def __init__(self, path: Path) -> None:
        self.title = str(path)
        try:
            certificate = msgspec.json.decode(read_bytes(path, MOST_BYTES), type=Certificate)
        except (ConfigError, RecursionError, ValueError, msgspec.DecodeError) as error:
            raise RunError(f"{path} is no certificate: {error}") from error
        self.machine = f"{certificate.instruction_set}, {certificate.platform}"
        self._configs = {
            name: canonical_json(values) for name, values in certificate.configurations.items()
        }
        for name, config in self._configs.items():
            if config_hash(config) != name:
                problem = f"must have the hash {config_hash(config)}, as its settings have"
                raise RunError(f"{path}: configurations.{name} {problem}")
        self._trials = {trial.key: trial for trial in certificate.trials}
        self.keys = sorted(self._trials)
        if len(self.keys) < len(certificate.trials):
            raise RunError(f"{path}: trials must be different, and some are there twice")
        for key in self.keys:
            if key.config_hash not in self._configs:
                problem = f"must have the configuration {key.config_hash} of a trial"
                raise RunError(f"{path}: configurations {problem}")

    def load(self, keys: Collection[TrialKey]) -> Iterator[ReportedTrial]:
        """Return the trials of the given keys."""
        for key in keys:
            trial = self._trials[key]
            yield ReportedTrial(
                key=key,
                config=self._configs[key.config_hash],
                version=trial.version,
                digest=trial.digest,
                n_decisions=trial.decisions,
                goals=trial.goals,
            )

    def check(self, keys: Iterable[TrialKey]) -> Iterator[bool]:
        """Yield True for each key: trials have no rows here."""
        return (True for _ in keys)
