// Checks of the list of effects that the table of ranges cannot express.
#include <fmt/format.h>

#include <map>
#include <set>

#include "core/base/say.hpp"
#include "core/experiment/field_checks.hpp"
#include "core/experiment/fields.hpp"
#include "core/experiment/limits.hpp"
#include "core/plan/memory_layout.hpp"

namespace kilotwin {

using proto::Effect, proto::Function;
using Shape = Function::ShapeCase;

namespace {

constexpr int kMostFunctions = 8, kMostKnots = 1000, kMostKnots2d = 200;
constexpr double kNearestKnots = 1e-6, kSmallestScale = 1e-6;
/// Upper limit of an arena field's cells, 8 octets each.
constexpr double kMostCells = 4e6;

const char* name_of(Function::Covariate covariate) { return Function::Covariate_Name(covariate).c_str(); }

bool needs_radius(Function::Covariate c) { return c >= Function::NEIGHBOURS && c <= Function::NEAREST_BEARING; }
bool adds_up(Function::Covariate c) { return c == Function::NEIGHBOURS || c == Function::DENSITY; }
bool forgets(Function::Covariate c) { return c >= Function::MOTOR_TIME && c <= Function::DRIVEN_TIME; }
bool is_own_motors(Function::Covariate c) { return c == Function::DUTY || c == Function::MOTOR_TIME; }
bool is_count(Function::Covariate c) {
  switch (c) {
    case Function::ROBOT:
    case Function::RUN:
    case Function::COMMAND:
    case Function::PREVIOUS_COMMAND:
    case Function::LAST_TURN:
    case Function::EARLIER_TURN:
    case Function::COMMAND_COUNT:
    case Function::NEIGHBOURS:
    case Function::DUTY:
    case Function::LEFT_DUTY:
    case Function::RIGHT_DUTY: return true;
    default: return false;
  }
}

class EffectCheck {
 public:
  explicit EffectCheck(const LoadedExperiment& loaded) : loaded_(loaded), experiment_(loaded.experiment) {}

  void check() {
    if (experiment_.effect_size() > kMostEffects) {
      fail("effect",
           fmt::format("there are {} effects; it takes at most {}", experiment_.effect_size(), kMostEffects));
    }
    for (int i = 0; i < experiment_.field_size(); ++i) check_field(i);
    for (int i = 0; i < experiment_.effect_size(); ++i)
      check_effect(experiment_.effect(i), fmt::format("effect[{}]", i));
  }

 private:
  [[noreturn]] void fail(const std::string& path, const std::string& text) const {
    throw loaded_.locations.error(path, text);
  }
  void demand(bool condition, const std::string& path, const std::string& text) const {
    if (!condition) fail(path, text);
  }

  /// Checks that a name has allowed characters and is unique.
  void check_name(const std::string& name, bool given, const std::string& path, const char* what,
                  std::map<std::string, std::string>& known) const {
    demand(given, path, fmt::format("name is missing; state name: \"...\", one that no other {} has", what));
    const bool plain = name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_") ==
                       std::string::npos;
    demand(plain && !name.empty() && name.size() <= 100, path + ".name",
           fmt::format("name is \"{}\"; it takes 1 to 100 letters, digits, '-' and '_'", one_line(name, 60)));
    const auto [at, is_new] = known.emplace(name, path);
    demand(is_new, path + ".name",
           fmt::format("name is \"{}\", as that of the {} at {}; give each its own", name, what,
                       loaded_.locations.where(at->second)));
  }

  void check_field(int i) {
    const proto::ArenaField& field = experiment_.field(i);
    const std::string path = fmt::format("field[{}]", i);
    demand(i < kMostFields, path,
           fmt::format("there are {} fields; it takes at most {}", experiment_.field_size(), kMostFields));
    check_name(field.name(), field.has_name(), path, "field", fields_);
    const double cells = (experiment_.arena().width_mm() / field.cell_mm() + 1) *
                         (experiment_.arena().height_mm() / field.cell_mm() + 1);
    demand(cells <= kMostCells, path + ".cell_mm",
           fmt::format("cell_mm is {}, which cuts the arena into {:.3g} cells; make them so large that there are "
                       "at most {:.0f}",
                       number_text(field.cell_mm()), cells, kMostCells));
    demand(field.counts() != proto::ArenaField::TRAIL || field.forget_s() > 0, path + ".forget_s",
           "forget_s is 0; a field that counts TRAIL needs the time in which a trail fades, e.g. forget_s: 10");
  }

