/// The functions that bind the packages, one for each.
#pragma once

#include <pybind11/pybind11.h>

#include "objects.hpp"  // how every argument is taken: before any function is bound

void bind_core(pybind11::module_& module);
void bind_coding(pybind11::module_& module);
void bind_approximators(pybind11::module_& module);
void bind_estimators(pybind11::module_& module);
void bind_experts(pybind11::module_& module);  // of estimators
void bind_agents(pybind11::module_& module);
void bind_controller(pybind11::module_& module);  // of agents
void bind_environments(pybind11::module_& module);
void bind_tools(pybind11::module_& module);
