#include "clients/behaviours/compiler.hpp"

#include <unistd.h>

#include <cstdlib>
#include <system_error>

#include "clients/behaviours/compiler_common.hpp"
#include "clients/behaviours/elf_file.hpp"
#include "clients/behaviours/files.hpp"
#include "clients/behaviours/process.hpp"
#include "clients/behaviours/sha256.hpp"
#include "core/base/error.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;
namespace {

using Arguments = std::vector<std::string>;

void append(Arguments& to, const Arguments& more) { to.insert(to.end(), more.begin(), more.end()); }

/// A C compiler and what it says of itself.
struct Compiler {
  std::string path, version;
  [[nodiscard]] bool is_clang() const { return version.find("clang") != std::string::npos; }
  [[nodiscard]] int major_version() const {
    const std::size_t at = version.find("version ");
    return at == std::string::npos ? 0 : std::atoi(version.c_str() + at + 8);
  }
};

Compiler find_compiler(const fs::path& wanted) {
  Compiler compiler{wanted.string(), ""};
  for (const char* name : {"cc", "gcc", "clang"}) {
    if (compiler.path.empty()) compiler.path = find_executable(name).string();
  }
  if (!compiler.path.empty() && access(compiler.path.c_str(), X_OK) == 0) {
    const ProcessResult result = run_process({compiler.path, "--version"});
    compiler.version = result.output;
    if (result.status == 0) return compiler;
  }
  throw UserError("no C compiler" + (wanted.empty() ? "" : " at " + wanted.string()) +
                  "; robots' programs are compiled when a run starts: apt-get install gcc");
}

/// As kilolib is built for the robot (unsigned char, packed structs, short enums, common globals of avr-gcc's age), with
/// what makes results equal everywhere: no contraction, no libm, wrapping integers, locals that start as zero, one CPU.
Arguments code_flags(const Compiler& compiler) {
  Arguments flags{"-std=gnu11",
                  "-O2",
                  "-g",
                  "-w",
                  "-fdiagnostics-color=never",
                  "-nostdinc",
                  "-ffreestanding",
                  "-fno-builtin",
                  "-DF_CPU=8000000",
                  "-funsigned-char",
                  "-fpack-struct",
                  "-fshort-enums",
                  "-fcommon",
                  "-march=x86-64",
                  "-fPIC",
                  "-fvisibility=hidden",
                  "-ffp-contract=off",
                  "-fno-math-errno",
                  "-fno-strict-aliasing",
                  "-fwrapv",
                  "-fno-delete-null-pointer-checks",
                  "-fcf-protection=none",
                  "-fno-stack-protector",
                  "-fstack-clash-protection",
                  "-fno-asynchronous-unwind-tables",
                  "-ffunction-sections",
                  "-fdata-sections",
                  "-ftrivial-auto-var-init=zero"};
  if (compiler.is_clang()) {
    // Before 16, clang wants to be told twice.
    if (compiler.major_version() < 16) {
      flags.emplace_back("-enable-trivial-auto-var-init-zero-knowing-it-will-be-removed-from-clang");
    }
  } else {
    append(flags, {"-fno-tree-loop-distribute-patterns", "-funsigned-bitfields"});
  }
  return flags;
}

const Arguments kLinkFlags{"-shared",           "-nostdlib",           "-Wl,-Bsymbolic",       "-Wl,-z,relro",
                           "-Wl,-z,now",        "-Wl,-z,noexecstack",  "-Wl,-z,separate-code", "-Wl,--no-undefined",
                           "-Wl,--gc-sections", "-Wl,--build-id=none", "-Wl,-e,kilotwin_image"};

/// Headers: ours before the compiler's own, no others.
Arguments include_flags(const Compiler& compiler, const fs::path& runtime) {
  std::string own = run_process({compiler.path, "-print-file-name=include"}).output;
  while (!own.empty() && own.back() == '\n') own.pop_back();
  return {"-isystem",
          (runtime / "kilolib").string(),
          "-isystem",
          (runtime / "libc").string(),
          "-isystem",
          own,
          "-ffile-prefix-map=" + runtime.string() + "=/kilotwin"};
}

/// Leaves the folders of the sources out of the result, so that the same content gives the same octets wherever it lies.
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
  return {file, sha256_hex(octets)};
}

