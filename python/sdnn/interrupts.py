"""Ctrl-C that waits for the end of a step, and Ctrl-C that extensions turn into other errors."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from typing_extensions import Self

__all__ = ["Interrupts", "stay_interrupts"]


class Interrupts:
    """A context in which a first signal calls ``ask_to_stop``; a second one acts as usual.

    Signals that somebody else handles, and threads other than the main one, are left alone.
    ``received`` is the signal that came, if any.
    """

    def __init__(
        self, ask_to_stop: Callable[[], None], signals: Sequence[int] = (signal.SIGINT,)
    ) -> None:
        self._ask_to_stop = ask_to_stop
        self._signals = signals
        self._before: dict[int, Any] = {}
        self.received: int | None = None

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in self._signals:
                handler = signal.getsignal(number)
                if handler in (signal.default_int_handler, signal.SIG_DFL):
                    self._before[number] = signal.signal(number, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _handle(self, number: int, _frame: FrameType | None) -> None:
        self.received = number
        self.__exit__()
        self._ask_to_stop()


@contextmanager
def stay_interrupts() -> Iterator[None]:
    """Let a Ctrl-C leave the block as KeyboardInterrupt, whatever the code in it makes of it.

    Extensions replace the exceptions of the Python code that they call, or forget them: matplotlib
    answers a Ctrl-C with "Invalid affine transformation matrix".
    """
    usual = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(usual):
        yield
        return
    came = False

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal came
        try:
            usual(number, frame)
        except KeyboardInterrupt:
            came = True
            raise

    signal.signal(signal.SIGINT, handle)
    try:
        yield
    except Exception as error:
        if came:
            raise KeyboardInterrupt from error
        raise
    finally:
        signal.signal(signal.SIGINT, usual)
    if came:
        raise KeyboardInterrupt
