"""C headers of regressors and classifiers with other compilers and on other processors."""

import re

import pytest

from bare_processors import BARE_TARGETS
from c_estimators import check_learning, check_predictions, fitted
from c_kernel_estimators import check_kernel
from c_policies import ALONE, STRICT, TARGETS, run
from sdnn.export import estimator_header
from sdnn.export.estimators import CODE_BYTES

OTHERS = {**TARGETS, **BARE_TARGETS}
del OTHERS["x86-64"]
SOME = ("several-outputs", "categories", "widening", "two-classes", "one-vs-one")


@pytest.fixture(params=OTHERS)
def target(request, needs):
    target = OTHERS[request.param]
    linker = ["ld.lld"] if request.param in BARE_TARGETS else []
    needs(*filter(None, (target.compiler, target.runner)), *linker)
    return target


@pytest.mark.parametrize("name", SOME)
def test_predictions_on_other_processors_have_the_bits_of_the_estimator(name, target, tmp_path):
    check_predictions(name, target, tmp_path, 300)


@pytest.mark.parametrize("name", SOME)
def test_learning_on_other_processors_has_the_bits_of_the_estimator(name, target, tmp_path):
    check_learning(name, target, tmp_path, 100)


@pytest.mark.parametrize("name", ["listed-pairs", "directions", "low-rank"])
def test_outputs_of_kernels_on_other_processors_are_sums_in_order(name, target, tmp_path):
    check_kernel(name, target, tmp_path, 50)


PREDICTS = """
#include "model.h"
int all(const double* x, double* y);
int all(const double* x, double* y) { return model_PREDICT(x, y); }
"""
LEARNS = """
#include "model.h"
extern model_model model;
int all(const double* x, double* y);
int all(const double* x, double* y) {
  model_begin(&model);
  return model_learn(&model, x, TARGET) && model_PREDICT(&model, x, y);
}
"""


@pytest.mark.parametrize("kind", ["thumbv6m-none-eabi", "thumbv7em-none-eabi", "riscv32-none-elf"])
@pytest.mark.parametrize("name", SOME)
def test_estimators_need_no_floating_point_and_little_code(name, kind, needs, tmp_path):
    """At most a multiplication and shifts of 64 bits are called from the compiler's library."""
    needs("clang", "nm", "llvm-size")
    model, _ = fitted(name)
    is_classifier = hasattr(model, "classes_")
    options = (*STRICT, *ALONE, f"--target={kind}", "-Os", "-c", "-Wno-unused-function")
    compiled = tmp_path / "calls.o"
    for source, learning in ((PREDICTS, False), (LEARNS, True)):
        header = estimator_header(model, "model", learning=learning)
        (tmp_path / "model.h").write_text(header.text)
        calls = source.replace("PREDICT", "scores" if is_classifier else "predict")
        (tmp_path / "calls.c").write_text(calls.replace("TARGET", "1" if is_classifier else "y"))
        run("clang", *options, tmp_path / "calls.c", "-o", compiled)
        called = {line.split()[-1].decode() for line in run("nm", "-u", compiled).splitlines()}
        wide = {"__aeabi_lmul", "__aeabi_llsl", "__aeabi_llsr", "__aeabi_lasr"}
        assert called <= {"model"} | (wide if kind.startswith("thumbv6m") else set())
        lines = map(str.split, run("llvm-size", "-A", compiled).decode().splitlines())
        sizes = {
            words[0]: int(words[1]) for words in lines if len(words) == 3 and words[0][0] == "."
        }
        assert 1500 < sizes[".text"] < CODE_BYTES
        constants = sum(size for name, size in sizes.items() if name.startswith(".rodata"))
        assert header.flash_bytes - 256 < constants < header.flash_bytes + 256


@pytest.mark.parametrize("learning", [False, True])
@pytest.mark.parametrize("name", SOME)
def test_estimators_compile_where_int_has_16_bits(name, learning, needs, tmp_path):
    needs("clang")
    header = estimator_header(fitted(name)[0], "model", learning=learning)
    (tmp_path / "model.h").write_text(header.text)
    (tmp_path / "model.c").write_text('#include "model.h"\n')
    options = (*STRICT, "-ffreestanding", "-Wno-unused-function", "--target=msp430")
    run("clang", *options, "-fsyntax-only", tmp_path / "model.c")


@pytest.mark.parametrize("learning", [False, True])
@pytest.mark.parametrize("name", ["several-outputs", "categories", "two-classes", "widening"])
def test_the_header_states_the_stack_that_an_estimator_needs(name, learning, needs, tmp_path):
    arm = TARGETS["arm"]
    needs(arm.compiler)
    model, _ = fitted(name)
    text = estimator_header(model, "model", learning=learning).text
    (tmp_path / "model.h").write_text(text)
    is_classifier = hasattr(model, "classes_")
    calls = LEARNS.replace(" && model_PREDICT(&model, x, y)", "") if learning else PREDICTS
    calls = calls.replace("PREDICT", "scores" if is_classifier else "predict")
    (tmp_path / "calls.c").write_text(calls.replace("TARGET", "1" if is_classifier else "y"))
    options = (*STRICT, *ALONE, "-Wno-unused-parameter", "-Os", "-c", "-fstack-usage")
    cortex_m0 = ("-mthumb", "-mcpu=cortex-m0plus", "-mfloat-abi=soft")
    run(arm.compiler, *options, *cortex_m0, "calls.c", "-o", "calls.o", cwd=tmp_path)
    frames = (tmp_path / "calls.su").read_text().splitlines()
    stack = sum(int(line.split("\t")[1]) for line in frames)
    (stated,) = re.findall(r" ([\d,]+) bytes of arrays", text)
    arrays = int(stated.replace(",", ""))
    assert arrays < stack < arrays + 640, "the header states at most 640 bytes beside arrays"