CompiledProgram given(const fs::path& file) {
  const auto octets = read_file(file);
  if (!octets) throw UserError(file.string() + ": cannot be read; name a C source or a .so of `kilotwin build`");
  return checked(file, *octets);
}

/// A private name next to `file`, in a directory that is made if need be, that ceases to exist with this object.
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

/// Runs a compilation that ends in `-o FILE`, and keeps the file as `kept`. Throws UserError with the compiler's words.
std::string build(Arguments arguments, const fs::path& kept, const std::vector<fs::path>& sources) {
  const Temporary result(kept);
  append(arguments, {"-o", result.path()});
  const ProcessResult process = run_process(arguments);
  if (process.status != 0) throw UserError(first_error(process.errors, sources));
  const auto octets = read_file(result.path());
  if (!octets || !write_file(kept, *octets))
    throw RunError(kept.string() + ": cannot be written; is the disk full?");
  return *octets;
}

/// The runtime as one object, made once per compiler.
fs::path runtime_object(const Compiler& compiler, const Arguments& flags, const Arguments& includes,
                        const fs::path& runtime, const std::string& content) {
  const fs::path kept = runtime / (sha256_hex(content) + ".o");
  std::error_code error;
  if (fs::is_regular_file(kept, error)) return kept;
  Arguments arguments{compiler.path, "-r", "-nostdlib"};
  append(arguments, flags);
  append(arguments, includes);
  append(arguments, {"-I", runtime.string()});
  for (const char* name :
       {"kilolib.c", "switch.c", "libavr.c", "libc.c", "libm.c", "libprintf.c", "core/math/elementary.c"}) {
    arguments.push_back((runtime / name).string());
  }
  (void)build(arguments, kept, {runtime / "kilolib.c"});
  return kept;
}

}  // namespace

CompiledProgram compile(const std::vector<fs::path>& sources, const CompileOptions& options) {
  if (sources.size() == 1 && sources[0].extension() == ".so") return given(sources[0]);
  check_sources(sources);
  const Arguments defines = define_flags(options.defines);
  const Compiler compiler = find_compiler(options.compiler);
  const fs::path cache = cache_directory(options.cache_directory);
  const fs::path runtime = unpacked_runtime(cache);
  const Arguments includes = include_flags(compiler, runtime);

  const Arguments code = code_flags(compiler);
  Arguments files;
  for (const fs::path& source : sources) files.push_back(source.string());

  Arguments preprocess{compiler.path, "-E"};
  for (const Arguments& part : {code, defines, place_flags(sources), includes, files}) append(preprocess, part);
  const ProcessResult text = run_process(preprocess);
  if (text.status != 0) throw UserError(first_error(text.errors, sources));

  std::string content = runtime.filename().string() + '\n' + compiler.path + '\n' + compiler.version;
  for (const std::string& flag : code) content += flag + '\n';
  for (const std::string& flag : kLinkFlags) content += flag + '\n';
  const std::string runtime_content = content;
  for (const std::string& flag : defines) content += flag + '\n';
  const fs::path kept = cache / "programs" / (sha256_hex(content + text.output) + ".so");
  if (const auto octets = read_file(kept)) {
    try {
      return checked(kept, *octets);
    } catch (const UserError&) {
      // Damaged on disk: made again below.
    }
  }
  Arguments arguments{compiler.path};
  for (const Arguments& part : {code, defines, kLinkFlags, place_flags(sources), includes, files})
    append(arguments, part);
  arguments.push_back(runtime_object(compiler, code, includes, runtime, runtime_content).string());
  return checked(kept, build(arguments, kept, sources));
}

}  // namespace kilotwin::behaviours
