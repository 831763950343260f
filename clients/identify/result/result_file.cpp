#include "clients/identify/result/result_file.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <fstream>
#include <iterator>
#include <string>

#include "core/base/error.hpp"

namespace kilotwin::identify {

identification::Result read_result(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    throw UserError(
        fmt::format("{}: cannot be read; give the directory that kilotwin identify wrote", file.string()));
  const std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  identification::Result result;
  const auto status = google::protobuf::util::JsonStringToMessage(text, &result, options);
  if (!status.ok())
    throw UserError(fmt::format("{}: is no result of kilotwin identify: {}", file.string(),
                                std::string(status.message()).substr(0, 120)));
  return result;
}

}  // namespace kilotwin::identify
