#include "clients/identify/search/calibration_shifts.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/os/worker_pool.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

/// Shift, rotation and scale of the image, then the motion of each driven robot: ahead, sideways, turn.
constexpr int kOwn = 3, kAll = CalibrationShift::kNumbers + kOwn;
using Columns = Eigen::Matrix<double, 3, kAll>;
using Normal = Eigen::Matrix<double, kAll, kAll>;
using Numbers = Eigen::Matrix<double, kAll, 1>;

/// Lever arm that converts rotations and scale changes to mm: about that of robots on a floor of 1 m. It sets the prior
/// of both.
constexpr double kArm_mm = 300;
/// Prior standard deviations: of shifts and of motions of robots, and of a robot's turn. Smaller ones would shrink
/// large shifts.
constexpr double kLargest_mm = 100, kLargest_rad = 1;
/// Bound on the contribution of one track, in half chi squared: five tracks at least make a certain shift.
constexpr double kMostOfATrack = 5;
/// Chance exceeds kCertain in one of 1e5 sets. kBeyondUsual: bound relative to other instants of the set.
constexpr double kCertain = 25, kBeyondUsual = 18;
/// The push must explain this much more to be preferred to a camera shift, nat. It has no rotation and no scale.
constexpr double kClear = 2;
/// Shifts of a set, and instants that are examined for one: they bound the cost. Later shifts stay in the residuals.
constexpr int kMostShifts = 8, kMostLooks = 40;

/// The innovation of one robot at one instant.
struct InstantInnovation {
  double from_s, to_s;
  Eigen::Vector3d whitened;
  Columns columns;  ///< whitened
  bool driven;
};
struct TrackInnovations {
  std::uint32_t run = 0;
  std::vector<InstantInnovation> of;  ///< ascending, with gaps where the track was lost
};

struct Recorder {
  const MotionModel& model;
  TrackInnovations& out;
  double last_s = 0;
  bool driven = false, after_outlier = false;

  void start(const TrackFilter&) {}
  void step(const StepRecord& record) { driven = driven || record.middle.commands.driven(); }
  void update(const Innovation& innovation, const Sample& sample) {
    InstantInnovation s;
    s.from_s = last_s;
    s.to_s = last_s = sample.time_s;
    s.driven = std::exchange(driven, false);
    // An outlier that the filter rejected reappears in the next innovation. That one is not new information.
    const bool again = std::exchange(after_outlier, innovation.weight < 1);
    if (innovation.lost || again || s.to_s <= s.from_s) return;
    // Innovation covariance without the inflation for outliers.
    const Eigen::Matrix3d root = Eigen::Matrix3d(
        (innovation.covariance * innovation.weight).llt().matrixL().solve(Eigen::Matrix3d::Identity()));
    const double seen_x = sample.x_mm - innovation.difference[0], seen_y = sample.y_mm - innovation.difference[1];
    const double c = std::cos(innovation.pose[2]), n = std::sin(innovation.pose[2]);
    s.columns.setZero();
    s.columns.col(0) << 1, 0, 0;
    s.columns.col(1) << 0, 1, 0;
    s.columns.col(2) << -seen_y / kArm_mm, seen_x / kArm_mm, 1 / kArm_mm;
    s.columns.col(3) << seen_x / kArm_mm, seen_y / kArm_mm, 0;
    if (s.driven) {
      s.columns.col(4) << c, n, 0;
      s.columns.col(5) << -n, c, 0;
      s.columns.col(6) << 0, 0, 1;
    }
    if (innovation.size == 2) s.columns.row(2).setZero();
    s.columns = root * s.columns;
    s.whitened = root * innovation.difference;
    if (innovation.size == 2) {
      s.columns.row(2).setZero();
      s.whitened[2] = 0;
    }
    out.of.push_back(s);
  }
};

std::vector<TrackInnovations> innovations_of(const Fitter& fitter, const FitState& state) {
  const MotionModel& model = state.model;
  std::vector<const TrackView*> views;
  for (const TrackView& view : state.tracks.views())
    if (!view.track->held_out) views.push_back(&view);
  std::vector<TrackInnovations> all(views.size());
  os::in_parallel(views.size(), fitter.threads(), [&](std::size_t i) {
    const TrackView& view = *views[i];
    RobotBias bias = model.bias_of(view.track->robot);
    bias.covariance.setZero();
    TrackFilter filter(model, bias, view.track->robot, view.number);
    all[i].run = view.number;
    Recorder recorder{model, all[i], view.track->samples.front().time_s};
    run_filter(filter, view, view.track->samples.size(), recorder);
  });
  return all;
}

/// Competing explanations: each robot's own motion only, a camera shift, a push of the driven robots.
enum class Explanation { kRobotsOnly, kCamera, kPush };

