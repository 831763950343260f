/// The runs of a sweep: combinations of swept values, and seeds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace kilotwin::cli {

inline constexpr std::size_t kMostSweepRuns = 100'000;

/// "FIRST..LAST", or one number; at most kMostSweepRuns. Throws UserError.
[[nodiscard]] std::vector<std::uint64_t> parse_seeds(const std::string& text);

/// One combination of swept values: "FIELD=V" per swept field, in the order of the arguments.
using SweepPoint = std::vector<std::string>;

/// "FIELD=V1,V2" or, for integers, "FIELD=A..B", each argument a field: all combinations, the last field fastest. Throws
/// UserError.
[[nodiscard]] std::vector<SweepPoint> sweep_points(const std::vector<std::string>& sets);

/// "FIELD=V, FIELD=V"
[[nodiscard]] std::string label(const SweepPoint& point);

/// The field's name and its value at a point, where that is a number.
[[nodiscard]] std::string field_of(const std::string& set);
[[nodiscard]] std::optional<double> number_of(const std::string& set);

}  // namespace kilotwin::cli
