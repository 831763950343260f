#include "clients/importers/imported.hpp"

#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include <iterator>

namespace kilotwin::importers {

std::string experiment_text(const Imported& imported, const std::string& source) {
  std::string text = fmt::format("# Made of {} by kilotwin import.\n", source);
  if (!imported.notes.empty()) text += "# Not taken over as it was, with its line:\n";
  for (const std::string& note : imported.notes) fmt::format_to(std::back_inserter(text), "#   {}\n", note);
  std::string fields;
  google::protobuf::TextFormat::PrintToString(imported.experiment, &fields);
  return text + fields;
}

}  // namespace kilotwin::importers
