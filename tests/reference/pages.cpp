#include "tests/reference/pages.hpp"

#include <fmt/format.h>

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "tests/reference/commands.hpp"
#include "tests/reference/limits.hpp"
#include "tests/reference/schema.hpp"

namespace kilotwin::reference {

std::string read_text(const std::filesystem::path& path) {
  std::ifstream in{path};
  if (!in) throw std::runtime_error(fmt::format("{}: cannot be read", path.string()));
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

Regions regions(const std::filesystem::path& sources, const std::filesystem::path& program) {
  return {{"experiment", [] { return experiment_schema(KILOTWIN_SCHEMA); }},
          {"model", [] { return model_schema(KILOTWIN_SCHEMA); }},
          {"result-keys", [] { return result_keys(KILOTWIN_SCHEMA); }},
          {"topics", [sources] { return "```idl\n" + read_text(sources / "idl" / "public.idl") + "```\n"; }},
          {"limits", [] { return limits_table(); }},
          {"counters", [] { return counters_table(); }},
          {"commands", [program] { return commands_help(program); }}};
}

std::string regenerated(const std::string& page, const Regions& regions) {
  const std::string opening = "<!-- generated: ";
  std::string made;
  std::size_t from = 0;
  for (;;) {
    const std::size_t begin = page.find(opening, from);
    if (begin == std::string::npos) return made + page.substr(from);
    const std::size_t name_at = begin + opening.size();
    const std::string name = page.substr(name_at, page.find(" -->", name_at) - name_at);
    const auto region = regions.find(name);
    if (region == regions.end()) throw std::runtime_error("there is no region " + name);
    const std::string closing = fmt::format("<!-- end of {} -->", name);
    const std::size_t end = page.find(closing, name_at);
    if (end == std::string::npos) throw std::runtime_error(fmt::format("region {} lacks \"{}\"", name, closing));
    made += page.substr(from, begin - from) + opening + name + " -->\n" + region->second() + closing;
    from = end + closing.size();
  }
}

}  // namespace kilotwin::reference
