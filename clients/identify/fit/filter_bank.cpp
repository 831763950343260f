#include "clients/identify/fit/filter_bank.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kilotwin::identify {
namespace {

/// Logarithm of the sum of the hypotheses' weights.
double total_of(const std::vector<FilterBank::Hypothesis>& hypotheses) {
  double best = -1e300, sum = 0;
  for (const auto& h : hypotheses) best = std::max(best, h.log_weight);
  for (const auto& h : hypotheses) sum += std::exp(h.log_weight - best);
  return best + std::log(sum);
}

}  // namespace

void FilterBank::advance_to(double to_s) {
  const std::vector<Sample>& samples = view_.track->samples;
  for (; next_ < samples.size() && samples[next_].time_s <= to_s + 1e-6; ++next_) take(samples[next_]);
}

void FilterBank::take(const Sample& sample) {
  if (next_ == 0) return start(sample);
  const double from_s = last_s(), weight = total_of(hypotheses_);
  double lost = 0;
  for (Hypothesis& h : hypotheses_) {
    sub_steps(*view_.clock, from_s, sample.time_s, [&](double t, double length, const CommandState& commands) {
      h.filter.step(t, length, commands, view_.neighbours->view(view_.place, std::min(t, from_s)));
    });
    const Innovation innovation = h.filter.update(sample, view_.clock->at(sample.time_s - 1e-9));
    h.log_weight += innovation.log_likelihood;
    if (!innovation.lost || innovation.size != 2) continue;
    h.log_weight -= 20;
    lost += 1;
  }
  log_likelihood_ += total_of(hypotheses_) - weight;
  // Every hypothesis lost the track: the position is known, the heading may be another one.
  if (lost > 0 && lost == static_cast<double>(hypotheses_.size())) return restart(sample);
  prune();
}

void FilterBank::start(const Sample& sample) {
  RobotBias bias = model_.bias_of(view_.track->robot);
  hypotheses_.clear();
  const auto add = [&](double heading, double sd) {
    TrackFilter filter(model_, bias, view_.track->robot, view_.number);
    filter.start(sample, {}, heading, sd);
    filter.stay_within_walls();
    hypotheses_.push_back({std::move(filter), 0});
  };
  if (TrackFilter::has_heading(sample)) return add(sample.heading_rad, std::sqrt(model_.noise.heading_rad2));
  constexpr int kHeadings = 18;
  for (int i = 0; i < kHeadings; ++i) add(2 * M_PI * i / kHeadings, M_PI / kHeadings);
}

void FilterBank::restart(const Sample& sample) {
  // A push by another robot displaces and turns a robot. Else a wrong heading has lost the track.
  constexpr double kOfAny = 0.3;
  const std::vector<Hypothesis> before = std::exchange(hypotheses_, {});
  const double total = total_of(before);
  start(sample);
  for (Hypothesis& h : hypotheses_) {
    double density = 0, all = 0;
    for (const Hypothesis& one : before) {
      const Belief &belief = one.filter.belief(), &own = h.filter.belief();
      const double variance = belief.covariance(2, 2);
      const auto likely = [&](double heading_rad) {
        const double apart = wrapped_angle(heading_rad - belief.mean[2]);
        return std::exp(-apart * apart / (2 * variance));
      };
      double sum = 0;
      for (const Hypothesis& other : hypotheses_) sum += likely(other.filter.belief().mean[2]);
      const double weight = std::exp(one.log_weight - total);
      density += weight * likely(own.mean[2]) / sum;
      all += weight;
    }
    const double share = kOfAny / static_cast<double>(hypotheses_.size()) + (1 - kOfAny) * density / all;
    // Weights that are no numbers know nothing.
    h.log_weight = std::isfinite(share) ? std::log(share) : 0;
  }
}

void FilterBank::prune() {
  constexpr double kHopeless = 20;
  // A weight that is no finite number is as good as none. If no weight is finite, all hypotheses stay, with equal weights.
  double best = -1e300;
  for (const Hypothesis& h : hypotheses_)
    if (std::isfinite(h.log_weight)) best = std::max(best, h.log_weight);
  const bool any = best > -1e300;
  for (Hypothesis& h : hypotheses_) h.log_weight = any ? h.log_weight - best : 0;
  std::erase_if(hypotheses_,
                [](const Hypothesis& h) { return !std::isfinite(h.log_weight) || h.log_weight < -kHopeless; });
  // Merges hypotheses that have converged to the same heading.
  for (std::size_t i = 0; i + 1 < hypotheses_.size(); ++i) {
    for (std::size_t j = i + 1; j < hypotheses_.size();) {
      const Belief& a = hypotheses_[i].filter.belief();
      const Belief& b = hypotheses_[j].filter.belief();
      const double apart = wrapped_angle(a.mean[2] - b.mean[2]);
      if (apart * apart < 0.25 * std::min(a.covariance(2, 2), b.covariance(2, 2))) {
        const double wa = std::exp(hypotheses_[i].log_weight), wb = std::exp(hypotheses_[j].log_weight);
        if (wb > wa) hypotheses_[i].filter = hypotheses_[j].filter;
        hypotheses_[i].log_weight = std::log(wa + wb);
        hypotheses_.erase(hypotheses_.begin() + static_cast<std::ptrdiff_t>(j));
      } else {
        ++j;
      }
    }
  }
}

Centres centres_of(const MotionModel& model, const TrackView& view) {
  Centres centres;
  FilterBank bank(model, view);
  for (const Sample& sample : view.track->samples) {
    bank.advance_to(sample.time_s);
    double sum = 0, x = 0, y = 0;
    for (const FilterBank::Hypothesis& h : bank.hypotheses()) {
      const double weight = std::exp(h.log_weight);
      sum += weight;
      x += weight * h.filter.belief().centre_x_mm();
      y += weight * h.filter.belief().centre_y_mm();
    }
    centres.x_mm.push_back(x / sum);
    centres.y_mm.push_back(y / sum);
  }
  return centres;
}

}  // namespace kilotwin::identify
