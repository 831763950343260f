/// Error messages for texts that the protobuf parser rejects.
#pragma once

#include <string>

namespace google::protobuf {
class Descriptor;
}

namespace kilotwin {

/// Line and column from 0, as protobuf counts them: a tab extends to the next multiple of 8.
struct TextError {
  int line = 0, column = 0;
  std::string message;
};

/// The first error of `text`, a message of type `root`, as "what is wrong; what would be right", at the first wrong word. It
/// suggests the name of an unknown field, gives the expected type of a value, and reports repeated fields and unclosed blocks.
/// `raw` is the parser's error.
[[nodiscard]] TextError explained(const std::string& text, const google::protobuf::Descriptor& root,
                                  const TextError& raw);

}  // namespace kilotwin
