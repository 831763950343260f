#include "services/behaviours/cycle_counters.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/base/error.hpp"
#include "services/behaviours/assembly.hpp"
#include "services/behaviours/budget_register.hpp"
#include "services/behaviours/constant_division.hpp"
#include "services/behaviours/runtime/image_abi.h"

namespace kilotwin::behaviours {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;
/// Straight code gets a test after this many cycles of the robot, and after each call: at the next place where the flags are dead.
constexpr unsigned kMostCyclesWithoutTest = 64;

/// Properties of a strongly connected component of the control-flow graph.
struct Component {
  bool is_cycle = false;
  bool reads = false;      ///< it reads memory that an interrupt may change, or calls a function
  bool can_leave = false;  ///< a return is reachable from it
  bool calls = false;      ///< a call is reachable from it
};

/// Depth-first search over all blocks: the targets of back edges, and the strongly connected components (Tarjan 1972).
class Cycles {
 public:
  Cycles(const FlowGraph& graph, const std::vector<Statement>& statements)
      : graph_(graph),
        component_of(graph.blocks.size(), kNone),
        closes(graph.blocks.size(), false),
        index_(graph.blocks.size(), kNone),
        low_(graph.blocks.size()),
        on_path_(graph.blocks.size(), false) {
    for (std::uint32_t b = 0; b < graph.blocks.size(); ++b) {
      if (index_[b] == kNone) search(b, statements);
    }
  }

 private:
  const FlowGraph& graph_;

 public:
  std::vector<std::uint32_t> component_of;
  std::vector<bool> closes;  ///< per block: it is the target of a back edge
  std::vector<Component> components;

 private:
  void search(std::uint32_t root, const std::vector<Statement>& statements) {
    struct Visit {
      std::uint32_t block;
      std::size_t next;
    };
    std::vector<Visit> path;
    auto enter = [&](std::uint32_t b) {
      index_[b] = low_[b] = counter_++;
      on_path_[b] = true;
      open_.push_back(b);
      path.push_back({b, 0});
    };
    enter(root);
    while (!path.empty()) {
      const std::uint32_t b = path.back().block;
      const auto& next = graph_.blocks[b].next;
      if (path.back().next < next.size()) {
        const std::uint32_t to = next[path.back().next++];
        if (index_[to] == kNone) {
          enter(to);
        } else if (component_of[to] == kNone) {
          low_[b] = std::min(low_[b], index_[to]);
          if (on_path_[to]) closes[to] = true;
        }
        continue;
      }
      path.pop_back();
      on_path_[b] = false;
      if (!path.empty()) low_[path.back().block] = std::min(low_[path.back().block], low_[b]);
      if (low_[b] == index_[b]) close_component(b, statements);
    }
  }

  /// The search completes a component after all components that are reachable from it, so their properties are known.
  void close_component(std::uint32_t root, const std::vector<Statement>& statements) {
    std::vector<std::uint32_t> members;
    do {
      members.push_back(open_.back());
      component_of[open_.back()] = static_cast<std::uint32_t>(components.size());
      open_.pop_back();
    } while (members.back() != root);
    Component component;
    component.is_cycle = members.size() > 1;
    for (const std::uint32_t b : members) {
      const FlowGraph::Block& block = graph_.blocks[b];
      component.can_leave = component.can_leave || block.leaves;
      for (std::uint32_t i = block.first; i < block.last; ++i) {
        if (statements[i].kind != Statement::Kind::kInstruction) continue;
        const bool calls = flow_of(statements[i]) == Flow::kCall;
        component.calls = component.calls || calls;
        component.reads = component.reads || calls || reads_memory(statements[i]);
      }
      for (const std::uint32_t to : block.next) {
        if (component_of[to] == components.size()) {
          component.is_cycle = component.is_cycle || to == b;
          continue;
        }
        component.can_leave = component.can_leave || components[component_of[to]].can_leave;
        component.calls = component.calls || components[component_of[to]].calls;
      }
    }
    components.push_back(component);
  }

