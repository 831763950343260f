#include "clients/identify/fit/linearisation.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <functional>

#include "clients/identify/fit/contact_gate.hpp"
#include "clients/identify/fit/likelihood.hpp"
#include "clients/identify/fit/products.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

constexpr Eigen::Index kBuffer = 96;  ///< innovation rows that are summed at once

/// Sensitivities of one track's filter to all columns, and the sums over its innovations.
class Sensitivities {
 public:
  /// `needed`: products of all columns, those of the biases last.
  Sensitivities(const MotionModel& model, const std::vector<Block>& blocks, const LineariseOptions& options,
                const NeededProducts& needed)
      : model_(model),
        blocks_(blocks),
        needed_(needed),
        of_block_(options.of_block),
        cluster_s_(options.cluster_s) {
    for (std::size_t t = 0; t < model.terms.size(); ++t) {
      Eigen::Index first = 0;
      for (const Block& block : model.terms[t].blocks) {
        own_.push_back({model.terms[t].coefficients.data() + first, static_cast<int>(t) == options.instead_of});
        first += static_cast<Eigen::Index>(block.basis.size());
      }
    }
    if (of_block_ != nullptr) gains_.resize(own_.size());
    columns_ = columns_of(blocks);
    all_ = columns_ + kBiases;
    pose_.setZero(3, all_);
    seen_.setZero(3, all_);
    information_.setZero(all_, all_);
    buffer_.resize(kBuffer, all_);
    values_.resize(kBuffer);
    for (const Block& block : blocks) measures_ = measures_ || is_measured(block.target);
    share_bases();
  }

