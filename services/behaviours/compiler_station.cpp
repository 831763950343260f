// Plugins of the station: C++ with its standard library, compiled for this machine. They run in a process of their own.
#include <unistd.h>

#include <system_error>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"
#include "services/behaviours/compiler.hpp"
#include "services/behaviours/compiler_common.hpp"
#include "services/behaviours/program_text.hpp"
#include "services/behaviours/sha256.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;
namespace {

using Arguments = std::vector<std::string>;

const std::string kPluginFolder = "services/ark/plugin";

void append(Arguments& to, const Arguments& more) { to.insert(to.end(), more.begin(), more.end()); }

struct CppCompiler {
  std::string path, version;
};

CppCompiler find_cpp_compiler(const fs::path& wanted) {
  CppCompiler compiler{wanted.string(), ""};
  for (const char* name : {"c++", "g++", "clang++"}) {
    if (compiler.path.empty()) compiler.path = os::find_executable(name).string();
  }
  if (!compiler.path.empty() && access(compiler.path.c_str(), X_OK) == 0) {
    const os::ProcessResult result = run_compiler({compiler.path, "--version"});
    compiler.version = result.output;
    if (result.end.well()) return compiler;
  }
  throw UserError("no C++ compiler" + (wanted.empty() ? "" : " at " + wanted.string()) +
                  "; the station's plugins are compiled when a run starts: apt-get install g++");
}

/// As robots' programs are compiled, where that applies: no contraction, wrapping integers, locals that start as zero, one CPU.
Arguments flags_for(const fs::path& runtime) {
  return {"-O2",
          "-g0",
          "-w",
          "-fdiagnostics-color=never",
          "-march=x86-64",
          "-fPIC",
          "-ffp-contract=off",
          "-fno-math-errno",
          "-fno-strict-aliasing",
          "-fwrapv",
          "-ftrivial-auto-var-init=zero",
          "-frandom-seed=kilotwin",
          "-I" + (runtime / kPluginFolder).string(),
          "-I" + runtime.string(),
          "-ffile-prefix-map=" + runtime.string() + "=/kilotwin"};
}

struct Toolchain {
  CppCompiler compiler;
  fs::path cache, runtime;
  Arguments flags;

  explicit Toolchain(const CompileOptions& options)
      : compiler(find_cpp_compiler(options.compiler)),
        cache(os::cache_directory(options.cache_directory)),
        runtime(unpacked_runtime(cache)),
        flags(flags_for(runtime)) {
    append(flags, define_flags(options.defines));
  }

  /// Runs a compilation that ends in `-o FILE`; keeps the file as `kept`.
  void build(Arguments arguments, const fs::path& kept, const std::vector<fs::path>& sources) const {
    std::string name = kept.string() + ".XXXXXX";
    const int descriptor = mkstemp(name.data());
    if (descriptor < 0) throw RunError(name + ": cannot be written; is the disk full?");
    close(descriptor);
    arguments.insert(arguments.begin(), compiler.path);
    append(arguments, {"-o", name});
    const os::ProcessResult result = run_compiler(arguments);
    std::error_code error;
    if (!result.end.well()) {
      fs::remove(name, error);
      throw UserError(all_errors(result.errors, sources));
    }
    fs::permissions(name, fs::perms::owner_all | fs::perms::group_read | fs::perms::group_exec |
                              fs::perms::others_read | fs::perms::others_exec);
    fs::rename(name, kept);
  }

  /// A name in the cache for what is made of this text with these words.
  [[nodiscard]] fs::path kept(const std::string& text, const Arguments& words, const char* ending) const {
    std::string all = compiler.version + '\0' + runtime.string() + '\0' + text;
    for (const std::string& word : words) all.append(1, '\0').append(word);
    return cache / ("station-" + sha256_hex(all).substr(0, 32) + ending);
  }

