#include "clients/behaviours/compiler.hpp"

#include <array>
#include <cstdio>
#include <system_error>
#include <unistd.h>

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
  Arguments flags{"-std=gnu11", "-O2", "-g", "-w", "-fdiagnostics-color=never", "-nostdinc", "-ffreestanding", "-fno-builtin",
                  "-DF_CPU=8000000", "-funsigned-char", "-fpack-struct", "-fshort-enums", "-fcommon",
                  "-march=x86-64", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno",
                  "-fno-strict-aliasing", "-fwrapv", "-fno-delete-null-pointer-checks", "-fcf-protection=none",
                  "-fno-stack-protector", "-fno-asynchronous-unwind-tables", "-ffunction-sections", "-fdata-sections",
                  "-ftrivial-auto-var-init=zero"};
  if (compiler.is_clang()) {
    append(flags, {"-Xclang", "-enable-trivial-auto-var-init-zero-knowing-it-will-be-removed-from-clang"});
  } else {
    append(flags, {"-fno-tree-loop-distribute-patterns", "-funsigned-bitfields"});
  }
  return flags;
}

const Arguments kLinkFlags{"-shared", "-nostdlib", "-Wl,-Bsymbolic", "-Wl,-z,relro", "-Wl,-z,now", "-Wl,-z,noexecstack",
                           "-Wl,-z,separate-code", "-Wl,--no-undefined", "-Wl,--gc-sections", "-Wl,--build-id=none",
                           "-Wl,-e,kilotwin_image"};

/// Headers: ours before the compiler's own, no others.
Arguments include_flags(const Compiler& compiler, const fs::path& runtime) {
  std::string own = run_process({compiler.path, "-print-file-name=include"}).output;
  while (!own.empty() && own.back() == '\n') own.pop_back();
  return {"-isystem", (runtime / "kilolib").string(), "-isystem", (runtime / "libc").string(), "-isystem", own,
          "-ffile-prefix-map=" + runtime.string() + "=/kilotwin"};
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

/// A private name next to `file` that ceases to exist with this object.
class Temporary {
 public:
  explicit Temporary(const fs::path& file) : path_(file.string() + ".XXXXXX") {
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

}  // namespace

CompiledProgram compile(const std::vector<fs::path>& sources, const CompileOptions& options) {
  if (sources.size() == 1 && sources[0].extension() == ".so") return given(sources[0]);
  check_sources(sources);
  const Arguments defines = define_flags(options.defines);
  const Compiler compiler = find_compiler(options.compiler);
  const fs::path cache = cache_directory(options.cache_directory);
  const fs::path runtime = unpacked_runtime(cache);
  const Arguments includes = include_flags(compiler, runtime);

  Arguments common = code_flags(compiler);
  append(common, defines);
  Arguments files;
  for (const fs::path& source : sources) files.push_back(source.string());

  Arguments preprocess{compiler.path, "-E"};
  append(preprocess, common);
  append(preprocess, includes);
  append(preprocess, files);
  const ProcessResult text = run_process(preprocess);
  if (text.status != 0) throw UserError(first_error_first(text.errors, sources[0]));

  std::string content = runtime.filename().string() + '\n' + compiler.path + '\n' + compiler.version;
  for (const std::string& flag : common) content += flag + '\n';
  for (const std::string& flag : kLinkFlags) content += flag + '\n';
  const fs::path kept = cache / "programs" / (sha256_hex(content + text.output) + ".so");
  if (const auto octets = read_file(kept)) {
    try {
      return checked(kept, *octets);
    } catch (const UserError&) {
      // Damaged on disk: made again below.
    }
  }

  std::error_code error;
  fs::create_directories(kept.parent_path(), error);
  const Temporary result(kept);
  Arguments build{compiler.path};
  append(build, common);
  append(build, kLinkFlags);
  append(build, includes);
  append(build, {"-idirafter", runtime.string()});
  append(build, files);
  for (const char* name : {"kilolib.c", "switch.c", "libc.c", "libm.c", "libprintf.c", "core/math/elementary.c"}) {
    build.push_back((runtime / name).string());
  }
  append(build, {"-o", result.path()});
  const ProcessResult built = run_process(build);
  if (built.status != 0) throw UserError(first_error_first(built.errors, sources[0]));
  const auto octets = read_file(result.path());
  if (!octets || !write_file(kept, *octets)) throw RunError(kept.string() + ": cannot be written; is the disk full?");
  return checked(kept, *octets);
}

}  // namespace kilotwin::behaviours
