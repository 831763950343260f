#include "services/behaviours/compiler.hpp"

#include <gtest/gtest.h>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "idl/manifest.pb.h"
#include "services/behaviours/sha256.hpp"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

namespace fs = std::filesystem;

std::string error_of(const std::vector<fs::path>& sources, const CompileOptions& options = cached()) {
  try {
    (void)compile(sources, options);
  } catch (const UserError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Sha256, KnownDigests) {
  EXPECT_EQ(sha256_hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Compiler, AllBehavioursCompileForSimulationAndRobot) {
  int count = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(KILOTWIN_BEHAVIOURS)) {
    if (entry.path().extension() != ".c") continue;
    EXPECT_EQ(error_of({entry.path()}), "no error");
    const AvrSize size = compile_for_avr({entry.path()}, cached());
    EXPECT_GT(size.flash_octets, 30u) << entry.path();
    EXPECT_LT(size.flash_octets, 8000u) << entry.path();
    EXPECT_LT(size.ram_octets, 500u) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 5);
}

TEST(Compiler, ErrorsNameTheUsersLine) {
  const Folder folder;
  const std::string syntax =
      folder.write("a.c", "#include <kilolib.h>\n\nint main(void) {\n  undeclared = 1;\n}\n");
  EXPECT_TRUE(error_of({syntax}).starts_with(syntax + ":4:3: error: ")) << error_of({syntax});
  const std::string header =
      folder.write("b.c", "#include <kilolib.h>\n#include <sys/mman.h>\nint main(void) { return 0; }\n");
  EXPECT_TRUE(error_of({header}).starts_with(header + ":2:10: error: sys/mman.h")) << error_of({header});
  const std::string link =
      folder.write("c.c", "#include <kilolib.h>\nvoid helper(void);\nint main(void) {\n  helper();\n}\n");
  EXPECT_TRUE(error_of({link}).starts_with(link + ":4:1: error: undefined reference to `helper'"))
      << error_of({link});
  const std::string no_main = folder.write("d.c", "int x;\n");
  EXPECT_TRUE(error_of({no_main}).starts_with(no_main + ":1:1: error: there is no main()")) << error_of({no_main});
  const std::string several =
      folder.write("f.c", "#include <kilolib.h>\nint main(void) {\n  one = 1;\n  two = 2;\n  three();\n}\n");
  EXPECT_EQ(error_of({several}), several + ":3:3: error: 'one' undeclared (first use in this function)\n" +
                                     several + ":4:3: error: 'two' undeclared (first use in this function)");
  const std::string twice = folder.write("g.c", "int main(void) { return 0; }\n");
  EXPECT_EQ(error_of({twice, link}).find('\n'), std::string::npos) << error_of({twice, link});
  const std::string avr = folder.write("e.c", "#include <kilolib.h>\nint main(void) { return oops; }\n");
  try {
    (void)compile_for_avr({avr}, cached());
    FAIL();
  } catch (const UserError& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with(avr + ":2:25: error: ")) << error.what();
  }
}

TEST(Compiler, MacrosThatAMakefileMayDefineAreNamed) {
  const Folder folder;
  const std::string source = folder.write("p.c",
                                          "#include <kilolib.h>\nstatic void setup(void) {}\n"
                                          "static void loop(void) { set_motors(SPEED, WIDTH); missing = 1; }\n"
                                          "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n");
  EXPECT_TRUE(error_of({source}).ends_with("add --define SPEED=VALUE WIDTH=VALUE")) << error_of({source});
  const std::string cpp = folder.write("p.cpp", os::read_file(source));
  EXPECT_TRUE(error_of({cpp}).ends_with("add --define SPEED=VALUE WIDTH=VALUE")) << error_of({cpp});
}

TEST(Compiler, CodeOnTheStackIsRefusedAsForTheRobot) {
  const Folder folder;
  const auto nested = [&](const std::string& captured) {
    const std::string file = folder.write("nested.c",
                                          "#include <kilolib.h>\n"
                                          "static int twice(int (*f)(int), int x) { return f(f(x)); }\n"
                                          "static void loop(void) {\n"
                                          "  int base = kilo_ticks;\n"
                                          "  int add(int x) { return x + " +
                                              captured +
                                              "; }\n"
                                              "  int (*volatile by_address)(int) = add;\n"
                                              "  set_color(twice(by_address, base));\n"
                                              "}\n"
                                              "int main(void) { kilo_init(); kilo_start(loop, loop); }\n");
    return error_of({file});
  };
  const std::string error = nested("base");
  EXPECT_NE(
      error.find("nested.c:5:7: error: trampoline generated for nested function 'add'; a robot cannot run code"),
      std::string::npos)
      << error;
  EXPECT_EQ(nested("1"), "no error");
}

TEST(Compiler, BadArgumentsGiveOneLine) {
  const Folder folder;
  const fs::path good = folder.write("good.c", "#include <kilolib.h>\nint main(void) { return 0; }\n");
  EXPECT_NE(error_of({}).find("no program given"), std::string::npos);
  EXPECT_NE(error_of({folder.path() / "missing.c"}).find("no such file"), std::string::npos);
  EXPECT_NE(error_of({folder.write("x.txt", "")}).find("not a C or C++ source"), std::string::npos);
  CompileOptions options = cached();
  options.defines = {"1X=2"};
  EXPECT_NE(error_of({good}, options).find("--define 1X=2"), std::string::npos);
  options = cached();
  options.compiler = "/nonexistent/cc";
  EXPECT_NE(error_of({good}, options).find("apt-get install gcc"), std::string::npos);
}