/// Joint innovations of all robots at one instant.
class Instant {
 public:
  explicit Instant(std::vector<const InstantInnovation*> seen) : seen_(std::move(seen)) {}

  /// Robust least squares.
  [[nodiscard]] Numbers fit(Explanation explanation, Normal* information = nullptr) const {
    Numbers at = Numbers::Zero();
    constexpr int kPasses = 4;  // of reweighting; bounds the cost per instant
    for (int pass = 0; pass < kPasses; ++pass) {
      Normal normal = prior();
      Numbers score = Numbers::Zero();
      for (const InstantInnovation* s : seen_) {
        const Columns columns = allowed(*s, explanation);
        const double far = (s->whitened - columns * at).squaredNorm();
        constexpr double kGate = 12;  // chi squared with three degrees exceeds this in 0.7 % of the innovations
        const double weight = far > kGate ? kGate / far : 1;
        normal.noalias() += weight * columns.transpose() * columns;
        score.noalias() += weight * columns.transpose() * s->whitened;
      }
      at = normal.llt().solve(score);
      if (information != nullptr) *information = normal;
    }
    return at;
  }
  /// Gain in log likelihood of one explanation over another.
  [[nodiscard]] double gain(Explanation explanation, const Numbers& at, Explanation than,
                            const Numbers& than_at) const {
    double sum = 0;
    for (const InstantInnovation* s : seen_) {
      const double with = (s->whitened - allowed(*s, explanation) * at).squaredNorm(),
                   without = (s->whitened - allowed(*s, than) * than_at).squaredNorm();
      sum += std::clamp((without - with) / 2, -kMostOfATrack, kMostOfATrack);
    }
    return sum;
  }

 private:
  static Normal prior() {
    Numbers precision;
    // Prior precision: its standard deviation is the largest shift; a larger value pulls shifts towards 0.
    constexpr double kMm = 1 / (kLargest_mm * kLargest_mm);
    precision << kMm, kMm, kMm, kMm, kMm, kMm, 1 / (kLargest_rad * kLargest_rad);
    return precision.asDiagonal();
  }
  static Columns allowed(const InstantInnovation& s, Explanation explanation) {
    Columns columns = s.columns;
    if (explanation == Explanation::kRobotsOnly || (explanation == Explanation::kPush && !s.driven))
      columns.leftCols<4>().setZero();
    if (explanation == Explanation::kPush) columns.middleCols<2>(2).setZero();
    return columns;
  }
  std::vector<const InstantInnovation*> seen_;
};

/// All instants of one run, or of all runs, on a raster finer than the samples.
class Scan {
 public:
  Scan(const std::vector<TrackInnovations>& all, std::optional<std::uint32_t> run) : run_(run) {
    for (const TrackInnovations& track : all)
      if (!run || track.run == *run) tracks_.push_back(&track);
  }
  [[nodiscard]] Instant at(double time_s) const {
    std::vector<const InstantInnovation*> seen;
    for (const TrackInnovations* track : tracks_) {
      const auto end = std::lower_bound(track->of.begin(), track->of.end(), time_s,
                                        [](const InstantInnovation& s, double t) { return s.to_s < t; });
      if (end != track->of.end() && end->from_s < time_s) seen.push_back(&*end);
    }
    return Instant(std::move(seen));
  }
  [[nodiscard]] std::optional<std::uint32_t> run() const { return run_; }

 private:
  std::vector<const TrackInnovations*> tracks_;
  std::optional<std::uint32_t> run_;
};

struct Candidate {
  double time_s, gain;
  Eigen::Vector4d size;
  Eigen::Matrix4d covariance;
};

Candidate candidate_at(const Scan& scan, double time_s) {
  const Instant instant = scan.at(time_s);
  Normal information;
  const Numbers own = instant.fit(Explanation::kRobotsOnly),
                picture = instant.fit(Explanation::kCamera, &information);
  return {time_s, instant.gain(Explanation::kCamera, picture, Explanation::kRobotsOnly, own), picture.head<4>(),
          information.inverse().topLeftCorner<4, 4>()};
}

/// Variance of shifts at most instants, beyond their expected variance.
Eigen::Vector4d usual_excess(const std::vector<Candidate>& all) {
  Eigen::Vector4d excess;
  for (int i = 0; i < 4; ++i) {
    std::vector<double> squares, expected;
    for (const Candidate& c : all) {
      squares.push_back(c.size[i] * c.size[i]);
      expected.push_back(c.covariance(i, i));
    }
    constexpr double kMedianOfChiSquared = 0.4549;  // with one degree of freedom: most instants have no shift
    excess[i] = std::max(0.0, stats::upper_median(squares) / kMedianOfChiSquared - stats::upper_median(expected));
  }
  return excess;
}

