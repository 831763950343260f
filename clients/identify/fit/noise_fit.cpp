#include "clients/identify/fit/noise_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "clients/identify/fit/linearisation.hpp"
#include "clients/identify/fit/noise_samples.hpp"
#include "clients/identify/fit/profile.hpp"
#include "core/os/worker_pool.hpp"
#include "core/stats/distributions.hpp"
#include "core/stats/moments.hpp"

namespace kilotwin::identify {
namespace {

using namespace fitted_variance;
constexpr std::size_t kSpreading = kPosition;  ///< number of process noises
using NoiseVector = FittedVariances;           ///< of their logarithms, where nothing else is said
using PoseByBias = Eigen::Matrix<double, 3, 2>;

/// A lower variance has no influence; a higher one hides everything. Units as in Noise, in the order of the fitted
/// variances.
constexpr std::array<double, kCount> kLeast = {1e-6, 1e-4, 1e-8, 1e-6, 1e-4, 1e-6},
                                     kMost = {1, 100, 1, 100, 1e4, 10};

NoiseVector logs_of(const Noise& noise) { return fitted_variances(noise).array().log(); }
/// Variances within bounds.
NoiseVector variances(const NoiseVector& logs) {
  NoiseVector v;
  for (Eigen::Index i = 0; i < kCount; ++i) {
    const auto k = static_cast<std::size_t>(i);
    v[i] = std::clamp(std::exp(logs[i]), kLeast[k], kMost[k]);
  }
  return v;
}
/// From one measurement to the next, linearised about the filter's path.
struct FilterInterval {
  FilterInterval() {
    for (Eigen::Matrix3d& m : spread) m.setZero();
  }
  Eigen::Matrix3d transition = Eigen::Matrix3d::Identity();  ///< of the pose
  /// By how much the pose at the end moves with the biases in this interval.
  PoseByBias by_bias = PoseByBias::Zero();
  /// Process noise covariance per unit of each variance, and the part that is not fitted.
  std::array<Eigen::Matrix3d, kSpreading> spread;
  Eigen::Matrix3d more = Eigen::Matrix3d::Zero();
  // The measurement at the end of the interval.
  double time_s = 0;
  int size = 0;
  Eigen::Matrix3d jacobian = Eigen::Matrix3d::Zero();
  /// Innovation along the path, and the correction that it applied.
  Eigen::Vector3d difference = Eigen::Vector3d::Zero(), correction = Eigen::Vector3d::Zero();
  bool counts = true;  ///< false: the recursion restarts here with this covariance
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

class Recorder {
 public:
  explicit Recorder(double wheel_base_mm) : wheel_base_mm_(wheel_base_mm) {}
  Eigen::Matrix3d first;  ///< covariance of the pose at the first sample
  std::vector<FilterInterval> stretches;

  void start(const TrackFilter& filter) {
    filter_ = &filter;
    first = filter.belief().covariance.topLeftCorner<3, 3>();
    begin();
  }
  void step(const StepRecord& record) {
    in_contact_ = in_contact_ || record.in_contact();
    const StepJacobian ways = step_jacobian(record, wheel_base_mm_);
    const auto carry = [&](auto& m) {
      m.row(0) += ways.by_heading[0] * m.row(2);
      m.row(1) += ways.by_heading[1] * m.row(2);
    };
    const auto carry_covariance = [&](Eigen::Matrix3d& m) {
      carry(m);
      m.col(0) += ways.by_heading[0] * m.col(2);
      m.col(1) += ways.by_heading[1] * m.col(2);
    };
    carry(now_.transition);
    carry(now_.by_bias);
    for (Eigen::Matrix3d& m : now_.spread) carry_covariance(m);
    carry_covariance(now_.more);
    const double h = record.h_s;
    now_.spread[kDrift](0, 0) += h;
    now_.spread[kDrift](1, 1) += h;
    now_.more(2, 2) += TrackFilter::kLeastTurn_rad2_s * h;
    if (!record.middle.commands.driven()) return;
    now_.by_bias +=
        h * ways.by_wheel * Eigen::Vector2d(record.rates.left_gain, record.rates.right_gain).asDiagonal();
    now_.spread[kFactor] +=
        ways.by_wheel * (h * record.rates.driven_mm_s().cwiseAbs2()).asDiagonal() * ways.by_wheel.transpose();
    now_.spread[kWheel] += h * ways.by_wheel * ways.by_wheel.transpose();
    now_.spread[kHeading](2, 2) += h;
  }
  void update(const Innovation& innovation, const Sample& sample) {
    now_.time_s = sample.time_s;
    now_.size = innovation.size;
    now_.jacobian = innovation.jacobian;
    now_.difference = innovation.difference;
    now_.correction = innovation.gain.topRows<3>() * innovation.difference;
    now_.counts = !innovation.lost && !in_contact_;
    now_.covariance = filter_->belief().covariance.topLeftCorner<3, 3>();
    stretches.push_back(now_);
    begin();
  }

