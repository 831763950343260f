#include <algorithm>
#include <cmath>
#include <map>

#include "clients/identify/predict/forecast.hpp"

namespace kilotwin::identify {

std::vector<Forecast> free_ones(const MotionModel& model, const PreparedSet& set, const std::vector<Forecast>& all,
                                double horizon_s) {
  std::map<std::pair<std::uint32_t, std::size_t>, const TrackView*> views;
  for (const TrackView& view : set.views()) views[{view.run, view.place}] = &view;
  const auto is_free = [&](const Forecast& f) {
    const TrackView& view = *views.at({f.run, f.place});
    const RunNeighbours& run = *view.neighbours;
    if (run.instants() == 0) return false;
    const auto instant = [&](double time_s) {
      const double at = (time_s - run.time_s(0)) / RunNeighbours::kRaster_s;
      return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(run.instants() - 1)));
    };
    for (std::size_t i = instant(f.time_s - horizon_s), last = instant(f.time_s); i <= last; ++i) {
      const RunNeighbours::Spot& spot = run.spot(view.place, i);
      if (std::isnan(spot.x_mm)) continue;
      if (model.walls.at_wall(spot.x_mm, spot.y_mm, kWallMargin_mm)) return false;
      if (model.contacts && run.view(view.place, run.time_s(i)).nearest_mm < model.contact_range_mm) return false;
    }
    return true;
  };
  std::vector<Forecast> free;
  std::copy_if(all.begin(), all.end(), std::back_inserter(free), is_free);
  return free;
}

}  // namespace kilotwin::identify