/// Whether frames well before or after the instant also move: then the displacement is gradual, as by wind. Just
/// after a shift the filter has not converged.
bool lasts(const Scan& scan, const Candidate& found, double frame_s) {
  const Eigen::Matrix4d information = found.covariance.inverse();
  const Eigen::Vector4d along = information * found.size;
  const double all = found.size.dot(along);
  const auto share = [&](int from, int to) {
    double sum = 0;
    for (int k = from; k <= to; ++k) sum += candidate_at(scan, found.time_s + k * frame_s).size.dot(along) / all;
    return sum / (to - from + 1);
  };
  // Mean share of the displacement that other frames show. Noise alone gives about 0. A larger one takes gusts for
  // shifts.
  constexpr double kMuch = 0.3;
  return share(-6, -2) > kMuch || share(4, 8) > kMuch;
}

/// Midpoint of the instants between two frames that give the same result.
double middle_of(const Scan& scan, const Candidate& found, double step_s) {
  double low = found.time_s, high = found.time_s;
  constexpr int kFine = 10;  // parts of a step of the raster: the precision of the instant
  const auto same = [&](double t) { return std::abs(candidate_at(scan, t).gain - found.gain) < 1e-9; };
  for (int i = 1; i < kFine && same(found.time_s - i * step_s / kFine); ++i)
    low = found.time_s - i * step_s / kFine;
  for (int i = 1; i < kFine && same(found.time_s + i * step_s / kFine); ++i)
    high = found.time_s + i * step_s / kFine;
  return (low + high) / 2;
}

}  // namespace

std::optional<CalibrationShift> find_calibration_shift(const Fitter& fitter, const FitState& state,
                                                       double least_gain) {
  const std::vector<TrackInnovations> all = innovations_of(fitter, state);
  std::vector<std::uint32_t> runs;
  std::vector<double> steps;
  double from_s = 1e300, to_s = -1e300;
  for (const TrackInnovations& track : all) {
    if (std::find(runs.begin(), runs.end(), track.run) == runs.end()) runs.push_back(track.run);
    for (const InstantInnovation& s : track.of) steps.push_back(s.to_s - s.from_s);
    if (track.of.empty()) continue;
    from_s = std::min(from_s, track.of.front().from_s);
    to_s = std::max(to_s, track.of.back().to_s);
  }
  constexpr std::size_t kFewest = 20;  // innovations, and instants: fewer give no usual variance of displacements
  if (steps.size() < kFewest) return std::nullopt;
  constexpr int kMostInstants = 20000;  // bounds the cost: long recordings get a raster coarser than half a frame
  const double frame_s = stats::upper_median(steps);
  const double step_s = std::max(frame_s / 2, (to_s - from_s) / kMostInstants);

  std::vector<Scan> scans{Scan(all, std::nullopt)};
  if (runs.size() > 1)
    for (const std::uint32_t run : runs) scans.emplace_back(all, run);
  struct Look {
    const Scan* scan;
    Candidate candidate;
  };
  std::vector<Look> looks;
  for (const Scan& scan : scans) {
    const auto count = static_cast<std::size_t>((to_s - from_s) / step_s);
    if (count < kFewest) return std::nullopt;
    std::vector<Candidate> of(count);
    os::in_parallel(count, fitter.threads(), [&](std::size_t i) {
      // Off the midpoint between frames, so that the raster does not coincide with regular frames.
      of[i] = candidate_at(scan, from_s + (static_cast<double>(i) + 0.47) * step_s);
    });
    const Eigen::Vector4d excess = usual_excess(of);
    for (const Candidate& c : of) {
      // A shift needs a few frames on both sides. Otherwise it is an outlier frame.
      constexpr double kFrames = 3;
      if (c.time_s < from_s + kFrames * frame_s || c.time_s > to_s - kFrames * frame_s) continue;
      if (c.gain < std::max(kCertain, least_gain)) continue;
      const Eigen::Matrix4d usual = c.covariance + Eigen::Matrix4d(excess.asDiagonal());
      if (c.size.dot(usual.ldlt().solve(c.size)) / 2 > kBeyondUsual) looks.push_back({&scan, c});
    }
  }
  std::stable_sort(looks.begin(), looks.end(),
                   [](const Look& a, const Look& b) { return a.candidate.gain > b.candidate.gain; });
  for (std::size_t i = 0; i < std::min<std::size_t>(looks.size(), kMostLooks); ++i) {
    const auto& [scan, found] = looks[i];
    if (lasts(*scan, found, frame_s)) continue;
    const Instant instant = scan->at(found.time_s);
    const Numbers picture = instant.fit(Explanation::kCamera), push = instant.fit(Explanation::kPush),
                  own = instant.fit(Explanation::kRobotsOnly);
    const double as_push = instant.gain(Explanation::kPush, push, Explanation::kRobotsOnly, own);
    if (instant.gain(Explanation::kPush, push, Explanation::kCamera, picture) > kClear) continue;
    CalibrationShift shift;
    shift.time_s = middle_of(*scan, found, step_s);
    shift.run = scan->run();
    shift.size = found.size;
    shift.size.tail<2>() /= kArm_mm;
    shift.sd = found.covariance.diagonal().cwiseSqrt();
    shift.sd.tail<2>() /= kArm_mm;
    shift.gain = found.gain;
    shift.gain_as_push = as_push;
    return shift;
  }
  return std::nullopt;
}

