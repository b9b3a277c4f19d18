// An agent that learned in Python, at work in C++: reads observations, writes greedy actions.
//
// Usage: run_agent FILE < observations. FILE is what `agent.save` wrote. Each line of the input is
// an observation, its numbers parted by blanks; each line of the output is the best action for it.
#include <cstdio>
#include <exception>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "sdnn/agents/compiled_controller.hpp"

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fprintf(stderr, "usage: run_agent FILE < observations\n");
    return 2;
  }
  sdnn::agents::CompiledController agent(argv[1]);
  agent.begin_episode();
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream numbers(line);
    std::vector<double> observation;
    for (double number = 0.0; numbers >> number;) observation.push_back(number);
    for (const double action : agent.act(observation, false)) std::printf("%.17g ", action);
    std::printf("\n");
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "run_agent: %s\n", error.what());
  return 1;
}
