#include "services/behaviours/assembly.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>

namespace kilotwin::behaviours {
namespace {

constexpr std::string_view kBlank = " \t\r";
constexpr std::string_view kBlankOrSemicolon = " \t\r;";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

bool is_symbol_char(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
         c == '$' || c == '@';
}

std::string_view first_symbol(std::string_view text) {
  std::size_t end = 0;
  while (end < text.size() && is_symbol_char(text[end])) ++end;
  return text.substr(0, end);
}

bool is_prefix(std::string_view word) {
  constexpr std::array<std::string_view, 9> kPrefixes{"rep",  "repe",    "repz", "repne", "repnz",
                                                      "lock", "notrack", "bnd",  "data16"};
  return std::find(kPrefixes.begin(), kPrefixes.end(), word) != kPrefixes.end();
}

/// Whether `name` is one of `bases`, with or without a size suffix (b, w, l, q).
template <std::size_t N> bool is_sized(std::string_view name, const std::array<std::string_view, N>& bases) {
  for (const std::string_view base : bases) {
    if (name == base) return true;
    if (name.size() == base.size() + 1 && name.starts_with(base) &&
        std::string_view("bwlq").find(name.back()) != std::string_view::npos) {
      return true;
    }
  }
  return false;
}

class Reader {
 public:
  explicit Reader(std::string_view text) : rest_(text) {}

  std::vector<Statement> read() {
    while (!rest_.empty()) {
      const std::size_t end = rest_.find('\n');
      line(rest_.substr(0, end));
      rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    }
    return std::move(statements_);
  }

 private:
  void line(std::string_view text) {
    const std::string_view content = trimmed(text);
    if (content == "#APP" || content == "#NO_APP") in_asm_ = content == "#APP";
    if (content.empty() || content[0] == '#') return add(Statement::Kind::kNothing, text, {}, {});
    // A directive may hold arbitrary text in quotes, so it is not split further.
    if (content[0] == '.' && content.find(':') == std::string_view::npos) return directive(text, content);
    if (const std::string_view symbol = first_symbol(content);
        content[0] == '.' && symbol.size() < content.size() && content[symbol.size()] != ':') {
      return directive(text, content);
    }
    text = text.substr(0, text.find('#'));
    while (!text.empty()) {
      std::size_t end = text.find(';');
      // Clang writes "rep;movsq": a prefix is no instruction of its own.
      while (end != std::string_view::npos && is_prefix(trimmed(text.substr(0, end))))
        end = text.find(';', end + 1);
      statement(text.substr(0, end));
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    }
  }

  void statement(std::string_view text) {
    std::string_view content = trimmed(text);
    const std::string_view symbol = first_symbol(content);
    if (!symbol.empty() && symbol.size() < content.size() && content[symbol.size()] == ':') {
      add(Statement::Kind::kLabel, content.substr(0, symbol.size() + 1), symbol, {});
      return statement(content.substr(symbol.size() + 1));
    }
    if (content.empty()) return;
    if (content[0] == '.') return directive(content, content);
    std::string_view name;
    std::string_view rest = content;
    do {
      name = rest.substr(0, rest.find_first_of(kBlankOrSemicolon));
      rest.remove_prefix(std::min(rest.size(), rest.find_first_not_of(kBlankOrSemicolon, name.size())));
    } while (is_prefix(name) && !rest.empty());
    add(Statement::Kind::kInstruction, text, name, rest);
  }

  void directive(std::string_view text, std::string_view content) {
    const std::string_view name = first_symbol(content);
    const std::string_view operands = trimmed(content.substr(name.size()));
    if (name == ".popsection") {
      if (!outer_.empty()) section_ = outer_.back();
      if (!outer_.empty()) outer_.pop_back();
    } else if (name == ".previous") {
      std::swap(section_, before_);
    } else if (name == ".text" || name == ".data" || name == ".bss" || name == ".section" ||
               name == ".pushsection") {
      if (name == ".pushsection") outer_.push_back(section_);
      before_ = section_;
      const bool is_code = name == ".text" || operands.starts_with(".text");
      section_ = is_code                          ? Statement::Section::kCode
                 : operands.starts_with(".debug") ? Statement::Section::kDebug
                                                  : Statement::Section::kData;
    }
    add(Statement::Kind::kDirective, text, name, operands);
  }

  void add(Statement::Kind kind, std::string_view text, std::string_view name, std::string_view operands) {
    statements_.push_back({kind, section_, in_asm_, text, name, operands});
  }

