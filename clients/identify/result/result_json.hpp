/// The result as JSON: result.json, and the data of the page's template.
#pragma once

#include <google/protobuf/message.h>

#include <nlohmann/json.hpp>

#include "idl/identification.pb.h"

namespace kilotwin::identify {

/// By protobuf's JSON printer, with the field names of the schema. Lists are there even if empty.
[[nodiscard]] nlohmann::json json_of(const google::protobuf::Message&);

/// result.json. Fields of other kinds of data are left out.
[[nodiscard]] nlohmann::json json_of(const identification::Result&);

}  // namespace kilotwin::identify
