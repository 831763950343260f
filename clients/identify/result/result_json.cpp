#include "clients/identify/result/result_json.hpp"

#include <google/protobuf/util/json_util.h>

#include <string>

#include "core/base/error.hpp"

namespace kilotwin::identify {

using nlohmann::json;

namespace {

/// Puts null where a number is not finite. The library prints such numbers as texts.
void drop_unknown_numbers(const google::protobuf::Message& message, json& out) {
  using Field = google::protobuf::FieldDescriptor;
  const google::protobuf::Descriptor& type = *message.GetDescriptor();
  if (type.file()->package() == "google.protobuf") return;  // values of any type
  for (int i = 0; i < type.field_count(); ++i) {
    const Field& field = *type.field(i);
    const auto found = out.find(field.name());
    if (field.is_map() || found == out.end()) continue;
    const auto each = [&](auto&& visit) {
      if (!field.is_repeated()) return visit(*found, -1);
      for (std::size_t n = 0; n < found->size(); ++n) visit((*found)[n], static_cast<int>(n));
    };
    if (field.cpp_type() == Field::CPPTYPE_DOUBLE) {
      each([](json& value, int) {
        if (value.is_string()) value = nullptr;
      });
    } else if (field.cpp_type() == Field::CPPTYPE_MESSAGE) {
      const google::protobuf::Reflection& reflection = *message.GetReflection();
      each([&](json& value, int n) {
        drop_unknown_numbers(
            n < 0 ? reflection.GetMessage(message, &field) : reflection.GetRepeatedMessage(message, &field, n),
            value);
      });
    }
  }
}

}  // namespace

json json_of(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) throw RunError("the result cannot be printed as JSON: " + std::string(status.message()));
  json out = json::parse(text);
  drop_unknown_numbers(message, out);
  return out;
}

json json_of(const identification::Result& result) {
  json out = json_of(static_cast<const google::protobuf::Message&>(result));
  for (const char* of_one_kind :
       {"robots", "statistics", "floor_numbers", "runs", "population", "measured_sent", "fitted_runs_themselves"}) {
    if (out.at(of_one_kind).empty()) out.erase(of_one_kind);
  }
  // Scripts read the entry whether or not there were windows enough for a learner.
  if (result.has_unexplained()) out["unexplained"].emplace("learner", nullptr);
  return out;
}

}  // namespace kilotwin::identify