 private:
  void begin() {
    now_ = FilterInterval();
    in_contact_ = false;
  }
  const double wheel_base_mm_;
  const TrackFilter* filter_ = nullptr;
  FilterInterval now_;
  bool in_contact_ = false;
};

struct Path {
  Eigen::Matrix3d first;
  double position_mm2;  ///< part of `first`
  std::vector<FilterInterval> stretches;
  std::uint32_t robot;
};

/// Score and information of a robot's biases.
struct BiasSums {
  Eigen::Vector2d score = Eigen::Vector2d::Zero();
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
};

Path path_of(const MotionModel& model, const TrackView& view) {
  RobotBias bias = model.bias_of(view.track->robot);
  bias.covariance.setZero();
  TrackFilter filter(model, bias, view.track->robot, view.number);
  Recorder recorder(model.base.wheel_base_mm);
  run_filter(filter, view, view.track->samples.size(), recorder);
  return {recorder.first, model.noise.position_mm2, std::move(recorder.stretches), view.track->robot};
}

/// Log likelihood of a path's measurements under other variances, and about the model's biases. each(time, value): of each
/// measurement.
template <class Each>
double log_likelihood(const Path& path, const NoiseVector& variance, BiasSums* biases, Each&& each) {
  double sum = 0;
  Eigen::Matrix3d p = path.first;
  p(0, 0) += variance[kPosition] - path.position_mm2;
  p(1, 1) += variance[kPosition] - path.position_mm2;
  Eigen::Vector3d off = Eigen::Vector3d::Zero();  // of the mean from the path
  PoseByBias by_bias = PoseByBias::Zero();
  for (const FilterInterval& s : path.stretches) {
    if (!s.counts) {
      p = s.covariance;
      off.setZero();
      by_bias.setZero();
      continue;
    }
    off = (s.transition * off).eval();
    Eigen::Matrix3d moved = s.transition * p;
    p.noalias() = moved * s.transition.transpose();
    p += s.more;
    for (std::size_t i = 0; i < kSpreading; ++i) p += variance[static_cast<Eigen::Index>(i)] * s.spread[i];
    const Eigen::Matrix3d ph = p * s.jacobian.transpose();
    Eigen::Matrix3d seen = s.jacobian * ph;
    seen(0, 0) += variance[kPosition];
    seen(1, 1) += variance[kPosition];
    seen(2, 2) = s.size == 3 ? seen(2, 2) + variance[kMeasuredHeading] : 1;
    const Eigen::Vector3d difference = s.difference - s.jacobian * off;
    Eigen::Matrix3d inverse = seen.inverse();
    const double distance2 = difference.dot(inverse * difference);
    const double factor = outlier_factor(distance2, s.size);
    // Bound on one sample, so that none decides alone. It is also the value of a covariance that is not positive
    // definite.
    constexpr double kLeastValue = -1e3;
    const double value = std::max(
        kLeastValue, -0.5 * (std::log(seen.determinant()) + s.size * std::log(factor) + distance2 / factor));
    sum += value;
    each(s.time_s, value);
    inverse /= factor;
    const Eigen::Matrix3d gain = ph * inverse;
    if (biases != nullptr) {
      by_bias = (s.transition * by_bias + s.by_bias).eval();
      PoseByBias seen_by_bias = s.jacobian * by_bias;
      if (s.size < 3) seen_by_bias.row(2).setZero();
      biases->score.noalias() += seen_by_bias.transpose() * (inverse * difference);
      biases->information.noalias() += seen_by_bias.transpose() * inverse * seen_by_bias;
      by_bias.noalias() -= gain * seen_by_bias;
    }
    off += gain * difference - s.correction;
    p.noalias() -= gain * ph.transpose();
    p = (0.5 * (p + p.transpose())).eval();
  }
  return sum;
}

double log_likelihood(const Path& path, const NoiseVector& variance, BiasSums* biases) {
  return log_likelihood(path, variance, biases, [](double, double) {});
}

/// Log likelihood by stretches of a path that hardly depend on each other.
std::vector<double> by_stretches(const Path& path, const NoiseVector& variance) {
  std::map<double, double> sums;
  log_likelihood(path, variance, nullptr,
                 [&](double time_s, double value) { sums[std::floor(time_s / kNoiseStretch_s)] += value; });
  std::vector<double> out;
  out.reserve(sums.size());
  for (const auto& [stretch, sum] : sums) out.push_back(sum);
  return out;
}

/// Weak prior about the default noise: bounds the search where the data say nothing. Its standard deviation of 6 is a
/// factor of 400 of a variance. A narrower one would pull what the data tell.
double log_prior(const NoiseVector& logs) {
  constexpr double kWeak = 1.0 / (6 * 6);
  static const NoiseVector middle = logs_of(Noise{});
  return -0.5 * kWeak * (logs - middle).squaredNorm();
}

/// The biases of the robots, which are integrated over: what they can follow is no noise.
struct Biases {
  double precision = 0;                     ///< of their prior
  std::vector<std::size_t> robot_of_path;   ///< index in `from_prior`
  std::vector<Eigen::Vector2d> from_prior;  ///< prior mean less the model's value, by robot
};

Biases biases_of(const MotionModel& model, const std::vector<Path>& paths) {
  Biases out;
  out.precision = 1 / (model.base.bias_sd_mm_s * model.base.bias_sd_mm_s);
  std::map<std::uint32_t, std::size_t> places;
  for (const Path& path : paths) {
    const auto [at, is_new] = places.emplace(path.robot, places.size());
    if (is_new)
      out.from_prior.emplace_back(Eigen::Vector2d::Constant(model.base.bias_mean_mm_s) -
                                  model.bias_of(path.robot).mean_mm_s);
    out.robot_of_path.push_back(at->second);
  }
  return out;
}

/// Estimates beside the noise, which are integrated over.
struct Estimated {
  Biases biases;
  NoiseRestriction columns;
};

/// Maximisation of a likelihood over the logarithms of the variances. With `estimated` it is the marginal likelihood over biases and
/// columns, in Laplace's approximation; without, they are known.
class Climb {
 public:
  Climb(const std::vector<Path>& paths, const Estimated* estimated, bool has_headings, std::uint32_t threads)
      : paths_(paths), estimated_(estimated), has_headings_(has_headings), threads_(threads) {
    for (const Path& path : paths) samples_ += path.stretches.size();
  }

