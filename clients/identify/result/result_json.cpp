#include "clients/identify/result/result_json.hpp"

#include <google/protobuf/util/json_util.h>

#include <string>

#include "core/base/error.hpp"

namespace kilotwin::identify {

using nlohmann::json;

json json_of(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  KILOTWIN_DEMAND(status.ok());
  return json::parse(text);
}

json json_of(const identification::Result& result) {
  json out = json_of(static_cast<const google::protobuf::Message&>(result));
  for (const char* of_one_kind :
       {"robots", "statistics", "runs", "population", "measured_sent", "fitted_runs_themselves"}) {
    if (out.at(of_one_kind).empty()) out.erase(of_one_kind);
  }
  // Scripts read the entry whether or not there were windows enough for a learner.
  if (result.has_unexplained()) out["unexplained"].emplace("learner", nullptr);
  return out;
}

}  // namespace kilotwin::identify
