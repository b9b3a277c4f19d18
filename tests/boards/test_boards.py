"""Agents and estimators in the firmware of emulated boards: the same bits as on x86-64."""

import functools
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from boards import BOARDS
from c_estimators import check_learning as check_learning_of_estimator, check_predictions
from c_histories import POLICIES, check_policy
from c_learners import LEARNERS, check_learning
from c_policies import TARGETS, run
from sdnn.approximators import LinearSDNNConfig
from sdnn.export import export_c_header, new_agent
from small_estimators import SMALL_ESTIMATORS

ROOT = Path(__file__).parents[2]
LIVES = Path(__file__).with_name("lives.c")
FLASH, FLASH_BYTES = 0x39000, 20 * 1024
"""Where states are in the micro:bit's flash, and their size."""
WHOLE = (2**32 - 1, 0)
"""No cut of the power."""


LARGE = {name: board for name, board in BOARDS.items() if board.ram_bytes > 64 * 1024}
MEDIUM = {name: board for name, board in BOARDS.items() if board.ram_bytes >= 64 * 1024}
ARE_SMALL = (
    "small-steps", "actor-discrete", "actor-states", "observer", "states", "discrete", "dutch",
    "several",
)  # fmt: skip
"""Agents that learn in 16 kB, with an image beside them."""
ARE_LARGE = ("few-pairs", "averages")
"""Agents that need more than 64 kB."""


@pytest.fixture
def board(request, needs):
    target = BOARDS[request.param].target()
    needs(target.compiler, target.runner, options=target.options)
    return target


def on(boards):
    """Run a test on boards."""
    return pytest.mark.parametrize("board", boards, indirect=True)


@on(BOARDS)
@pytest.mark.parametrize("name", ARE_SMALL)
def test_small_agents_act_and_learn_with_the_same_bits(name, board, tmp_path):
    check_learning(name, board, tmp_path, 3000)


@on(MEDIUM)
@pytest.mark.parametrize("name", sorted(LEARNERS.keys() - {*ARE_SMALL, *ARE_LARGE}))
def test_agents_act_and_learn_with_the_same_bits(name, board, tmp_path):
    check_learning(name, board, tmp_path, 3000)


@on(LARGE)
@pytest.mark.parametrize("name", ARE_LARGE)
def test_large_agents_act_and_learn_with_the_same_bits(name, board, tmp_path):
    check_learning(name, board, tmp_path, 3000)


@on(BOARDS)
@pytest.mark.parametrize("name", POLICIES)
def test_exported_policies_act_with_the_same_bits(name, board, tmp_path):
    check_policy(name, "int32_t", board, tmp_path)


@on(BOARDS)
@pytest.mark.parametrize("name", SMALL_ESTIMATORS)
def test_estimators_predict_with_the_same_bits(name, board, tmp_path):
    check_predictions(name, board, tmp_path, 10_000)


@on(MEDIUM)
@pytest.mark.parametrize("name", SMALL_ESTIMATORS)
def test_estimators_learn_with_the_same_bits(name, board, tmp_path):
    check_learning_of_estimator(name, board, tmp_path, 5000)


def lives_of(target, folder, *options):
    """Compile the smallest agent for the pendulum with a wheel; return its command."""
    folder.mkdir()
    high = np.array([0.3, 1.0, 1.0])
    agent = new_agent(
        gym.spaces.Box(-high, high, dtype=np.float64), gym.spaces.Discrete(5), seed=1,
        approximator=LinearSDNNConfig(n_pattern_units=32),
    )  # fmt: skip
    export_c_header(agent, folder / "pole.h", learning=True)
    (folder / "lives.c").write_bytes(LIVES.read_bytes())
    flags = ("-std=c99", "-Os", "-Wall", "-Wextra", "-Werror", "-I", ROOT / "bench" / "arm")
    return target.compile(folder / "lives.c", *flags, *options)


def live(command, flash, lives, *, is_micro_bit=False):
    """Run lives in a process; return their results and images, and the flash that they leave."""
    numbers = np.array(lives, "<u4").tobytes()
    if is_micro_bit:
        loaded = Path(command[-1]).with_suffix(".flash")
        loaded.write_bytes(flash)
        command = [*command, "-device", f"loader,file={loaded},addr={FLASH:#x},force-raw=on"]
    written = run(*command, input=numbers if is_micro_bit else flash + numbers)
    n, flash = len(written) - FLASH_BYTES, written[-FLASH_BYTES:]
    results = [written[i : i + n // len(lives)] for i in range(0, n, max(1, n // len(lives)))]
    return [(np.frombuffer(r, "<u4", 3).tolist(), r[12:]) for r in results], flash


@pytest.mark.parametrize("name", ["cortex-m0", *MEDIUM])
def test_an_agent_learns_keeps_and_saves_on_a_board_that_loses_its_power(name, needs, tmp_path):
    """The flash outlives each process, and becomes that of a life without a loss."""
    target, is_micro_bit = BOARDS[name].target(), name == "cortex-m0"
    needs(target.compiler, target.runner, options=target.options)
    board = lives_of(target, tmp_path / "board", *(["-DNRF51"] if is_micro_bit else []))
    native = lives_of(TARGETS["x86-64"], tmp_path / "native")
    on_board = functools.partial(live, board, is_micro_bit=is_micro_bit)
    blank = b"\xff" * FLASH_BYTES
    first, second = (25_000, 1, *WHOLE), (25_000, 2, *WHOLE)
    expected, last_flash = live(native, blank, [first, second])
    assert expected[1][0][1] >= 4750  # steps of ten episodes with the best policy
    [((restored, score, stack), image)], flash = on_board(flash=blank, lives=[first])
    assert ([restored, score, 0], image) == expected[0]
    assert 500 < stack < 1500
    # The power is cut while the second state is saved: in the first one, the life is the same.
    nothing, cut = on_board(flash=flash, lives=[(25_000, 2, 50, 20)])
    assert nothing == []
    assert cut not in (flash, last_flash)
    [((restored, score, stack), image)], flash = on_board(flash=cut, lives=[second])
    assert ([restored, score, 0], image) == ([1, *expected[1][0][1:]], expected[1][1])
    assert 500 < stack < 1500
    assert flash == last_flash
