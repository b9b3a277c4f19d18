"""C headers of policies with other compilers and on other processors, against their agents."""

import pytest

from c_learners import LEARNERS, check_life
from c_policies import (
    AGENTS,
    TARGETS,
    agents,
    check_all_actions,
    check_integer_path,
    check_symbols,
    compile_policy,
    run,
    write_policy,
)


@pytest.fixture(params=[name for name in TARGETS if name != "x86-64"])
def target(request, needs):
    found = TARGETS[request.param]
    needs(*filter(None, (found.compiler, found.runner)))
    return found


@pytest.mark.parametrize("name", AGENTS)
def test_the_actions_are_the_agents(name, target, tmp_path):
    check_all_actions(name, target, tmp_path)


@pytest.mark.parametrize("name", LEARNERS)
def test_it_learns_as_the_agent(name, target, tmp_path):
    check_life(name, target, tmp_path, n_steps=1000)


def test_symbols_are_readings_of_one_and_zero(target, tmp_path):
    check_symbols(target, tmp_path)


@pytest.mark.parametrize("name", AGENTS)
def test_the_integer_path_needs_no_library_and_no_floating_point(name, target, tmp_path):
    check_integer_path(name, target, tmp_path)


def test_flash_and_ram_are_as_the_header_says(needs, tmp_path):
    target = TARGETS["arm"]
    needs(target.compiler)
    for number, agent in enumerate(agents().values()):
        folder = tmp_path / str(number)
        folder.mkdir()
        header = write_policy(folder, agent, floats=False)
        options = ("-Os", "-mcpu=cortex-m4", "-mfloat-abi=soft", "-fstack-usage")
        done = compile_policy(folder, target, *options)
        lines = run(target.prefix + "size", "-A", done).decode().splitlines()
        sizes = {w[0]: int(w[1]) for w in map(str.split, lines) if len(w) == 3 and w[0][0] == "."}
        constants = sum(n for name, n in sizes.items() if name.startswith((".rodata", ".data.rel")))
        # Tables of what nobody calls (actions, say) are not in the object.
        assert header.flash_bytes - 512 < constants < header.flash_bytes + 128
        assert 600 < sizes[".text"] < 2048
        usage = (folder / "policy.su").read_text().splitlines()
        stack = sum(int(line.split("\t")[1]) for line in usage)
        assert header.ram_bytes < stack < header.ram_bytes + 256
        assert f"{header.flash_bytes:,} bytes of constants" in header.text
        assert f"{header.ram_bytes:,} bytes of arrays on the stack" in header.text
