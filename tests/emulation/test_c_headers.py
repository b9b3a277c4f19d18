"""C headers of policies with other compilers and on other processors, against their agents."""

import functools
import itertools
import re
import subprocess

import pytest

from bare_processors import BARE_TARGETS
from c_estimators import fitted
from c_histories import POLICIES, actor_observer, check_policy, policy
from c_keeping import check_best, cut_power
from c_kernel_estimators import fitted_kernel
from c_learners import LEARNERS, TIMED, actor, check_learning, exported, network, several, states
from c_policies import (
    AGENTS,
    ALONE,
    STRICT,
    TARGETS,
    agents,
    check_all_actions,
    check_integer_path,
    check_symbols,
    compile_policy,
    run,
    write_policy,
)
from sdnn.export import c_header, estimator_header, export_c_header

ARM = TARGETS["arm"]


@pytest.fixture(params=[name for name in TARGETS if name != "x86-64"])
def target(request, needs):
    target = TARGETS[request.param]
    needs(*filter(None, (target.compiler, target.runner)))
    return target


@pytest.mark.parametrize("name", AGENTS)
def test_actions_on_other_processors_are_those_of_the_agent(name, target, tmp_path):
    check_all_actions(name, target, tmp_path)


@pytest.mark.parametrize("kind", ["int32_t", "double", "float"])
@pytest.mark.parametrize("name", POLICIES)
def test_greedy_actions_with_a_history_are_those_of_the_agent(name, kind, target, tmp_path):
    check_policy(name, kind, target, tmp_path)


