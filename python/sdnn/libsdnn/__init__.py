"""LIBSDNN's parameter files, model files and numbers, bit for bit."""

from sdnn.libsdnn.network import (
    LibsdnnInput,
    LibsdnnModel,
    LibsdnnParameters,
    read_model_file,
    read_parameter_file,
)

__all__ = [
    "LibsdnnInput",
    "LibsdnnModel",
    "LibsdnnParameters",
    "read_model_file",
    "read_parameter_file",
]
