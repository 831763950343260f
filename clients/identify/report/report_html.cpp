#include "clients/identify/report/report_html.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <utility>

#include "clients/recorder/svg.hpp"

namespace kilotwin::identify::html {
namespace {

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    std::uint32_t three = 0;
    for (std::size_t i = 0; i < 3; ++i)
      three = three << 8 | (k + i < bytes.size() ? static_cast<std::uint8_t>(bytes[k + i]) : 0U);
    for (std::size_t i = 0; i < 4; ++i) out += k + i <= bytes.size() ? kDigits[three >> (18 - 6 * i) & 63] : '=';
  }
  return out;
}

constexpr std::string_view kStyle = R"(
:root { --ink: #1f2933; --faint: #5a6673; --line: #d8dee5; --before: #d95f0e; --after: #2563a8; --floor: #66727f; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2rem 1.5rem 4rem; max-width: 62rem; color: var(--ink); background: #fff;
  font: 16px/1.5 "Helvetica Neue", Helvetica, Arial, "DejaVu Sans", sans-serif; }
h1 { font-size: 1.9rem; line-height: 1.25; margin: 0.2rem 0 0.8rem; font-weight: 650; text-wrap: balance; }
h1 em { font-style: normal; color: var(--after); }
h2 { font-size: 1.25rem; margin: 2.6rem 0 0.4rem; padding-top: 0.9rem; border-top: 1px solid var(--line); }
h3 { font-size: 1.05rem; margin: 0 0 0.3rem; }
a { color: inherit; }
h3::first-letter, .what::first-letter, .effect p::first-letter { text-transform: uppercase; }
.kicker { margin: 0; color: var(--faint); font-size: 0.85rem; letter-spacing: 0.03em; }
.verdict { font-size: 1.1rem; max-width: 50rem; margin: 0 0 1.2rem; }
.lead { color: var(--faint); max-width: 50rem; margin: 0 0 0.8rem; }
.bars { display: grid; gap: 0.45rem; }
.bar { display: grid; grid-template-columns: 5.5rem 1fr 18rem; gap: 0.8rem; align-items: center; }
.track { display: block; height: 1.1rem; background: #f1f4f7; border-radius: 3px; }
.fill { display: block; height: 100%; border-radius: 3px; }
.fill.before { background: var(--before); } .fill.after { background: var(--after); } .fill.floor { background: #b6c0ca; }
small { color: var(--faint); font-size: 0.85rem; }
.effect { display: grid; grid-template-columns: 1fr 460px; gap: 1.5rem; align-items: start; padding: 0.9rem 0; }
.effect + .effect { border-top: 1px dotted var(--line); }
.effect p { margin: 0 0 0.6rem; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 0.1rem 0.9rem; margin: 0; font-size: 0.92rem; }
dt { color: var(--faint); } dd { margin: 0; }
figure { margin: 0 0 1rem; }
figure img { max-width: 100%; height: auto; display: block; }
figure.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 0.5rem 1rem; justify-items: center; margin-bottom: 1.4rem; }
figure.pair figcaption { grid-column: 1 / -1; justify-self: start; }
figcaption { color: var(--faint); font-size: 0.88rem; margin-top: 0.2rem; }
.grid { display: grid; grid-template-columns: 1fr 1fr; gap: 0.3rem 1rem; }
.thirds { display: grid; grid-template-columns: repeat(3, 1fr); gap: 0.5rem 2rem; align-items: start; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: 0.88rem; font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 600; color: var(--faint); border-bottom: 1px solid var(--line); padding: 0.3rem 0.8rem 0.3rem 0; vertical-align: bottom; }
td { border-bottom: 1px solid #eef1f4; padding: 0.3rem 0.8rem 0.3rem 0; vertical-align: top; }
table.facts thead { display: none; } table.facts td:last-child { text-align: right; padding-right: 0; }
details summary { cursor: pointer; color: var(--faint); margin: 0.4rem 0; }
.faults b { text-transform: capitalize; margin-right: 0.3em; }
@media screen and (max-width: 56rem) { .effect, .grid, .thirds, figure.pair { grid-template-columns: 1fr; } .bar { grid-template-columns: 5.5rem 1fr; } .bar .value { grid-column: 2; } }
@page { size: A4; margin: 14mm 13mm; }
@media print {
  body { padding: 0; max-width: none; font-size: 10pt; }
  h1 { font-size: 16pt; } .verdict { font-size: 11pt; } h2 { font-size: 12.5pt; margin-top: 1.2rem; break-after: avoid; } .lead { break-after: avoid; break-inside: avoid; }
  .effect { grid-template-columns: 1fr 9cm; } .bar { grid-template-columns: 5rem 1fr 15rem; }
  figure, .effect, tr, .bars, .thirds > div { break-inside: avoid; }
  .grid, figure.pair { grid-template-columns: 1fr 1fr; }
  .thirds { grid-template-columns: repeat(3, 1fr); } table { font-size: 8pt; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
)";

}  // namespace

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

std::string image(std::string_view svg, std::string_view alt) {
  return fmt::format("<img alt=\"{}\" src=\"data:image/svg+xml;base64,{}\">", escaped(alt), base64(svg));
}

void Table::row(const std::vector<std::string>& cells) {
  rows_ += "<tr>";
  for (const std::string& cell : cells) rows_ += "<td>" + cell + "</td>";
  rows_ += "</tr>\n";
}

std::string Table::text(std::string_view kind) const {
  std::string out = kind.empty() ? "<div class=\"scroll\"><table><thead><tr>"
                                 : fmt::format("<div class=\"scroll\"><table class=\"{}\"><thead><tr>", kind);
  for (const std::string& head : heads_) out += "<th>" + head + "</th>";
  return out + "</tr></thead><tbody>\n" + rows_ + "</tbody></table></div>\n";
}

std::string page(std::string_view title, std::string_view body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style></head>\n<body>\n{}</body></html>\n",
      escaped(title), kStyle, body);
}

}  // namespace kilotwin::identify::html
