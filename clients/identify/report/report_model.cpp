#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <cmath>

#include "clients/identify/report/report_sections.hpp"
#include "core/stats/distributions.hpp"

namespace kilotwin::identify::report {
namespace {

using google::protobuf::FieldDescriptor, google::protobuf::Message;
using Rows = std::vector<std::vector<std::string>>;

/// A number of a message; nothing if it is absent or not known.
std::optional<double> number_of(const Message& message, const FieldDescriptor& field) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  if (field.cpp_type() != FieldDescriptor::CPPTYPE_DOUBLE ||
      (field.has_presence() && !reflection.HasField(message, &field)))
    return std::nullopt;
  const double value = reflection.GetDouble(message, &field);
  return known(std::isfinite(value), value);
}

/// A field as text; empty if it is absent.
std::string text_of(const Message& message, const FieldDescriptor& field) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  if (field.is_repeated() || (field.has_presence() && !reflection.HasField(message, &field))) return "";
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE: return figure(reflection.GetDouble(message, &field));
    case FieldDescriptor::CPPTYPE_UINT32: return std::to_string(reflection.GetUInt32(message, &field));
    case FieldDescriptor::CPPTYPE_BOOL: return reflection.GetBool(message, &field) ? "yes" : "no";
    case FieldDescriptor::CPPTYPE_STRING: return reflection.GetString(message, &field);
    default: return "";
  }
}

/// The fields of a message as a table of two columns. `after`: what follows the text of a field.
template <typename After> std::string facts_of(const Message& message, const After& after) {
  Rows rows;
  for (int f = 0; f < message.GetDescriptor()->field_count(); ++f) {
    const FieldDescriptor& field = *message.GetDescriptor()->field(f);
    if (const std::string text = text_of(message, field); !text.empty())
      rows.push_back({html::with_unit(field.name()), text + after(field)});
  }
  return rows.empty() ? "" : table_of({"", ""}, rows, "facts");
}

std::string interval_in_words(std::optional<double> low, std::optional<double> high) {
  return low && high ? fmt::format(" ({} to {})", figure(low), figure(high)) : "";
}

}  // namespace

Section model_section(const Identification& found) {
  const Result& result = found.result();
  Data tables{Data::type::list};
  const auto add = [&](const char* title, const std::string& table) {
    if (table.empty()) return;
    Data one{Data::type::object};
    one.set("of", title);
    one.set("table", table);
    tables << one;
  };
  add("Drive", facts_of(result.base(), [&](const FieldDescriptor& field) {
        const auto sd = number_of(result.base_sd(), field);
        return sd ? " ± " + figure(stats::kNormal95 * *sd) : "";
      }));
  if (result.has_noise())
    add("Noise", facts_of(result.noise(), [&](const FieldDescriptor& field) {
          if (!result.has_noise_low()) return std::string();
          return interval_in_words(number_of(result.noise_low(), field), number_of(result.noise_high(), field));
        }));
  add("Walls", facts_of(result.walls(), [&](const FieldDescriptor& field) {
        return interval_in_words(number_of(result.walls_low(), field), number_of(result.walls_high(), field));
      }));
  add("Data", facts_of(found.set(), [](const FieldDescriptor&) { return ""; }));
  if (tables.is_empty_list()) return std::nullopt;
  Data section{Data::type::object};
  set_text(section, "disc_centre", result.disc_centre().in_words());
  if (const identification::CommandLag& lag = result.command_lag(); lag.has_low_s() && lag.has_high_s())
    section.set("lag", fmt::format("{:.3f} s ({:.3f} to {:.3f} s, 95 %)", lag.lag_s(), lag.low_s(), lag.high_s()));
  if (result.has_base_sd() || result.has_noise_low()) section.set("intervals", Data{Data::type::bool_true});
  section.set("tables", tables);
  return section;
}

Section robots_section(const Result& result) {
  if (result.robots().empty()) return std::nullopt;
  Rows rows;
  const auto bias = [](double mean_mm_s, double sd_mm_s) {
    return figure(mean_mm_s) + " ± " + figure(stats::kNormal95 * sd_mm_s);
  };
  for (const identification::Robot& robot : result.robots())
    rows.push_back({std::to_string(robot.robot()), bias(robot.bias_left_mm_s(), robot.sd_left_mm_s()),
                    bias(robot.bias_right_mm_s(), robot.sd_right_mm_s()),
                    figure(known(robot.has_noise_ratio(), robot.noise_ratio())) +
                        interval_in_words(known(robot.has_noise_ratio_low(), robot.noise_ratio_low()),
                                          known(robot.has_noise_ratio_high(), robot.noise_ratio_high())),
                    figure(known(robot.has_before_mm(), robot.before_mm())),
                    figure(known(robot.has_after_mm(), robot.after_mm()))});
  return Data{"table", table_of({"robot", "bias left, mm/s", "bias right, mm/s", "noise over the common one",
                                 "error before, mm", "error after, mm"},
                                rows)};
}

}  // namespace kilotwin::identify::report
