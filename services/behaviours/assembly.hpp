/// Assembly text of a compiler (x86-64, AT&T syntax, GNU directives), read as far as a control-flow graph needs.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace kilotwin::behaviours {

/// One line or, in inline assembly, one statement of a line.
struct Statement {
  enum class Kind : std::uint8_t { kNothing, kLabel, kDirective, kInstruction };
  Kind kind = Kind::kNothing;
  enum class Section : std::uint8_t { kCode, kData, kDebug };
  Section section = Section::kCode;
  std::string_view text;  ///< all of it
  std::string_view name;  ///< of the label, directive or instruction; prefixes of instructions left out
  std::string_view operands;
  [[nodiscard]] bool is_code(Kind which) const { return section == Section::kCode && kind == which; }
};

/// The statements of a text, which must outlive them.
[[nodiscard]] std::vector<Statement> read_assembly(std::string_view text);

/// What an instruction does to the order of execution.
enum class Flow : std::uint8_t { kNext, kBranch, kJump, kIndirect, kCall, kReturn, kStop };
[[nodiscard]] Flow flow_of(const Statement& instruction);

/// Whether an instruction reads the arithmetic flags, or leaves no flag as it was.
[[nodiscard]] bool reads_flags(std::string_view instruction);
[[nodiscard]] bool overwrites_flags(std::string_view instruction);
/// Whether it uses registers other than the sixteen general ones.
[[nodiscard]] bool uses_vectors(const Statement& instruction);
/// Whether it reads memory that others may write: neither the stack below %rsp or %rbp nor the table of global addresses.
[[nodiscard]] bool reads_memory(const Statement& instruction);

/// Basic blocks of all code of a text. Blocks are numbered in the order of the text.
struct FlowGraph {
  struct Block {
    std::uint32_t first = 0, last = 0;  ///< statements [first, last)
    std::vector<std::uint32_t> next;    ///< blocks that may follow
    bool leaves = false;                ///< may return, or go where nobody knows
    bool is_function = false;           ///< its first label is a function
  };
  std::vector<Block> blocks;
};
[[nodiscard]] FlowGraph flow_graph(const std::vector<Statement>&);

}  // namespace kilotwin::behaviours
