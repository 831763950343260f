#include "services/behaviours/compiler.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <optional>
#include <system_error>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"
#include "services/behaviours/budget_register.hpp"
#include "services/behaviours/companions.hpp"
#include "services/behaviours/compiler_common.hpp"
#include "services/behaviours/cycle_counters.hpp"
#include "services/behaviours/elf_file.hpp"
#include "services/behaviours/loop_barriers.hpp"
#include "services/behaviours/program_text.hpp"
#include "services/behaviours/robot_int.hpp"
#include "services/behaviours/sha256.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;
namespace {

using Arguments = std::vector<std::string>;

void append(Arguments& to, const Arguments& more) { to.insert(to.end(), more.begin(), more.end()); }

/// A C compiler and its version text.
struct Compiler {
  std::string path, version;
  [[nodiscard]] bool is_clang() const { return version.find("clang") != std::string::npos; }
  [[nodiscard]] int major_version() const {
    const std::size_t at = version.find("version ");
    return at == std::string::npos ? 0 : static_cast<int>(std::strtol(version.c_str() + at + 8, nullptr, 10));
  }
};

Compiler find_compiler(const fs::path& wanted) {
  Compiler compiler{wanted.string(), ""};
  for (const char* name : {"cc", "gcc", "clang"}) {
    if (compiler.path.empty()) compiler.path = os::find_executable(name).string();
  }
  if (!compiler.path.empty() && access(compiler.path.c_str(), X_OK) == 0) {
    const os::ProcessResult result = run_compiler({compiler.path, "--version"});
    compiler.version = result.output;
    if (result.end.well()) return compiler;
  }
  throw UserError("no C compiler" + (wanted.empty() ? "" : " at " + wanted.string()) +
                  "; robots' programs are compiled when a run starts: apt-get install gcc");
}

/// Flags for all code. One part follows kilolib's build for the robot: unsigned char, packed structs, short enums, common globals.
/// The other part makes results alike on all machines: no contraction of floating-point operations, no libm, wrapping integers,
/// zero-initialised locals, one CPU type.
Arguments code_flags(const Compiler& compiler) {
  Arguments flags{
      "-O2", "-g", "-w", "-fdiagnostics-color=never", "-nostdinc", "-DF_CPU=8000000", "-funsigned-char",
      "-fpack-struct", "-fshort-enums", "-fcommon", "-march=x86-64", "-fPIC", "-fvisibility=hidden",
      "-ffp-contract=off", "-fno-math-errno", "-fno-strict-aliasing", "-fwrapv", "-fno-delete-null-pointer-checks",
      "-fcf-protection=none", "-fno-stack-protector", "-fstack-clash-protection", "-fno-asynchronous-unwind-tables",
      // The cycle counters need: memory below the stack pointer is free, jumps have known targets, recursion uses the
      // stack, and empty loops stay.
      "-mno-red-zone", "-fno-jump-tables", "-fno-optimize-sibling-calls", "-fno-finite-loops",
      "-ffunction-sections", "-fdata-sections", "-ftrivial-auto-var-init=zero"};
  if (compiler.is_clang()) {
    // clang 15 and older refuse -ftrivial-auto-var-init=zero without this second flag.
    if (compiler.major_version() < 16) {
      flags.emplace_back("-enable-trivial-auto-var-init-zero-knowing-it-will-be-removed-from-clang");
    }
  } else {
    // xmm15 holds the cycle budget (runtime/budget.h). -fno-ipa-ra: a caller keeps no value in a vector register across a call, so
    // that a robot that stops in a function without vectors has none to save.
    append(flags, {"-fno-tree-loop-distribute-patterns", "-funsigned-bitfields",
                   "-fno-isolate-erroneous-paths-dereference", "-ffixed-xmm15", "-fno-ipa-ra"});
  }
  return flags;
}

/// The runtime implements the C library, so the compiler must not replace its loops by calls of memcpy() and the like.
const Arguments kRuntimeFlags{"-std=gnu11", "-ffreestanding", "-fno-builtin", "-fno-common"};

/// C++ without exceptions, threads and library, as with avr-gcc.
Arguments language_flags(bool cpp) {
  if (!cpp) return {"-std=gnu11"};
  return {"-std=gnu++17", "-fno-exceptions",     "-fno-rtti",  "-fno-threadsafe-statics",
          "-fpermissive", "-fno-use-cxa-atexit", "-nostdinc++"};
}

const Arguments kLinkFlags{"-shared",           "-nostdlib",           "-Wl,-Bsymbolic",       "-Wl,-z,relro",
                           "-Wl,-z,now",        "-Wl,-z,noexecstack",  "-Wl,-z,separate-code", "-Wl,--no-undefined",
                           "-Wl,--gc-sections", "-Wl,--build-id=none", "-Wl,-e,kilotwin_image"};

/// Header search path: the runtime's headers, then the compiler's own, and no others.
Arguments include_flags(const Compiler& compiler, const fs::path& runtime) {
  std::string own = run_compiler({compiler.path, "-print-file-name=include"}).output;
  while (!own.empty() && own.back() == '\n') own.pop_back();
  return {"-isystem",
          (runtime / "kilolib").string(),
          "-isystem",
          (runtime / "libc").string(),
          "-isystem",
          own,
          "-include",
          (runtime / "machine.h").string(),
          "-ffile-prefix-map=" + runtime.string() + "=/kilotwin"};
}

/// Removes the sources' folders, and that where one stands, from debug information, so that equal sources give equal octets.
Arguments place_flags(const std::vector<fs::path>& sources) {
  std::error_code error;
  Arguments flags;
  if (const fs::path here = fs::current_path(error); !error)
    flags.push_back("-ffile-prefix-map=" + here.string() + "=.");
  for (const fs::path& source : sources) {
    if (source.has_parent_path()) flags.push_back("-ffile-prefix-map=" + source.parent_path().string() + "=.");
  }
  return flags;
}

CompiledProgram checked(const fs::path& file, const std::string& octets) {
  (void)ElfFile::parse(octets, file.string());
  return {file, sha256_hex(octets), {}};
}

CompiledProgram given(const fs::path& file) {
  const auto octets = os::read_if_there(file);
  if (!octets) throw UserError(file.string() + ": cannot be read; name a C source or a .so of `kilotwin build`");
  return checked(file, *octets);
}

/// A temporary file beside `file`, removed by the destructor. Creates the directory if it does not exist.
class Temporary {
 public:
  explicit Temporary(const fs::path& file) : path_(file.string() + ".XXXXXX") {
    std::error_code error;
    fs::create_directories(file.parent_path(), error);
    const int descriptor = mkstemp(path_.data());
    if (descriptor < 0) throw RunError(path_ + ": cannot be written; is the disk full?");
    close(descriptor);
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  ~Temporary() { unlink(path_.c_str()); }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Runs a compilation with `-o` and stores its output as `kept`. Throws UserError with the compiler's first error.
std::string build(Arguments arguments, const fs::path& kept, const std::vector<fs::path>& sources) {
  const Temporary result(kept);
  append(arguments, {"-o", result.path()});
  const os::ProcessResult process = run_compiler(arguments);
  if (!process.end.well()) throw UserError(all_errors(process.errors, sources));
  std::string octets = os::read_file(result.path());
  os::write_file(kept, octets);
  return octets;
}

/// Compiles to assembly. On failure returns nothing and puts the compiler's messages into `errors`.
std::optional<std::string> assembly_of(Arguments arguments, const fs::path& place, std::string& errors) {
  const Temporary result(place);
  append(arguments, {"-S", "-o", result.path()});
  const os::ProcessResult process = run_compiler(arguments);
  errors = process.errors;
  if (!process.end.well()) return std::nullopt;
  return os::read_if_there(result.path());
}

bool needs_code_on_stack(const std::string& assembly) {
  return assembly.find(".note.GNU-stack,\"x\"") != std::string::npos;
}

/// Refuses trampolines: gcc calls a nested function through code on the stack if its address is taken and it uses variables of the
/// enclosing function. The AVR cannot execute its RAM, and here stacks are not executable.
void refuse_code_on_stack(const std::string& assembly, Arguments compile, const std::vector<fs::path>& sources,
                          const fs::path& place) {
  if (!needs_code_on_stack(assembly)) return;
  std::erase(compile, "-w");
  append(compile, {"-Wtrampolines", "-Werror=trampolines"});
  std::string errors;
  (void)assembly_of(compile, place, errors);
  const std::string error = all_errors(errors, sources);
  throw UserError(
      error.substr(0, error.find(" [-W")) +
      "; a robot cannot run code on its stack: let the nested function use no variable of the one around it, or "
      "call it there by its name alone");
}

/// Thrown if a program does not compile with the robot's int. It may compile without.
struct NeedsWideInt {};

/// Compiles one source to assembly with cycle counters and loop barriers. The barriers change the text that is compiled, so error
/// messages come from a compilation of the unchanged source.
std::string counted_assembly(const Arguments& compiler, const fs::path& source, const std::string& preprocessed,
                             const std::vector<fs::path>& sources, const fs::path& place, bool robot_int) {
  const Temporary marked(place);
  os::write_file(marked.path(), with_loop_barriers(preprocessed));
  std::string errors;
  Arguments arguments;
  for (std::size_t i = 0; i < compiler.size(); ++i) {
    if (compiler[i] == "-include")
      ++i;  // skip "-include FILE": the preprocessed text contains it
    else
      arguments.push_back(compiler[i]);
  }
  append(arguments, {"-x", is_cpp(source) ? "c++-cpp-output" : "cpp-output", marked.path()});
  auto assembly = assembly_of(arguments, place, errors);
  if (!assembly && robot_int) throw NeedsWideInt{};
  if (!assembly) {
    arguments = compiler;
    arguments.push_back(source.string());
    assembly = assembly_of(arguments, place, errors);
  }
  if (!assembly) throw UserError(all_errors(errors, sources));
  // The error is to name the columns of the source, which the robot's int shifts.
  if (robot_int && needs_code_on_stack(*assembly)) throw NeedsWideInt{};
  refuse_code_on_stack(*assembly, arguments, sources, place);
  try {
    return with_cycle_counters(*assembly);
  } catch (const NeedsAllVectorRegisters& one) {
    throw UserError(sources.front().string() + ":1:1: error: " + one.function +
                    "() computes with more floating-point values at a time than fit into registers; split it, or "
                    "compile with gcc");
  }
}

/// The runtime as one object file, cached per compiler.
fs::path runtime_object(const Compiler& compiler, const Arguments& includes, const fs::path& runtime,
                        const std::string& content) {
  fs::path kept = runtime / (sha256_hex(content) + ".o");
  std::error_code error;
  if (fs::is_regular_file(kept, error)) return kept;
  Arguments compile{compiler.path};
  append(compile, place_flags({}));
  append(compile, code_flags(compiler));
  append(compile, kRuntimeFlags);
  append(compile, includes);
  append(compile, {"-I", runtime.string()});
  Arguments link = compile;
  append(link, {"-r", "-nostdlib", (runtime / "switch.c").string(), "-x", "assembler"});
  std::vector<std::unique_ptr<Temporary>> parts;
  for (const char* name : {"kilolib.c", "machine.c", "libavr.c", "libc.c", "libcomplex.c", "libm.c", "libnumbers.c",
                           "libstdio.c", "core/math/elementary.c"}) {
    Arguments arguments = compile;
    arguments.push_back((runtime / name).string());
    std::string errors;
    const auto assembly = assembly_of(arguments, kept, errors);
    if (!assembly) throw UserError(all_errors(errors, {runtime / name}));
    parts.push_back(std::make_unique<Temporary>(kept));
    const bool is_firmware = name == std::string_view("kilolib.c") || name == std::string_view("machine.c");
    const auto counted = is_firmware ? Counted::kTestsOnly : Counted::kAll;
    os::write_file(parts.back()->path(), with_cycle_counters(*assembly, counted));
    link.push_back(parts.back()->path());
  }
  (void)build(link, kept, {runtime / "kilolib.c"});
  return kept;
}

/// Links twice. The first link gives the size of the variables. The second aligns their end with the end of a page, so that an
/// access beyond them faults.
std::string linked(const Arguments& first, const Arguments& rest, const fs::path& place,
                   const std::vector<fs::path>& sources) {
  constexpr std::uint64_t kAlignment = 64;  // the largest alignment of any variable
  const Temporary result(place), front(place);
  for (std::uint64_t pad = 0;;) {
    os::write_file(front.path(),
                   ".section .data,\"aw\"\n.balign " + std::to_string(kAlignment) + "\n.zero " +
                       std::to_string(pad) +
                       "\n.globl kilotwin_variables\n.hidden kilotwin_variables\nkilotwin_variables:\n"
                       ".section .note.GNU-stack,\"\"\n");
    Arguments arguments = first;
    append(arguments, {"-x", "assembler", front.path(), "-x", "none"});
    append(arguments, rest);
    append(arguments, {"-o", result.path()});
    const os::ProcessResult process = run_compiler(arguments);
    if (!process.end.well()) {
      if (!undefined_names(process.errors).empty()) throw Incomplete{process.errors};
      throw UserError(all_errors(process.errors, sources));
    }
    std::string octets = os::read_file(result.path());
    const std::uint64_t unused = ElfFile::parse(octets, place.string()).unused_octets() / kAlignment * kAlignment;
    if (unused == 0 || pad != 0) return octets;
    pad = unused;
  }
}

/// A compiler with the flags and the runtime, which do not depend on the program.
struct Toolchain {
  Compiler compiler;
  fs::path cache, runtime;
  Arguments code, includes, defines;
  Kilolib kilolib = Kilolib::kKilobot;
  bool robot_int = true;  ///< C programs get an int of 16 bits

  /// Compiles and links, or returns the cached result. Throws Incomplete if functions are missing, NeedsWideInt if robot_int
  /// does not suit the program, UserError for other errors.
  [[nodiscard]] CompiledProgram make(const ProgramText& text, const Arguments& dialect) const;

  /// The preprocessed text of one source, or "" on failure.
  [[nodiscard]] std::string preprocessed(const fs::path& source, const Arguments& dialect) const;

 private:
  [[nodiscard]] Arguments flags_for(const ProgramText& text, const fs::path& file, const Arguments& dialect) const {
    const bool as_cpp = std::find(dialect.begin(), dialect.end(), "c++") != dialect.end();
    Arguments result = language_flags(as_cpp || is_cpp(file));
    // Of several names for one folder the last one counts: the runtime may be where one stands.
    for (const Arguments& part : {place_flags(text.sources), code, dialect, defines, includes})
      append(result, part);
    if (robot_int) result.emplace_back("-DKILOTWIN_ROBOT_INT");
    return result;
  }
};

std::string Toolchain::preprocessed(const fs::path& source, const Arguments& dialect) const {
  const ProgramText text = program_text({source}, cache, kilolib);
  Arguments preprocess{compiler.path, "-E", "-P"};
  append(preprocess, flags_for(text, text.files[0], dialect));
  preprocess.push_back(text.files[0].string());
  const os::ProcessResult process = run_compiler(preprocess);
  return process.end.well() ? process.output : "";
}

CompiledProgram Toolchain::make(const ProgramText& text, const Arguments& dialect) const {
  std::string content = runtime.filename().string() + '\n' + compiler.path + '\n' + compiler.version +
                        "\ncounters " + std::to_string(kCountersVersion) + '\n';
  for (const std::string& flag : code) content += flag + '\n';
  for (const std::string& flag : kLinkFlags) content += flag + '\n';
  const std::string runtime_content = content;
  for (const std::string& flag : defines) content += flag + '\n';
  for (const std::string& flag : dialect) content += flag + '\n';
  content += robot_int ? "int 16\n" : "int 32\n";
  const std::string program_content = content;
  std::vector<fs::path> files = text.files;
  if (const fs::path library = kilolib_source(kilolib, runtime); !library.empty()) files.push_back(library);
  const std::size_t first_of_simulator = files.size();
  std::vector<std::string> texts;
  bool for_kilombo = std::find(dialect.begin(), dialect.end(), "-DSIMULATOR") != dialect.end();
  for (std::size_t i = 0; i < files.size(); ++i) {
    const fs::path file = files[i];
    Arguments preprocess{compiler.path, "-E"};
    append(preprocess, flags_for(text, file, dialect));
    preprocess.push_back(file.string());
    os::ProcessResult process = run_compiler(preprocess);
    if (!process.end.well()) throw UserError(all_errors(process.errors, text.sources));
    content += sha256_hex(process.output);
    for_kilombo = for_kilombo || process.output.find("UserdataSize") != std::string::npos;
    if (robot_int) {
      const bool as_cpp = std::find(dialect.begin(), dialect.end(), "c++") != dialect.end() || is_cpp(file);
      if (as_cpp || !allows_robot_int(process.output)) throw NeedsWideInt{};
      process.output = with_robot_int(process.output);
    }
    texts.push_back(std::move(process.output));
    if (i + 1 == first_of_simulator && for_kilombo) files.push_back(runtime / "simulator.c");
  }
  const fs::path kept = cache / "programs" / (sha256_hex(content) + ".so");
  if (const auto octets = os::read_if_there(kept)) {
    try {
      return checked(kept, *octets);
    } catch (const UserError&) {
      // The cached file is damaged, so compile again below.
    }
  }
  Arguments first{compiler.path}, link;
  append(first, kLinkFlags);
  // The runtime's variables come first. A write past the end of a program's array then hits the program's variables, as on the robot.
  link.push_back(runtime_object(compiler, includes, runtime, runtime_content).string());
  append(link, {"-x", "assembler"});
  std::vector<std::unique_ptr<Temporary>> parts;
  for (std::size_t i = 0; i < files.size(); ++i) {
    Arguments compile{compiler.path};
    append(compile, flags_for(text, files[i], dialect));
    parts.push_back(std::make_unique<Temporary>(kept));
    // Each file is compiled once: its counted assembly is kept by the content of everything that goes into it.
    const fs::path assembly =
        cache / "assembly" / (sha256_hex(program_content + (is_cpp(files[i]) ? "c++\n" : "c\n") + texts[i]) + ".s");
    auto counted = os::read_if_there(assembly);
    if (!counted) {
      counted = counted_assembly(compile, files[i], texts[i], text.sources, kept, robot_int);
      std::error_code error;
      fs::create_directories(assembly.parent_path(), error);
      os::write_file(assembly, *counted);
    }
    os::write_file(parts.back()->path(), *counted);
    link.push_back(parts.back()->path());
  }
  append(link, {"-x", "none", "-lgcc", "-Wl,-T," + (runtime / "constructors.ld").string()});
  const std::string octets = linked(first, link, kept, text.sources);
  os::write_file(kept, octets);
  return checked(kept, octets);
}

bool mentions(const std::vector<fs::path>& sources, std::string_view word) {
  for (const fs::path& source : sources) {
    if (os::read_if_there(source).value_or("").find(word) != std::string::npos) return true;
  }
  return false;
}

CompiledProgram complete(const Toolchain& toolchain, const std::vector<fs::path>& sources,
                         const Arguments& dialect) {
  std::string kind = "simulation";
  for (const std::string& flag : toolchain.defines) kind += '\n' + flag;
  return with_companions(
      sources, toolchain.cache,
      {toolchain.kilolib, kind, [&](const ProgramText& text) { return toolchain.make(text, dialect); },
       [&](const fs::path& source) { return toolchain.preprocessed(source, dialect); }});
}

/// complete(), with the robot's int if the program allows it.
CompiledProgram complete_with_int(Toolchain toolchain, const std::vector<fs::path>& sources,
                                  const Arguments& dialect) {
  try {
    return complete(toolchain, sources, dialect);
  } catch (const NeedsWideInt&) {
    toolchain.robot_int = false;
  }
  CompiledProgram program = complete(toolchain, sources, dialect);
  if (!is_cpp(sources.front()))
    program.notes.push_back(sources.front().string() + ": its int has 32 bits here, 16 on the robot");
  return program;
}

/// Compiler options under which a program may compile that is invalid without them, and the note for the user.
struct Dialect {
  Arguments flags;
  std::string note;
};

/// Dialects that may cure this error, the likeliest first.
std::vector<Dialect> dialects_for(const std::string& error, const std::vector<fs::path>& sources,
                                  const fs::path& runtime) {
  auto says = [&](std::string_view word) { return error.find(word) != std::string::npos; };
  std::vector<Dialect> result;
  const Arguments headers{"-include", (runtime / "headers.h").string()};
  const std::string with_headers = "compiled with headers that it does not include";
  if (says("undefined reference"))
    result.push_back({{"-fgnu89-inline"}, "compiled with inline functions as before C99"});
  if (says("'debug_info_t' undeclared"))
    result.push_back({{"-DKILOTWIN_NO_DEBUG_INFO"}, "compiled without debug_info_t"});
  if (says("undeclared") || says("unknown type name") || says("was not declared")) {
    result.push_back({headers, with_headers});
    result.push_back(
        {{"-DKILOTWIN_NO_DEBUG_INFO", headers[0], headers[1]}, with_headers + ", without debug_info_t"});
  }
  if (mentions(sources, "SIMULATOR")) {
    const std::string for_kilombo = "compiled with SIMULATOR, as for Kilombo";
    result.push_back({{"-DSIMULATOR"}, for_kilombo});
    result.push_back({{"-DSIMULATOR", headers[0], headers[1]}, for_kilombo + "; " + with_headers});
  }
  if (!says("undefined reference") && !says("No such file")) {
    const Arguments as_cpp{"-x", "c++", headers[0], headers[1]};
    const std::string note = "compiled as C++, " + with_headers.substr(9);
    result.push_back({as_cpp, note});
    if (mentions(sources, "log_message")) {
      result.push_back({as_cpp, note + ", and with log_message()"});
      append(result.back().flags, {"-include", (runtime / "log_message.h").string()});
    }
  }
  return result;
}

}  // namespace

CompiledProgram compile(const std::vector<fs::path>& sources, const CompileOptions& options) {
  if (sources.size() == 1 && sources[0].extension() == ".so") return given(sources[0]);
  check_sources(sources);
  Toolchain toolchain;
  toolchain.defines = define_flags(options.defines);
  toolchain.compiler = find_compiler(options.compiler);
  toolchain.cache = os::cache_directory(options.cache_directory);
  toolchain.runtime = unpacked_runtime(toolchain.cache);
  toolchain.kilolib = kilolib_for(sources, options);
  append(toolchain.defines, kilolib_flags(toolchain.kilolib, toolchain.runtime));
  toolchain.includes = include_flags(toolchain.compiler, toolchain.runtime);
  toolchain.code = code_flags(toolchain.compiler);
  toolchain.robot_int = !options.wide_int;
  try {
    return complete_with_int(toolchain, sources, {});
  } catch (const UserError& error) {
    for (const Dialect& dialect : dialects_for(error.what(), sources, toolchain.runtime)) {
      try {
        CompiledProgram program = complete_with_int(toolchain, sources, dialect.flags);
        program.notes.push_back(sources.front().string() + ": " + dialect.note);
        return program;
      } catch (const UserError&) {
        // Keep the error of the first attempt, because it is about the program as written.
      }
    }
    throw;
  }
}

}  // namespace kilotwin::behaviours
