#include "clients/identify/model/neighbours.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::identify {

NeighbourView view_of(std::size_t robot, std::span<const double> x_mm, std::span<const double> y_mm,
                      std::vector<OtherRobot>* list, std::span<const Neighbour> who) {
  NeighbourView view;
  if (list != nullptr) {
    view.list = list;
    view.first_listed = static_cast<std::uint32_t>(list->size());
  }
  double nearest2 = view.nearest_mm * view.nearest_mm;
  std::size_t nearest = robot;
  const double reach2 = kNeighbourRadii_mm.back() * kNeighbourRadii_mm.back();
  for (std::size_t other = 0; other < x_mm.size(); ++other) {
    const double dx = x_mm[other] - x_mm[robot], dy = y_mm[other] - y_mm[robot], d2 = dx * dx + dy * dy;
    if (other == robot || !(d2 <= std::max(reach2, nearest2))) continue;
    if (d2 < nearest2) {
      nearest2 = d2;
      nearest = other;
    }
    if (list != nullptr && d2 <= kListed_mm * kListed_mm) {
      const double d = std::sqrt(d2), by = d > 0 ? 1 / d : 0;
      const Neighbour is = who.empty() ? Neighbour{} : who[other];
      list->push_back({static_cast<float>(d), static_cast<float>(dx * by), static_cast<float>(dy * by),
                       is.robot & 0x7fffffffU, is.driven});
    }
    for (std::size_t r = kNeighbourRadii_mm.size(); r-- > 0;) {
      const auto part = static_cast<float>(1 - d2 / (kNeighbourRadii_mm[r] * kNeighbourRadii_mm[r]));
      if (part < 0) break;
      view.count[r] += 1;
      view.density[r] += part * part;
    }
  }
  if (list != nullptr) view.listed = static_cast<std::uint32_t>(list->size()) - view.first_listed;
  if (nearest != robot) {
    view.nearest_mm = std::sqrt(nearest2);
    view.direction_rad = std::atan2(y_mm[nearest] - y_mm[robot], x_mm[nearest] - x_mm[robot]);
  }
  return view;
}

RunNeighbours::RunNeighbours(const Run& run, const std::vector<Centres>* centres, double command_lag_s) {
  double end_s = -1e300;
  start_s_ = 1e300;
  for (const Track& track : run.tracks) {
    if (track.samples.empty()) continue;
    start_s_ = std::min(start_s_, track.samples.front().time_s);
    end_s = std::max(end_s, track.samples.back().time_s);
  }
  const std::size_t robots = run.tracks.size();
  if (robots == 0 || end_s < start_s_) return;
  instants_ = static_cast<std::size_t>((end_s - start_s_) / kRaster_s) + 2;
  views_.resize(robots * instants_);
  spots_.assign(robots * instants_, {std::nan(""), std::nan(""), false});
  std::vector<std::size_t> next(robots, 0);
  for (std::size_t i = 0; i < instants_; ++i) {
    const double t = start_s_ + static_cast<double>(i) * kRaster_s;
    for (std::size_t r = 0; r < robots; ++r) {
      const std::vector<Sample>& samples = run.tracks[r].samples;
      while (next[r] < samples.size() && samples[next[r]].time_s <= t) ++next[r];
      if (next[r] == 0) continue;
      Spot& spot = spots_[r * instants_ + i];
      const std::size_t last = next[r] - 1;
      const Sample& a = samples[last];
      const auto place = [&](std::size_t at) -> std::pair<double, double> {
        if (centres == nullptr) return {samples[at].x_mm, samples[at].y_mm};
        return {(*centres)[r].x_mm[at], (*centres)[r].y_mm[at]};
      };
      const auto [ax, ay] = place(last);
      if (next[r] == samples.size()) {
        if (t - a.time_s < kGap_s) spot.x_mm = ax, spot.y_mm = ay;
        continue;
      }
      const Sample& b = samples[next[r]];
      if (b.time_s - a.time_s > kGap_s) continue;
      const double part = (t - a.time_s) / (b.time_s - a.time_s);
      const auto [bx, by] = place(next[r]);
      spot.x_mm = ax + part * (bx - ax);
      spot.y_mm = ay + part * (by - ay);
    }
  }
  set_driven(run, command_lag_s);
  find_views(run);
}

void RunNeighbours::set_driven(const Run& run, double command_lag_s) {
  for (std::size_t r = 0; r < run.tracks.size(); ++r) {
    const CommandClock clock(run.tracks[r], command_lag_s);
    for (std::size_t i = 0; i < instants(); ++i)
      spots_[r * instants_ + i].driven = clock.at(time_s(i) + 1e-9).driven();
  }
}

void RunNeighbours::find_views(const Run& run) {
  const std::size_t robots = run.tracks.size();
  const auto others = std::make_shared<std::vector<OtherRobot>>();
  std::vector<double> x(robots), y(robots);
  std::vector<Neighbour> who(robots);
  for (std::size_t i = 0; i < instants(); ++i) {
    for (std::size_t r = 0; r < robots; ++r) {
      const Spot& s = spot(r, i);
      x[r] = s.x_mm;
      y[r] = s.y_mm;
      who[r] = {run.tracks[r].robot, s.driven};
    }
    for (std::size_t r = 0; r < robots; ++r) {
      if (std::isnan(x[r])) continue;
      NeighbourView& view = views_[r * instants_ + i];
      const auto traffic = view.traffic;
      view = view_of(r, x, y, others.get(), who);
      view.traffic = traffic;
    }
  }
  others_ = others;
}

void RunNeighbours::set_command_lag(const Run& run, double command_lag_s) {
  set_driven(run, command_lag_s);
  find_views(run);
}

void RunNeighbours::update_traffic(const Run& run, const std::array<GridCells, kTrafficGrids>& cells) {
  for (std::size_t c = 0; c < kTrafficGrids; ++c) {
    TrafficGrid traffic(cells[c]);
    for (std::size_t i = 0; i < instants(); ++i) {
      for (std::size_t r = 0; r < run.tracks.size(); ++r) {
        const Spot& s = spot(r, i);
        if (!std::isnan(s.x_mm)) views_[r * instants_ + i].traffic[c] = traffic.value(r, s.x_mm, s.y_mm, time_s(i));
      }
      for (std::size_t r = 0; r < run.tracks.size(); ++r) {
        const Spot& s = spot(r, i);
        if (!std::isnan(s.x_mm) && s.driven) traffic.add(r, s.x_mm, s.y_mm, kRaster_s, time_s(i));
      }
    }
  }
}

const NeighbourView& RunNeighbours::view(std::size_t track, double time_s) const {
  if (instants_ == 0) return nobody_;
  const double at = std::clamp((time_s - start_s_) / kRaster_s + 0.5, 0.0, static_cast<double>(instants_ - 1));
  return views_[track * instants_ + static_cast<std::size_t>(at)];
}

}  // namespace kilotwin::identify