  std::vector<std::uint32_t> index_, low_, open_;
  std::vector<bool> on_path_;
  std::uint32_t counter_ = 0;
};

/// Blocks at whose entry the flags are live.
std::vector<bool> blocks_that_need_flags(const FlowGraph& graph, const std::vector<Statement>& statements) {
  std::vector<bool> needs(graph.blocks.size(), false), passes(graph.blocks.size(), true);
  for (std::uint32_t b = 0; b < graph.blocks.size(); ++b) {
    for (std::uint32_t i = graph.blocks[b].first; i < graph.blocks[b].last; ++i) {
      if (statements[i].kind != Statement::Kind::kInstruction) continue;
      if (reads_flags(statements[i].name)) needs[b] = true;
      passes[b] = !needs[b] && !overwrites_flags(statements[i].name);
      if (!passes[b]) break;
    }
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (std::uint32_t b = static_cast<std::uint32_t>(graph.blocks.size()); b-- > 0;) {
      if (needs[b] || !passes[b]) continue;
      for (const std::uint32_t to : graph.blocks[b].next) {
        if (needs[to]) needs[b] = changed = true;
      }
    }
  }
  return needs;
}

class Instrumenter {
 public:
  explicit Instrumenter(std::string_view assembly, Counted counted)
      : assembly_(assembly),
        counted_(counted),
        statements_(read_assembly(assembly)),
        graph_(flow_graph(statements_)),
        cycles_(graph_, statements_),
        needs_flags_(blocks_that_need_flags(graph_, statements_)) {}

  std::string instrument() {
    plan();
    std::string result;
    result.reserve(assembly_.size() * 3 / 2);
    std::string_view place;  // the last .loc
    std::string stubs;
    std::uint32_t next = 0;
    for (std::uint32_t i = 0; i < statements_.size(); ++i) {
      const Statement& s = statements_[i];
      if (s.kind == Statement::Kind::kDirective && s.section == Statement::Section::kCode) {
        if (s.name == ".loc") place = s.text.substr(0, s.text.find(" view "));
        // At the end of a function, place the stubs that its tests jump to when the budget is used up.
        if (s.name == ".size" && !stubs.empty()) {
          result += stubs;
          stubs.clear();
        }
      }
      for (; next < counters_.size() && counters_[next].before == i; ++next) {
        emit(counters_[next], next, place, result, stubs);
      }
      const bool keeps =
          s.is_code(Statement::Kind::kInstruction) && flow_of(s) == Flow::kCall && may_overwrite_budget(s.operands);
      if (keeps) result += "\tmovd\t" + register_ + ", " + memory_ + "\n";
      result.append(s.text).append(1, '\n');
      if (keeps) result += "\tmovd\t" + memory_ + ", " + register_ + "\n";
    }
    if (!stubs.empty()) result.append("\t.text\n").append(stubs);
    return result + constants();
  }

 private:
  struct Counter {
    std::uint32_t before = 0;  ///< index of the statement before which the counter stands
    std::uint32_t cycles = 0;
    bool tests = false, keeps_flags = false;
    bool writes = false;  ///< code that follows may write memory: runtime/budget.h
    unsigned kind = 0;    ///< KT_CHECK_*
  };

  [[nodiscard]] unsigned cycles_of(const FlowGraph::Block& block, std::uint32_t i) const {
    const std::span<const Statement> code(statements_.data() + block.first, block.last - block.first);
    const auto division = constant_division_cycles(code, i - block.first);
    return division ? *division : avr_cycles(statements_[i].name, statements_[i].operands);
  }

  /// Adds a counter of block `b`. The block's own, number `first`, stands where the flags are dead, and tests where it must.
  void add(std::uint32_t b, Counter counter, std::size_t first) {
    const FlowGraph::Block& block = graph_.blocks[b];
    if (counters_.size() == first && !counter.tests) {
      counter.tests = cycles_.closes[b] || (block.is_function && function_calls(b));
      if (counter.cycles == 0 && !counter.tests) return;
      const std::optional<std::uint32_t> place = place_in(b, dead_flags(b));
      if (!place && !counter.tests) return;
      counter.before = place ? *place : first_instruction(block);
      counter.keeps_flags = !place;
    }
    if (counter.before == block.last) return;  // the block has no instruction
    const Component& component = cycles_.components[cycles_.component_of[b]];
    if (!component.is_cycle || component.reads) counter.kind |= KT_CHECK_WAITS;
    if (component.is_cycle && !component.can_leave && !component.calls) counter.kind |= KT_CHECK_ENDLESS;
    if (function_uses_vectors(b)) counter.kind |= KT_CHECK_VECTORS;
    counters_.push_back(counter);
  }

