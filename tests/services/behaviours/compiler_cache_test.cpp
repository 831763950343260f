// The content of the compilers' cache, and what makes them look again: sources around a program, folders, firmware.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"
#include "services/behaviours/robot_warnings.hpp"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

namespace fs = std::filesystem;

/// A program that shows the colour that a further source holds.
const std::string kIncomplete =
    "#include <kilolib.h>\nint colour(void);\nvoid setup() {} void loop() { set_color(colour()); }\n" + kMain;

std::string colour_source(int colour) { return "int colour(void) { return " + std::to_string(colour) + "; }\n"; }

bool has_avr_gcc() { return !os::find_executable("avr-gcc").empty(); }

/// A compiler that writes a line for each of its calls.
class CountedCompiler {
 public:
  CountedCompiler(const Folder& folder, const std::string& name) : log_(folder.path() / (name + ".log")) {
    const fs::path real = os::find_executable(name);
    path_ = folder.write("counted/" + name,
                         "#!/bin/sh\necho \"$*\" >>" + log_.string() + "\nexec " + real.string() + " \"$@\"\n");
    fs::permissions(path_, fs::perms::owner_all);
  }
  [[nodiscard]] const fs::path& path() const { return path_; }
  /// Calls since the last one of this function that compile or link, and not only preprocess or tell something.
  int compilations() {
    const std::string text = os::read_if_there(log_).value_or("");
    int count = 0;
    for (std::size_t at = read_, end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
      count += text.substr(at, end - at).find(" -o ") != std::string::npos ? 1 : 0;
    read_ = text.size();
    return count;
  }

 private:
  fs::path log_, path_;
  std::size_t read_ = 0;
};

TEST(CompilerCache, AnUnchangedProgramIsNotCompiledAgain) {
  const Folder folder;
  CountedCompiler compiler(folder, "gcc");
  CompileOptions options;
  options.cache_directory = folder.path() / "cache";
  options.compiler = compiler.path();
  folder.write("colour.c", colour_source(3));
  const fs::path source = folder.write("a.c", kIncomplete);
  const std::string first = compile({source}, options).sha256;
  EXPECT_GT(compiler.compilations(), 0);
  EXPECT_EQ(compile({source}, options).sha256, first);
  EXPECT_EQ(compiler.compilations(), 0);
  folder.write("a.c", kIncomplete + "int more = 1;\n");
  EXPECT_NE(compile({source}, options).sha256, first);
  EXPECT_GT(compiler.compilations(), 0);
}

TEST(CompilerCache, UnchangedFirmwareIsNotCompiledAgain) {
  if (!has_avr_gcc()) GTEST_SKIP() << "no avr-gcc";
  const Folder folder;
  CountedCompiler compiler(folder, "avr-gcc");
  fs::create_symlink(os::find_executable("avr-objcopy"), compiler.path().parent_path() / "avr-objcopy");
  const std::string path = std::getenv("PATH");
  setenv("PATH", (compiler.path().parent_path().string() + ':' + path).c_str(), 1);
  CompileOptions options;
  options.cache_directory = folder.path() / "cache";
  options.boot_loader = true;
  folder.write("colour.c", colour_source(3));
  const fs::path source = folder.write("a.c", kIncomplete);
  const std::string first = compile_firmware({source}, options).sha256;
  EXPECT_GT(compiler.compilations(), 0);
  EXPECT_EQ(compile_firmware({source}, options).sha256, first);
  EXPECT_EQ(compiler.compilations(), 0);
  folder.write("colour.c", colour_source(4));
  EXPECT_NE(compile_firmware({source}, options).sha256, first);
  EXPECT_GT(compiler.compilations(), 0);
  options.boot_loader = false;
  EXPECT_NE(compile_firmware({source}, options).sha256, first);
  setenv("PATH", path.c_str(), 1);
}

TEST(CompilerCache, ANearerSourceTakesThePlaceOfOneThatWasFound) {
  const Folder folder;
  folder.write("project/lib/colour.c", colour_source(3));
  const fs::path source = folder.write("project/src/a.c", kIncomplete);
  EXPECT_TRUE(mentions(compile({source}, cached()).notes, "lib/colour.c: compiled too"));
  EXPECT_TRUE(mentions(compile({source}, cached()).notes, "lib/colour.c: compiled too"));
  folder.write("project/src/colour.c", colour_source(4));
  const CompiledProgram program = compile({source}, cached());
  EXPECT_TRUE(mentions(program.notes, "src/colour.c: compiled too"));
  EXPECT_FALSE(mentions(program.notes, "lib/colour.c"));
}

TEST(CompilerCache, AProgramThatNoLongerNeedsASourceLosesIt) {
  const Folder folder, fresh;
  folder.write("colour.c", colour_source(3));
  const fs::path source = folder.write("a.c", kIncomplete);
  EXPECT_TRUE(mentions(compile({source}, cached()).notes, "colour.c: compiled too"));
  folder.write("a.c", "#include <kilolib.h>\nvoid setup() {} void loop() { set_color(5); }\n" + kMain);
  const CompiledProgram program = compile({source}, cached());
  EXPECT_FALSE(mentions(program.notes, "colour.c"));
  CompileOptions elsewhere;
  elsewhere.cache_directory = fresh.path();
  const fs::path here = fs::current_path();
  fs::current_path(fresh.path());
  EXPECT_EQ(program.sha256, compile({source}, elsewhere).sha256) << "whoever compiled it, and where";
  fs::current_path(here);
}

TEST(CompilerCache, WarningsNameTheFolderThatIsCompiled) {
  const std::string text =
      "#include <kilolib.h>\nvoid setup() {} void loop() { int x = 1; if (x = 2) set_color(x); }\n" + kMain;
  const Folder one, other;
  const fs::path first = one.write("a.c", text), second = other.write("a.c", text);
  const auto warnings = [](const fs::path& source) {
    const CompiledProgram program = compile({source}, cached());
    return program_warnings(program.sources, program.sha256, cached());
  };
  EXPECT_TRUE(mentions(warnings(first), first.string() + ":2:"));
  EXPECT_TRUE(mentions(warnings(second), second.string() + ":2:"));
  EXPECT_FALSE(mentions(warnings(second), first.string()));
}

TEST(CompilerCache, SourcesThatWereFoundGiveWarningsToo) {
  const Folder folder;
  folder.write("colour.c", "int colour(void) {\n  int x = 1;\n  if (x = 2) return 1;\n  return 3;\n}\n");
  const fs::path source = folder.write("a.c", kIncomplete);
  const CompiledProgram program = compile({source}, cached());
  EXPECT_TRUE(mentions(program_warnings(program.sources, program.sha256, cached()), "colour.c:3:"));
}

TEST(CompilerCache, TheRobotsCompilerFindsTheSameSources) {
  if (!has_avr_gcc()) GTEST_SKIP() << "no avr-gcc";
  const Folder folder;
  folder.write("colour.c", "char room[100];\nint colour(void) { return room[3]; }\n");
  const fs::path source = folder.write("a.c", kIncomplete);
  const CompiledProgram firmware = compile_firmware({source}, cached());
  EXPECT_TRUE(mentions(firmware.notes, "colour.c: compiled too"));
  EXPECT_GE(compile_for_avr(firmware.sources, cached()).ram_octets, 100u);
}

TEST(CompilerCache, ErrorsComeWithTheNotesAboutTheSources) {
  const Folder folder;
  folder.write("lib/light.h", "#define COLOUR 3\n");
  const fs::path source =
      folder.write("src/a.c",
                   "#include <kilolib.h>\n#include \"light.h\"\nint colour(void);\nvoid setup() {} void loop() { "
                   "set_color(colour()); }\n" +
                       kMain);
  try {
    (void)compile({source}, cached());
    ADD_FAILURE() << "no error";
  } catch (const UserError& error) {
    EXPECT_TRUE(mentions({error.what()}, "undefined reference to `colour'")) << error.what();
    EXPECT_TRUE(mentions({error.what()}, "\nnote: ")) << error.what();
    EXPECT_TRUE(mentions({error.what()}, "light.h: found for #include")) << error.what();
  }
}

TEST(CompilerCache, TheNearestOfSeveralHeadersIsTakenAndNamed) {
  const Folder folder;
  folder.write("project/README.md", "A project.\n");
  folder.write("project/a/deep/light.h", "#define COLOUR 1\n");
  folder.write("project/lib/light.h", "#define COLOUR 3\n");
  const fs::path source = folder.write(
      "project/src/a.c",
      "#include <kilolib.h>\n#include \"light.h\"\nvoid setup() {} void loop() { set_color(COLOUR); }\n" + kMain);
  const CompiledProgram program = compile({source}, cached());
  EXPECT_TRUE(mentions(program.notes, "project/lib/light.h: found for #include \"light.h\"; the nearest of 2"));
  EXPECT_TRUE(mentions(program.notes, "another is " + (folder.path() / "project/a/deep/light.h").string()));
}

}  // namespace
}  // namespace kilotwin::behaviours::test