  using Square = Eigen::Matrix<double, kCount, kCount>;
  /// Settings of a search: the variance that stays (-1: none), the most steps, the gain at which it ends, and the inverse curvature at
  /// its start.
  struct Search {
    Eigen::Index fixed = -1;
    int most_steps = 20;
    double settled = 0.3;  ///< nat; a search from near, or a further round, gains the rest
    Square inverse = Square::Zero();
  };
  [[nodiscard]] Search from_afar() const {
    // A log variance from n samples has the standard deviation sqrt(2 / n).
    Search search;
    search.inverse = Square::Identity() / std::max<double>(10, 0.1 * static_cast<double>(samples_));
    return search;
  }
  /// With the negative second derivatives `curvature` near the maximum.
  [[nodiscard]] Search from_near(const Eigen::MatrixXd& curvature, Eigen::Index fixed) const {
    // kFlattest: least curvature of a direction, at which a log variance has the standard deviation 1.4. Flatter ones
    // would take far steps. kSettled: 1 % of the drop at the end of a 95 % interval. A larger one shifts these ends.
    constexpr double kFlattest = 0.5, kSettled = 0.02;
    constexpr int kMostSteps = 8;  // bounds the cost: each end of a profile takes several searches
    Search search{fixed, kMostSteps, kSettled, Square::Zero()};
    Eigen::MatrixXd others = curvature;
    if (fixed >= 0) {
      others.row(fixed).setZero();
      others.col(fixed).setZero();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(others);
    const Eigen::VectorXd inverse = parts.eigenvalues().cwiseMax(kFlattest).cwiseInverse();
    search.inverse.topLeftCorner(size(), size()) =
        parts.eigenvectors() * inverse.asDiagonal() * parts.eigenvectors().transpose();
    return search;
  }

  /// Moves to the maximum by quasi-Newton steps (BFGS), and returns the value there.
  double operator()(NoiseVector& at, Search search) const {
    // A step changes no variance by more than a factor exp(1.5) = 4.5: the quadratic form hardly holds farther.
    constexpr double kLongest = 1.5;
    // A step that gains nothing is shortened, down to 0.2 % of its length. The number of trials bounds the cost of the
    // last step.
    constexpr int kMostShortened = 6;
    constexpr double kShorter = 0.3;
    // Least curvature along a step that updates the inverse: below, rounding errors of the gradients decide.
    constexpr double kLeastAlong = 1e-9;
    double value = values({at}).front();
    NoiseVector gradient = gradient_at(at, value, search.fixed);
    for (int step = 0; step < search.most_steps; ++step) {
      NoiseVector move = search.inverse * gradient;
      if (search.fixed >= 0) move[search.fixed] = 0;
      const double longest = move.cwiseAbs().maxCoeff();
      if (longest > kLongest) move *= kLongest / longest;
      bool better = false;
      double gained = 0;
      for (int shortened = 0; shortened < kMostShortened; ++shortened, move *= kShorter) {
        const double found = values({at + move}).front();
        if (!(found > value)) continue;
        gained = found - value;
        value = found;
        better = true;
        break;
      }
      if (!better) break;
      at += move;
      if (gained < search.settled) break;
      const NoiseVector next = gradient_at(at, value, search.fixed);
      const NoiseVector change = gradient - next;  // of the negative objective
      const double along = change.dot(move);
      if (along > kLeastAlong) {
        const Square side = Square::Identity() - move * change.transpose() / along;
        search.inverse = (side * search.inverse * side.transpose() + move * move.transpose() / along).eval();
      }
      gradient = next;
    }
    return value;
  }

  [[nodiscard]] double value(const NoiseVector& at) const { return values({at}).front(); }

  /// Negative second derivatives at the maximum.
  [[nodiscard]] Eigen::MatrixXd curvature(const NoiseVector& at) const {
    // In logarithms. Smaller steps suffer from cancellation, larger ones from the third derivative.
    constexpr double kStep = 0.15;
    const Eigen::Index count = size();
    std::vector<NoiseVector> trials{at};
    const auto add = [&](Eigen::Index i, double by, Eigen::Index j, double and_by) {
      trials.push_back(at);
      trials.back()[i] += by;
      trials.back()[j] += and_by;
    };
    for (Eigen::Index i = 0; i < count; ++i)
      for (Eigen::Index j = 0; j <= i; ++j)
        for (const double by : {kStep, -kStep})
          for (const double and_by : {kStep, -kStep}) add(i, by, j, and_by);
    const std::vector<double> found = values(trials);
    Eigen::MatrixXd out(count, count);
    auto next = found.begin() + 1;
    for (Eigen::Index i = 0; i < count; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j, next += 4)
        out(i, j) = out(j, i) = -(next[0] - next[1] - next[2] + next[3]) / (4 * kStep * kStep);
    }
    return out;
  }

