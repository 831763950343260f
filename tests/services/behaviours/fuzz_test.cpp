// Faulty programs end only their own robots: random C with loops, wild pointers, recursion, division by zero, overwritten
// stacks, stale longjmp. Compiling takes longer than running, so one source holds eight programs, and each robot runs one of
// them. KILOTWIN_FUZZ_PROGRAMS sets the number of programs, KILOTWIN_FUZZ_SEED the first seed, KILOTWIN_FUZZ_ROBOTS the robots
// per program.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "idl/checkpoint.pb.h"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

/// Generates a program from a seed. The names of its functions begin with `name`.
class Generator {
 public:
  Generator(std::uint32_t seed, std::string name) : random_(seed), name_(std::move(name)) {}

  std::string functions() {
    std::string text = "static int32_t";
    for (std::uint32_t f = 0; f < 4; ++f) text += (f == 0 ? " " : ", ") + function(f) + "(int32_t)";
    text += ";\n";
    for (functions_ = 0; functions_ < 4;) {
      const std::string head = "static int32_t " + function(functions_) + "(int32_t x)";
      ++functions_;  // it may call itself
      text += head + " { int32_t i = x, b[4] = {x}; (void)b; " + statements(3) + " return i + b[x & 3]; }\n";
    }
    text += "static void " + name_ +
            "rx(message_t* h) { int32_t x = h->data[0], i = x, b[4] = {0}; received = 1; " +
            (chance(3) ? statements(2) : "") + " (void)i, (void)b; }\n";
    text += "static message_t* " + name_ + "tx(void) { int32_t x = 1, i = v, b[4] = {0}; " +
            (chance(6) ? statements(2) : "") + " (void)x, (void)i, (void)b; m.data[0] = v; return &m; }\n";
    text += "static void " + name_ + "setup(void) { pointer = " + function(0) + "; }\n";
    text += "static void " + name_ +
            "loop(void) { int32_t x = kilo_ticks, i = x, b[4] = {0}; (void)b; set_color(i); set_motors(v, x); " +
            statements(3) + " v += i; }\n";
    return text;
  }

 private:
  std::uint32_t draw(std::uint32_t below) { return static_cast<std::uint32_t>(random_() % below); }
  bool chance(std::uint32_t one_in) { return draw(one_in) == 0; }
  [[nodiscard]] std::string function(std::uint32_t number) const { return name_ + "f" + std::to_string(number); }

  std::string number() {
    static const char* const kNumbers[] = {"0",   "1",   "-1",   "2",     "7",          "31",
                                           "255", "-40", "1000", "65536", "0x7fffffff", "(-0x7fffffff - 1)"};
    return kNumbers[draw(12)];
  }

  std::string value(int depth = 2) {
    if (depth == 0 || chance(3)) {
      static const char* const kValues[] = {
          "x",           "i",        "v",          "g[1]",    "b[1]", "(int32_t)kilo_ticks",
          "rand_soft()", "kilo_uid", "(int32_t)r", "received"};
      return chance(3) ? number() : kValues[draw(10)];
    }
    const std::string a = value(depth - 1), b = value(depth - 1);
    static const char* const kOperators[] = {"+", "-", "*",  "/", "%",      "&",     "|",
                                             "^", "<", "==", ">", "<< 3 |", ">> 1 ^"};
    if (chance(12)) return function(draw(functions_ < 4 ? functions_ : 4)) + "(" + a + ")";
    return "(" + a + " " + kOperators[draw(13)] + " " + b + ")";
  }

  std::string place() {
    static const char* const kPlaces[] = {"i", "i", "v", "g[2]", "b[2]"};
    if (chance(8)) return "g[" + value() + "]";
    if (chance(10)) return "b[" + value() + "]";
    return kPlaces[draw(5)];
  }

  std::string statements(int depth) {
    std::string result;
    for (std::uint32_t n = 1 + draw(4); n > 0; --n) result += statement(depth) + " ";
    return result;
  }

  std::string statement(int depth) {
    if (depth > 0) {
      switch (draw(9)) {
        case 0: return "if (" + value() + ") { " + statements(depth - 1) + "}";
        case 1: return "for (int k = 0; k < " + number() + "; ++k) { " + statements(depth - 1) + "}";
        case 2: return "while (" + value() + ") { " + statements(depth - 1) + "}";
        case 3: return "do { " + statements(depth - 1) + "} while (" + value() + ");";
        case 4:
          return "for (;;) { " + statements(depth - 1) + (chance(4) ? "" : "if (" + value() + ") break; ") + "}";
        default: break;
      }
    }
    if (chance(5)) return horror();
    switch (draw(8)) {
      case 0: return "set_motors(" + value() + ", " + value() + ");";
      case 1: return "set_color(" + value() + ");";
      case 2: return "r = r * 1.5f - " + value() + ";";
      case 3: return "delay(" + value() + " & 127);";
      case 4: return "if (" + value() + " == 3) return" + std::string(" RETURN;");
      default: return place() + " = " + value() + ";";
    }
  }

