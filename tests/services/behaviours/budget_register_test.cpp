// The register of the cycle budget: compilers' own use of it gets another register. Programs of many floats run. The register's
// second part counts writes.
#include "services/behaviours/budget_register.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/math/elementary.h"
#include "services/behaviours/assembly.hpp"
#include "services/behaviours/cycle_counters.hpp"
#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

std::string function(const std::string& name, const std::string& body) {
  return "\t.type\t" + name + ", @function\n" + name + ":\n" + body + "\tret\n";
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(BudgetRegister, AFunctionThatUsesItGetsOneThatItDoesNotUse) {
  const std::string text =
      with_free_budget_register(function("f", "\tmovapd\t%xmm8, %xmm15\n.L2:\n\taddsd\t%xmm9, %xmm15\n") +
                                function("g", "\tpxor\t%xmm15, %xmm15\n"));
  EXPECT_TRUE(has(text, "\tmovapd\t%xmm8, %xmm10\n.L2:\n\taddsd\t%xmm9, %xmm10\n")) << text;
  EXPECT_TRUE(has(text, "\tpxor\t%xmm8, %xmm8\n"))
      << "another function has its own choice; 0 to 7 may hold arguments: " << text;
}

TEST(BudgetRegister, UnlikelyCodeOfAFunctionSharesItsRegisters) {
  const std::string text = with_free_budget_register(function("f", "\tmovapd\t%xmm0, %xmm15\n\tjmp\tf.cold\n") +
                                                     function("f.cold", "\taddsd\t%xmm8, %xmm15\n"));
  EXPECT_TRUE(has(text, "\tmovapd\t%xmm0, %xmm9\n")) << text;
  EXPECT_TRUE(has(text, "\taddsd\t%xmm8, %xmm9\n")) << text;
}

TEST(BudgetRegister, TheRuntimesOwnStatementsKeepIt) {
  const std::string text =
      with_free_budget_register(function("f", "#APP\n\tmovd %xmm15, %eax\n#NO_APP\n\tmovapd\t%xmm15, %xmm0\n"));
  EXPECT_TRUE(has(text, "\tmovd %xmm15, %eax\n")) << text;
  EXPECT_TRUE(has(text, "\tmovapd\t%xmm8, %xmm0\n")) << text;
}

TEST(BudgetRegister, AFunctionThatNeedsAllIsNamed) {
  std::string body;
  for (int n = 8; n < 16; ++n) body += "\taddsd\t%xmm0, %xmm" + std::to_string(n) + "\n";
  try {
    (void)with_free_budget_register(function("all_of_them", body));
    FAIL() << "there is no register left";
  } catch (const NeedsAllVectorRegisters& error) {
    EXPECT_EQ(error.function, "all_of_them");
  }
}

TEST(BudgetRegister, IsKeptWhileComplexNumbersAreMultiplied) {
  const std::string text = with_cycle_counters(function("f", "\tcall\t__muldc3@PLT\n\tcall\tother\n"));
  EXPECT_TRUE(has(text, "\tmovd\t%xmm15, %gs:24\n\tcall\t__muldc3@PLT\n\tmovd\t%gs:24, %xmm15\n")) << text;
  EXPECT_FALSE(has(text, "\tmovd\t%xmm15, %gs:24\n\tcall\tother")) << text;
}

TEST(BudgetRegister, IsKeptIfTheCallGoesThroughATable) {
  const std::string text = with_cycle_counters(function("f", "\tcall\t*__divsc3@GOTPCREL(%rip)\n"));
  EXPECT_TRUE(has(text, "\tmovd\t%gs:24, %xmm15\n")) << text;
}

bool writes(const std::string& instruction) {
  const std::vector<Statement> statements = read_assembly(instruction);
  return may_write_memory(statements.at(0));
}

TEST(Writes, AreRecognised) {
  for (const char* one :
       {"movb %al, count(%rip)", "movl %eax, (%rdi)", "addl $1, 4(%rsp,%rax)", "movl %eax, -8(%rbp)", "sete (%rax)",
        "incw n(%rip)", "movl $1, 32", "movl %eax, %gs:40", "rep stosq", "movsq", "rep;movsq (%rsi), %es:(%rdi)",
        "xchgl (%rdi), %eax", "lock cmpxchgl %ecx, (%rdx)", "movups %xmm0, (%rax)", "fstpt (%rdi)", "popq (%rax)"})
    EXPECT_TRUE(writes(one)) << one;
  for (const char* one : {"movb count(%rip), %al", "cmpl $9, (%rdi)", "testb $1, (%rdi)", "leaq 8(%rdi), %rax",
                          "movl %eax, 12(%rsp)", "movl %eax, (%rsp)", "pushq (%rdi)", "call *8(%rax)",
                          "jmp *(%rax)", "addl (%rdi), %eax", "imull n(%rip), %eax", "idivl (%rdi)",
                          "nopw 0(%rax,%rax,1)", "ucomisd (%rax), %xmm0", "ret", "cltq", "fldt (%rdi)"})
    EXPECT_FALSE(writes(one)) << one;
}

TEST(Writes, AreNotedAfterTheCallThatPrecedesThem) {
  const std::string text = with_cycle_counters(
      function("f", "\tcall\tother\n\tmovl\t%eax, n(%rip)\n\tmovl\t%eax, m(%rip)\n"), Counted::kTestsOnly);
  EXPECT_TRUE(has(
      text, "\tcall\tother\n\tpsubd\t.Lkt_count0w(%rip), %xmm15\n\tmovl\t%eax, n(%rip)\n\tmovl\t%eax, m(%rip)\n"))
      << text;
  EXPECT_TRUE(has(text, ".Lkt_count0w:\n\t.long\t0,1,0,0\n")) << text;
}

TEST(Writes, ShareACounterWhereTheyCan) {
  const std::string text = with_cycle_counters(function("f", "\tmovl\t%edi, n(%rip)\n"));
  EXPECT_TRUE(has(text, "w(%rip), %xmm15\n\tmovl\t%edi, n(%rip)\n")) << text;
  EXPECT_FALSE(has(text, ".Lkt_count0w")) << text;
}

TEST(BudgetRegister, AProgramOfManyFloatsRunsAcrossTicks) {
  // Twenty numbers that live through a loop of some million cycles. Each is a whole number, so the sums are exact.
  Swarm swarm(
      {program(
          "volatile float start = 1; static uint8_t done;\n"
          "static void loop(void) {\n"
          "  if (done) return;\n"
          "  float a = start, b = a + 1, c = b + 1, d = c + 1, e = d + 1, f = e + 1, g = f + 1, h = g + 1;\n"
          "  float i = h + 1, j = i + 1, k = j + 1, l = k + 1, m = l + 1, n = m + 1, o = n + 1, p = o + 1;\n"
          "  float q = p + 1, r = q + 1, s = r + 1, t = s + 1;\n"
          "  for (uint16_t x = 0; x < 3000; ++x) {\n"
          "    a += start; b += a - x; c += start; d += start; e += start; f += start; g += start; h += start;\n"
          "    i += start; j += start; k += start; l += start; m += start; n += start; o += start; p += start;\n"
          "    q += start; r += start; s += start; t += start;\n"
          "  }\n"
          "  done = 1;\n"
          "  set_motors(a == 3001 && b == 6002, t == 3020 && k == 3011 && c + d + e + f + g + h == 18033 &&\n"
          "    i + j + l + m + n + o + p + q + r + s == 30143);\n"
          "}")},
      2);
  swarm.start();
  int ticks = 0;
  for (; swarm.frame().motor_left[1] == 0 && ticks < 400; ++ticks) swarm.steps(1);
  EXPECT_GT(ticks, 5) << "no cycles are counted";
  EXPECT_LT(ticks, 100);
  EXPECT_EQ(swarm.frame().motor_left[1], 1);
  EXPECT_EQ(swarm.frame().motor_right[1], 1);
  EXPECT_EQ(swarm.hosts[0]->robots_failed(), 0u);
}

/// The motors that a program of one robot has set, once the left one runs; at most 400 ticks.
std::pair<int, int> motors_of(const std::string& body) {
  Swarm swarm({program(body)}, 2);
  swarm.start();
  for (int ticks = 0; swarm.frame().motor_left[1] == 0 && ticks < 400; ++ticks) swarm.steps(1);
  EXPECT_EQ(swarm.hosts[0]->robots_failed(), 0u);
  return {swarm.frame().motor_left[1], swarm.frame().motor_right[1]};
}

TEST(BudgetRegister, AValueLivesAcrossACallOfAFunctionWithManyFloats) {
  // Interprocedural allocation would keep `x` in a vector register that many() does not use, the last one.
  EXPECT_EQ(
      motors_of("static volatile float start = 1; static volatile int rounds; static float out;\n"
                "static __attribute__((noinline)) float many(int n) {\n"
                "  float a = start, b = a + 1, c = b + 1, d = c + 1, e = d + 1, f = e + 1, h = f + 1, i = h + 1;\n"
                "  float j = i + 1, k = j + 1, l = k + 1, m = l + 1, o = m + 1;\n"
                "  for (int x = 0; x < n; ++x) {\n"
                "    float s = start;\n"
                "    a += s; b += s * a; c += s * b; d += s * c; e += s * d; f += s * e; h += s * f; i += s * h;\n"
                "    j += s * i; k += s * j; l += s * k; m += s * l; o += s * m;\n"
                "  }\n"
                "  return a + b * c + d * e + f * h + i * j + k * l + m * o;\n"
                "}\n"
                "static void loop(void) {\n"
                "  float x = start;\n"
                "  float y = many(rounds);\n"
                "  out = x + y;\n"
                "  set_motors(10, out == 408 ? 20 : 0);\n"
                "}"),
      std::pair(10, 20));
}

TEST(BudgetRegister, ValuesLiveAcrossACallThatStopsInAFunctionWithoutVectors) {
  // count() takes several ticks and holds no float; its caller holds eleven.
  EXPECT_EQ(
      motors_of(
          "static volatile float start = 1;\n"
          "static __attribute__((noinline)) uint32_t count(uint32_t n) {\n"
          "  uint32_t sum = 0;\n"
          "  for (uint32_t r = 0; r < n; ++r) sum = sum * 3 + r;\n"
          "  return sum;\n"
          "}\n"
          "static void loop(void) {\n"
          "  float a = start, b = start + 1, c = start + 2, d = start + 3, e = start + 4, f = start + 5;\n"
          "  float g = start + 6, h = start + 7, i = start + 8, j = start + 9, k = start + 10;\n"
          "  uint32_t sum = count(30000);\n"
          "  float all = a + 2 * b + 3 * c + 4 * d + 5 * e + 6 * f + 7 * g + 8 * h + 9 * i + 10 * j + 11 * k;\n"
          "  set_motors(10, all == 506 && sum != 1 ? 20 : 0);\n"
          "}"),
      std::pair(10, 20));
}

TEST(BudgetRegister, FunctionsOfTheMathematicalLibraryHaveTheirSigns) {
  // Bit by bit those of core/math, for arguments of both signs; the host's own build has the budget in no register.
  const double ys[] = {1, -1, 0.3, -2.5}, xs[] = {1, -1, -0.2, 3};
  double all[4][4] = {};
  for (int i = 0; i < 4; ++i) {
    all[i][0] = kt_atan2(ys[i], xs[i]), all[i][1] = kt_atan(ys[i]), all[i][2] = kt_sin(ys[i]),
    all[i][3] = kt_exp(ys[i]);
  }
  std::uint64_t sum = 0;  // a hash of the bits
  for (const auto& of : all)
    for (const double value : of) {
      std::uint64_t bits = 0;
      std::memcpy(&bits, &value, sizeof bits);
      sum = sum * 31 + (bits ^ bits >> 32);  // folded: two wrong signs do not cancel
    }
  EXPECT_EQ(
      motors_of(
          "#include <math.h>\n#include <string.h>\n"
          "static volatile double ys[] = {1, -1, 0.3, -2.5}, xs[] = {1, -1, -0.2, 3};\n"
          "static uint64_t sum;\n"
          "static void add(double value) { uint64_t b; memcpy(&b, &value, 8); sum = sum * 31 + (b ^ b >> 32); }\n"
          "static void loop(void) {\n"
          "  sum = 0;\n"
          "  for (uint8_t i = 0; i < 4; ++i) {\n"
          "    add(atan2(ys[i], xs[i])); add(atan(ys[i])); add(sin(ys[i])); add(exp(ys[i]));\n"
          "  }\n"
          "  set_motors(10, sum == " +
          std::to_string(sum) +
          "ull ? 20 : 0);\n"
          "}"),
      std::pair(10, 20));
}

}  // namespace
}  // namespace kilotwin::behaviours::test
