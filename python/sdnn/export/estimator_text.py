"""Text of the headers of estimators: comments, tables of words, and the frame of the file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, TypeAlias

import numpy as np

from sdnn.export.coded_inputs import CodedInput
from sdnn.export.text import Header, Tables, c_source, c_strings, define_lines, header_text

if TYPE_CHECKING:
    from sdnn.estimators import (
        SDNNClassifier,
        SDNNKernelClassifier,
        SDNNKernelRidge,
        SDNNRegressor,
    )

    AnyModel: TypeAlias = SDNNRegressor | SDNNClassifier | SDNNKernelRidge | SDNNKernelClassifier


def _in_comment(name: str) -> str:
    """Return a name in ASCII on a line, which neither begins nor ends a comment of C.

    A backslash before the end of a line would join two lines, and so is doubled.
    """
    text = name.encode("unicode_escape").decode()
    return text.replace("*/", "* /").replace("/*", "/ *")


class EstimatorHeader(Header):
    """A C header that holds a regressor or a classifier.

    ``text`` is the file and ``name`` the prefix of its names. ``flash_bytes`` of constants include
    ``weight_bytes``. ``ram_bytes`` are the arrays that a prediction has on the stack or, if the
    estimator learns, all that it remembers.
    """


class HeaderText(ABC):
    """Makes the text of an estimator's header."""

    title: ClassVar[str] = "a regressor or classifier"
    file: ClassVar[str]
    code_size: ClassVar[str] = "4 to 7 kB"
    remedy: ClassVar[str]
    """How to get a smaller header, for messages."""

    def __init__(self, model: AnyModel, name: str, inputs: Sequence[CodedInput]) -> None:
        self.model, self.name, self.inputs = model, name, inputs
        self.is_classifier = hasattr(model, "classes_")

    @abstractmethod
    def header(self) -> EstimatorHeader:
        """Make the header."""

    @abstractmethod
    def about(self) -> str:
        """Describe the size of the estimator."""

    @abstractmethod
    def ram_bytes(self) -> int:
        """Return the bytes of memory that the header states."""

    def text(self, macros: dict[str, object], tables: Tables) -> str:
        """Return the text of the header."""
        return header_text(
            self.name,
            title=self.title,
            made=[f"{type(self.model).__name__}: {self.about()}."],
            needs=self.needs(tables.n_bytes),
            arithmetic=[
                "integers, with doubles too: their bits are those of the library on any processor.",
                "Include it in one source file: its constants are static.",
            ],
            usage=self.usage(),
            constants=[
                *define_lines(self.name.upper(), macros), "", *tables.lines, *self.words(),
            ],
            code=c_source(self.file, self.name, ["sdnn_observation.h"]),
        )  # fmt: skip

    def needs(self, flash_bytes: int) -> list[str]:
        """Return comment lines about memory."""
        return [
            f"Flash: {flash_bytes:,} bytes of constants; the code comes to some {self.code_size}.",
            f"RAM:   {self.ram_bytes():,} bytes of arrays on the stack, and at most 640 for all",
            "       else there. No heap, and nothing static that changes.",
        ]

    def calls(self) -> list[str]:
        """Return example lines of C that predict."""
        name, macro = self.name, self.name.upper()
        if self.is_classifier:
            return [f"int32_t c = {name}_predict(x); // the label is {name}_classes[c]; or -1"]
        return [
            f"double y[{macro}_N_OUTPUTS];",
            f"int is_predicted = {name}_predict(x, y);",
        ]

    def usage(self) -> list[str]:
        """Return comment lines about the calls, and the values of a sample."""
        names = self.model._feature_names() or [""] * len(self.model.codings_)
        values = [
            f"  {source.usage(_in_comment(names[source.column]))}".replace(
                "CATEGORIES", f"{self.name}_categories"
            )
            for source in self.inputs
            if source.column < len(names)
        ]
        return [
            f"  double x[{self.name.upper()}_N_FEATURES];",
            *(f"  {line}" for line in self.calls()),
            "",
            "The values of a sample; others are ignored:",
            *values,
            f"{self.name}_missing() is a missing value, and {self.name}_number(n, -8) is n / 2^8.",
        ]

    def words(self) -> list[str]:
        """Return the categories and classes that are words, as tables of strings."""
        lines = []
        for source in self.inputs:
            if source.type == "WORDS":
                name = f"{self.name}_categories_{source.column}"
                lines += c_strings(name, map(str, source.categories))
        if not self.is_classifier:
            return lines
        classes, name = self.model.classes_.tolist(), f"{self.name}_classes"
        if all(isinstance(label, int) and abs(label) < 2**31 for label in classes):
            numbers = Tables(self.name)
            numbers.add("int32_t", "classes", np.array(classes, np.int64), "Labels of the classes.")
            return [*lines, *numbers.lines]
        return [*lines, *c_strings(name, map(str, classes))]