namespace {

constexpr std::array kTargets = {Target::kMeasuredX, Target::kMeasuredY, Target::kMeasuredTurn,
                                 Target::kMeasuredScale};

/// Shifts as steps in time: those of all runs first, then run by run.
Term term_of(const std::vector<CalibrationShift>& shifts, const std::array<bool, 4>& components) {
  std::vector<std::optional<std::uint32_t>> scopes;
  for (const CalibrationShift& shift : shifts)
    if (std::find(scopes.begin(), scopes.end(), shift.run) == scopes.end()) scopes.push_back(shift.run);
  Term term{kCalibrationShiftsName, {}, {}, {}};
  std::vector<double> coefficients, precision;
  for (const auto& scope : scopes) {
    std::vector<const CalibrationShift*> own;
    for (const CalibrationShift& shift : shifts)
      if (shift.run == scope) own.push_back(&shift);
    std::sort(own.begin(), own.end(),
              [](const CalibrationShift* a, const CalibrationShift* b) { return a->time_s < b->time_s; });
    Factor steps;
    steps.shape = Factor::Shape::kAtLeast;
    steps.axis.of = Covariate::kTime;
    for (const CalibrationShift* shift : own) steps.points.push_back(shift->time_s);
    Basis basis{{steps}};
    if (scope) {
      Factor which;
      which.shape = Factor::Shape::kTable;
      which.axis.of = Covariate::kRun;
      which.points = {static_cast<double>(*scope)};
      basis.factors.insert(basis.factors.begin(), which);
    }
    for (std::size_t t = 0; t < kTargets.size(); ++t) {
      if (!components[t]) continue;
      term.blocks.push_back({kTargets[t], basis, kAlways});
      for (const CalibrationShift* shift : own) {
        coefficients.push_back(shift->size[static_cast<Eigen::Index>(t)]);
        // Prior standard deviations, mm, and rad or relative: far above those of a shift that was found, so that the
        // fit moves freely.
        constexpr double kShiftSd_mm = 50, kTurnSd = 0.2;
        const double sd = t < 2 ? kShiftSd_mm : kTurnSd;
        precision.push_back(1 / (sd * sd));
      }
    }
  }
  const auto n = static_cast<Eigen::Index>(coefficients.size());
  term.coefficients = Eigen::Map<Eigen::VectorXd>(coefficients.data(), n);
  term.precision = Eigen::Map<Eigen::VectorXd>(precision.data(), n);
  return term;
}

}  // namespace

std::vector<CalibrationShift> add_calibration_shifts(const Fitter& fitter, FitState& state, double least_gain) {
  MotionModel& model = state.model;
  const std::size_t place = model.terms.size();
  std::vector<CalibrationShift> shifts;
  for (bool fitted = false; static_cast<int>(shifts.size()) < kMostShifts;) {
    const std::optional<CalibrationShift> found = find_calibration_shift(fitter, state, least_gain);
    if (!found) {
      // Noise that was fitted without shifts is too large and may hide smaller ones.
      if (shifts.empty() || fitted) break;
      fitter.fit(state, 2);
      fitted = true;
      continue;
    }
    shifts.push_back(*found);
    MotionModel with = model;
    with.terms.resize(place);
    // Displacement always; rotation and scale only if some shift needs them.
    constexpr double kNeeded = 4;  // standard deviations; smaller components would follow noise in every shift
    std::array<bool, 4> components{true, true, false, false};
    for (const CalibrationShift& shift : shifts)
      for (Eigen::Index t = 2; t < 4; ++t)
        components[static_cast<std::size_t>(t)] =
            components[static_cast<std::size_t>(t)] || std::abs(shift.size[t]) > kNeeded * shift.sd[t];
    with.terms.push_back(term_of(shifts, components));
    model = with;
    fitted = false;
  }
  return shifts;
}

}  // namespace kilotwin::identify
