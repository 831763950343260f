#include "clients/cli/export_model.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>

#include <utility>
#include <vector>

#include "core/model/robot_parameters.hpp"
#include "core/os/files.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::cli {
namespace {

namespace pb = google::protobuf;

/// Sets every absent field to its default, so that the file is complete.
void write_defaults(pb::Message& message) {
  const pb::Reflection& r = *message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const pb::FieldDescriptor* const field = message.GetDescriptor()->field(i);
    if (field->is_repeated() || field->containing_oneof() != nullptr || r.HasField(message, field)) continue;
    switch (field->cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_DOUBLE: r.SetDouble(&message, field, field->default_value_double()); break;
      case pb::FieldDescriptor::CPPTYPE_UINT32: r.SetUInt32(&message, field, field->default_value_uint32()); break;
      case pb::FieldDescriptor::CPPTYPE_BOOL: r.SetBool(&message, field, field->default_value_bool()); break;
      case pb::FieldDescriptor::CPPTYPE_ENUM: r.SetEnum(&message, field, field->default_value_enum()); break;
      default: break;
    }
  }
}

/// Adds the robot's random draws to the parameters that the experiment states.
proto::RobotModel model_of(std::uint32_t robot, const RobotParameters& parameters, proto::RobotModel model) {
  const Calibration& calibration = parameters.calibration(robot);
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
  *model.mutable_motion() = manifest.experiment().motion();
  write_defaults(*model.mutable_motion());
  if (manifest.experiment().radio().model() == proto::Radio::PROPAGATION) {
    *model.mutable_propagation() = manifest.experiment().radio().propagation();
    write_defaults(*model.mutable_propagation());
  }
  *model.mutable_effect() = manifest.experiment().effect();
  *model.mutable_field() = manifest.experiment().field();
  std::string text = fmt::format("# The model of {}, seed {}, with the parameters of its robots.\n",
                                 plan.experiment_name(), plan.seed());
  std::string blocks;
  google::protobuf::TextFormat::PrintToString(model, &blocks);
  text += blocks;

  // One line per robot.
  google::protobuf::TextFormat::Printer line;
  line.SetSingleLineMode(true);
  const RobotParameters parameters(plan);
  std::vector<proto::RobotModel> stated(plan.robots());
  for (const proto::RobotModel& robot : manifest.experiment().robot_model()) {
    if (robot.robot() < plan.robots()) stated[robot.robot()] = robot;
  }
  std::uint32_t robots = 0;
  for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) {
    if (plan.tracked(robot)) continue;
    std::string fields;
    line.PrintToString(model_of(robot, parameters, std::move(stated[robot])), &fields);
    text += fmt::format("robot {{ {}}}\n", fields);
    ++robots;
  }
  os::write_file(file, text);
  return robots;
}

}  // namespace kilotwin::cli
