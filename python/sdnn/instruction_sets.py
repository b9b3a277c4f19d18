"""Which vector instructions the core uses.

The core picks the best level that the processor offers when it is first used. The environment
variable ``SDNN_INSTRUCTION_SET`` (``portable``, ``neon``, ``avx2`` or ``avx512``) or
`set_instruction_set` choose another one, for the whole process. Results have the same bits on all
levels; only the time differs.
"""

from __future__ import annotations

from sdnn import _core

__all__ = ["available_instruction_sets", "instruction_set", "set_instruction_set"]


def instruction_set() -> str:
    """Return the level in use.

    Raises
    ------
    ValueError
        If the environment variable names a level that does not exist, or not on this processor.
    """
    return _core.instruction_set()


def available_instruction_sets() -> tuple[str, ...]:
    """Return the levels that can be chosen here, the best one last.

    Examples
    --------
    >>> available_instruction_sets()[0]
    'portable'
    """
    return tuple(_core.available_instruction_sets())


def set_instruction_set(name: str) -> None:
    """Force a level of `available_instruction_sets`, for the whole process.

    Raises
    ------
    ValueError
        If there is no such level, or this processor does not offer it.

    Examples
    --------
    >>> before = instruction_set()
    >>> set_instruction_set("portable")
    >>> instruction_set()
    'portable'
    >>> set_instruction_set(before)
    """
    _core.set_instruction_set(name)
