#include "clients/report/html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "clients/recorder/svg.hpp"
#include "clients/report/templates.hpp"
#include "core/base/base64.hpp"
#include "core/base/error.hpp"

namespace kilotwin::html {
std::string escaped(std::string_view text) { return recorder::svg::escaped(text); }

std::string with_unit(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kUnits = {{{"_mm2_s", "mm²/s"},
                                                                                    {"_rad_s", "rad/s"},
                                                                                    {"_mm_s", "mm/s"},
                                                                                    {"_variance_s", "s"},
                                                                                    {"_mm2", "mm²"},
                                                                                    {"_rad", "rad"},
                                                                                    {"_mm", "mm"},
                                                                                    {"_deg", "degrees"},
                                                                                    {"_s", "s"}}};
  std::string unit;
  for (const auto& [ending, word] : kUnits) {
    if (!name.ends_with(ending) || name.size() == ending.size()) continue;
    unit = word;
    name.remove_suffix(ending == "_variance_s" ? 2 : ending.size());
    break;
  }
  std::string out(name);
  for (char& c : out) c = c == '_' ? ' ' : c;
  return unit.empty() ? out : out + ", " + unit;
}

std::string mark_of(std::size_t plot) { return fmt::format("<plot {}>", plot); }

std::string image(std::string_view svg, std::string_view alt, Ground ground) {
  return fmt::format("<img{} alt=\"{}\" src=\"data:image/svg+xml;base64,{}\">",
                     ground == Ground::kPage ? " class=\"plot\"" : "", escaped(alt), base64(svg));
}

void Table::row(const std::vector<std::string>& cells) {
  Data list{Data::type::list};
  for (const std::string& cell : cells) list << Data{"cell", cell};
  Data row{Data::type::object};
  row.set("cells", list);
  rows_.push_back(std::move(row));
}

std::string Table::text(std::string_view kind) const {
  Data heads{Data::type::list}, rows{Data::type::list}, table{Data::type::object};
  for (const std::string& head : heads_) heads << Data{"head", head};
  for (const Data& row : rows_) rows << row;
  if (!kind.empty()) table.set("kind", std::string(kind));
  table.set("heads", heads);
  table.set("rows", rows);
  return rendered(templates::kTable, table);
}

std::string bars(const std::vector<Bar>& bars, double longest) {
  if (!(longest > 0)) return "";
  Data list{Data::type::list}, all{Data::type::object};
  for (const Bar& bar : bars) {
    Data one{Data::type::object};
    one.set("what", bar.what);
    one.set("kind", bar.kind);
    one.set("percent", fmt::format("{:.1f}", std::clamp(100 * bar.length / longest, 0.0, 100.0)));
    one.set("value", bar.value);
    if (!bar.interval.empty()) one.set("interval", bar.interval);
    list << one;
  }
  all.set("bars", list);
  return rendered(templates::kBars, all);
}

std::string page(std::string_view title, std::string_view body) {
  Data page{Data::type::object};
  page.set("title", std::string(title));
  page.set("style", std::string(templates::kStyle));
  page.set("body", std::string(body));
  return rendered(templates::kPage, page);
}

std::string rendered(std::string_view text, const Data& data) {
  kainjow::mustache::mustache page{std::string(text)};
  page.set_custom_escape([](const std::string& given) { return escaped(given); });
  std::string out = page.render(data);
  // Templates are part of the program.
  KILOTWIN_DEMAND(page.is_valid() && page.error_message().empty());
  return out;
}

}  // namespace kilotwin::html
