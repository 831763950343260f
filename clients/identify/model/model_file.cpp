#include "clients/identify/model/model_file.hpp"

#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "clients/identify/model/effect_records.hpp"

namespace kilotwin::identify {
namespace {

proto::Effect& add_effect(proto::Model& model, const std::string& name, proto::Effect::Target target) {
  proto::Effect& effect = *model.add_effect();
  effect.set_name(name);
  effect.set_acts_on(target);
  return effect;
}

void add_noise(proto::Model& model, const std::string& name, proto::Effect::Target target, double direction_deg,
               double sd) {
  proto::Effect& effect = add_effect(model, name, target);
  if (direction_deg != 0) effect.set_direction_deg(direction_deg);
  effect.add_function()->mutable_noise()->set_sd(rounded(sd));
}

}  // namespace

proto::Model proto_of(const MotionModel& fitted) {
  proto::Model model;
  proto::Motion& motion = *model.mutable_motion();
  motion.set_noise(true);
  motion.set_straight_speed_mm_s(rounded(fitted.base.straight_mm_s));
  motion.set_turn_speed_mm_s(rounded(fitted.base.turn_mm_s));
  motion.set_wheel_base_mm(rounded(fitted.base.wheel_base_mm));
  // The simulator takes no disc centre outside of the body.
  const double centre_mm = std::clamp(fitted.base.centre_mm, -kDiscDiameter_mm / 2, kDiscDiameter_mm / 2);
  motion.set_axle_offset_mm(rounded(centre_mm));
  motion.set_bias_mean_mm_s(rounded(fitted.base.bias_mean_mm_s));
  motion.set_bias_sd_mm_s(rounded(fitted.base.bias_sd_mm_s));
  motion.set_factor_variance_s(rounded(fitted.noise.factor_s));
  motion.set_spin_up_s(0);  // included in the fitted speeds
  for (const auto& [robot, bias] : fitted.robots) {
    proto::RobotModel& own = *model.add_robot();
    own.set_robot(robot);
    own.set_bias_left_mm_s(rounded(bias.mean_mm_s[0]));
    own.set_bias_right_mm_s(rounded(bias.mean_mm_s[1]));
  }
  const double ahead = fitted.base.ahead_mm - centre_mm;
  const double off = std::hypot(ahead, fitted.base.left_mm);
  if (off > 1e-3) {
    proto::Effect& point = add_effect(model, "tracked-point", proto::Effect::MEASURED_BODY_OFFSET);
    point.set_direction_deg(rounded(std::atan2(fitted.base.left_mm, ahead) * 180 / M_PI));
    point.add_function()->set_constant(rounded(off));
  }
  add_noise(model, "wheel-noise", proto::Effect::WHEEL_OFFSET, 0, std::sqrt(fitted.noise.wheel_mm2_s));
  add_noise(model, "heading-noise", proto::Effect::TURN_RATE, 0, std::sqrt(fitted.noise.heading_rad2_s));
  add_noise(model, "tracker-x", proto::Effect::MEASURED_OFFSET, 0, std::sqrt(fitted.noise.position_mm2));
  add_noise(model, "tracker-y", proto::Effect::MEASURED_OFFSET, 90, std::sqrt(fitted.noise.position_mm2));
  add_noise(model, "tracker-heading", proto::Effect::MEASURED_HEADING, 0, std::sqrt(fitted.noise.heading_rad2));
  for (std::uint8_t c = 0; c < kTrafficGrids; ++c) {
    if (!fitted.looks_at({Covariate::kTraffic, c})) continue;
    proto::ArenaField& field = *model.add_field();
    field.set_name(field_name(c));
    field.set_counts(fitted.cells[c].trail ? proto::ArenaField::TRAIL : proto::ArenaField::DRIVEN_TIME);
    field.set_cell_mm(rounded(fitted.cells[c].side_mm));
    field.set_corner_x_mm(rounded(fitted.cells[c].x_mm));
    field.set_corner_y_mm(rounded(fitted.cells[c].y_mm));
    if (fitted.cells[c].forget_s > 0) field.set_forget_s(rounded(fitted.cells[c].forget_s));
  }
  if (fitted.stalls) {
    proto::Effect& effect = add_effect(model, "stalls", proto::Effect::WHEEL_GAIN);
    effect.add_function()->set_constant(rounded(fitted.stalls->gain - 1));
    proto::Episodes& episodes = *effect.add_function()->mutable_episodes();
    episodes.set_mean_apart_s(rounded(fitted.stalls->mean_apart_s));
    episodes.set_scale_s(rounded(fitted.stalls->scale_s));
    episodes.set_tail(rounded(fitted.stalls->tail));
    episodes.set_longest_s(rounded(fitted.stalls->longest_s));
    if (fitted.stalls->shape != 1) episodes.set_shape(rounded(fitted.stalls->shape));
  }
  std::set<std::string> names;
  std::map<std::string, int> terms_named;
  for (const Term& term : fitted.terms) {
    const int number = ++terms_named[term.name];
    for (const proto::Effect& effect : effects_of_term(term)) {
      std::string name = effect.name();
      for (int again = 2; !names.insert(name).second; ++again)
        name = fmt::format("{}-again{}", effect.name(), again);
      proto::Effect& written = *model.add_effect();
      written = effect;
      written.set_name(name);
      // Gains of different terms multiply, also those of one name.
      if (number > 1 && effect.has_sum()) written.set_sum(fmt::format("{}-again{}", effect.sum(), number));
    }
  }
  return model;
}

std::string text_of(const proto::Model& model, const std::string& remark) {
  proto::Model rest = model;
  rest.clear_robot();
  std::string blocks;
  google::protobuf::TextFormat::PrintToString(rest, &blocks);
  std::string text = fmt::format("# {}\n{}", remark, blocks);
  google::protobuf::TextFormat::Printer line;
  line.SetSingleLineMode(true);
  for (const proto::RobotModel& robot : model.robot()) {
    std::string fields;
    line.PrintToString(robot, &fields);
    text += fmt::format("robot {{ {}}}\n", fields);
  }
  return text;
}

}  // namespace kilotwin::identify