  /// By which factor the drop at the ends of an interval exceeds that of a perfect model and of many data. The scores of stretches
  /// along a direction may vary more than the curvature expects (Kent 1982), and few stretches tell little.
  [[nodiscard]] double widening(const NoiseVector& at, const NoiseVector& along) const {
    constexpr double kStep = 0.05;  // in logarithms, along the ridge
    // Fewest stretches whose dispersion counts. Fewer widen the drop by Student's factor for eight, 1.46.
    constexpr double kFewest = 8;
    const NoiseVector up = variances(at + kStep * along), down = variances(at - kStep * along);
    stats::Moments scores;
    for (const Path& path : paths_) {
      const std::vector<double> higher = by_stretches(path, up), lower = by_stretches(path, down);
      for (std::size_t k = 0; k < higher.size(); ++k) scores.add((higher[k] - lower[k]) / (2 * kStep));
    }
    const std::vector<double> three = values({at + kStep * along, at, at - kStep * along});
    const double curvature = (2 * three[1] - three[0] - three[2]) / (kStep * kStep);
    const auto count = static_cast<double>(scores.count());
    const double of_scores = count * scores.standard_deviation() * scores.standard_deviation();
    const double dispersion = count < kFewest || curvature <= 0 ? 1 : std::max(1.0, of_scores / curvature);
    const double wider = stats::student_quantile(0.975, std::max(kFewest, count) - 1) / stats::kNormal95;
    return dispersion * wider * wider;
  }

