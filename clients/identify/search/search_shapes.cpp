#include "clients/identify/search/central_distortion.hpp"
#include "clients/identify/search/change_points.hpp"
#include "clients/identify/search/moving_circles.hpp"
#include "clients/identify/search/neighbour_shape.hpp"
#include "clients/identify/search/products.hpp"
#include "clients/identify/search/search_loop.hpp"
#include "clients/identify/search/shape_refinement.hpp"
#include "clients/identify/search/simplification.hpp"
#include "clients/identify/search/target_extension.hpp"
#include "clients/identify/search/total_variation_map.hpp"
#include "clients/identify/search/traffic_shape.hpp"
#include "clients/identify/search/travelling_waves.hpp"
#include "clients/identify/search/wheel_offsets.hpp"

namespace kilotwin::identify {

void SearchLoop::refine_shape(std::size_t place) {
  const std::string before = out_.fit.model.terms[place].name;
  refine_form(place);
  out_.note_renamed(before, out_.fit.model.terms[place].name);
}

void SearchLoop::refine_form(std::size_t place) {
  if (out_.fit.model.terms[place].general) {
    refit(fitter_, out_.fit, place);
    if (!became_switch(place) && separate(fitter_, out_.fit, place)) extend_targets(fitter_, out_.fit, place);
    return;
  }
  if (!refine_neighbour_shape(fitter_, out_.fit, place) && !refine_traffic_shape(fitter_, out_.fit, place))
    refine_curves(fitter_, out_.fit, place);
  // Smooth curves leave residuals of a switch, which would pass the tests as one further term after another.
  if (became_switch(place)) return;
  const std::string before = out_.fit.model.terms[place].name;
  if (refine_wave_numbers(fitter_, out_.fit, place)) refit(fitter_, out_.fit, place);
  if (refine_moving_circle(fitter_, out_.fit, place)) {
    // The curve is sharper about the right centre.
    refine_curves(fitter_, out_.fit, place);
    if (refine_moving_circle(fitter_, out_.fit, place)) refit(fitter_, out_.fit, place);
  }
  const std::string name = find_change_points(fitter_, out_.fit, place);
  if (name != before) {
    for (const Hypothesis& h : dictionary_.hypotheses) {
      if (h.name != name) continue;
      out_.reasons[place].covariates = h.covariates;
      out_.reasons[place].acts_on = h.acts_on;
    }
  }
  fit_total_variation_map(fitter_, out_.fit, place);
  fit_central_distortion(fitter_, out_.fit, place);
  extend_targets(fitter_, out_.fit, place);
}

bool SearchLoop::became_switch(std::size_t place) {
  if (!simplify_to_switch(fitter_, out_.fit, place)) return false;
  if (replace_by_wheel_offsets(fitter_, out_.fit, place)) out_.reasons[place].acts_on = "speed of each wheel";
  return true;
}

void Search::note_renamed(const std::string& from, const std::string& to) {
  if (from == to) return;
  for (Step& step : steps)
    if (step.added == from) step.added = to;
  for (Ambiguity& one : ambiguous)
    if (one.found == from) one.found = to;
}

}  // namespace kilotwin::identify
