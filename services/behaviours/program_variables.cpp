#include "services/behaviours/program_variables.hpp"

#include <dwarf.h>
#include <elfutils/libdw.h>
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>

#include "core/base/error.hpp"

namespace kilotwin::behaviours {
namespace {

/// Folder of the runtime's sources in debug information.
constexpr std::string_view kRuntime = "/kilotwin";
constexpr int kDeepest = 32;

/// The debug information of an ELF file, which may be damaged.
class DebugInformation {
 public:
  explicit DebugInformation(const std::string& elf) : octets_(elf) {
    if (elf_version(EV_CURRENT) == EV_NONE) return;
    file_.reset(elf_memory(octets_.data(), octets_.size()));
    if (file_) dwarf_.reset(dwarf_begin_elf(file_.get(), DWARF_C_READ, nullptr));
  }
  /// Calls f(die of the unit, whether it is of the runtime) for each compilation unit.
  template <class F> void each_unit(F f) const {
    if (!dwarf_) return;
    Dwarf_CU* unit = nullptr;
    Dwarf_Die die;
    std::uint8_t type = 0;
    while (dwarf_get_units(dwarf_.get(), unit, &unit, nullptr, &type, &die, nullptr) == 0) {
      const char* const name = dwarf_diename(&die);
      f(die, name != nullptr && std::string_view(name).starts_with(kRuntime));
    }
  }

 private:
  struct End {
    void operator()(Elf* elf) const { elf_end(elf); }
    void operator()(Dwarf* dwarf) const { dwarf_end(dwarf); }
  };
  std::string octets_;  // libelf takes memory that it may write to
  std::unique_ptr<Elf, End> file_;
  std::unique_ptr<Dwarf, End> dwarf_;
};

std::optional<std::uint64_t> number_of(Dwarf_Die& die, unsigned attribute) {
  Dwarf_Attribute found;
  Dwarf_Word value = 0;
  if (dwarf_attr_integrate(&die, attribute, &found) == nullptr || dwarf_formudata(&found, &value) != 0)
    return std::nullopt;
  return value;
}

/// The type of a variable, member, array or pointer, without typedefs and qualifiers.
std::optional<Dwarf_Die> type_of(Dwarf_Die& die) {
  Dwarf_Attribute attribute;
  Dwarf_Die type, peeled;
  if (dwarf_attr_integrate(&die, DW_AT_type, &attribute) == nullptr ||
      dwarf_formref_die(&attribute, &type) == nullptr)
    return std::nullopt;
  if (dwarf_peel_type(&type, &peeled) != 0) return std::nullopt;
  return peeled;
}

std::uint64_t size_of(Dwarf_Die& type) {
  Dwarf_Word size = 0;
  return dwarf_aggregate_size(&type, &size) == 0 ? size : 0;
}

struct Found {
  Dwarf_Die die;
  std::string function;  ///< empty outside functions
  std::optional<std::uint64_t> address;
  bool is_runtime = false;
};

std::optional<std::uint64_t> address_of(Dwarf_Die& variable) {
  Dwarf_Attribute attribute;
  Dwarf_Op* operations = nullptr;
  std::size_t count = 0;
  if (dwarf_attr(&variable, DW_AT_location, &attribute) == nullptr ||
      dwarf_getlocation(&attribute, &operations, &count) != 0 || count != 1 || operations[0].atom != DW_OP_addr)
    return std::nullopt;
  // The linker has left the variable out, because nothing refers to it.
  if (operations[0].number == 0) return std::nullopt;
  return operations[0].number;
}

/// Calls f(die, function) for each variable among the children of a unit, function or block.
template <class F> void each_variable(Dwarf_Die& parent, const std::string& function, int depth, F& f) {
  Dwarf_Die child;
  if (depth > kDeepest || dwarf_child(&parent, &child) != 0) return;
  do {
    const int tag = dwarf_tag(&child);
    const char* const name = dwarf_diename(&child);
    if (tag == DW_TAG_variable && name != nullptr)
      f(child, std::string(name), function);
    else if (tag == DW_TAG_subprogram || tag == DW_TAG_inlined_subroutine)
      each_variable(child, name != nullptr ? name : function, depth + 1, f);
    else if (tag == DW_TAG_lexical_block || tag == DW_TAG_namespace)
      each_variable(child, function, depth + 1, f);
  } while (dwarf_siblingof(&child, &child) == 0);
}

/// From a variable's type and a path to scalars.
class Resolver {
 public:
  Resolver(const std::string& name, std::uint64_t address) {
    at_.name = name;
    at_.address = address;
  }