  void check_effect(const Effect& effect, const std::string& path) {
    check_name(effect.name(), effect.has_name(), path, "effect", effects_);
    demand(effect.has_acts_on(), path,
           "acts_on is missing; state what the effect acts on, e.g. acts_on: WHEEL_GAIN");
    const Effect::Target target = effect.acts_on();
    const bool on_wheels = target == Effect::WHEEL_GAIN || target == Effect::WHEEL_OFFSET;
    demand(on_wheels || !effect.has_wheel(), path + ".wheel",
           "wheel has no effect here; it goes with acts_on: WHEEL_GAIN or WHEEL_OFFSET");
    demand(target == Effect::WHEEL_GAIN || effect.sum().empty(), path + ".sum",
           "sum has no effect here; it goes with acts_on: WHEEL_GAIN, since all others are added in any case");
    const bool directed = target == Effect::BODY_DRIFT || target == Effect::WORLD_DRIFT ||
                          target == Effect::MEASURED_OFFSET || target == Effect::MEASURED_BODY_OFFSET;
    demand(directed || !effect.has_direction_deg(), path + ".direction_deg",
           "direction_deg has no effect here; it goes with drifts and measured offsets");
    demand(effect.function_size() >= 1 && effect.function_size() <= kMostFunctions,
           effect.function_size() == 0 ? path : path + ".function",
           fmt::format("there are {} functions; it takes 1..{}, function {{ ... }}", effect.function_size(),
                       kMostFunctions));
    for (int f = 0; f < effect.function_size(); ++f)
      check_function(effect.function(f), fmt::format("{}.function[{}]", path, f), on_wheels,
                     target >= Effect::MEASURED_OFFSET);
    std::set<std::uint32_t> robots;
    for (int i = 0; i < effect.robot_size(); ++i) {
      demand(robots.insert(effect.robot(i)).second, fmt::format("{}.robot[{}]", path, i),
             fmt::format("robot {} is named twice; name it once", effect.robot(i)));
    }
  }

  void check_function(const Function& function, const std::string& path, bool on_wheels, bool measured) const {
    const Shape shape = function.shape_case();
    demand(shape != Function::SHAPE_NOT_SET, path,
           "function has no shape; it takes constant, linear, exponential, harmonic, spline, spline_2d, steps, "
           "table, noise or episodes");
    const bool has_variable = function.of() != Function::NOTHING;
    if (shape == Function::kConstant || shape == Function::kNoise || shape == Function::kEpisodes) {
      demand(!has_variable, path + ".of",
             "of has no effect here; a constant, noise and episodes look at nothing, remove it");
    } else {
      demand(has_variable, path, "of is missing; state what the function looks at, e.g. of: TIME");
    }
    const bool has_second = function.and_of() != Function::NOTHING;
    demand((shape == Function::kSpline2D) == has_second, has_second ? path + ".and_of" : path,
           has_second ? "and_of has no effect here; it is the second variable of spline_2d"
                      : "and_of is missing; state the second variable of spline_2d, e.g. and_of: Y");
    const Function::Covariate variables[] = {function.of(), function.and_of()};
    const auto any = [&](auto&& is) { return is(variables[0]) || is(variables[1]); };
    demand(any(needs_radius) == function.has_radius_mm(), function.has_radius_mm() ? path + ".radius_mm" : path,
           function.has_radius_mm()
               ? "radius_mm has no effect here; it goes with NEIGHBOURS, NEAREST, DENSITY and NEAREST_BEARING"
               : "radius_mm is missing; state how far away robots count, mm");
    demand(!function.has_others() || any(needs_radius), path + ".others",
           "others has no effect here; it goes with NEIGHBOURS, NEAREST, DENSITY and NEAREST_BEARING");
    demand(function.other_robot().empty() || any(needs_radius), path + ".other_robot",
           "other_robot has no effect here; it goes with NEIGHBOURS, NEAREST, DENSITY and NEAREST_BEARING");
    demand(!function.has_focus() || any(adds_up), path + ".focus",
           "focus has no effect here; it goes with NEIGHBOURS and DENSITY");
    demand(!function.has_toward_deg() || function.focus() > 0, path + ".toward_deg",
           "toward_deg has no effect here; it goes with a focus above 0");
    demand(
        !function.has_forget_s() || any(forgets), path + ".forget_s",
        "forget_s has no effect here; it goes with MOTOR_TIME, LEFT_MOTOR_TIME, RIGHT_MOTOR_TIME and DRIVEN_TIME");
    demand(on_wheels || !any(is_own_motors), path + ".of",
           fmt::format("{} is that of a wheel's own motor, and the effect does not act on wheels; take one of the "
                       "left or the right motor",
                       name_of(is_own_motors(variables[0]) ? variables[0] : variables[1])));
    const bool of_place = any([](Function::Covariate c) { return c == Function::PLACE; });
    demand(!(of_place && measured), path + ".of",
           "PLACE is known to what moves robots alone; take it with a gain, an offset, a turn rate or a drift");
    demand(of_place == function.has_field(), function.has_field() ? path + ".field" : path,
           function.has_field() ? "field has no effect here; it goes with of: PLACE"
                                : "field is missing; state the name of an arena field, field: \"...\"");
    const bool of_point = any([](Function::Covariate c) { return c == Function::POINT_DISTANCE; });
    demand(of_point == function.has_point(), function.has_point() ? path + ".point" : path,
           function.has_point()
               ? "point has no effect here; it goes with of: POINT_DISTANCE"
               : "point is missing; state the centre of the circles, point { x_mm: ... y_mm: ... }");
    demand(!function.has_along_deg() || any([](Function::Covariate c) { return c == Function::ALONG; }),
           path + ".along_deg", "along_deg has no effect here; it goes with of: ALONG");
    demand(!of_place || fields_.contains(function.field()), path + ".field",
           fmt::format("there is no arena field \"{}\"; add field {{ name: \"{}\" }}, or name one that is there",
                       one_line(function.field(), 60), one_line(function.field(), 60)));
    demand(
        !(measured && shape == Function::kEpisodes), path + ".episodes",
        "episodes are known to what moves robots alone; take them with a gain, an offset, a turn rate or a drift");
    check_shape(function, path);
  }