  std::string horror() {
    switch (draw(14)) {
      case 0: return "*(volatile int32_t*)(uintptr_t)(" + value() + " * 4096L) = " + value() + ";";
      case 1: return "memset(b, " + value() + ", " + value() + " & 511);";
      case 2: return "((void (*)(void))(uintptr_t)(" + value() + "))();";
      case 3: return "if (pointer) i = pointer(" + value() + ");";
      case 4: return "pointer = (int32_t (*)(int32_t))((uintptr_t)" + function(1) + " + (" + value() + " & 63));";
      case 5: return "if (!setjmp(place)) i = 1;";
      case 6: return "longjmp(place, " + value() + ");";
      case 7: return "i = " + function(draw(4)) + "(x + 1);";
      case 8: return "i = " + value() + " / " + value() + " + " + value() + " % " + value() + ";";
      case 9: return "memcpy(text, (void*)((uintptr_t)text + " + value() + "), " + value() + " & 1023);";
      case 10:
        return "free(block); block = malloc(" + value() + "); if (block) *(int32_t*)block = " + value() + ";";
      case 11: return "while (!received); received = 0;";
      case 12: return "kilo_message_rx = (message_rx_t)(uintptr_t)(" + value() + ");";
      default: return "((volatile char*)&b)[" + value() + "] = " + value() + ";";
    }
  }

  std::mt19937 random_;  // the C++ standard defines its sequence
  std::string name_;
  std::uint32_t functions_ = 0;
};

constexpr std::uint32_t kTogether = 8;

/// The programs of these seeds, `robots` robots of each.
std::string source(std::uint32_t first_seed, std::uint32_t robots) {
  std::string functions, rx, tx, setup, loop;
  for (std::uint32_t p = 0; p < kTogether; ++p) {
    const std::string name = "p" + std::to_string(p);
    functions += Generator(first_seed + p, name).functions();
    const std::string of_robot = " case " + std::to_string(p) + ": ";
    rx += of_robot + name + "rx(h); break;";
    tx += of_robot + "return " + name + "tx();";
    setup += of_robot + name + "setup(); break;";
    loop += of_robot + name + "loop(); break;";
  }
  const std::string choose = "switch (kilo_uid / " + std::to_string(robots) + ") {";
  return program(
      "#include <setjmp.h>\n#include <stdio.h>\n"
      "int32_t g[8] = {1, 2, 3}; volatile int32_t v; float r = 1; uint8_t received; char text[16]; jmp_buf place;\n"
      "int32_t (*pointer)(int32_t); void* block; static message_t m;\n" +
      functions + "static void rx(message_t* h, distance_measurement_t* d) { " + choose + rx + " } }\n" +
      "static message_t* tx(void) { " + choose + tx + " } return &m; }\n" +
      "static void setup(void) { rand_seed(kilo_uid); v = kilo_uid; " + choose + setup + " } }\n" +
      "static void loop(void) { " + choose + loop + " } }\n");
}

std::uint32_t wanted(const char* name, std::uint32_t otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : static_cast<std::uint32_t>(std::atoi(text));
}

std::string repaired(std::string text) {
  // `return` has a value in some of the functions above; GNU C takes either in all of them, warnings aside.
  for (std::size_t at = text.find(" RETURN"); at != std::string::npos; at = text.find(" RETURN")) text.erase(at, 7);
  return text;
}

TEST(Fuzz, FaultyProgramsEndOnlyTheirOwnRobots) {
  const std::string decent = program(
      "static uint8_t n; static message_t m; static message_t* tx(void) { m.data[0] = n; return &m; }\n"
      "static void loop(void) { set_motors(++n, kilo_ticks); }");
  const std::uint32_t programs = wanted("KILOTWIN_FUZZ_PROGRAMS", kTogether),
                      seed = wanted("KILOTWIN_FUZZ_SEED", 1);
  const std::uint32_t of_each = wanted("KILOTWIN_FUZZ_ROBOTS", 3), robots = kTogether * of_each;
  std::uint32_t run = 0, failed = 0;
  for (; run < programs; run += kTogether) {
    SCOPED_TRACE("seeds from " + std::to_string(seed + run));
    const std::string text = repaired(source(seed + run, of_each));
    Swarm one({text, decent}, robots), other({text, decent}, robots, 3);
    Swarm third({text, decent}, robots, 2);
    one.start();
    other.start();
    for (int k = 0; k < 80; ++k) {
      Air air = echo(one.frame());
      // Random messages of the overhead controller's types would reset the receivers, as on the robot. Clear that bit.
      for (Air::Reception& reception : air.receptions) reception.message[9] &= 0x7f;
      one.step(air);
      if (k < 40) {
        other.step(air);
        ASSERT_EQ(one.hash(), other.hash()) << "tick " << k << "\n" << text;
      } else {
        // Preempted programs continue on other hosts.
        if (k == 40) {
          std::vector<proto::BehavioursState> saved(3);
          std::vector<const proto::BehavioursState*> parts;
          for (std::size_t h = 0; h < 3; ++h) {
            other.hosts[h]->save(saved[h]);
            parts.push_back(&saved[h]);
          }
          for (const auto& host : third.hosts) host->load(other.tick, parts);
          third.tick = other.tick;
        }
        third.step(air);
        ASSERT_EQ(one.hash(), third.hash()) << "tick " << k << " after a restart\n" << text;
      }
      for (std::uint32_t robot = robots; robot < 2 * robots; ++robot) {
        ASSERT_EQ(one.frame().motor_left[robot], static_cast<std::uint8_t>(k + 2)) << text;
        ASSERT_EQ(one.life_cycle(robot), LifeCycle::kRunning);
      }
    }
    failed += one.hosts[0]->robots_failed();
  }
  EXPECT_GT(failed, run / 2) << "these programs are too good";
  if (run > 100) std::cerr << run << " programs, " << failed << " of " << run * of_each << " robots failed\n";
}

}  // namespace
}  // namespace kilotwin::behaviours::test