  void plan() {
    for (std::uint32_t b = 0; b < graph_.blocks.size(); ++b) {
      const FlowGraph::Block& block = graph_.blocks[b];
      const std::vector<bool> flags_are_dead = dead_flags(b);
      const std::optional<std::uint32_t> place = place_in(b, flags_are_dead);
      Counter counter;
      bool after_call = false;
      const std::size_t first = counters_.size();
      for (std::uint32_t i = block.first; i < block.last; ++i) {
        const Statement& s = statements_[i];
        if (s.kind != Statement::Kind::kInstruction) continue;
        // On a robot an interrupt comes at any place. Here it comes at tests, so long straight code has more than one.
        if (counted_ == Counted::kAll && place && i > *place && flags_are_dead[i - block.first] &&
            (after_call || counter.cycles >= kMostCyclesWithoutTest)) {
          add(b, counter, first);
          counter = {.before = i, .tests = true};
          after_call = false;
        }
        if (counted_ == Counted::kAll) counter.cycles += cycles_of(block, i);
        after_call = after_call || flow_of(s) == Flow::kCall;
      }
      add(b, counter, first);
      note_writes(b, first);
    }
    verify();
  }

  /// Checks that the graph without the testing blocks is acyclic.
  void verify() const {
    FlowGraph rest = graph_;
    for (std::uint32_t b = 0; b < rest.blocks.size(); ++b) {
      const FlowGraph::Block& block = rest.blocks[b];
      const bool tests = std::any_of(counters_.begin(), counters_.end(), [&](const Counter& c) {
        return c.tests && c.before >= block.first && c.before < block.last;
      });
      if (tests) rest.blocks[b].next.clear();
    }
    const Cycles left(rest, statements_);
    if (std::find(left.closes.begin(), left.closes.end(), true) != left.closes.end())
      throw RunError("a loop of this program cannot be interrupted; this is an error of kilotwin");
  }

  /// Notes writes of block `b`, whose counters begin with number `first`. Calls and the runtime's own looks at the register divide a
  /// block: each part with a write has a counter before it, a further one if need be. That one changes no flags.
  void note_writes(std::uint32_t b, std::size_t first) {
    const FlowGraph::Block& block = graph_.blocks[b];
    std::uint32_t part = block.first;
    bool noted = false;
    for (std::uint32_t i = block.first; i < block.last; ++i) {
      const Statement& s = statements_[i];
      if (s.kind != Statement::Kind::kInstruction) continue;
      if (flow_of(s) == Flow::kCall || uses_budget(s)) {
        part = i + 1;
        noted = false;
      }
      if (noted || !may_write_memory(s)) continue;
      noted = true;
      const auto own = std::find_if(counters_.begin() + static_cast<std::ptrdiff_t>(first), counters_.end(),
                                    [&](const Counter& c) { return c.before >= part && c.before <= i; });
      if (own != counters_.end())
        own->writes = true;
      else
        counters_.push_back({.before = i, .writes = true});
    }
    std::stable_sort(counters_.begin() + static_cast<std::ptrdiff_t>(first), counters_.end(),
                     [](const Counter& a, const Counter& c) { return a.before < c.before; });
  }

  [[nodiscard]] std::uint32_t first_instruction(const FlowGraph::Block& block) const {
    std::uint32_t i = block.first;
    while (i < block.last && statements_[i].kind != Statement::Kind::kInstruction) ++i;
    return i;
  }

  /// Per statement of a block: whether the flags are dead before it.
  [[nodiscard]] std::vector<bool> dead_flags(std::uint32_t b) const {
    const FlowGraph::Block& block = graph_.blocks[b];
    bool needed =
        std::any_of(block.next.begin(), block.next.end(), [&](std::uint32_t to) { return needs_flags_[to]; });
    std::vector<bool> dead(block.last - block.first, false);
    for (std::uint32_t i = block.last; i-- > block.first;) {
      const Statement& s = statements_[i];
      if (s.kind != Statement::Kind::kInstruction) continue;
      needed = reads_flags(s.name) || (needed && !overwrites_flags(s.name));
      dead[i - block.first] = !needed;
    }
    return dead;
  }

