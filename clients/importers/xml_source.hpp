/// An XML document that knows which of its attributes were read: what nobody read is reported.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kilotwin::importers {

class XmlSource {
 public:
  /// Throws UserError with the line of a syntax error.
  XmlSource(std::string_view text, const std::string& name);

  [[nodiscard]] pugi::xml_node root() const { return document_.document_element(); }
  [[nodiscard]] int line_of(pugi::xml_node node) const;

  /// The attribute's text, which thereby counts as read; empty if it is not there.
  [[nodiscard]] std::string text(pugi::xml_node node, const char* attribute);
  /// A number, or nothing if the attribute is not there. Throws UserError if it is no number.
  [[nodiscard]] std::optional<double> number(pugi::xml_node node, const char* attribute);
  /// Three numbers separated by commas; zeros if the attribute is not there. Throws UserError if they are not three numbers.
  [[nodiscard]] std::array<double, 3> triple(pugi::xml_node node, const char* attribute);
  /// The element was understood; its attributes that nobody reads are still reported.
  void take(pugi::xml_node node) { taken_.insert(node.hash_value()); }
  /// The element with all that it contains is of no concern.
  void take_all(pugi::xml_node node);

  /// A remark about an element.
  void note(pugi::xml_node node, const std::string& remark);
  /// All remarks, and one for each element and attribute that nobody read, in the order of lines. `reasons` by "element",
  /// "element@attribute" or "@attribute"; an empty reason: none is reported.
  [[nodiscard]] std::vector<std::string> notes(const std::map<std::string, std::string>& reasons);

 private:
  [[nodiscard]] std::string place(pugi::xml_node node, const char* attribute) const;
  void note_unread(pugi::xml_node node, const std::map<std::string, std::string>& reasons);

  std::string text_, name_;
  pugi::xml_document document_;
  std::set<std::pair<std::size_t, std::string>> read_;
  std::set<std::size_t> taken_;
  std::multimap<int, std::string> notes_;
};

}  // namespace kilotwin::importers