  void check_shape(const Function& function, const std::string& path) const {
    switch (function.shape_case()) {
      case Function::kExponential: {
        const double scale = function.exponential().scale();
        demand(function.exponential().has_scale(), path + ".exponential",
               "scale is missing; state how far off the difference has fallen to 1/e");
        demand(scale >= kSmallestScale || scale <= -kSmallestScale, path + ".exponential.scale",
               fmt::format("scale is {}; it takes a number of at least 1e-6 in size", number_text(scale)));
        return;
      }
      case Function::kHarmonic:
        return demand(
            function.harmonic().period() >= kSmallestScale, path + ".harmonic.period",
            fmt::format("period is {}; it takes at least 1e-6", number_text(function.harmonic().period())));
      case Function::kSpline: {
        const proto::Spline& spline = function.spline();
        check_knots(spline.knot(), path + ".spline", "knot", 2, kMostKnots);
        return demand(spline.value_size() == spline.knot_size(), path + ".spline",
                      fmt::format("spline has {} knots and {} values; give as many of one as of the other",
                                  spline.knot_size(), spline.value_size()));
      }
      case Function::kSpline2D: {
        const proto::Spline2d& spline = function.spline_2d();
        check_knots(spline.knot(), path + ".spline_2d", "knot", 2, kMostKnots2d);
        check_knots(spline.and_knot(), path + ".spline_2d", "and_knot", 2, kMostKnots2d);
        return demand(
            spline.value_size() == spline.knot_size() * spline.and_knot_size(), path + ".spline_2d",
            fmt::format("spline_2d has {} x {} knots and {} values; give {}, one per pair", spline.knot_size(),
                        spline.and_knot_size(), spline.value_size(), spline.knot_size() * spline.and_knot_size()));
      }
      case Function::kSteps: {
        const proto::Steps& steps = function.steps();
        check_knots(steps.at(), path + ".steps", "at", 1, kMostKnots);
        return demand(steps.value_size() == steps.at_size() + 1, path + ".steps",
                      fmt::format("steps has {} at and {} values; give one value more than at", steps.at_size(),
                                  steps.value_size()));
      }
      case Function::kTable: {
        const proto::Table& table = function.table();
        demand(is_count(function.of()), path + ".of",
               fmt::format("a table takes whole numbers, and {} is none; take ROBOT, RUN, COMMAND, NEIGHBOURS or a "
                           "duty, or another shape",
                           name_of(function.of())));
        demand(function.focus() == 0, path + ".focus",
               "a table takes whole numbers, and with a focus neighbours add up to none; take another shape");
        demand(table.key_size() == table.value_size(), path + ".table",
               fmt::format("table has {} keys and {} values; give as many of one as of the other", table.key_size(),
                           table.value_size()));
        std::set<std::uint32_t> keys;
        for (int i = 0; i < table.key_size(); ++i)
          demand(keys.insert(table.key(i)).second, fmt::format("{}.table.key[{}]", path, i),
                 fmt::format("key {} is given twice; give it once", table.key(i)));
        return;
      }
      case Function::kNoise:
        return demand(function.noise().has_sd(), path + ".noise", "sd is missing; state the standard deviation");
      case Function::kEpisodes: {
        const proto::Episodes& episodes = function.episodes();
        demand(episodes.has_mean_apart_s(), path + ".episodes",
               "mean_apart_s is missing; state the mean time from the end of an episode to the next");
        return demand(episodes.has_scale_s(), path + ".episodes",
                      "scale_s is missing; state the scale of the episodes' lengths");
      }
      default: return;
    }
  }

  void check_knots(const google::protobuf::RepeatedField<double>& knots, const std::string& path, const char* name,
                   int least, int most) const {
    demand(knots.size() >= least && knots.size() <= most, path,
           fmt::format("there are {} of {}; it takes {}..{}", knots.size(), name, least, most));
    for (int i = 1; i < knots.size(); ++i) {
      demand(knots[i] - knots[i - 1] >= kNearestKnots, fmt::format("{}.{}[{}]", path, name, i),
             fmt::format("{} after {} does not ascend; each {} is at least 1e-6 more than the one before",
                         number_text(knots[i]), number_text(knots[i - 1]), name));
    }
  }

  const LoadedExperiment& loaded_;
  const proto::Experiment& experiment_;
  std::map<std::string, std::string> effects_, fields_;  ///< name to path in the experiment
};

}  // namespace

void check_effects(const LoadedExperiment& loaded) { EffectCheck(loaded).check(); }

}  // namespace kilotwin