  static constexpr Eigen::Index kBiases = 2;  ///< columns after the others
  [[nodiscard]] static Eigen::Index columns_of(const std::vector<Block>& blocks) {
    Eigen::Index columns = kBaseColumns;
    for (const Block& block : blocks) columns += static_cast<Eigen::Index>(block.basis.size());
    return columns;
  }
  [[nodiscard]] Eigen::Index columns() const { return columns_; }
  void begin_track(const TrackView& view) {
    run_ = view.run;
    cluster_start_s_ = -1e300;
    likelihood_ = {};
    first_ = &view.track->samples.front();
    last_ = view.at(first_->time_s);
  }
  void start(const TrackFilter& filter) {
    filter_ = &filter;
    const Eigen::Vector3d pose = filter.belief().mean.head<3>();
    Eigen::Matrix2d by_place = Eigen::Matrix2d::Identity();
    if (model_.measures()) {
      // Step of the difference quotient; a larger one blurs the bends of a map, a tiny one loses digits.
      constexpr double kStep_mm = 0.1;
      const Eigen::Vector3d here = model_.measured(pose[0], pose[1], pose[2], last_);
      by_place.col(0) = (model_.measured(pose[0] + kStep_mm, pose[1], pose[2], last_) - here).head<2>() / kStep_mm;
      by_place.col(1) = (model_.measured(pose[0], pose[1] + kStep_mm, pose[2], last_) - here).head<2>() / kStep_mm;
    }
    place(*first_, pose, by_place);
  }
  void step(const StepRecord& record) {
    const Rates& r = record.rates;
    const Arc& arc = record.arc;
    const double h = record.h_s, base = model_.base.wheel_base_mm;
    ++instant_;
    const double by_heading_x = -(arc.dy_mm - r.drift_y_mm_s * h), by_heading_y = arc.dx_mm - r.drift_x_mm_s * h;
    add_row({by_heading_x, by_heading_y, 0}, pose_.row(2).data(), all_, pose_, 0);
    last_ = record.middle;
    in_contact_.step(record);
    likelihood_.step(record);
    const double forward = r.forward_mm_s() * h;
    const Eigen::Vector3d turn = h * Eigen::Vector3d(-arc.along_y * forward / 2, arc.along_x * forward / 2, 1);
    const Eigen::Vector3d ahead = h * Eigen::Vector3d(arc.along_x, arc.along_y, 0);
    const Eigen::Vector3d sideways = h * Eigen::Vector3d(-arc.along_y, arc.along_x, 0);
    const Eigen::Vector3d left = ahead / 2 - turn / base, right = ahead / 2 + turn / base;
    const CommandState& commands = record.middle.commands;
    if (commands.driven()) {
      const Eigen::Vector3d by_left = left * r.left_gain, by_right = right * r.right_gain;
      if (commands.command == Motion::kStraight) pose_.col(kStraightSpeed) += by_left + by_right;
      if (commands.command == Motion::kLeft) pose_.col(kTurnSpeed) += by_right;
      if (commands.command == Motion::kRight) pose_.col(kTurnSpeed) += by_left;
      pose_.col(kWheelBase) -= turn * (((r.right_mm_s - r.left_mm_s) / base - r.turn_effects_rad_s) / base);
      pose_.col(columns_) += by_left;
      pose_.col(columns_ + 1) += by_right;
    }
    Eigen::Index c = kBaseColumns;
    Wheels replaced;
    std::fill(gains_.begin(), gains_.end(), Wheels{});
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      const Block& block = blocks_[b];
      const Eigen::Index n = shared_[b].columns, first = c;
      c += n;
      if (is_measured(block.target) || (block.during >> static_cast<int>(commands.command) & 1) == 0) continue;
      if (block.basis.lacks_key(record.middle)) continue;
      const double* const left_values = values_of(b, record.middle, 0);
      const auto add = [&](const Eigen::Vector3d& force, const double* values) {
        add_row(force, values, n, pose_, first);
      };
      const double* const right_values = shared_[b].per_wheel ? values_of(b, record.middle, 1) : left_values;
      // Gains are factors: a term's columns do not act on the term's own gain.
      Wheels without = replaced;
      if (of_block_ != nullptr && b >= own_.size()) without = gains_[(*of_block_)[b - own_.size()]];
      if (b < own_.size()) {
        without = own_gains(b, left_values, right_values);
        if (of_block_ != nullptr) gains_[b] = without;
        if (own_[b].replaced) {
          replaced.left *= without.left;
          replaced.right *= without.right;
        }
      }
      const double gained_left = r.left_base_mm_s * r.left_gain / without.left,
                   gained_right = r.right_base_mm_s * r.right_gain / without.right;
      switch (block.target) {
        case Target::kGain:
          if (right_values == left_values) {
            add(left * gained_left + right * gained_right, left_values);
          } else {
            add(left * gained_left, left_values);
            add(right * gained_right, right_values);
          }
          break;
        case Target::kGainLeft: add(left * gained_left, left_values); break;
        case Target::kGainRight: add(right * gained_right, right_values); break;
        case Target::kOffset: add(ahead, left_values); break;
        case Target::kOffsetLeft: add(left, left_values); break;
        case Target::kOffsetRight: add(right, right_values); break;
        case Target::kTurn: add(turn, left_values); break;
        case Target::kAhead: add(ahead, left_values); break;
        case Target::kSideways: add(sideways, left_values); break;
        case Target::kWorldX: add({h, 0, 0}, left_values); break;
        case Target::kWorldY: add({0, h, 0}, left_values); break;
        default: break;
      }
    }
  }
  void update(const Innovation& innovation, const Sample& sample) {
    const ContactGate::Counts counts = in_contact_.update(innovation);
    const bool heading_only = counts == ContactGate::Counts::kHeading;
    likelihood_.update(innovation, sample);
    ++samples;
    if (innovation.weight < 1) ++outliers;
    // Otherwise the sensitivities start at zero again.
    if (innovation.lost || counts == ContactGate::Counts::kNothing) {
      lost += innovation.lost ? 1 : 0;
      place(sample, innovation);
      return;
    }
    if (sample.time_s > cluster_start_s_ + cluster_s_ || clusters_.empty()) {
      flush();
      cluster_start_s_ = sample.time_s;
      clusters_.emplace_back(Eigen::VectorXd::Zero(all_));
      cluster_run.push_back(run_);
    }
    put_combined(innovation.jacobian, pose_, 3, seen_.data());
    add_measured(sample, innovation.pose);
    if (filled_ + 3 > kBuffer) flush();
    if (heading_only) return add_heading(sample, innovation);
    if (innovation.size == 2) seen_.row(2).setZero();
    const Eigen::LLT<Eigen::Matrix3d> root(innovation.covariance);
    const Eigen::Matrix3d whiten = root.matrixL().solve(Eigen::Matrix3d::Identity());
    put_combined(whiten, seen_, innovation.size, buffer_.row(filled_).data());
    values_.segment(filled_, innovation.size) = (whiten * innovation.difference).head(innovation.size);
    filled_ += innovation.size;
    take_combined(innovation.gain.topRows<3>(), seen_, innovation.size, pose_);
  }
  void flush() {
    if (filled_ == 0) return;
    const auto rows = buffer_.topRows(filled_);
    add_products(buffer_, filled_, needed_, information_);
    clusters_.back().noalias() += rows.transpose() * values_.head(filled_);
    filled_ = 0;
  }

  /// Eliminates the biases (Schur complement) under the prior `prior`.
  void finish(Unit& unit, const Eigen::Vector2d& from_prior, double prior_precision) {
    flush();
    information_ = Eigen::MatrixXd(information_.selfadjointView<Eigen::Lower>());
    const Eigen::Index n = columns_;
    const auto count = static_cast<Eigen::Index>(clusters_.size());
    const Eigen::Matrix2d own =
        information_.bottomRightCorner<2, 2>() + prior_precision * Eigen::Matrix2d::Identity();
    unit.bias_covariance = own.inverse();
    const Eigen::MatrixXd cross = information_.bottomLeftCorner(2, n);
    unit.bias_by_column = unit.bias_covariance * cross;
    unit.information = information_.topLeftCorner(n, n);
    unit.information.noalias() -= cross.transpose() * unit.bias_by_column;
    unit.cluster_scores.resize(n, count);
    Eigen::Vector2d bias_score = prior_precision * from_prior;
    for (Eigen::Index k = 0; k < count; ++k) {
      const Eigen::VectorXd& score = clusters_[static_cast<std::size_t>(k)];
      const Eigen::Vector2d share =
          score.tail<2>() + prior_precision * from_prior / static_cast<double>(std::max<Eigen::Index>(1, count));
      unit.cluster_scores.col(k) = score.head(n) - unit.bias_by_column.transpose() * share;
      bias_score += score.tail<2>();
    }
    unit.bias_step = unit.bias_covariance * bias_score;
    unit.score = unit.cluster_scores.rowwise().sum();
    unit.cluster_run = cluster_run;
    unit.samples = samples;
    unit.outliers = outliers;
    unit.lost = lost;
  }

  [[nodiscard]] double log_likelihood_of_track() const { return likelihood_.sum; }

  std::size_t samples = 0, outliers = 0, lost = 0;
  std::vector<std::uint32_t> cluster_run;

 private:
  /// Data of one block of the model.
  struct Own {
    const double* coefficients;
    bool replaced;
  };
  struct Wheels {
    double left = 1, right = 1;
  };

  /// The gains of a block of the model itself, where it acts on gains; else 1. Not near 0: they are divisors.
  [[nodiscard]] Wheels own_gains(std::size_t b, const double* left, const double* right) const {
    const Block& block = blocks_[b];
    const Eigen::Map<const Eigen::VectorXd> own(own_[b].coefficients,
                                                static_cast<Eigen::Index>(block.basis.size()));
    const auto factor = [&](const double* values) {
      const double gain = 1 + own.dot(Eigen::Map<const Eigen::VectorXd>(values, own.size()));
      constexpr double kLeast = 0.05;  // least gain; a smaller one makes columns that are divided by it larger
      return std::abs(gain) < kLeast ? kLeast : gain;
    };
    const bool both = block.target == Target::kGain;
    return {both || block.target == Target::kGainLeft ? factor(left) : 1,
            both || block.target == Target::kGainRight ? factor(right) : 1};
  }
  void share_bases() {
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      std::size_t first = 0;
      while (!(blocks_[first].basis == blocks_[b].basis)) ++first;
      const Basis& basis = blocks_[b].basis;
      shared_.push_back({first, static_cast<Eigen::Index>(basis.size()), false, basis.per_wheel()});
      if (first == b) continue;
      shared_[first].used_again = true;
      shared_[first].left.resize(kMostColumns);
    }
  }
  /// The columns of a block at the present instant, valid until the next call for the same wheel.
  const double* values_of(std::size_t b, const Situation& at, std::size_t wheel) {
    Shared& shared = shared_[shared_[b].first];
    if (wheel == 1 || !shared.used_again) {
      double* const to = wheel == 0 ? of_left_ : of_right_;
      blocks_[b].basis.evaluate(at, wheel, to);
      return to;
    }
    if (shared.instant != instant_) {
      blocks_[b].basis.evaluate(at, wheel, shared.left.data());
      shared.instant = instant_;
    }
    return shared.left.data();
  }
  /// At the start the robot is at its measured position for any coefficients, so the measurement effect moves the
  /// pose.
  void place(const Sample& sample, const Eigen::Vector3d& pose, const Eigen::Matrix2d& by_place) {
    seen_.setZero();
    add_measured(sample, pose);
    pose_.topRows<2>().noalias() = -by_place.inverse() * seen_.topRows<2>();
    if (TrackFilter::has_heading(sample))
      pose_.row(2) = -seen_.row(2);
    else
      pose_.row(2).setZero();
  }
  void place(const Sample& sample, const Innovation& innovation) {
    place(sample, filter_->belief().mean.head<3>(), innovation.jacobian.topLeftCorner<2, 2>());
  }
  /// After a contact with a robot the position restarts from the measurement. The heading continues.
  void add_heading(const Sample& sample, const Innovation& innovation) {
    const double spread = std::sqrt(innovation.covariance(2, 2));
    buffer_.row(filled_) = seen_.row(2) / spread;
    values_[filled_++] = innovation.difference[2] / spread;
    const Eigen::RowVectorXd heading = pose_.row(2) - innovation.gain(2, 2) * seen_.row(2);
    place(sample, innovation);
    pose_.row(2) = heading;
  }
  void add_measured(const Sample& sample, const Eigen::Vector3d& pose) {
    const double heading = pose[2];
    const double c = std::cos(heading), s = std::sin(heading);
    seen_(0, kAheadPoint) += c;
    seen_(1, kAheadPoint) += s;
    seen_(0, kLeftPoint) -= s;
    seen_(1, kLeftPoint) += c;
    if (!measures_) return;
    Situation at = last_;
    at.time_s = sample.time_s;
    at.span_s = 0;
    at.x_mm = pose[0] + model_.base.centre_mm * c;
    at.y_mm = pose[1] + model_.base.centre_mm * s;
    at.heading_rad = heading;
    const BaseParameters& base = model_.base;
    const double point_x = pose[0] + base.ahead_mm * c - base.left_mm * s,
                 point_y = pose[1] + base.ahead_mm * s + base.left_mm * c;
    ++instant_;
    Eigen::Index first = kBaseColumns;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      const Block& block = blocks_[b];
      const Eigen::Index n = shared_[b].columns;
      if (is_measured(block.target) && (block.during >> static_cast<int>(at.commands.command) & 1) != 0 &&
          !block.basis.lacks_key(at)) {
        const Eigen::Map<const Eigen::RowVectorXd> row(values_of(b, at, 0), n);
        const auto add = [&](double x, double y, double turn) {
          if (x != 0) seen_.row(0).segment(first, n) += x * row;
          if (y != 0) seen_.row(1).segment(first, n) += y * row;
          if (turn != 0) seen_.row(2).segment(first, n) += turn * row;
        };
        switch (block.target) {
          case Target::kMeasuredX: add(1, 0, 0); break;
          case Target::kMeasuredY: add(0, 1, 0); break;
          case Target::kMeasuredAhead: add(c, s, 0); break;
          case Target::kMeasuredLeft: add(-s, c, 0); break;
          case Target::kMeasuredScale: add(point_x, point_y, 0); break;
          case Target::kMeasuredTurn: add(-point_y, point_x, 1); break;
          default: add(0, 0, 1); break;
        }
      }
      first += n;
    }
  }

  const MotionModel& model_;
  const std::vector<Block>& blocks_;
  const NeededProducts& needed_;
  std::vector<Own> own_;  ///< of the first blocks
  const std::vector<std::size_t>* const of_block_;
  std::vector<Wheels> gains_;  ///< of the model's blocks in the present step, if others change their values
  const double cluster_s_;
  Eigen::Index columns_ = 0, all_ = 0, filled_ = 0;
  PoseRows pose_, seen_;
  Eigen::MatrixXd information_;
  RowMajorMatrix buffer_;
  Eigen::VectorXd values_;
  std::vector<Eigen::VectorXd> clusters_;
  std::uint32_t run_ = 0;
  double cluster_start_s_ = -1e300;
  const TrackFilter* filter_ = nullptr;
  const Sample* first_ = nullptr;  ///< first sample of the track
  Situation last_;
  ContactGate in_contact_;
  LogLikelihood likelihood_;  ///< of the track
  bool measures_ = false;
  /// Blocks with the same basis share its columns: those of the first of them.
  struct Shared {
    std::size_t first;  ///< index of the first block with the basis
    Eigen::Index columns;
    bool used_again, per_wheel;
    std::uint64_t instant = 0;      ///< for which `left` holds the columns
    std::vector<double> left = {};  ///< of the first block, if it is used again
  };
  std::vector<Shared> shared_;  ///< by block
  std::uint64_t instant_ = 0;   ///< number of the present step or update
  double of_left_[kMostColumns], of_right_[kMostColumns];
};