  /// The first instruction of a block before which the flags are dead.
  [[nodiscard]] std::optional<std::uint32_t> place_in(std::uint32_t b, const std::vector<bool>& dead) const {
    const auto found = std::find(dead.begin(), dead.end(), true);
    if (found == dead.end()) return std::nullopt;
    return graph_.blocks[b].first + static_cast<std::uint32_t>(found - dead.begin());
  }

  /// Properties of the function that contains a block. A function extends to the start of the next one.
  [[nodiscard]] bool function_calls(std::uint32_t b) const {
    return any_in_function(
        b, [](const Statement& s) { return flow_of(s) == Flow::kCall || flow_of(s) == Flow::kIndirect; });
  }
  [[nodiscard]] bool function_uses_vectors(std::uint32_t b) const { return any_in_function(b, uses_vectors); }
  template <class Predicate> [[nodiscard]] bool any_in_function(std::uint32_t b, Predicate predicate) const {
    while (b > 0 && !graph_.blocks[b].is_function) --b;
    do {
      for (std::uint32_t i = graph_.blocks[b].first; i < graph_.blocks[b].last; ++i) {
        if (statements_[i].kind == Statement::Kind::kInstruction && predicate(statements_[i])) return true;
      }
    } while (++b < graph_.blocks.size() && !graph_.blocks[b].is_function);
    return false;
  }

  /// The vectors that counters subtract, and the sign that tests look for.
  [[nodiscard]] std::string constants() const {
    if (counts_.empty()) return "";
    std::string text =
        "\t.section\t.rodata.cst16,\"aM\",@progbits,16\n\t.balign\t16\n.Lkt_sign:\n\t.long\t0x80000000,0,0,0\n";
    for (const auto& [cycles, writes] : counts_)
      text +=
          name_of(cycles, writes) + ":\n\t.long\t" + std::to_string(cycles) + (writes ? ",1,0,0\n" : ",0,0,0\n");
    return text;
  }
  static std::string name_of(unsigned cycles, bool writes) {
    return ".Lkt_count" + std::to_string(cycles) + (writes ? "w" : "");
  }

  void emit(const Counter& c, std::uint32_t number, std::string_view place, std::string& code, std::string& stubs) {
    const unsigned cycles = std::max(c.cycles, c.tests ? 1u : 0u);
    counts_.insert({cycles, c.writes});
    const std::string count = "\tpsubd\t" + name_of(cycles, c.writes) + "(%rip), " + register_ + "\n";
    const std::string test = "\tptest\t.Lkt_sign(%rip), " + register_ + "\n";
    const std::string id = std::to_string(number), preempt = "kt_preempt_" + std::to_string(c.kind) + "\n";
    if (!c.tests) {
      code += count;
    } else if (c.keeps_flags) {
      code += "\tpushfq\n" + count + test + "\tjz\t.Lkt_back" + id + "\n\tcall\t" + preempt + ".Lkt_back" + id +
              ":\n\tpopfq\n";
    } else {
      code += count + test + "\tjnz\t.Lkt_out" + id + "\n.Lkt_back" + id + ":\n";
      stubs.append(".Lkt_out" + id + ":\n").append(place).append(place.empty() ? "" : "\n");
      // A call written as push and jump, because it is not matched by a return: see switch.c.
      stubs.append("\tleaq\t-8(%rsp), %rsp\n\tpushq\t%rax\n\tleaq\t.Lkt_back" + id +
                   "(%rip), %rax\n\tmovq\t%rax, 8(%rsp)\n\tpopq\t%rax\n\tjmp\t" + preempt);
    }
  }

  const std::string register_{kBudgetRegister}, memory_ = "%gs:" + std::to_string(offsetof(KtThread, budget));
  std::string_view assembly_;
  const Counted counted_;
  const std::vector<Statement> statements_;
  const FlowGraph graph_;
  const Cycles cycles_;
  const std::vector<bool> needs_flags_;
  std::vector<Counter> counters_;
  std::set<std::pair<unsigned, bool>> counts_;  ///< cycles and writes of the counters
};

}  // namespace

std::string with_cycle_counters(std::string_view assembly, Counted counted) {
  const std::string free = with_free_budget_register(assembly);
  return Instrumenter(free, counted).instrument();
}

}  // namespace kilotwin::behaviours