  std::string_view rest_;
  bool in_asm_ = false;
  Statement::Section section_ = Statement::Section::kCode, before_ = section_;
  std::vector<Statement::Section> outer_;
  std::vector<Statement> statements_;
};

/// The memory operand, or "".
std::string_view memory_operand(std::string_view operands) {
  const std::size_t open = operands.find('(');
  if (open == std::string_view::npos) return {};
  std::size_t first = operands.rfind(',', open);
  first = first == std::string_view::npos ? 0 : first + 1;
  const std::size_t close = operands.find(')', open);
  return trimmed(operands.substr(first, (close == std::string_view::npos ? operands.size() : close + 1) - first));
}

}  // namespace

std::vector<Statement> read_assembly(std::string_view text) { return Reader(text).read(); }

Flow flow_of(const Statement& instruction) {
  const std::string_view name = instruction.name;
  if (name.starts_with("jmp")) return instruction.operands.starts_with("*") ? Flow::kIndirect : Flow::kJump;
  if (name.starts_with("j") || name.starts_with("loop")) return Flow::kBranch;
  if (name.starts_with("call")) return Flow::kCall;
  if (name.starts_with("ret") || name.starts_with("iret")) return Flow::kReturn;
  if (name.starts_with("ud2") || name == "hlt") return Flow::kStop;
  return Flow::kNext;
}

bool reads_flags(std::string_view name) {
  if (name.starts_with("j")) return !name.starts_with("jmp") && name != "jrcxz" && name != "jecxz";
  if (is_sized(name, std::array<std::string_view, 4>{"adc", "sbb", "rcl", "rcr"})) return true;
  for (const std::string_view start : {"set", "cmov", "fcmov", "lahf", "pushf", "cmc", "loop", "adcx", "adox"}) {
    if (name.starts_with(start)) return true;
  }
  return false;
}

bool overwrites_flags(std::string_view name) {
  constexpr std::array<std::string_view, 11> kArithmetic{"add", "sub", "cmp",  "test", "and", "or",
                                                         "xor", "neg", "imul", "mul",  "div"};
  return is_sized(name, kArithmetic) || is_sized(name, std::array<std::string_view, 1>{"idiv"}) ||
         name.starts_with("ucomis") || name.starts_with("comis") || name.starts_with("call") ||
         name.starts_with("ret");
}

bool uses_budget(const Statement& instruction) {
  return instruction.in_asm && instruction.operands.find(kBudgetRegister) != std::string_view::npos;
}

bool uses_vectors(const Statement& instruction) {
  if (uses_budget(instruction)) return false;
  return instruction.operands.find("%xmm") != std::string_view::npos ||
         instruction.operands.find("%mm") != std::string_view::npos || instruction.name.starts_with("f");
}

bool reads_memory(const Statement& instruction) {
  const std::string_view name = instruction.name, operands = instruction.operands;
  // The budget changes from tick to tick.
  if (uses_budget(instruction)) return true;
  if (name.starts_with("lea") || name.starts_with("nop") || name.starts_with("prefetch")) return false;
  for (const std::string_view start : {"lods", "scas", "cmps", "movs"}) {
    if (name.starts_with(start) && operands.find("(%rsi)") != std::string_view::npos) return true;
  }
  const std::string_view memory = memory_operand(operands);
  if (memory.empty())
    return operands.find("%fs:") != std::string_view::npos || operands.find("%gs:") != std::string_view::npos;
  if (memory.find("(%rsp") != std::string_view::npos || memory.find("(%rbp") != std::string_view::npos ||
      memory.find("@GOT") != std::string_view::npos) {
    return false;
  }
  const bool is_store = name.starts_with("mov") && operands.ends_with(memory);
  return !is_store && !name.starts_with("set");
}

namespace {

/// The last operand, which AT&T syntax changes.
std::string_view last_operand(std::string_view operands) {
  std::size_t first = 0;
  int depth = 0;
  for (std::size_t at = 0; at < operands.size(); ++at) {
    if (operands[at] == '(') ++depth;
    if (operands[at] == ')') --depth;
    if (operands[at] == ',' && depth == 0) first = at + 1;
  }
  return trimmed(operands.substr(first));
}

bool is_memory(std::string_view operand) {
  if (operand.empty() || operand[0] == '$') return false;
  return operand[0] != '%' || operand.find(':') != std::string_view::npos;
}

/// A fixed place relative to the stack pointer: of the function's own frame, or of arguments to functions that it calls.
bool is_own_frame(std::string_view operand) {
  return operand.ends_with("(%rsp)") && operand.find_first_not_of("-0123456789") == operand.size() - 6;
}

}  // namespace

bool may_write_memory(const Statement& instruction) {
  const std::string_view name = instruction.name, operands = instruction.operands;
  if (flow_of(instruction) != Flow::kNext || name.starts_with("nop")) return false;
  if (operands.empty()) return name.starts_with("stos") || name.starts_with("movs");
  if (name.starts_with("xchg") || name.starts_with("xadd") || name.starts_with("cmpxchg")) return true;
  constexpr std::array<std::string_view, 12> kReading{"cmp",  "test", "ucomis", "comis", "push", "mul",
                                                      "imul", "div",  "idiv",   "fld",   "fild", "prefetch"};
  for (const std::string_view start : kReading) {
    if (name.starts_with(start)) return false;
  }
  const std::string_view changed = last_operand(operands);
  return is_memory(changed) && !is_own_frame(changed);
}

namespace {

/// Symbols that instructions or data refer to: functions, jump targets, and labels whose address is taken.
struct Mentioned {
  std::set<std::string_view> functions, jumped_to, taken;
  [[nodiscard]] bool contains(std::string_view label) const {
    return functions.count(label) + jumped_to.count(label) + taken.count(label) > 0 || is_number(label);
  }
  static bool is_number(std::string_view label) {
    return label.find_first_not_of("0123456789") == std::string_view::npos;
  }
};

Mentioned mentioned_in(const std::vector<Statement>& statements) {
  Mentioned result;
  for (const Statement& s : statements) {
    if (s.kind == Statement::Kind::kDirective && s.name == ".type" &&
        s.operands.find("function") != std::string_view::npos) {
      result.functions.insert(first_symbol(s.operands));
    } else if (s.is_code(Statement::Kind::kInstruction) &&
               (flow_of(s) == Flow::kBranch || flow_of(s) == Flow::kJump)) {
      result.jumped_to.insert(first_symbol(s.operands));
    } else if (s.is_code(Statement::Kind::kInstruction) ||
               (s.kind == Statement::Kind::kDirective && s.section == Statement::Section::kData)) {
      for (std::size_t at = 0; at < s.operands.size(); ++at) {
        if (!is_symbol_char(s.operands[at])) continue;
        const std::string_view symbol = first_symbol(s.operands.substr(at));
        if (symbol.starts_with(".L")) result.taken.insert(symbol);
        at += symbol.size();
      }
    }
  }
  return result;
}

}  // namespace

FlowGraph flow_graph(const std::vector<Statement>& statements) {
  using Kind = Statement::Kind;
  FlowGraph graph;
  const Mentioned mentioned = mentioned_in(statements);
  // A block ends before a label that something refers to, and after an instruction with another flow than kNext.
  std::map<std::string_view, std::uint32_t> block_of;
  std::map<std::string_view, std::vector<std::uint32_t>> blocks_of_number;
  bool open = false, has_code = false;
  for (std::uint32_t i = 0; i < statements.size(); ++i) {
    const Statement& s = statements[i];
    const bool labels = s.is_code(Kind::kLabel) && mentioned.contains(s.name);
    if (!labels && !s.is_code(Kind::kInstruction)) continue;
    if (!open || (labels && has_code)) {
      graph.blocks.push_back({i, i, {}, false, false});
      open = true;
      has_code = false;
    }
    FlowGraph::Block& block = graph.blocks.back();
    block.last = i + 1;
    if (labels) {
      const auto number = static_cast<std::uint32_t>(graph.blocks.size() - 1);
      if (Mentioned::is_number(s.name))
        blocks_of_number[s.name].push_back(number);
      else
        block_of.emplace(s.name, number);
      block.is_function = block.is_function || mentioned.functions.count(s.name) > 0;
    } else {
      has_code = true;
      open = flow_of(s) == Flow::kNext || flow_of(s) == Flow::kCall;
    }
  }
  std::set<std::uint32_t> taken;
  for (const std::string_view label : mentioned.taken) {
    if (const auto found = block_of.find(label); found != block_of.end()) taken.insert(found->second);
  }
  for (std::uint32_t b = 0; b < graph.blocks.size(); ++b) {
    FlowGraph::Block& block = graph.blocks[b];
    const Statement& end = statements[block.last - 1];
    const Flow flow = end.kind == Kind::kInstruction ? flow_of(end) : Flow::kNext;
    if (flow == Flow::kBranch || flow == Flow::kJump) {
      const std::string_view target = first_symbol(end.operands);
      const auto found = block_of.find(target);
      const auto numbered = blocks_of_number.find(target.substr(0, target.size() - (target.empty() ? 0 : 1)));
      if (found != block_of.end())
        block.next.push_back(found->second);
      else if (numbered != blocks_of_number.end())
        block.next = numbered->second;
      else
        block.leaves = true;
    }
    if (flow == Flow::kIndirect) block.next.assign(taken.begin(), taken.end());
    if (flow == Flow::kIndirect || flow == Flow::kReturn || flow == Flow::kStop) block.leaves = true;
    if (flow == Flow::kNext || flow == Flow::kBranch || flow == Flow::kCall) {
      if (b + 1 < graph.blocks.size())
        block.next.push_back(b + 1);
      else
        block.leaves = true;
    }
  }
  return graph;
}

}  // namespace kilotwin::behaviours
