/// The tracks of a set with what belongs to each: commands, neighbours, where it started to point; ready to be walked along.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "clients/identify/fit/filter_pass.hpp"

namespace kilotwin::identify {

struct Pair;

/// How often the nearest robot was so near that discs would overlap, and a little farther away.
struct Meetings {
  static constexpr double kRing_mm = 55;
  /// Well within two radii, so that no lens makes robots that touch look as if they overlapped.
  static constexpr double kInside_mm = 0.85 * kDiscs_mm;
  /// Such a share within, and robots do not feel each other.
  static constexpr double kUnhindered = 0.6;
  std::size_t within = 0, near = 0;
  /// Of what there would be within if robots did not feel each other, by areas; 0.2 where few have met.
  [[nodiscard]] double share_within() const {
    constexpr double kInner = kInside_mm * kInside_mm, kOuter = kRing_mm * kRing_mm - kTouch_mm * kTouch_mm;
    constexpr double kFew = 10;
    return (static_cast<double>(within) + 0.2 * kFew) / (static_cast<double>(near) * kInner / kOuter + kFew);
  }
};

/// The tracks of a set, ready to be walked along.
class PreparedSet {
 public:
  /// Runs are numbered from `first_number` on: no run of one set is one of another.
  explicit PreparedSet(const MeasuredSet&, std::uint32_t first_number = 0);

  [[nodiscard]] const MeasuredSet& set() const { return *set_; }
  [[nodiscard]] std::vector<TrackView>& views() { return views_; }
  [[nodiscard]] const std::vector<TrackView>& views() const { return views_; }
  [[nodiscard]] const RunNeighbours& neighbours(std::size_t run) const { return *neighbours_[run]; }
  /// The tracks that may be fitted to, by unit: by robot, or each for itself where there are fewer than six robots.
  [[nodiscard]] std::vector<std::vector<const TrackView*>> units() const;
  /// Looks again at where discs are, which is not where they are measured, for what robots see of each other.
  void find_centres(const MotionModel&, std::uint32_t threads);
  /// What was found of tracks: where discs are, and headings at starts.
  struct Found {
    std::vector<std::vector<Centres>> centres;          ///< by run; none: where they were measured
    std::vector<std::pair<double, double>> starts_rad;  ///< of each view: the heading, and its standard deviation
  };
  [[nodiscard]] Found found() const;
  /// All as it was when that was found, but for what floors remember, which is by the model's cells.
  void go_back(const Found&, const MotionModel&);
  /// Looks again at what floors remember, in cells of the model's sizes.
  void remember(const MotionModel&);
  [[nodiscard]] Meetings meetings() const;
  /// Robots that came near each other, by where discs are.
  [[nodiscard]] std::vector<Pair> pairs() const;
  /// Finds the heading at the start of each track: as measured, or by which of many would best explain what follows.
  void find_headings(const MotionModel&, std::uint32_t threads);

 private:
  const MeasuredSet* set_;
  std::uint32_t first_number_;
  std::vector<std::unique_ptr<RunNeighbours>> neighbours_;
  std::vector<std::vector<Centres>>
      centres_;  ///< by which neighbours were found last; none: where they were measured
  std::vector<TrackView> views_;
};

}  // namespace kilotwin::identify
