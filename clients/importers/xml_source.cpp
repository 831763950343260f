#include "clients/importers/xml_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "core/base/error.hpp"

namespace kilotwin::importers {
namespace {

int line_at(std::string_view text, std::ptrdiff_t offset) {
  const std::size_t end = std::min(text.size(), static_cast<std::size_t>(std::max<std::ptrdiff_t>(offset, 0)));
  return 1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
}

/// The number at the start of the text, behind spaces; moves the text on.
std::optional<double> leading_number(const char*& text) {
  char* end = nullptr;
  const double value = std::strtod(text, &end);
  if (end == text) return std::nullopt;
  text = end;
  while (*text == ' ') ++text;
  return value;
}

}  // namespace

XmlSource::XmlSource(std::string_view text, const std::string& name) : text_(text), name_(name) {
  const pugi::xml_parse_result result = document_.load_buffer(text_.data(), text_.size());
  if (!result)
    throw UserError(fmt::format("{}:{}: is no XML: {}", name, line_at(text_, result.offset), result.description()));
}

int XmlSource::line_of(pugi::xml_node node) const { return line_at(text_, node.offset_debug()); }

std::string XmlSource::place(pugi::xml_node node, const char* attribute) const {
  return fmt::format("{}:{}: <{} {}=\"{}\">", name_, line_of(node), node.name(), attribute,
                     node.attribute(attribute).value());
}

std::string XmlSource::text(pugi::xml_node node, const char* attribute) {
  take(node);
  read_.emplace(node.hash_value(), attribute);
  return node.attribute(attribute).value();
}

std::optional<double> XmlSource::number(pugi::xml_node node, const char* attribute) {
  const std::string words = text(node, attribute);
  if (words.empty()) return std::nullopt;
  const char* at = words.c_str();
  const std::optional<double> value = leading_number(at);
  if (!value || *at != 0) throw UserError(place(node, attribute) + ": is no number");
  return value;
}

std::array<double, 3> XmlSource::triple(pugi::xml_node node, const char* attribute) {
  const std::string words = text(node, attribute);
  std::array<double, 3> values{};
  if (words.empty()) return values;
  const char* at = words.c_str();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::optional<double> value = leading_number(at);
    const char expected = i + 1 < values.size() ? ',' : '\0';
    if (!value || *at != expected)
      throw UserError(place(node, attribute) + ": expected three numbers, as in \"1,2,0\"");
    values[i] = *value;
    if (*at != 0) ++at;
  }
  return values;
}

void XmlSource::take_all(pugi::xml_node node) {
  take(node);
  for (const pugi::xml_attribute attribute : node.attributes()) read_.emplace(node.hash_value(), attribute.name());
  for (const pugi::xml_node child : node.children()) take_all(child);
}

void XmlSource::note(pugi::xml_node node, const std::string& remark) {
  const int line = line_of(node);
  notes_.emplace(line, fmt::format("{}: <{}>: {}", line, node.name(), remark));
}

void XmlSource::note_unread(pugi::xml_node node, const std::map<std::string, std::string>& reasons) {
  if (node.type() != pugi::node_element) return;
  const std::string name = node.name();
  if (!taken_.contains(node.hash_value())) {
    const auto reason = reasons.find(name);
    if (reason == reasons.end()) {
      note(node, "has no counterpart that this program knows");
      return;
    }
    if (!reason->second.empty()) note(node, reason->second);
    return;
  }
  for (const pugi::xml_attribute attribute : node.attributes()) {
    if (read_.contains({node.hash_value(), attribute.name()})) continue;
    auto reason = reasons.find(name + "@" + attribute.name());
    if (reason == reasons.end()) reason = reasons.find(std::string("@") + attribute.name());
    if (reason == reasons.end())
      note(node, fmt::format("{}=\"{}\" has no counterpart that this program knows", attribute.name(),
                             attribute.value()));
    else if (!reason->second.empty())
      note(node, fmt::format("{}=\"{}\": {}", attribute.name(), attribute.value(), reason->second));
  }
  for (const pugi::xml_node child : node.children()) note_unread(child, reasons);
}

std::vector<std::string> XmlSource::notes(const std::map<std::string, std::string>& reasons) {
  note_unread(root(), reasons);
  std::vector<std::string> lines;
  for (const auto& [line, note] : notes_) lines.push_back(note);
  return lines;
}

}  // namespace kilotwin::importers
