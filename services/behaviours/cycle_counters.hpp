/// Makes programs interruptible at places that depend on what they execute and on nothing else: their machine code counts
/// the cycles that a Kilobot's processor would have needed, about, and hands over to the host when it has used up its share.
#pragma once

#include <string>
#include <string_view>

namespace kilotwin::behaviours {

/// The text of a compiler's assembly with counters: one in each basic block, and in at least one block of every cycle, as
/// well as at the entry of every function that calls another, a test of what is left. The code must be compiled with
/// -mno-red-zone. Throws RunError if a cycle was left without a test, which would be an error of this function.
/// To be raised whenever this pass, or that of the loops, comes to give other code: compiled programs are kept by it.
inline constexpr int kCountersVersion = 4;

enum class Counted : bool { kAll, kTestsOnly };
/// Of code that a robot has in another form, as kilolib, only the tests count, one cycle each.
[[nodiscard]] std::string with_cycle_counters(std::string_view assembly, Counted counted = Counted::kAll);

/// About how many cycles of an ATmega328P an instruction for x86-64 stands for, in code compiled from the same source.
/// docs/explanation/execution.md tells how good that is.
[[nodiscard]] unsigned avr_cycles(std::string_view instruction, std::string_view operands);

}  // namespace kilotwin::behaviours