  /// How far variance `i` moves along `ridge`, in its logarithm, until the profile log likelihood is `most_drop` below `value`;
  /// infinite if it does not fall so far within the variance's bounds. `ridge`: about how the others follow.
  [[nodiscard]] double profile_end(const NoiseVector& best, double value, Eigen::Index i, const NoiseVector& ridge,
                                   const Eigen::MatrixXd& curvature, double most_drop) const {
    const auto k = static_cast<std::size_t>(i);
    const double farthest =
        std::max(0.0, ridge[i] > 0 ? std::log(kMost[k]) - best[i] : best[i] - std::log(kLeast[k]));
    const double along = std::abs(curvature.row(i).dot(ridge.head(size())));
    // Bounds of the first distance, in the logarithm: 2 % of a variance to a factor of 20. They bound the cost, not the
    // result.
    constexpr double kFlattest = 1e-3, kNearest = 0.02, kFarthest = 3;
    const double first = std::clamp(std::sqrt(2 * most_drop / std::max(along, kFlattest)), kNearest, kFarthest);
    const Search others = from_near(curvature, i);
    // The others start from the nearest point that is known.
    std::map<double, NoiseVector> known{{0, best}};
    const auto drop = [&](double far) {
      auto near = known.lower_bound(far);
      if (near == known.end() || (near != known.begin() && far - std::prev(near)->first < near->first - far))
        --near;
      NoiseVector at = near->second;
      const NoiseVector moved = at + (far - near->first) * ridge;
      at[i] = moved[i];
      if (this->value(moved) > this->value(at)) at = moved;
      const double found = (*this)(at, others);
      known[far] = at;
      return value - found;
    };
    return profile_distance(drop, first, farthest, most_drop);
  }

  /// Number of variances that these data have.
  [[nodiscard]] Eigen::Index size() const { return has_headings_ ? kCount : kMeasuredHeading; }

