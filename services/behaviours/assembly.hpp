/// Parser of a compiler's assembly output (x86-64, AT&T syntax, GNU directives). It reads what a control-flow graph needs.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace kilotwin::behaviours {

/// A line, or one of several statements on a line of inline assembly.
struct Statement {
  enum class Kind : std::uint8_t { kNothing, kLabel, kDirective, kInstruction };
  Kind kind = Kind::kNothing;
  enum class Section : std::uint8_t { kCode, kData, kDebug };
  Section section = Section::kCode;
  bool in_asm = false;    ///< of an asm statement of the source, between #APP and #NO_APP
  std::string_view text;  ///< the whole statement
  std::string_view name;  ///< label, directive or mnemonic; without prefixes of the instruction
  std::string_view operands;
  [[nodiscard]] bool is_code(Kind which) const { return section == Section::kCode && kind == which; }
};

/// Splits `text` into statements, which point into it: it must outlive them.
[[nodiscard]] std::vector<Statement> read_assembly(std::string_view text);

/// How an instruction continues: with the next one, at a branch target, not at all, etc.
enum class Flow : std::uint8_t { kNext, kBranch, kJump, kIndirect, kCall, kReturn, kStop };
[[nodiscard]] Flow flow_of(const Statement& instruction);

/// Whether an instruction reads any arithmetic flag.
[[nodiscard]] bool reads_flags(std::string_view instruction);
/// Whether an instruction overwrites all arithmetic flags.
[[nodiscard]] bool overwrites_flags(std::string_view instruction);
/// The register that holds the cycle budget while a robot's code runs: runtime/budget.h.
inline constexpr std::string_view kBudgetRegister = "%xmm15";
/// Whether an instruction of the runtime reads or changes the budget. Compilers may use its register too: free_budget_register().
[[nodiscard]] bool uses_budget(const Statement& instruction);

/// Whether an instruction uses registers other than the sixteen general-purpose ones, besides the budget.
[[nodiscard]] bool uses_vectors(const Statement& instruction);
/// Whether an instruction reads the budget, or memory that an interrupt may write. Operands relative to %rsp or %rbp, the function's own
/// stack frame, and the global offset table do not count.
[[nodiscard]] bool reads_memory(const Statement& instruction);

/// Whether an instruction may write memory other than the running function's own stack frame at a fixed offset from %rsp. Writes of
/// called functions do not count. May be true of an instruction that writes nothing.
[[nodiscard]] bool may_write_memory(const Statement& instruction);

/// Control-flow graph: the basic blocks of all code, in the order of the text.
struct FlowGraph {
  struct Block {
    std::uint32_t first = 0, last = 0;  ///< statements [first, last)
    std::vector<std::uint32_t> next;    ///< successors
    bool leaves = false;                ///< the block may return or jump to an unknown target
    bool is_function = false;           ///< the block's first label is a function
  };
  std::vector<Block> blocks;
};
[[nodiscard]] FlowGraph flow_graph(const std::vector<Statement>&);

}  // namespace kilotwin::behaviours
