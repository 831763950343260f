/// Deterministic preemption: a pass over a program's assembly inserts counters of the cycles that a Kilobot's processor would need,
/// approximately. When the tick's budget is used up, the program returns to the host. The place of preemption therefore depends
/// on the executed instructions alone.
#pragma once

#include <string>
#include <string_view>

namespace kilotwin::behaviours {

/// Part of the cache key of compiled programs. Raise it when this pass or with_loop_barriers() changes its output.
inline constexpr int kCountersVersion = 18;

/// kTestsOnly counts one cycle per test, and no others. It is for kilolib, which a robot runs in another form.
enum class Counted : bool { kAll, kTestsOnly };
/// Adds counters to a compiler's assembly. Each basic block gets a counter. At least one block of every cycle of the control-flow
/// graph, and the entry of every function that calls another, also tests whether the budget is used up. So does long straight
/// code, because interrupts come at tests. Blocks that may write memory say so: runtime/budget.h. The code must be compiled
/// with -mno-red-zone. Throws RunError if a cycle has no test, which would be a defect of this function, and
/// NeedsAllVectorRegisters: budget_register.hpp.
[[nodiscard]] std::string with_cycle_counters(std::string_view assembly, Counted counted = Counted::kAll);

/// Cycles of the robot's division routines, with their calls: means over dividends, avr-libgcc as of avr-gcc 5.4.
enum AvrDivision : unsigned {
  kDivision8 = 82,
  kSignedDivision8 = 100,
  kDivision16 = 206,
  kSignedDivision16 = 230,
  kDivision32 = 600,
  kDivision64 = 1240
};

/// Estimated cycles of an ATmega328P per x86-64 instruction, for code compiled from the same source. docs/explanation/execution.md
/// gives the accuracy.
[[nodiscard]] unsigned avr_cycles(std::string_view instruction, std::string_view operands);

}  // namespace kilotwin::behaviours