 private:
  [[nodiscard]] std::vector<double> values(const std::vector<NoiseVector>& at) const {
    std::vector<NoiseVector> variance;
    variance.reserve(at.size());
    for (const NoiseVector& logs : at) variance.push_back(variances(logs));
    std::vector<std::vector<double>> of_paths(paths_.size(), std::vector<double>(at.size()));
    std::vector<std::vector<BiasSums>> sums_of_paths(estimated_ != nullptr ? paths_.size() : 0,
                                                     std::vector<BiasSums>(at.size()));
    os::in_parallel(paths_.size(), threads_, [&](std::size_t p) {
      for (std::size_t i = 0; i < at.size(); ++i)
        of_paths[p][i] =
            log_likelihood(paths_[p], variance[i], estimated_ != nullptr ? &sums_of_paths[p][i] : nullptr);
    });
    std::vector<double> sums(at.size());
    for (std::size_t i = 0; i < at.size(); ++i) {
      for (const std::vector<double>& of_path : of_paths) sums[i] += of_path[i];
      // The prior of the search would hold a variance that may be 0 near its usual value.
      sums[i] += estimated_ != nullptr ? over_biases(sums_of_paths, i) + estimated_->columns(variance[i])
                                       : log_prior(at[i]);
    }
    return sums;
  }
  /// The integral over the biases adds this to the log likelihood of the model's biases, up to a constant.
  [[nodiscard]] double over_biases(const std::vector<std::vector<BiasSums>>& of_paths, std::size_t i) const {
    const Biases& biases = estimated_->biases;
    std::vector<BiasSums> robots(biases.from_prior.size());
    for (std::size_t r = 0; r < robots.size(); ++r) {
      robots[r].score = biases.precision * biases.from_prior[r];
      robots[r].information.diagonal().setConstant(biases.precision);
    }
    for (std::size_t p = 0; p < of_paths.size(); ++p) {
      robots[biases.robot_of_path[p]].score += of_paths[p][i].score;
      robots[biases.robot_of_path[p]].information += of_paths[p][i].information;
    }
    double sum = 0;
    for (const BiasSums& robot : robots)
      sum += 0.5 * (robot.score.dot(robot.information.inverse() * robot.score) -
                    std::log(robot.information.determinant()));
    return sum;
  }
  [[nodiscard]] NoiseVector gradient_at(const NoiseVector& at, double value, Eigen::Index fixed) const {
    constexpr double kStep = 1e-3;  // in logarithms; the error of the slope is this times half the curvature
    std::vector<NoiseVector> trials;
    for (Eigen::Index i = 0; i < size(); ++i) {
      if (i == fixed) continue;
      trials.push_back(at);
      trials.back()[i] += kStep;
    }
    const std::vector<double> found = values(trials);
    NoiseVector gradient = NoiseVector::Zero();
    auto next = found.begin();
    for (Eigen::Index i = 0; i < size(); ++i)
      if (i != fixed) gradient[i] = (*next++ - value) / kStep;
    return gradient;
  }

