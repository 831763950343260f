#include "clients/cli/export_model.hpp"

#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include "clients/recorder/file.hpp"
#include "core/model/robot_parameters.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::cli {
namespace {

proto::RobotModel model_of(std::uint32_t robot, const RobotParameters& parameters) {
  const Calibration& calibration = parameters.calibration(robot);
  proto::RobotModel model;
  model.set_robot(robot);
  model.set_bias_left_mm_s(parameters.bias(robot).left_mm_s);
  model.set_bias_right_mm_s(parameters.bias(robot).right_mm_s);
  model.set_turn_left(calibration.turn_left);
  model.set_turn_right(calibration.turn_right);
  model.set_straight_left(calibration.straight_left);
  model.set_straight_right(calibration.straight_right);
  return model;
}

}  // namespace

std::uint32_t export_model(const proto::Manifest& manifest, const std::filesystem::path& file) {
  const RunPlan plan(manifest);
  proto::Model model;
  *model.mutable_motion() = plan.experiment().motion();
  *model.mutable_effect() = plan.experiment().effect();
  *model.mutable_field() = plan.experiment().field();
  std::string text = fmt::format("# The model of {}, seed {}, with the parameters of its robots.\n",
                                 plan.experiment().name(), plan.seed());
  std::string blocks;
  google::protobuf::TextFormat::PrintToString(model, &blocks);
  text += blocks;

  // A robot takes a line.
  google::protobuf::TextFormat::Printer line;
  line.SetSingleLineMode(true);
  const RobotParameters parameters(plan);
  std::uint32_t robots = 0;
  for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) {
    if (plan.tracked(robot)) continue;
    std::string fields;
    line.PrintToString(model_of(robot, parameters), &fields);
    text += fmt::format("robot {{ {}}}\n", fields);
    ++robots;
  }
  recorder::write_file(file, text);
  return robots;
}

}  // namespace kilotwin::cli