  std::vector<ScalarVariable> resolve(Dwarf_Die type, const std::vector<VariablePath::Step>& steps) {
    for (const VariablePath::Step& step : steps) {
      switch (step.kind) {
        case VariablePath::Step::Kind::kField: take_field(type, step.field, "."); break;
        case VariablePath::Step::Kind::kArrow:
          follow(type, step.field);
          take_field(type, step.field, "->");
          break;
        case VariablePath::Step::Kind::kIndex: take_element(type, step.index); break;
      }
    }
    if (dwarf_tag(&type) == DW_TAG_pointer_type)
      refuse("is a pointer; name what it points to, such as " + at_.name + "->x");
    expand(type, 0);
    return std::move(scalars_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const { throw UserError(at_.name + " " + what); }

  void follow(Dwarf_Die& type, const std::string& towards) {
    if (dwarf_tag(&type) != DW_TAG_pointer_type) refuse("is no pointer; write ." + towards);
    if (at_.pointer_octets != 0) refuse("is a second pointer on the way; one can be followed");
    const auto target = type_of(type);
    if (!target) refuse("points to nothing that has a type");
    at_.pointer = at_.address;
    at_.pointer_octets = static_cast<std::uint32_t>(std::max<std::uint64_t>(size_of(type), 1));
    at_.address = 0;
    type = *target;
  }

  static bool is_struct(Dwarf_Die& type) {
    const int tag = dwarf_tag(&type);
    return tag == DW_TAG_structure_type || tag == DW_TAG_union_type || tag == DW_TAG_class_type;
  }

  /// Calls f(member, its name or nullptr) until it returns true.
  template <class F> static bool each_member(Dwarf_Die& type, F f) {
    Dwarf_Die member;
    if (dwarf_child(&type, &member) != 0) return false;
    do {
      if (dwarf_tag(&member) == DW_TAG_member && f(member, dwarf_diename(&member))) return true;
    } while (dwarf_siblingof(&member, &member) == 0);
    return false;
  }

  /// Moves to a member; bit fields set bit_offset and bits.
  void enter(Dwarf_Die& member, Dwarf_Die& type) {
    const std::uint64_t offset = number_of(member, DW_AT_data_member_location).value_or(0);
    const auto next = type_of(member);
    if (!next) refuse("has a member without a type");
    type = *next;
    const std::uint64_t bits = number_of(member, DW_AT_bit_size).value_or(0);
    std::uint64_t bit = 8 * offset;
    if (bits != 0) {
      const std::uint64_t storage = number_of(member, DW_AT_byte_size).value_or(size_of(type));
      if (const auto from_start = number_of(member, DW_AT_data_bit_offset))
        bit = *from_start;
      else if (const auto from_top = number_of(member, DW_AT_bit_offset))
        bit = 8 * offset + 8 * storage - *from_top - bits;
    }
    at_.address += bit / 8;
    at_.bit_offset = static_cast<std::uint32_t>(bit % 8);
    at_.bits = static_cast<std::uint32_t>(bits);
  }

  void take_field(Dwarf_Die& type, const std::string& field, std::string_view connector) {
    if (dwarf_tag(&type) == DW_TAG_pointer_type) refuse("is a pointer; write " + at_.name + "->" + field);
    if (!is_struct(type)) refuse("has no fields; it is no struct");
    if (!find_field(type, field, 0)) refuse(fmt::format("has no field \"{}\"; {}", field, fields_in_words(type)));
    at_.name += std::string(connector) + field;
  }

  /// Members of unnamed structs and unions count as members of the struct around them.
  bool find_field(Dwarf_Die& type, const std::string& field, int depth) {
    const ScalarVariable before = at_;
    return depth < kDeepest && each_member(type, [&](Dwarf_Die& member, const char* name) {
             Dwarf_Die inner;
             if (name != nullptr && field == name) {
               enter(member, inner);
               type = inner;
               return true;
             }
             if (name != nullptr) return false;
             enter(member, inner);
             if (is_struct(inner) && find_field(inner, field, depth + 1)) {
               type = inner;
               return true;
             }
             at_ = before;
             return false;
           });
  }

  static std::string fields_in_words(Dwarf_Die& type) {
    std::string text;
    each_member(type, [&](Dwarf_Die&, const char* name) {
      if (name != nullptr) text += (text.empty() ? "it has " : ", ") + std::string(name);
      return false;
    });
    return text.empty() ? "it has none" : text;
  }

  /// Elements per dimension of an array.
  static std::vector<std::uint64_t> dimensions(Dwarf_Die& array) {
    std::vector<std::uint64_t> counts;
    Dwarf_Die child;
    if (dwarf_child(&array, &child) != 0) return counts;
    do {
      if (dwarf_tag(&child) != DW_TAG_subrange_type) continue;
      const auto count = number_of(child, DW_AT_count), last = number_of(child, DW_AT_upper_bound);
      counts.push_back(count ? *count : last ? *last + 1 : 0);
    } while (dwarf_siblingof(&child, &child) == 0);
    return counts;
  }

  void take_element(Dwarf_Die& type, std::uint64_t index) {
    if (dwarf_tag(&type) == DW_TAG_pointer_type) {
      follow(type, {});
      at_.address += index * size_of(type);
    } else if (dwarf_tag(&type) == DW_TAG_array_type) {
      if (rest_.empty()) rest_ = dimensions(type);
      if (rest_.empty() || index >= rest_.front())
        refuse(fmt::format("has {} elements, so there is no [{}]", rest_.empty() ? 0 : rest_.front(), index));
      auto element = type_of(type);
      if (!element) refuse("is an array without a type");
      std::uint64_t size = size_of(*element);
      for (std::size_t i = 1; i < rest_.size(); ++i) size *= rest_[i];
      at_.address += index * size;
      rest_.erase(rest_.begin());
      if (rest_.empty()) type = *element;
    } else {
      refuse("is no array");
    }
    at_.name += fmt::format("[{}]", index);
  }

  void expand(Dwarf_Die type, int depth) {
    if (depth > kDeepest) return;
    const ScalarVariable before = at_;
    if (dwarf_tag(&type) == DW_TAG_array_type) {
      const std::vector<std::uint64_t> counts = rest_.empty() ? dimensions(type) : rest_;
      const std::uint64_t count = counts.empty() ? 0 : counts.front();
      if (count > kMostScalars) refuse(fmt::format("has {} elements; name some of them", count));
      for (std::uint64_t i = 0; i < count; ++i) {
        Dwarf_Die element = type;
        rest_ = counts;
        take_element(element, i);
        expand(element, depth + 1);
        at_ = before;
      }
      rest_.clear();
    } else if (is_struct(type)) {
      each_member(type, [&](Dwarf_Die& member, const char* name) {
        Dwarf_Die inner;
        enter(member, inner);
        if (name != nullptr) at_.name += std::string(".") + name;
        expand(inner, depth + 1);
        at_ = before;
        return false;
      });
    } else if (dwarf_tag(&type) != DW_TAG_pointer_type) {
      add_scalar(type);
    }
  }

  void add_scalar(Dwarf_Die& type) {
    const int tag = dwarf_tag(&type);
    const std::uint64_t encoding = tag == DW_TAG_base_type ? number_of(type, DW_AT_encoding).value_or(0) : 0;
    ScalarVariable scalar = at_;
    const bool is_float = encoding == DW_ATE_float;
    scalar.kind = is_float                                                      ? ScalarVariable::Kind::kFloat
                  : encoding == DW_ATE_signed || encoding == DW_ATE_signed_char ? ScalarVariable::Kind::kSigned
                                                                                : ScalarVariable::Kind::kUnsigned;
    const std::uint64_t octets =
        scalar.bits == 0 ? size_of(type) : (scalar.bit_offset + std::uint64_t{scalar.bits} + 7) / 8;
    const bool known = tag == DW_TAG_enumeration_type || (encoding != 0 && encoding != DW_ATE_complex_float);
    if (!known || octets == 0 || octets > 8 || (is_float && octets != 4 && octets != 8))
      refuse("is of a type that cannot be recorded");
    scalar.octets = static_cast<std::uint32_t>(octets);
    if (scalars_.size() == kMostScalars)
      refuse(fmt::format("has more than {} values; name some of them", kMostScalars));
    scalars_.push_back(std::move(scalar));
  }

  ScalarVariable at_;                // where the walk is
  std::vector<std::uint64_t> rest_;  // dimensions of the array at hand that have no index yet
  std::vector<ScalarVariable> scalars_;
};

/// Those that count: of the program before the runtime's, outside functions before those within.
std::vector<Found> preferred(std::vector<Found> all) {
  const auto keep = [&](auto condition) {
    if (std::any_of(all.begin(), all.end(), condition))
      std::erase_if(all, [&](const Found& f) { return !condition(f); });
  };
  keep([](const Found& f) { return !f.is_runtime; });
  keep([](const Found& f) { return f.address.has_value(); });
  keep([](const Found& f) { return f.function.empty(); });
  return all;
}

}  // namespace

std::vector<ScalarVariable> find_variable(const std::string& elf, const VariablePath& path) {
  const DebugInformation information(elf);
  std::vector<Found> all;
  information.each_unit([&](Dwarf_Die& unit, bool is_runtime) {
    auto take = [&](Dwarf_Die& die, const std::string& name, const std::string& function) {
      if (name != path.name || (!path.function.empty() && path.function != function)) return;
      Dwarf_Attribute declaration;
      const bool declares = dwarf_attr(&die, DW_AT_declaration, &declaration) != nullptr;
      const auto address = address_of(die);
      // Automatic variables of functions have no fixed address, and say nothing where a static one is not kept.
      if (!address && (declares || !function.empty())) return;
      all.push_back({die, function, address, is_runtime});
    };
    each_variable(unit, {}, 0, take);
  });
  std::vector<Found> found = preferred(std::move(all));
  if (found.empty()) return {};
  if (!found.front().address) {
    throw UserError(
        fmt::format("the program keeps {} nowhere, because nothing reads it; use its value, and declare it "
                    "volatile if that does not help",
                    path.name));
  }
  for (const Found& other : found) {
    if (other.address == found.front().address) continue;
    throw UserError(other.function.empty()
                        ? fmt::format("two files have a static variable {}; give one another name", path.name)
                        : fmt::format("the functions {} and {} have a static variable {}; write {}::{}",
                                      found.front().function, other.function, path.name, other.function,
                                      path.name));
  }
  const auto type = type_of(found.front().die);
  if (!type) throw UserError(path.name + " has no type in the debug information");
  const std::string name = path.function.empty() ? path.name : path.function + "::" + path.name;
  return Resolver(name, *found.front().address).resolve(*type, path.steps);
}

std::vector<std::string> variable_names(const std::string& elf) {
  const DebugInformation information(elf);
  std::set<std::string> names;
  information.each_unit([&](Dwarf_Die& unit, bool is_runtime) {
    auto take = [&](Dwarf_Die& die, const std::string& name, const std::string& function) {
      if (address_of(die)) names.insert(function.empty() ? name : function + "::" + name);
    };
    if (!is_runtime) each_variable(unit, {}, 0, take);
  });
  return {names.begin(), names.end()};
}

}  // namespace kilotwin::behaviours