@pytest.mark.parametrize("n_steps", [1000, pytest.param(100_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", LEARNERS)
@pytest.mark.parametrize("kind", [*TARGETS, *BARE_TARGETS])
def test_learning_on_other_processors_has_the_bits_of_the_agent(
    kind, name, n_steps, needs, tmp_path
):
    target = (TARGETS | BARE_TARGETS)[kind]
    linker = ["ld.lld"] if kind in BARE_TARGETS else []
    needs(*filter(None, (target.compiler, target.runner)), *linker)
    check_learning(name, target, tmp_path, n_steps)


@pytest.mark.parametrize("make", [several, actor, network, actor_observer])
def test_a_kept_policy_acts_alike_on_other_processors(make, target, tmp_path):
    check_best(make, target, tmp_path, "-O2")


@pytest.mark.parametrize("make", [states, network])
def test_no_state_is_lost_on_other_processors_when_the_power_is_cut(make, target, tmp_path):
    n_cuts, *faults = cut_power(make, target=target, folder=tmp_path, n_states=4, stride=97)
    assert n_cuts > 20
    assert faults == [0, 0, 0, 0]


@pytest.mark.parametrize("name", LEARNERS)
@pytest.mark.parametrize("kind", ["thumbv6m-none-eabi", "thumbv7em-none-eabi", "riscv32-none-elf"])
def test_learning_compiles_for_microcontrollers_with_few_library_calls(name, kind, needs, tmp_path):
    """At most a multiplication and shifts of 64 bits are called from the compiler's library."""
    needs("clang", "nm")
    agent = LEARNERS[name]()
    (tmp_path / "agent.h").write_text(exported(name).text)
    act, action = "a[0] = agent_act(&agent, x)", "a[0]"
    if agent.n_dimensions > 1:
        act, action = "agent_act(&agent, x, a)", "a"
    learn, dt = ("agent_learn_over", ", 99") if name in TIMED else ("agent_learn", "")
    memory, episode = "", ""
    if agent.history != "none":
        memory, episode = "agent_greedy_episode episode;", "&episode, "
    best = f"agent_best(&agent, &keeper, {episode}x"
    best = f"{best}, a)" if agent.n_dimensions > 1 else f"a[0] = {best})"
    calls = f"""
        #include "agent.h"
        agent_agent agent; int32_t x[9]; uint8_t image[AGENT_IMAGE_BYTES];
        agent_keeper keeper;
        extern const agent_flash flash;
        {memory}
        void all(void);
        void all(void) {{
          uint32_t a[2] = {{0, 0}};
          agent_begin(&agent);
          {act};
          {learn}(&agent, x, {action}, 1, x, 0{dt});
          agent_save(&agent, image);
          agent_load(&agent, image);
          agent_begin_keeping(&keeper, image, agent_read_memory, agent_write_memory, 30);
          agent_keep(&agent, &keeper, a[0]);
          {best};
          agent_store(&agent, &flash);
          agent_restore(&agent, &flash);
        }}
    """
    (tmp_path / "calls.c").write_text(calls + "\n")
    done = tmp_path / "calls.o"
    options = (*STRICT, *ALONE, f"--target={kind}", "-Os", "-c")
    run("clang", *options, tmp_path / "calls.c", "-o", done)
    called = {line.split()[-1].decode() for line in run("nm", "-u", done).splitlines()}
    wide = {"__aeabi_lmul", "__aeabi_llsl", "__aeabi_llsr", "__aeabi_lasr"}
    assert called <= {"flash"} | (wide if kind.startswith("thumbv6m") else set())


@pytest.mark.parametrize("name", LEARNERS)
def test_learning_compiles_where_int_has_16_bits(name, needs, tmp_path):
    needs("clang")
    (tmp_path / "agent.h").write_text(exported(name).text)
    (tmp_path / "agent.c").write_text('#include "agent.h"\n')
    options = (*STRICT, "-ffreestanding", "-Wno-unused-function", "--target=msp430")
    run("clang", *options, "-fsyntax-only", tmp_path / "agent.c")


SIZE = re.compile(r"#define (AGENT_(?:N|MOST)_\w+) \d+$", re.MULTILINE)
NEVER_LARGE = ("AGENT_N_STEPS", "AGENT_N_DIMENSIONS", "AGENT_N_UNIT_BITS")
"""Sizes that settings keep far below 2^15: n_steps is at most 1,000."""
SIZED = {
    **{
        name: functools.partial(exported, name) for name in ("network", "observer", "actor-running")
    },
    "policy": lambda: c_header(agents()["pairs"], "agent"),
    "classes": lambda: estimator_header(fitted("categories")[0], "agent"),
    "regressor": lambda: estimator_header(fitted("several-outputs")[0], "agent", learning=True),
    "kernel": lambda: estimator_header(fitted_kernel("directions")[0], "agent"),
}


@pytest.mark.parametrize("header_of", SIZED.values(), ids=SIZED)
def test_arithmetic_of_large_sizes_does_not_overflow_an_int_of_16_bits(header_of, needs, tmp_path):
    """Each size is made large in turn: 4 * 8192 and 32767 + 1 are the first that overflow."""
    needs("clang")
    options = (
        "-std=c99",
        "-ffreestanding",
        "--target=msp430",
        "-fsyntax-only",
        "-ferror-limit=0",
        "-Wno-everything",
        "-Winteger-overflow",
    )
    (tmp_path / "agent.c").write_text('#include "agent.h"\n')
    (tmp_path / "agent.h").write_text(header_of().text)
    run("clang", *options, tmp_path / "agent.c")  # without an error, and so for this target
    definitions, code = header_of().text.split("static const", 1)
    # With its single row the largest arrays stay below 64 kB: clang skips those that are larger.
    definitions = re.sub("(AGENT_N_ROWS) .*", r"\1 1", definitions)
    sizes = set(SIZE.findall(definitions)) - {*NEVER_LARGE}
    assert sizes
    for name, size in itertools.product(sizes, (8192, 32767)):
        large = re.sub(f"(define {name}) .*", rf"\1 {size}", definitions)
        (tmp_path / "agent.h").write_text(f"{large}static const{code}")
        clang = subprocess.run(
            ["clang", *options, tmp_path / "agent.c"], capture_output=True, text=True
        )
        errors = re.findall("error: .*", clang.stderr)
        assert errors == [] or "too large" in errors[0] or "excess elements" in errors[0], errors
        overflows = re.findall(".*(?:overflow in expression|negative size).*", clang.stderr)
        assert overflows == [], f"{name} {size}"


def test_discrete_observations_are_one_hot_on_other_processors(target, tmp_path):
    check_symbols(target, tmp_path)


@pytest.mark.parametrize("name", AGENTS)
def test_the_integer_path_needs_no_library_and_no_floating_point(name, target, tmp_path):
    check_integer_path(name, target, tmp_path)


def sizes_on_arm(folder):
    """Compile policy.c for size; return the bytes of its constants, its code and its stack."""
    options = ("-Os", "-mcpu=cortex-m4", "-mfloat-abi=soft", "-fstack-usage")
    done = compile_policy(folder, ARM, *options)
    lines = run(ARM.prefix + "size", "-A", done).decode().splitlines()
    sizes = {w[0]: int(w[1]) for w in map(str.split, lines) if len(w) == 3 and w[0][0] == "."}
    constants = sum(n for name, n in sizes.items() if name.startswith((".rodata", ".data.rel")))
    usage = (folder / "policy.su").read_text().splitlines()
    return constants, sizes[".text"], sum(int(line.split("\t")[1]) for line in usage)


def test_the_header_states_flash_and_ram_of_the_compiled_policy(needs, tmp_path):
    needs(ARM.compiler)
    for number, agent in enumerate(agents().values()):
        folder = tmp_path / str(number)
        folder.mkdir()
        header = write_policy(folder, agent, floats=False)
        constants, code, stack = sizes_on_arm(folder)
        # Unused tables, such as that of actions, are not in the object; padding adds bytes.
        assert header.flash_bytes - 512 < constants < header.flash_bytes + 128
        assert 400 < code < 2048, "the header states 1 to 2 kB of code"
        assert header.ram_bytes < stack < header.ram_bytes + 256, "arrays, and saved registers"
        assert f"{header.flash_bytes:,} bytes of constants" in header.text
        assert f"{header.ram_bytes:,} bytes of arrays on the stack" in header.text


@pytest.mark.parametrize("name", POLICIES)
def test_the_header_states_flash_and_ram_of_a_policy_with_a_history(name, needs, tmp_path):
    needs(ARM.compiler)
    agent = policy(name)
    header = export_c_header(agent, tmp_path / "policy.h")
    stated = re.search(r"RAM: +([\d,]+) bytes in one struct[^;]*; ([\d,]+) bytes", header.text)
    episode_bytes, arrays = (int(number.replace(",", "")) for number in stated.groups())
    assert episode_bytes + arrays == header.ram_bytes
    arguments = "&episode, x" if agent.n_dimensions == 1 else "&episode, x, action"
    source = f"""
        #include "policy.h"
        extern policy_episode episode;
        extern uint32_t action[POLICY_N_DIMENSIONS];
        void step(const int32_t *x);
        void step(const int32_t *x) {{
          {"action[0] = " if agent.n_dimensions == 1 else ""}policy_greedy({arguments});
        }}
        typedef char bytes_are_stated[sizeof episode == {episode_bytes} ? 1 : -1];
    """
    (tmp_path / "policy.c").write_text(source + "\n")
    constants, code, stack = sizes_on_arm(tmp_path)
    assert header.flash_bytes - 512 < constants < header.flash_bytes + 256
    assert 2048 < code < 5120
    assert arrays < stack < arrays + 704
    undefined = set(run(ARM.prefix + "nm", "-u", tmp_path / "policy.o").decode().split())
    assert undefined <= {"U", "action", "episode", "_GLOBAL_OFFSET_TABLE_"}
