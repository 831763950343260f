#include "core/experiment/syntax_error.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include "core/base/say.hpp"
#include "core/experiment/fields.hpp"

namespace kilotwin {
namespace pb = google::protobuf;

namespace {

using pb::FieldDescriptor;
using pb::io::Tokenizer;

class Silent : public pb::io::ErrorCollector {
 public:
  void AddError(int, pb::io::ColumnNumber, const std::string&) override {}
};

/// Whether a word is protobuf's notation of an infinite number or NaN.
bool is_not_finite(std::string word) {
  for (char& c : word) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return word == "inf" || word == "infinity" || word == "nan";
}

/// Follows the text token by token and reports the first one that the schema does not allow.
class Reader {
 public:
  explicit Reader(const pb::Descriptor& root) { blocks_.push_back(Block{&root, nullptr, 0, false, {}}); }

  /// Reads a token. Returns an error if it is wrong.
  std::optional<TextError> read(const Tokenizer::Token& token);
  /// Returns an error if the text must not end here.
  [[nodiscard]] std::optional<TextError> end(const Tokenizer::Token& token) const;
  /// True after a minus sign, which belongs to the next token.
  [[nodiscard]] bool within_value() const { return negative_; }

 private:
  struct Block {
    const pb::Descriptor* type;
    const FieldDescriptor* field;  ///< the field whose value the block is; null for the whole text
    int line;                      ///< line of its opening brace
    bool in_list;                  ///< it is an element of a list in brackets
    std::set<std::string> given;   ///< names of fields and oneofs that have a value
  };
  enum class Expected { kName, kColonOrBlock, kValue };

  std::optional<TextError> read_name(const Tokenizer::Token& token);
  std::optional<TextError> read_value(const Tokenizer::Token& token);
  [[nodiscard]] bool fits(const Tokenizer::Token& token) const;
  static TextError at(const Tokenizer::Token& token, std::string message) {
    return TextError{token.line, token.column, std::move(message)};
  }

