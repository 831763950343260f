/// Frees the vector register that holds the cycle budget of robots' code: kBudgetRegister, runtime/budget.h.
#pragma once

#include <string>
#include <string_view>

namespace kilotwin::behaviours {

/// Thrown if a function needs all sixteen vector registers at once.
struct NeedsAllVectorRegisters {
  std::string function;
};

/// Returns a compiler's assembly without its own use of the register: that of clang, for gcc leaves it alone by -ffixed-xmm15. A
/// function that uses it gets another one that it does not use. No instruction changes but by the name of the register. All vector
/// registers belong to the function that runs (System V), also if it is called within its file: clang allocates registers function
/// by function, gcc with -fno-ipa-ra. Throws NeedsAllVectorRegisters.
[[nodiscard]] std::string with_free_budget_register(std::string_view assembly);

/// Whether the operand of a call names a function of libgcc that uses vector registers at will: products and quotients of complex
/// numbers.
[[nodiscard]] bool may_overwrite_budget(std::string_view callee);

}  // namespace kilotwin::behaviours