  const std::vector<Path>& paths_;
  const Estimated* estimated_;
  const bool has_headings_;
  const std::uint32_t threads_;
  std::size_t samples_ = 0;
};

std::vector<Path> paths_of(const MotionModel& model, const std::vector<const TrackView*>& tracks,
                           std::uint32_t threads) {
  std::vector<Path> paths(tracks.size());
  os::in_parallel(tracks.size(), threads, [&](std::size_t i) { paths[i] = path_of(model, *tracks[i]); });
  return paths;
}

/// By which the other log variances follow one of them along the ridge of the likelihood.
NoiseVector along_ridge(const Eigen::MatrixXd& curvature, Eigen::Index i) {
  // kRidge keeps directions without information from moving. kSteepest bounds how far another variance follows, in its
  // logarithm.
  constexpr double kRidge = 0.05, kSteepest = 3;
  Eigen::MatrixXd others = curvature;
  others.diagonal().array() += kRidge;
  others.row(i).setZero();
  others.col(i).setZero();
  others(i, i) = 1;
  Eigen::VectorXd cross = curvature.col(i);
  cross[i] = 0;
  NoiseVector by = NoiseVector::Zero();
  by.head(curvature.rows()) = -others.ldlt().solve(cross).cwiseMax(-kSteepest).cwiseMin(kSteepest);
  by[i] = 1;
  return by;
}

}  // namespace

NoiseInterval noise_interval(const MotionModel& model, const std::vector<const TrackView*>& tracks,
                             const NoiseRestriction& columns, bool has_headings, std::uint32_t threads) {
  const std::vector<Path> paths = paths_of(model, tracks, threads);
  const Estimated estimated{biases_of(model, paths), columns};
  const Climb climb(paths, &estimated, has_headings, threads);
  NoiseVector best = logs_of(model.noise);
  climb(best, climb.from_afar());
  const Eigen::MatrixXd curvature = climb.curvature(best);
  double value = climb(best, climb.from_near(curvature, -1));
  // By how much the likelihood falls if one process noise is none.
  NoiseVector without = NoiseVector::Constant(-INFINITY);  // log likelihoods until then
  for (Eigen::Index i = 0; i < kPosition; ++i) {
    NoiseVector at = best;
    at[i] = std::log(kLeast[static_cast<std::size_t>(i)]);
    const double found = climb(at, climb.from_near(curvature, i));
    if (found > value) best = at;
    value = std::max(value, found);
    without[i] = found;
  }
  without = (value - without.array()).matrix();
  best = logs_of(with_fitted(model.noise, variances(best)));
  NoiseVector low = NoiseVector::Constant(NAN), high = low;
  for (Eigen::Index i = 0; i < climb.size(); ++i) {
    const NoiseVector ridge = along_ridge(curvature, i);
    bool others_at_bound = false;
    for (Eigen::Index j = 0; j < kPosition; ++j)
      others_at_bound = others_at_bound || (j != i && without[j] < kProfileDrop95);
    const double most_drop =
        (others_at_bound ? kProfileDropAtBound95 : kProfileDrop95) * climb.widening(best, ridge);
    const auto end = [&](double sign) {
      return std::exp(best[i] + sign * climb.profile_end(best, value, i, sign * ridge, curvature, most_drop));
    };
    low[i] = without[i] < most_drop ? 0 : end(-1);
    high[i] = end(1);
  }
  Noise unknown;
  unknown.wall_mm2_s = unknown.wall_rad2_s = unknown.contact_mm2_s = unknown.contact_rad2_s = NAN;
  return {with_fitted(unknown, low), with_fitted(unknown, high), with_fitted(model.noise, variances(best))};
}

Noise most_likely_noise(const MotionModel& start, const std::vector<const TrackView*>& tracks, bool has_headings,
                        std::uint32_t threads) {
  MotionModel model = start;
  constexpr int kMostRounds = 4;    // bounds the cost, as each round runs all filters
  constexpr double kSettled = 0.1;  // in the logarithm; the paths are then consistent with the variances
  for (int round = 0; round < kMostRounds; ++round) {
    const std::vector<Path> paths = paths_of(model, tracks, threads);
    const Climb climb(paths, nullptr, has_headings, threads);
    const NoiseVector before = logs_of(model.noise);
    NoiseVector at = before;
    const double value = climb(at, climb.from_afar());
    // A variance near zero has no gradient. A restart at a larger value tests whether it should be larger.
    // kNone_mm2: a position noise of 0.1 mm, below usual trackers. kNone_s: a wheel noise of 0.3 % of the speed in 1 s.
    constexpr double kNone_mm2 = 0.01, kNone_s = 1e-5;
    // Bounds of the restart: a drift of 0.1 mm in a second, and a position noise of 0.3 mm, whose gradient is not flat.
    constexpr double kMostDrift_mm2_s = 1e-2, kLeastPosition_mm2 = 0.1;
    if (std::exp(at[kPosition]) < kNone_mm2 || std::exp(at[kFactor]) < kNone_s) {
      const NoiseVector middle = logs_of(Noise{});
      NoiseVector restart = at;
      restart[kFactor] = std::max(at[kFactor], middle[kFactor]);
      restart[kDrift] = std::min(at[kDrift], std::log(kMostDrift_mm2_s));
      restart[kPosition] = std::max(at[kPosition], std::log(kLeastPosition_mm2));
      if (climb(restart, climb.from_afar()) > value) at = restart;
    }
    model.noise = with_fitted(model.noise, variances(at));
    if ((at - before).cwiseAbs().maxCoeff() < kSettled) break;
  }
  return model.noise;
}

}  // namespace kilotwin::identify
