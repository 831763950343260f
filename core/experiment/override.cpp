// Overrides from the command line, by reflection (declared in load.hpp).
#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <charconv>
#include <vector>

#include "core/base/say.hpp"
#include "core/experiment/fields.hpp"
#include "core/experiment/load.hpp"

namespace kilotwin {
namespace pb = google::protobuf;

namespace {

using pb::FieldDescriptor;

struct Step {
  const FieldDescriptor* field;
  int index;  ///< 0 if the field is not a list
};

/// Applies one `PATH=VALUE` argument to the experiment.
class Override {
 public:
  Override(std::string_view argument, std::string_view option) : argument_(argument), option_(option) {}
  void apply(LoadedExperiment& loaded);

 private:
  [[nodiscard]] UserError error(std::string_view text) const {
    return UserError{fmt::format("{}: {}", one_line(option_, 200), text)};
  }
  Step parse_step(std::string_view segment, const pb::Descriptor& type) const;
  void assign(pb::Message& message, const Step& step, std::string_view value) const;
  template <class Number> Number number(const FieldDescriptor& field, std::string_view value) const;
  bool boolean(const FieldDescriptor& field, std::string_view value) const;
  const pb::EnumValueDescriptor* enumerator(const FieldDescriptor& field, std::string_view value) const;
  UserError unfit(const FieldDescriptor& field, std::string_view value) const {
    return error(fmt::format("{} cannot be {}; it takes {}", field.name(),
                             value.empty() ? "empty" : one_line(value, 60), value_text(field)));
  }
  void demand_element(const pb::Message& message, const Step& step) const;

