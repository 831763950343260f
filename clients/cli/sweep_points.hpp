/// The points of a sweep: combinations of swept values; and its seeds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace kilotwin::cli {

inline constexpr std::size_t kMostSweepRuns = 100'000;

/// Parses "FIRST..LAST" or one number. Throws UserError, also for more than kMostSweepRuns seeds.
[[nodiscard]] std::vector<std::uint64_t> parse_seeds(const std::string& text);

/// One combination of swept values: "FIELD=V" per swept field, in the order of the arguments.
using SweepPoint = std::vector<std::string>;

/// All combinations of values; the last field runs fastest. Each argument is "FIELD=V1,V2" or, for integers, "FIELD=A..B". Throws
/// UserError.
[[nodiscard]] std::vector<SweepPoint> sweep_points(const std::vector<std::string>& sets);

/// A point as text: "FIELD=V, FIELD=V".
[[nodiscard]] std::string label(const SweepPoint& point);

/// The field of "FIELD=V".
[[nodiscard]] std::string field_of(const std::string& set);
/// The value of "FIELD=V", or nothing if it is not a number.
[[nodiscard]] std::optional<double> number_of(const std::string& set);

}  // namespace kilotwin::cli