/// Columns cost in proportion, their products by the square: one sub-step of the filter is the unit.
void count_work(const TrackView& view, Eigen::Index columns) {
  // Relative costs. The work limits of the search are in this unit: larger values end it earlier.
  constexpr double kByColumn = 0.1, kByProduct = 1.0 / 3000;
  const auto n = static_cast<double>(columns);
  if (view.work != nullptr)
    *view.work += static_cast<std::uint64_t>(static_cast<double>(view.track->samples.size()) *
                                             (kByColumn * n + kByProduct * n * n));
}

}  // namespace

std::vector<Unit> linearise(const MotionModel& model, const std::vector<std::vector<const TrackView*>>& units,
                            const std::vector<Block>& blocks, const LineariseOptions& options) {
  std::vector<Unit> out(units.size());
  const Eigen::Index all = Sensitivities::columns_of(blocks) + Sensitivities::kBiases;
  const NeededProducts needed =
      options.needed == nullptr
          ? NeededProducts(all)
          : NeededProducts(all, options.needed->groups, options.needed->with_all, Sensitivities::kBiases);
  os::in_parallel(units.size(), options.threads, [&](std::size_t u) {
    Sensitivities sums(model, blocks, options, needed);
    RobotBias bias;
    for (const TrackView* view : units[u]) {
      out[u].robot = view->track->robot;
      bias = model.bias_of(view->track->robot);
      RobotBias fixed = bias;
      fixed.covariance.setZero();
      TrackFilter filter(model, fixed, view->track->robot, view->number);
      sums.begin_track(*view);
      run_filter(filter, *view, view->track->samples.size(), sums);
      sums.flush();
      out[u].log_likelihood_of_track.push_back(sums.log_likelihood_of_track());
      count_work(*view, sums.columns());
    }
    const double sd = model.base.bias_sd_mm_s;
    sums.finish(out[u], Eigen::Vector2d::Constant(model.base.bias_mean_mm_s) - bias.mean_mm_s, 1 / (sd * sd));
  });
  return out;
}

}  // namespace kilotwin::identify
