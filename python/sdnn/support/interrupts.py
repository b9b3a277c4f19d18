"""Signals that are handled at the end of a step or a block."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from types import FrameType
from typing import Self, TypeAlias

Handler: TypeAlias = Callable[[int, FrameType | None], object] | int | None


class Interrupts:
    """A context in which the first signal calls ``ask_to_stop``; a second one acts as usual.

    Signals with other handlers, and threads other than the main one, are left alone.
    ``received`` is the received signal, or None.
    """

    def __init__(
        self, ask_to_stop: Callable[[], None], signals: Sequence[int] = (signal.SIGINT,)
    ) -> None:
        self._ask_to_stop = ask_to_stop
        self._signals = signals
        self._before: dict[int, Handler] = {}
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
        """Note the first signal and ask to stop; a second one has its usual effect."""
        self.received = number
        self.__exit__()
        self._ask_to_stop()


@contextmanager
def stay_interrupts() -> Iterator[None]:
    """Delay Ctrl-C until the end of the block, then raise KeyboardInterrupt.

    Extensions replace the exceptions of the Python code that they call, or forget them: matplotlib
    reports a Ctrl-C as "Invalid affine transformation matrix". A second one acts as usual.
    """
    with Interrupts(lambda: None) as interrupts:
        yield
    if interrupts.received is not None:
        raise KeyboardInterrupt


@contextmanager
def thread_pool(n_threads: int) -> Iterator[ThreadPoolExecutor]:
    """Run a block with a pool of threads, and wait for all of them at its end.

    If a Ctrl-C interrupts the wait for a thread, Python before 3.13 considers the thread ended, and
    crashes if it is in C++ when the interpreter exits (python/cpython#90882). A second Ctrl-C
    during the wait acts as usual, in case a thread hangs.
    """
    pool = ThreadPoolExecutor(n_threads)
    try:
        yield pool
    finally:
        with stay_interrupts():
            pool.shutdown()