TEST(Compiler, KeepsResultsByContent) {
  const Folder folder;
  CompileOptions options{{}, {}, folder.path() / "cache"};
  folder.write("part.h", "#define COLOUR 1\n");
  const fs::path source = folder.write("a.c",
                                       "#include <kilolib.h>\n#include \"part.h\"\n#ifndef K\n#define K 0\n#endif\n"
                                       "int main(void) { set_color(COLOUR + K); kilo_start(0, 0); }\n");
  const CompiledProgram first = compile({source}, options);
  EXPECT_EQ(first.sha256, sha256_hex(os::read_if_there(first.file).value()));
  const auto written = fs::last_write_time(first.file);
  const CompiledProgram again = compile({source}, options);
  EXPECT_EQ(again.file, first.file);
  EXPECT_EQ(fs::last_write_time(again.file), written);

  options.defines = {"K=1"};
  EXPECT_NE(compile({source}, options).sha256, first.sha256);
  options.defines = {};
  folder.write("part.h", "#define COLOUR 2\n");
  EXPECT_NE(compile({source}, options).sha256, first.sha256);
  folder.write("part.h", "#define COLOUR 1\n");
  folder.write(fs::relative(first.file, folder.path()), "damaged");
  EXPECT_EQ(compile({source}, options).sha256, first.sha256);  // compiled again, with equal octets
  EXPECT_EQ(compile({source}, {{}, {}, folder.path() / "elsewhere"}).sha256, first.sha256);
}

TEST(Compiler, SeveralSourcesAndReadySharedObjects) {
  const Folder folder;
  const fs::path a = folder.write("a.c",
                                  "#include <kilolib.h>\nuint8_t shared;\nvoid helper(void);\n"
                                  "int main(void) { kilo_init(); helper(); kilo_start(helper, helper); }\n");
  const fs::path b =
      folder.write("b.c", "#include \"kilolib.h\"\nuint8_t shared;\nvoid helper(void) { set_color(++shared); }\n");
  const CompiledProgram built = compile({a, b}, cached());
  const fs::path copy = folder.write("ready.so", os::read_if_there(built.file).value());
  const CompiledProgram ready = compile({copy}, cached());
  EXPECT_EQ(ready.file, copy);
  EXPECT_EQ(ready.sha256, built.sha256);
  EXPECT_NE(error_of({folder.write("other.so",
                                   "\x7f"
                                   "ELF")})
                .find("not a program for simulated robots"),
            std::string::npos);
}

TEST(Compiler, AKilledCompilerIsAFailureAndNotRetriedInAnotherLanguage) {
  const Folder folder;
  CompileOptions options = cached();
  options.compiler =
      folder.write("killed-cc",
                   "#!/bin/sh\n"
                   "case \"$*\" in *cpp-output*)\n"
                   "  deed=$(cat \"$0.deed\" 2>/dev/null); rm -f \"$0.deed\"\n"
                   "  case \"$deed\" in\n"
                   "    itself) kill -9 $$;;\n"
                   "    child) echo 'cc: fatal error: Killed signal terminated program cc1' >&2; exit 1;;\n"
                   "  esac;;\n"
                   "esac\nexec cc \"$@\"\n");
  fs::permissions(options.compiler, fs::perms::owner_all);
  const fs::path source = folder.write("a.c", program("static void loop(void) { set_color(1); }"));
  const auto failure = [&](const char* deed) -> std::string {
    folder.write("killed-cc.deed", deed);
    try {
      (void)compile({source}, options);
    } catch (const RunError& error) {
      return error.what();
    }
    return "none";
  };
  const std::string itself = failure("itself"), child = failure("child");
  EXPECT_TRUE(itself.starts_with(options.compiler.string() + " was ended by signal 9 (Killed)")) << itself;
  EXPECT_NE(child.find("cc: fatal error: Killed signal terminated program cc1"), std::string::npos) << child;
  const CompiledProgram built = compile({source}, options);
  EXPECT_TRUE(built.notes.empty()) << built.notes.front();
}

TEST(Compiler, ClangGivesTheSameBehaviour) {
  // If the machine has clang, compare the frames of every tick.
  const fs::path clang = "/usr/bin/clang";
  if (!fs::exists(clang)) return;
  const fs::path source = std::string(KILOTWIN_BEHAVIOURS) + "/disperse.c";
  CompileOptions options = cached();
  options.compiler = clang;
  const CompiledProgram by_clang = compile({source}, options);
  auto frames = [&](bool clang_made) {
    Swarm swarm({source.string()}, 30);
    if (clang_made) {
      proto::Manifest manifest = swarm.plan->manifest();
      manifest.mutable_program(0)->set_sha256(by_clang.sha256);
      swarm.folder.write("programs/" + by_clang.sha256 + ".so", os::read_if_there(by_clang.file).value());
      swarm.hosts.clear();
      swarm.programs.reset();
      swarm.plan = std::make_unique<RunPlan>(manifest);
      swarm.programs = ProgramSet::load(*swarm.plan, swarm.folder.path());
      swarm.hosts.push_back(std::make_unique<BehavioursEngine>(*swarm.plan, HostId{0}, swarm.programs));
    }
    std::vector<ActuationFrame> result;
    swarm.start();
    for (int k = 0; k < 200; ++k) {
      swarm.step(echo(swarm.frame()));
      result.push_back(swarm.frame());
    }
    return result;
  };
  const auto a = frames(false), b = frames(true);
  for (std::size_t k = 0; k < a.size(); ++k) ASSERT_TRUE(equal(a[k], b[k])) << k;
}

}  // namespace
}  // namespace kilotwin::behaviours::test
