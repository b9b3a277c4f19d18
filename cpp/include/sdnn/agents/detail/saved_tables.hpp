/// Patterns that an agent was given, among its state.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdnn/coding/pattern_table.hpp"
#include "sdnn/core/detail/check.hpp"
#include "sdnn/core/state.hpp"

namespace sdnn::agents::detail {

inline std::string name_of_table(std::size_t i) { return "table." + std::to_string(i); }

/// Lists the tables' signs; where they are read, tables_in has already made them.
template <class Archive>
void serialize_tables(const std::vector<coding::PatternTable>& tables, Archive& archive) {
  for (std::size_t i = 0; i < tables.size(); ++i) {
    std::vector<std::int8_t> signs;
    signs.reserve(tables[i].n_bins() * tables[i].n_units());
    for (std::size_t bin = 0; bin < tables[i].n_bins(); ++bin) {
      for (std::size_t k = 0; k < tables[i].n_units(); ++k) {
        signs.push_back(static_cast<std::int8_t>(tables[i].sign(bin, k)));
      }
    }
    archive.fixed(name_of_table(i), {tables[i].n_bins(), tables[i].n_units()}, signs);
  }
}

/// Throws std::invalid_argument naming a tensor that is no table.
inline std::vector<coding::PatternTable> tables_in(const core::State& state) {
  std::vector<coding::PatternTable> tables;
  for (;;) {
    const std::string name = name_of_table(tables.size());
    const auto found = state.find(name);
    if (found == state.end()) return tables;
    const core::Tensor& tensor = found->second;
    const bool is_table = tensor.type == core::TensorType::i8 && tensor.shape.size() == 2 &&
                          tensor.shape[0] * tensor.shape[1] == tensor.bytes.size();
    core::require(is_table, "state: " + name, "a table of I8", tensor.shape.size());
    const auto* const signs = reinterpret_cast<const std::int8_t*>(tensor.bytes.data());
    tables.push_back(coding::PatternTable::from_signs({signs, tensor.bytes.size()}, tensor.shape[0],
                                                      tensor.shape[1]));
  }
}

}  // namespace sdnn::agents::detail
