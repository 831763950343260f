#include "services/behaviours/budget_register.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <map>
#include <vector>

#include "services/behaviours/assembly.hpp"

namespace kilotwin::behaviours {
namespace {

constexpr std::string_view kVector = "%xmm";
constexpr std::size_t kVectors = 16, kBudget = 15;
/// A function may pass on arguments, in registers 0 to 7, without naming them.
constexpr std::size_t kFirstFree = 8;
using Vectors = std::bitset<kVectors>;

/// Number of the vector register whose name begins at `at`, after "%xmm".
std::size_t number_at(std::string_view text, std::size_t at) {
  std::size_t number = 0;
  for (at += kVector.size(); at < text.size() && text[at] >= '0' && text[at] <= '9'; ++at)
    number = number * 10 + static_cast<std::size_t>(text[at] - '0');
  return number;
}

void note_vectors(std::string_view operands, Vectors& used) {
  for (std::size_t at = 0; (at = operands.find(kVector, at)) != std::string_view::npos; at += kVector.size())
    used.set(number_at(operands, at) % kVectors);
}

/// The function to which code after this label belongs. gcc moves unlikely code of f() behind a label "f.cold".
std::string_view function_of(std::string_view label) { return label.substr(0, label.find(".cold")); }

/// Calls `use` with each statement and the function to which it belongs, the last label that names no place within one.
template <class Use> void for_each(const std::vector<Statement>& statements, Use use) {
  std::string_view function;
  for (const Statement& s : statements) {
    const bool is_local =
        s.name.starts_with(".L") || s.name.find_first_not_of("0123456789") == std::string_view::npos;
    if (s.is_code(Statement::Kind::kLabel) && !is_local) function = function_of(s.name);
    use(s, function);
  }
}

}  // namespace

std::string with_free_budget_register(std::string_view assembly) {
  if (assembly.find(kBudgetRegister) == std::string_view::npos) return std::string(assembly);
  const std::vector<Statement> statements = read_assembly(assembly);
  std::map<std::string_view, Vectors> used_by;
  for_each(statements, [&](const Statement& s, std::string_view function) {
    if (s.is_code(Statement::Kind::kInstruction) && !uses_budget(s)) note_vectors(s.operands, used_by[function]);
  });
  std::string result;
  result.reserve(assembly.size());
  for_each(statements, [&](const Statement& s, std::string_view function) {
    const bool renames = s.is_code(Statement::Kind::kInstruction) && !uses_budget(s) &&
                         s.operands.find(kBudgetRegister) != std::string_view::npos;
    std::string text(s.text);
    if (renames) {
      std::size_t other = kFirstFree;
      while (other < kBudget && used_by[function][other]) ++other;
      if (other == kBudget) throw NeedsAllVectorRegisters{std::string(function)};
      const std::string name = std::string(kVector) + std::to_string(other);
      for (std::size_t at = 0; (at = text.find(kBudgetRegister, at)) != std::string::npos; at += name.size())
        text.replace(at, kBudgetRegister.size(), name);
    }
    result.append(text).append(1, '\n');
  });
  return result;
}

bool may_overwrite_budget(std::string_view callee) {
  constexpr std::array<std::string_view, 4> kComplex{"__mulsc3", "__muldc3", "__divsc3", "__divdc3"};
  // The operand may be "NAME@PLT", or "*NAME@GOTPCREL(%rip)" with compilers that avoid the table of procedures.
  return std::any_of(kComplex.begin(), kComplex.end(),
                     [&](std::string_view name) { return callee.find(name) != std::string_view::npos; });
}

}  // namespace kilotwin::behaviours
