/// Parses pictures as XML.
#pragma once

#include <libxml/parser.h>
#include <libxml/tree.h>

#include <memory>
#include <string>
#include <vector>

namespace kilotwin::recorder {

/// Elements of a well-formed document in order: name, attributes by name, text. Empty if it is not well-formed.
struct Element {
  std::string name, text;
  xmlNode* node;
  [[nodiscard]] std::string attribute(const char* key) const {
    xmlChar* const value = xmlGetProp(node, reinterpret_cast<const xmlChar*>(key));
    const std::string out = value == nullptr ? "" : reinterpret_cast<const char*>(value);
    xmlFree(value);
    return out;
  }
};

class Xml {
 public:
  explicit Xml(const std::string& svg)
      : document_(xmlReadMemory(svg.data(), static_cast<int>(svg.size()), "svg", nullptr,
                                XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING | XML_PARSE_HUGE),
                  xmlFreeDoc) {
    if (document_ != nullptr) collect(xmlDocGetRootElement(document_.get()));
  }
  [[nodiscard]] const std::vector<Element>& elements() const { return elements_; }
  [[nodiscard]] bool has_text(const std::string& wanted) const {
    for (const Element& element : elements_) {
      if (element.name == "text" && element.text.find(wanted) != std::string::npos) return true;
    }
    return false;
  }

 private:
  void collect(xmlNode* node) {
    for (; node != nullptr; node = node->next) {
      if (node->type != XML_ELEMENT_NODE) continue;
      xmlChar* const text = xmlNodeGetContent(node);
      elements_.push_back({reinterpret_cast<const char*>(node->name), reinterpret_cast<const char*>(text), node});
      xmlFree(text);
      collect(node->children);
    }
  }
  std::unique_ptr<xmlDoc, void (*)(xmlDoc*)> document_;
  std::vector<Element> elements_;
};

}  // namespace kilotwin::recorder
