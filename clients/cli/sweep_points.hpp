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

/// All combinations of values; the last field runs fastest. Each argument is "FIELD=VALUES", where VALUES is a list of
///   V           any text
///   A..B        whole numbers
///   A..B:STEP   from A to B, both included where STEP fits
///   log:A..B:N  N numbers from A to B with equal ratios
/// Throws UserError.
[[nodiscard]] std::vector<SweepPoint> sweep_points(const std::vector<std::string>& sets);

/// `count` points that cover all ranges evenly: a Latin hypercube (McKay 1979). Each field's range is cut into `count` cells of equal
/// width, and each cell has one point, at random within it. Each argument is "FIELD=A..B", "FIELD=log:A..B" or "FIELD=V1,V2...". A range
/// between whole numbers gives whole numbers. The same arguments and seed give the same points. Throws UserError.
[[nodiscard]] std::vector<SweepPoint> latin_points(const std::vector<std::string>& sets, std::size_t count,
                                                   std::uint64_t seed);

/// A point as text: "FIELD=V, FIELD=V".
[[nodiscard]] std::string label(const SweepPoint& point);

/// The field of "FIELD=V".
[[nodiscard]] std::string field_of(const std::string& set);
/// The value of "FIELD=V", or nothing if it is not a number.
[[nodiscard]] std::optional<double> number_of(const std::string& set);

}  // namespace kilotwin::cli
