/// What every binding file shares: one function per room.
#pragma once

#include <pybind11/pybind11.h>

#include "objects.hpp"  // how every argument is taken: before any function is bound

void bind_core(pybind11::module_& module);
void bind_coding(pybind11::module_& module);
void bind_approximators(pybind11::module_& module);
void bind_estimators(pybind11::module_& module);
void bind_agents(pybind11::module_& module);
void bind_environments(pybind11::module_& module);
void bind_experiments(pybind11::module_& module);
void bind_benchmarks(pybind11::module_& module);