  std::string_view argument_;
  std::string option_;
};

Step Override::parse_step(std::string_view segment, const pb::Descriptor& type) const {
  const std::size_t bracket = segment.find('[');
  const std::string_view name = segment.substr(0, bracket);
  const FieldDescriptor* const field = type.FindFieldByName(std::string{name});
  if (field == nullptr) {
    std::string right = field_suggestion(name, type);
    if (right.ends_with('?')) right += " Its fields are " + field_names(type);
    throw error(fmt::format("unknown field {} in {}; {}", one_line(name, 60), type.name(), right));
  }
  if (bracket == std::string_view::npos) return Step{field, 0};
  if (!field->is_repeated()) throw error(fmt::format("{} is no list; write it without an index", field->name()));
  const std::string_view digits = segment.substr(bracket + 1);
  int index = -1;
  const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
  if (failure != std::errc{} || index < 0 || std::string_view{end, digits.data() + digits.size()} != "]") {
    throw error(fmt::format("{} is no element of a list; write {}[0]", one_line(segment, 60), field->name()));
  }
  return Step{field, index};
}

void Override::demand_element(const pb::Message& message, const Step& step) const {
  const int size = message.GetReflection()->FieldSize(message, step.field);
  if (step.index > size) {
    throw error(fmt::format("{0}[{1}] does not exist; {0} has {2} elements, the next to be created is {0}[{2}]",
                            step.field->name(), step.index, size));
  }
}

template <class Number> Number Override::number(const FieldDescriptor& field, std::string_view value) const {
  Number result{};
  const auto [end, failure] = std::from_chars(value.data(), value.data() + value.size(), result);
  if (failure != std::errc{} || end != value.data() + value.size()) throw unfit(field, value);
  return result;
}

bool Override::boolean(const FieldDescriptor& field, std::string_view value) const {
  if (value == "true" || value == "1") return true;
  if (value == "false" || value == "0") return false;
  throw unfit(field, value);
}

const pb::EnumValueDescriptor* Override::enumerator(const FieldDescriptor& field, std::string_view value) const {
  const auto* const found = field.enum_type()->FindValueByName(std::string{value});
  if (found == nullptr) throw unfit(field, value);
  return found;
}

void Override::assign(pb::Message& message, const Step& step, std::string_view value) const {
  const pb::Reflection& reflection = *message.GetReflection();
  const FieldDescriptor* const field = step.field;
  const bool list = field->is_repeated();
  const bool append = list && step.index == reflection.FieldSize(message, field);
  // Reflection has three functions per type: set a field, add an element, set an element. Call the right one.
  const auto put = [&](auto set, auto add, auto set_element, const auto& content) {
    if (!list)
      (reflection.*set)(&message, field, content);
    else if (append)
      (reflection.*add)(&message, field, content);
    else
      (reflection.*set_element)(&message, field, step.index, content);
  };
  using R = pb::Reflection;
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return put(&R::SetDouble, &R::AddDouble, &R::SetRepeatedDouble, number<double>(*field, value));
    case FieldDescriptor::CPPTYPE_UINT32:
      return put(&R::SetUInt32, &R::AddUInt32, &R::SetRepeatedUInt32, number<std::uint32_t>(*field, value));
    case FieldDescriptor::CPPTYPE_UINT64:
      return put(&R::SetUInt64, &R::AddUInt64, &R::SetRepeatedUInt64, number<std::uint64_t>(*field, value));
    case FieldDescriptor::CPPTYPE_BOOL:
      return put(&R::SetBool, &R::AddBool, &R::SetRepeatedBool, boolean(*field, value));
    case FieldDescriptor::CPPTYPE_ENUM:
      return put(&R::SetEnum, &R::AddEnum, &R::SetRepeatedEnum, enumerator(*field, value));
    case FieldDescriptor::CPPTYPE_STRING:
      return put(&R::SetString, &R::AddString, &R::SetRepeatedString, std::string{value});
    default:
      throw error(fmt::format("{} is a block and takes no value; set one of its fields: {}", field->name(),
                              field_names(*field->message_type())));
  }
}

void Override::apply(LoadedExperiment& loaded) {
  const std::size_t equals = argument_.find('=');
  if (equals == std::string_view::npos) {
    throw error("there is no value; write FIELD=VALUE, for instance arena.width_mm=1000");
  }
  std::string_view rest = argument_.substr(0, equals);
  const std::string_view value = argument_.substr(equals + 1);

  proto::Experiment changed = loaded.experiment;
  pb::Message* message = &changed;
  std::string path;
  std::vector<std::string> created;
  for (;;) {
    const std::size_t dot = rest.find('.');
    const Step step = parse_step(rest.substr(0, dot), *message->GetDescriptor());
    const pb::Reflection& reflection = *message->GetReflection();
    path += (path.empty() ? "" : ".") + step.field->name();
    if (step.field->is_repeated()) {
      demand_element(*message, step);
      path += fmt::format("[{}]", step.index);
    }
    if (dot == std::string_view::npos) {
      assign(*message, step, value);
      break;
    }
    if (step.field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
      throw error(fmt::format("{0} has no fields of its own; write {0}=VALUE", step.field->name()));
    }
    const bool present = step.field->is_repeated() ? step.index < reflection.FieldSize(*message, step.field)
                                                   : reflection.HasField(*message, step.field);
    if (!present) created.push_back(path);
    if (!step.field->is_repeated())
      message = reflection.MutableMessage(message, step.field);
    else if (!present)
      message = reflection.AddMessage(message, step.field);
    else
      message = reflection.MutableRepeatedMessage(message, step.field, step.index);
    rest = rest.substr(dot + 1);
  }
  loaded.experiment = std::move(changed);
  for (std::string& block : created) loaded.locations.set_option(std::move(block), one_line(option_, 200));
  loaded.locations.set_option(std::move(path), one_line(option_, 200));
}

}  // namespace

void apply_override(LoadedExperiment& loaded, std::string_view argument, std::string_view option) {
  Override{argument, option.empty() ? "--set " + std::string{argument} : std::string{option}}.apply(loaded);
}

void set_robots(LoadedExperiment& loaded, std::uint32_t count) {
  apply_override(loaded, fmt::format("robots[0].count={}", count), fmt::format("--robots {}", count));
}

void set_behaviour(LoadedExperiment& loaded, const std::filesystem::path& program) {
  if (loaded.experiment.robots_size() == 0) loaded.experiment.add_robots();
  loaded.experiment.mutable_robots(0)->clear_behaviour();
  loaded.experiment.mutable_robots(0)->add_behaviour(std::filesystem::absolute(program).string());
  loaded.locations.set_option("robots[0].behaviour", "--behaviour " + one_line(program.string()));
}

}  // namespace kilotwin
