#include "core/stats/time_left.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::stats {
namespace {

/// A unit may take longer than the mean of its kind: by this factor if none of its kind has ended yet, and if some have.
constexpr double kDoubt = 1.5, kSpread = 1.15;
/// Part of its expected or elapsed time that a unit still takes if it is late.
constexpr double kLate = 0.1;

/// Two digits at most, and steps that a watch would use.
std::string rounded(double seconds) {
  const double step = seconds < 10 ? 1 : seconds < 60 ? 5 : seconds < 120 ? 10 : 60;
  const auto value = static_cast<long>(std::ceil(seconds / step) * step);
  return seconds < 120 ? std::to_string(value) + " s" : std::to_string(value / 60) + " min";
}

}  // namespace

void TimeLeft::begin(double now_s, const Work& work) {
  least_share_ = share(now_s);
  if (now_ && now_->cost > 0) {
    const double seconds = now_s - began_s_;
    for (Finished* const f : {&finished_[now_->kind], &all_}) {
      f->cost += now_->cost;
      f->seconds += seconds;
      f->highest_rate = std::max(f->highest_rate, seconds / now_->cost);
      ++f->units;
    }
  }
  now_ = work;
  began_s_ = now_s;
}

TimeLeft::Rate TimeLeft::rate_of(int kind) const {
  const double common = all_.seconds / all_.cost;
  const auto own = finished_.find(kind);
  if (own == finished_.end()) return {common, kDoubt * common};
  const Finished& f = own->second;
  const double prior_cost = f.cost / f.units;
  const double likely = (prior_cost * common + f.seconds) / (prior_cost + f.cost);
  return {likely, std::max(kSpread * likely, f.highest_rate)};
}

std::optional<TimeLeft::Estimate> TimeLeft::at(double now_s) const {
  if (!now_ || all_.units == 0) return std::nullopt;
  const Rate now = rate_of(now_->kind);
  const double elapsed_s = now_s - began_s_;
  const auto rest_s = [&](double whole_s) {
    return now_->cost > 0 ? std::max(whole_s - elapsed_s, kLate * std::max(whole_s, elapsed_s)) : 0;
  };
  Estimate out{rest_s(now.likely * now_->cost), rest_s(now.most * now_->cost)};
  for (const WorkLeft& w : now_->left) {
    const Rate rate = rate_of(w.kind);
    out.likely_s += rate.likely * w.likely;
    out.most_s += rate.most * w.most;
  }
  return out;
}

double TimeLeft::share(double now_s) const {
  if (!now_ || all_.units == 0) return least_share_;
  // The growing time of a late unit does not count: with it the share would fall.
  const double due_s = began_s_ + rate_of(now_->kind).likely * now_->cost;
  const double whole_s = now_s + at(std::min(now_s, due_s))->likely_s;
  return std::max(least_share_, whole_s > 0 ? now_s / whole_s : 0);
}

std::string in_words(const std::optional<TimeLeft::Estimate>& left) {
  if (!left) return "time left not known yet";
  const std::string likely = rounded(left->likely_s), most = rounded(left->most_s);
  return "about " + likely + " left" + (most == likely ? "" : " (at most " + most + ")");
}

}  // namespace kilotwin::stats
