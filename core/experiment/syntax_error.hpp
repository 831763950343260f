/// What a person should know about a text that the protobuf parser turned down.
#pragma once

#include <string>

namespace google::protobuf {
class Descriptor;
}

namespace kilotwin {

/// Line and column count from 0, as protobuf counts them (a tab reaches to the next multiple of 8).
struct TextError {
  int line = 0, column = 0;
  std::string message;
};

/// The parser's first error of `text`, a message of type `root`, as "what is wrong; what would be right" at the
/// very word that is wrong: an unknown field with the name that was meant, a value of another type with the type that
/// is expected, a field given twice, a block left open.
[[nodiscard]] TextError explained(const std::string& text, const google::protobuf::Descriptor& root,
                                  const TextError& raw);

}  // namespace kilotwin