  /// An object of one file of the runtime.
  [[nodiscard]] fs::path object(const std::string& name, const Arguments& more) const {
    Arguments arguments = flags;
    append(arguments, more);
    const fs::path to = kept(name, arguments, ".o");
    std::error_code error;
    if (fs::is_regular_file(to, error)) return to;
    append(arguments, {"-c", (runtime / name).string()});
    build(arguments, to, {runtime / name});
    return to;
  }
};

CompiledProgram finished(const fs::path& file) { return {file, sha256_hex(os::read_file(file)), {}}; }

}  // namespace

bool is_station_plugin(const std::vector<fs::path>& sources) {
  for (const fs::path& source : sources) {
    if (!is_cpp(source)) continue;
    if (os::read_if_there(source).value_or("").find("createExpt") != std::string::npos) return true;
  }
  return false;
}

CompiledProgram compile_station_plugin(const std::vector<fs::path>& sources, const CompileOptions& options) {
  if (sources.size() == 1 && sources[0].extension() == ".so") {
    if (!os::read_if_there(sources[0]))
      throw UserError(sources[0].string() + ": cannot be read; name a C++ source or a .so of `kilotwin build`");
    return finished(sources[0]);
  }
  check_sources(sources);
  const Toolchain toolchain(options);
  Arguments arguments = toolchain.flags;
  arguments.emplace_back("-std=c++20");
  std::string text;
  for (const fs::path& source : sources) {
    if (source.has_parent_path()) arguments.push_back("-ffile-prefix-map=" + source.parent_path().string() + "=.");
    Arguments preprocess{toolchain.compiler.path};
    append(preprocess, arguments);
    append(preprocess, {"-E", "-P", source.string()});
    const os::ProcessResult result = run_compiler(preprocess);
    if (!result.end.well()) throw UserError(all_errors(result.errors, sources));
    text.append(result.output).append(1, '\0');
  }
  const fs::path kept = toolchain.kept(text, arguments, ".so");
  std::error_code error;
  if (fs::is_regular_file(kept, error)) return finished(kept);
  const Arguments hidden_c{"-x", "c", "-std=gnu11", "-fno-builtin", "-fvisibility=hidden"};
  // Its own copies of what the interface defines inline, not those of the program that loads it.
  append(arguments, {"-shared", "-Wl,--build-id=none", "-Wl,--no-undefined", "-Wl,-z,now", "-Wl,-Bsymbolic", "-s"});
  for (const fs::path& source : sources) arguments.push_back(source.string());
  for (const fs::path& object :
       {toolchain.object("core/math/elementary.c", hidden_c),
        toolchain.object(kPluginFolder + "/mathematics.c", hidden_c),
        toolchain.object(kPluginFolder + "/support.cpp", {"-std=c++20", "-fvisibility=hidden"})})
    arguments.push_back(object.string());
  toolchain.build(arguments, kept, sources);
  return finished(kept);
}

CompiledProgram compile_plugin_host(const CompileOptions& options) {
  CompileOptions plain = options;
  plain.defines.clear();
  const Toolchain toolchain(plain);
  Arguments arguments = toolchain.flags;
  append(arguments, {"-std=c++20", "-rdynamic", "-Wl,--build-id=none"});
  const fs::path kept = toolchain.kept("host", arguments, "");
  std::error_code error;
  if (fs::is_regular_file(kept, error)) return finished(kept);
  std::vector<fs::path> sources;
  for (const std::string& name :
       {kPluginFolder + "/host.cpp", kPluginFolder + "/runner.cpp", std::string("core/random/random.cpp")})
    sources.push_back(toolchain.runtime / name);
  for (const fs::path& source : sources) arguments.push_back(source.string());
  arguments.push_back(
      toolchain.object("core/math/elementary.c", {"-x", "c", "-std=gnu11", "-fno-builtin"}).string());
  arguments.emplace_back("-ldl");
  toolchain.build(arguments, kept, sources);
  return finished(kept);
}

}  // namespace kilotwin::behaviours
