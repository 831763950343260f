#include "clients/identify/report/report.hpp"

#include <string>

#include "clients/identify/report/report_sections.hpp"
#include "clients/identify/report/report_summary.hpp"
#include "clients/report/templates.hpp"
#include "core/os/files.hpp"

namespace kilotwin::identify {

using namespace report;

namespace {

/// Further tables of the result, one section each.
Data tables_of(const Identification& found) {
  Data tables{Data::type::list};
  for (const identification::Table& given : found.tables()) {
    std::vector<std::vector<std::string>> rows;
    for (const google::protobuf::ListValue& row : given.rows()) {
      rows.emplace_back();
      for (const google::protobuf::Value& cell : row.values()) rows.back().push_back(cell.string_value());
    }
    Data one{Data::type::object};
    one.set("id", given.id());
    one.set("title", given.title());
    set_text(one, "lead", given.lead());
    one.set("table", table_of({given.head().begin(), given.head().end()}, rows));
    tables << one;
  }
  return tables;
}

Section faults_of(const Result& result) {
  Data faults{Data::type::list};
  for (const identification::Fault& fault : result.faults()) {
    Data one{Data::type::object};
    one.set("kind", fault.kind());
    one.set("words", fault.in_words());
    faults << one;
  }
  if (faults.is_empty_list()) return std::nullopt;
  return Data{"faults", faults};
}

/// All values of identification.mustache.
Data page_of(const Identification& found, Figures& figures) {
  const Result& result = found.result();
  Data page{Data::type::object};
  const auto add = [&](const char* name, const Section& section) {
    if (section) page.set(name, *section);
  };
  page.set("figures_template", std::string(html::templates::kFigures));
  add_summary(page, found);
  add("effects", effects_section(found, figures));
  add("improvement", improvement_section(found, figures));
  add("unexplained", unexplained_section(result.unexplained(), figures));
  page.set("given_tables", tables_of(found));
  add("data_faults", faults_of(result));
  add("residual_maps", residual_map_section(found, figures));
  add("simulated", simulated_section(found, figures));
  add("covariates", covariate_section(found, figures));
  add("evidence", evidence_section(result));
  add("ambiguous", ambiguous_section(result));
  add("rejected", rejected_section(result));
  add("model", model_section(found));
  add("robots", robots_section(result));
  return page;
}

}  // namespace

std::string report_html(const Identification& found) {
  Gnuplot gnuplot;
  Figures figures(gnuplot);
  const Data page = page_of(found, figures);
  return html::page("Kilotwin: identification report",
                    figures.filled(html::rendered(html::templates::kIdentification, page)));
}

void write_report(const Identification& found, const std::filesystem::path& file) {
  os::write_file(file, report_html(found));
}

}  // namespace kilotwin::identify
