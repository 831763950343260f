/// How large a picture is that is put straight. Tracks alone do not tell: in a picture that shows all larger, robots are as much
/// faster. Lengths that are known do: discs that touch are two radii apart.
#pragma once

#include <optional>
#include <vector>

#include "clients/identify/model/motion_model.hpp"
#include "clients/identify/model/neighbours.hpp"

namespace kilotwin::identify {

/// How far apart the centres of robots are that touch.
struct TouchingApart {
  double mm = 0, sd_mm = 0;  ///< of what touching is by chance and by how discs are made
  std::size_t meetings = 0;  ///< of two robots in one run
};

/// A pair of robots at an instant.
struct Pair {
  double apart_mm = 0;
  std::size_t meeting = 0;    ///< by number: what one pair does within a while is no new evidence
  double x_mm = 0, y_mm = 0;  ///< the middle between them
  Situation at;               ///< when, and in which run
};

/// Where distances begin: robots stay at the distance at which they touch, and none come nearer. Nothing where it does not show.
[[nodiscard]] std::optional<TouchingApart> touching_apart(const std::vector<Pair>&);

/// All pairs of a run that came near each other; `number` is that of the run.
void add_pairs(const RunNeighbours&, std::size_t robots, std::uint32_t number, std::vector<Pair>& to);

/// Keeps the scale of a picture that is put straight while its map is fitted anew: places in the picture that lie as far from
/// each other in the room as before, on the average.
class ScaleHold {
 public:
  /// About where pairs met.
  ScaleHold(const MotionModel&, const std::vector<Pair>&, double relative_sd);
  [[nodiscard]] double relative_sd() const { return relative_sd_; }
  /// So many times as long must all lengths in the room become.
  [[nodiscard]] double factor(const MotionModel&) const;

 private:
  struct Span {
    Situation at;
    double x_mm[2], y_mm[2];  ///< of its ends, in the picture
  };
  [[nodiscard]] double log_length(const MotionModel&) const;  ///< mean of all
  std::vector<Span> spans_;
  double then_ = 0, relative_sd_ = 0;
};

/// The walls of the model, where another picture of them has them: they are seen where they were seen before.
[[nodiscard]] Room carried(const Room&, const MotionModel& before, const MotionModel& after);

/// The same model with all lengths in the room `factor` times as long, and the picture as it was, about the middle of the map
/// of the picture. False, and the model as it was, where it has no map that could take it up.
bool rescale(MotionModel&, double factor);
/// By how much such a map makes the picture larger (logarithm of the scale) with each coefficient of all terms, in order; none where
/// it has no such map.
[[nodiscard]] Eigen::VectorXd log_scale_by_coefficients(const MotionModel&);

}  // namespace kilotwin::identify