  std::vector<Block> blocks_;
  const FieldDescriptor* field_ = nullptr;
  Expected expected_ = Expected::kName;
  bool in_list_ = false, negative_ = false;
  Tokenizer::Token minus_;
};

std::optional<TextError> Reader::read(const Tokenizer::Token& token) {
  if (expected_ == Expected::kName) return read_name(token);
  if (expected_ == Expected::kColonOrBlock && token.text == ":") {
    expected_ = Expected::kValue;
    return std::nullopt;
  }
  const bool block = field_->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
  const bool opens = token.text == "{" || token.text == "<" || (token.text == "[" && block);
  if (expected_ == Expected::kColonOrBlock && !opens) {
    return at(token,
              fmt::format("{} is followed by {}; write {}", field_->name(), one_line(token.text, 60),
                          block ? field_->name() + " { ... }" : field_->name() + ": and " + value_text(*field_)));
  }
  return read_value(token);
}

std::optional<TextError> Reader::read_name(const Tokenizer::Token& token) {
  Block& block = blocks_.back();
  if (token.text == "}" || token.text == ">") {
    if (blocks_.size() == 1)
      return at(token, fmt::format("a closing {} has no block to close; remove it", token.text));
    field_ = block.field;
    in_list_ = block.in_list;
    expected_ = in_list_ ? Expected::kValue : Expected::kName;
    blocks_.pop_back();
    return std::nullopt;
  }
  if (token.type != Tokenizer::TYPE_IDENTIFIER) return std::nullopt;
  field_ = block.type->FindFieldByName(token.text);
  if (field_ == nullptr) {
    const std::string place = block.field == nullptr ? "" : " in " + block.field->name();
    return at(token, fmt::format("unknown field {}{}; {}", one_line(token.text, 60), place,
                                 field_suggestion(token.text, *block.type)));
  }
  if (!field_->is_repeated() && !block.given.insert(field_->name()).second) {
    return at(token, fmt::format("{} is given twice; give it once", field_->name()));
  }
  if (const pb::OneofDescriptor* oneof = field_->containing_oneof();
      oneof && !block.given.insert(oneof->name() + " of").second) {
    std::string members;
    for (int i = 0; i < oneof->field_count(); ++i) members += (i ? ", " : "") + oneof->field(i)->name();
    return at(token, fmt::format("{} is a second {}; give one of {}", field_->name(), oneof->name(), members));
  }
  expected_ = Expected::kColonOrBlock;
  return std::nullopt;
}

std::optional<TextError> Reader::read_value(const Tokenizer::Token& token) {
  const bool block = field_->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
  if (token.text == "[" && field_->is_repeated() && !in_list_) {
    in_list_ = true;
  } else if (token.text == "]" && in_list_) {
    in_list_ = false;
    expected_ = Expected::kName;
  } else if (token.text == "," && in_list_) {
    return std::nullopt;
  } else if (token.text == "-" && !block && !negative_) {
    negative_ = true;
    minus_ = token;
  } else if (block && (token.text == "{" || token.text == "<")) {
    blocks_.push_back(Block{field_->message_type(), field_, token.line, in_list_, {}});
    expected_ = Expected::kName;
    in_list_ = false;
  } else if (block || !fits(token)) {
    const std::string value = one_line((negative_ ? "-" : "") + token.text, 60);
    return at(negative_ ? minus_ : token,
              fmt::format("{} is {}; it takes {}", field_->name(), value.empty() ? "left without a value" : value,
                          value_text(*field_)));
  } else {
    negative_ = false;
    if (!in_list_) expected_ = Expected::kName;
  }
  return std::nullopt;
}

bool Reader::fits(const Tokenizer::Token& token) const {
  const bool integer = token.type == Tokenizer::TYPE_INTEGER;
  std::uint64_t whole = 0;
  switch (field_->cpp_type()) {
    case FieldDescriptor::CPPTYPE_STRING: return token.type == Tokenizer::TYPE_STRING && !negative_;
    case FieldDescriptor::CPPTYPE_BOOL:
      return !negative_ &&
             (token.text == "true" || token.text == "false" || token.text == "True" || token.text == "False" ||
              token.text == "t" || token.text == "f" || token.text == "0" || token.text == "1");
    case FieldDescriptor::CPPTYPE_ENUM:
      if (integer)
        return Tokenizer::ParseInteger(token.text, 0x7fffffff, &whole) && !negative_ &&
               field_->enum_type()->FindValueByNumber(static_cast<int>(whole)) != nullptr;
      return field_->enum_type()->FindValueByName(token.text) != nullptr && !negative_;
    case FieldDescriptor::CPPTYPE_UINT32:
      return integer && !negative_ && Tokenizer::ParseInteger(token.text, UINT32_MAX, &whole);
    case FieldDescriptor::CPPTYPE_UINT64:
      return integer && !negative_ && Tokenizer::ParseInteger(token.text, UINT64_MAX, &whole);
    default: return integer || token.type == Tokenizer::TYPE_FLOAT || is_not_finite(token.text);
  }
}

std::optional<TextError> Reader::end(const Tokenizer::Token& token) const {
  if (expected_ != Expected::kName) {
    return at(token, fmt::format("{} is left without a value; it takes {}", field_->name(), value_text(*field_)));
  }
  if (blocks_.size() == 1) return std::nullopt;
  return at(token, fmt::format("the block {} of line {} is not closed; end it with }}",
                               blocks_.back().field->name(), blocks_.back().line + 1));
}

}  // namespace

TextError explained(const std::string& text, const pb::Descriptor& root, const TextError& raw) {
  Silent silent;
  pb::io::ArrayInputStream stream{text.data(), static_cast<int>(text.size())};
  Tokenizer tokens{&stream, &silent};
  tokens.set_allow_f_after_float(true);
  tokens.set_comment_style(Tokenizer::SH_COMMENT_STYLE);
  tokens.set_require_space_after_number(false);
  Reader reader{root};
  while (tokens.Next()) {
    const Tokenizer::Token& token = tokens.current();
    if (std::tie(token.line, token.column) > std::tie(raw.line, raw.column) && !reader.within_value()) break;
    if (auto error = reader.read(token)) return *error;
  }
  if (tokens.current().type == Tokenizer::TYPE_END) {
    if (auto error = reader.end(tokens.current())) return *error;
  }
  std::string message = one_line(raw.message, 200);
  while (message.ends_with('.')) message.pop_back();
  if (message.starts_with("Expected ")) message[0] = 'e';
  return TextError{raw.line, raw.column, message + "; write fields as name: value and blocks as name { ... }"};
}

}  // namespace kilotwin
