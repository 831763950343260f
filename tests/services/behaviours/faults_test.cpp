#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

/// Robot 9 of 18 executes `action` when its clock shows 5. All robots count in their left motor.
void one_fails(const std::string& action, const std::string& text, const std::string& before = "",
               const std::string& after = "") {
  Swarm swarm({program(before +
                       "\nstatic uint8_t n;\nstatic void loop(void) { set_color(5); set_motors(++n, 1);\n"
                       "  if (kilo_uid == 9 && kilo_ticks == 5) { " +
                       action + " } }\n" + after)},
              18);
  swarm.start();
  swarm.steps(10);
  const ActuationFrame frame = swarm.frame();
  for (std::uint32_t robot = 0; robot < 18; ++robot) {
    const bool failed = robot == 9;
    EXPECT_EQ(LifeCycle{frame.life_cycle[robot]}, failed ? LifeCycle::kFailed : LifeCycle::kRunning) << robot;
    EXPECT_EQ(frame.motor_left[robot], failed ? 0 : 11) << robot;
    EXPECT_EQ(frame.led[robot], 5) << robot;
  }
  ASSERT_EQ(swarm.hosts[0]->robots_failed(), 1u);
  EXPECT_EQ(swarm.hosts[0]->failures()[0].robot, 9u);
  EXPECT_NE(swarm.hosts[0]->failures()[0].text.find(text), std::string::npos) << swarm.hosts[0]->failures()[0].text;
}

/// Whether this kernel has the instruction for 32-bit system calls. Without them, it is a forbidden one.
bool has_32_bit_system_calls() {
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGSEGV, SIG_DFL);
    constexpr int kGetPid = 20;
    __asm__ volatile("int $0x80" : : "a"(kGetPid) : "memory");
    _exit(0);
  }
  int status = 0;
  return waitpid(child, &status, 0) == child && WIFEXITED(status);
}

TEST(Faults, NullWrite) {
  one_fails("volatile int* p = (int*)(uintptr_t)(n - n); *p = 1;", "access to address 0x0 in loop()");
}

TEST(Faults, WildJump) {
  one_fails("((void (*)(void))(uintptr_t)(n + 16))();", "call of a function at address 0x1");
}

TEST(Faults, WriteToCode) { one_fails("*(volatile uint8_t*)&loop = 0;", "access to address 0x"); }

TEST(Faults, EndlessLoop) {
  one_fails("for (;;) {}", "endless loop in loop() at program0.c:4");
  one_fails("for (volatile int i = 0; i < 10;) {}", "endless loop in loop() at program0.c:4");
}

TEST(Faults, EndlessLoopThatChangesState) {
  Swarm swarm({program("uint32_t counter; static void loop(void) { for (;;) ++counter; }")}, 2);
  swarm.start();
  swarm.steps(20);
  EXPECT_EQ(swarm.life_cycle(1), LifeCycle::kRunning);
  swarm.steps(20);
  EXPECT_EQ(swarm.life_cycle(1), LifeCycle::kFailed);
  EXPECT_NE(swarm.hosts[0]->failures().at(0).text.find("endless loop in loop()"), std::string::npos);
}

TEST(Faults, ACallbackThatDoesNotReturn) {
  for (const std::string body : {"for (;;) {}", "static uint32_t n; while (kilo_uid < 5) ++n;"}) {
    Swarm swarm({program("static void rx(message_t* m, distance_measurement_t* d) { " + body + " }")}, 3);
    swarm.start();
    Air air;
    air.receptions = {{1, message(0)}};
    swarm.step(air);
    EXPECT_EQ(swarm.life_cycle(1), LifeCycle::kFailed);
    EXPECT_EQ(swarm.life_cycle(2), LifeCycle::kRunning);
    EXPECT_NE(swarm.hosts[0]->failures().at(0).text.find("does not return from kilo_message_rx"),
              std::string::npos);
  }
}

TEST(Faults, StackOverflow) {
  one_fails(
      "n = deep(n);", "stack overflow",
      "static int deep(int n) { volatile char room[300]; room[n & 127] = n; return deep(n + 1) + room[n & 127]; }");
}

TEST(Faults, AStackThatIsAlmostFull) {
  // Each robot waits with another number of octets left on its stack, from 0 to some hundreds. Those with enough room continue.
  Swarm swarm({program("static char* top;\n"
                       "static int deep(void) { volatile char room[8]; room[0] = 0;\n"
                       "  if (top - (char*)room > 65536 - 256 - 16 * kilo_uid) { delay(100); return room[0]; }\n"
                       "  return deep() + room[0]; }\n"
                       "static void loop(void) { char here; top = &here; deep(); set_color(RGB(0, 3, 0)); }")},
              40);
  swarm.start();
  swarm.steps(20);
  EXPECT_EQ(swarm.led(39), 3 << 2);
  std::uint32_t lowest = 39;
  while (lowest > 0 && swarm.life_cycle(lowest - 1) == LifeCycle::kRunning) --lowest;
  EXPECT_LT(lowest, 20u);
  EXPECT_EQ(swarm.hosts[0]->robots_failed(), lowest) << "the deepest overflow, all others do not";
}

TEST(Faults, LargeFrame) { one_fails("volatile char room[1000000]; room[n] = 1;", "stack overflow"); }

TEST(Faults, SystemCalls) {
  // exit_group(0) and exit(0), which would end the whole run, by the three instructions for system calls.
  one_fails("__asm__ volatile(\"syscall\" : : \"a\"(231), \"D\"(0) : \"rcx\", \"r11\", \"memory\");",
            "system call 231, which a robot does not have in loop() at program0.c:4");
  one_fails("__asm__ volatile(\"syscall\" : : \"a\"(60), \"D\"(0) : \"rcx\", \"r11\", \"memory\");",
            "system call 60,");
  one_fails("__asm__ volatile(\"int $0x80\" : : \"a\"(1), \"b\"(0) : \"memory\");",
            has_32_bit_system_calls() ? "system call 1," : "access to address 0x0 in loop()");
}

TEST(Faults, Breakpoint) { one_fails("__asm__ volatile(\"int3\");", "breakpoint instruction in loop()"); }

TEST(Faults, SingleStepping) {
  one_fails("__asm__ volatile(\"pushf; orl $0x100, (%%rsp); popf; nop\" : : : \"cc\", \"memory\");",
            "breakpoint instruction");
}

TEST(Faults, BeyondTheVariables) {
  // It reads octet after octet behind its last variable. 256 are accessible, the next one faults.
  Swarm swarm(
      {program("static uint8_t here; static void loop(void) { if (kilo_uid != 9 || kilo_ticks < 5) return;\n"
               "  uint8_t sum = 0; for (const volatile uint8_t* p = &here;; ++p) { sum += *p; if (sum == 3) "
               "set_color(1); } }")},
      10);
  swarm.start();
  swarm.steps(10);
  const Program& loaded = swarm.programs->program(0);
  const std::uint64_t end = loaded.slot(9 % kSlots).image_address() + loaded.file.data.last + kSlackOctets;
  ASSERT_EQ(swarm.hosts[0]->robots_failed(), 1u);
  char text[64];
  std::snprintf(text, sizeof text, "access to address 0x%llx in loop()", static_cast<unsigned long long>(end));
  EXPECT_NE(swarm.hosts[0]->failures()[0].text.find(text), std::string::npos)
      << swarm.hosts[0]->failures()[0].text << "; expected " << text;
}

TEST(Faults, BeforeTheVariables) {
  one_fails("kilotwin_variables[-1] = 1;", "a write before its first variable",
            "extern uint8_t kilotwin_variables[] __attribute__((visibility(\"hidden\")));");
  one_fails("kilotwin_variables[-64] = 1;", "a write before its first variable",
            "extern uint8_t kilotwin_variables[] __attribute__((visibility(\"hidden\")));");
}

TEST(Faults, FailedAssertion) {
  one_fails("assert(n == 200);", "abort(), or a failed assertion, in loop() at program0.c:4",
            "#include <assert.h>");
}

TEST(Faults, AbortNamesItsCaller) {
  one_fails("give_up(n);", "abort(), or a failed assertion, in give_up() at program0.c:1",
            "static void __attribute__((noinline)) give_up(int n) { if (n != 200) abort(); }");
}

TEST(Faults, OverwrittenReturnAddress) {
  const std::string fill =
      "static void __attribute__((noinline)) fill(uint8_t* a, int n, uint8_t with) { for (int i = 0; i < n; ++i) "
      "((volatile uint8_t*)a)[i] = with; }\n"
      "static void __attribute__((noinline)) careless(int n, uint8_t with) { uint8_t a[8]; fill(a, n, with); }";
  // An address that no processor has, and one that it has but the program has not.
  one_fails("careless(64, 0xaa);", "careless() returns to nowhere: its return address is overwritten", fill);
  one_fails("careless(64, 0);", "a function returns to address 0x0: its return address is overwritten", fill);
}

TEST(Faults, AFullHeapIsReportedOnceWithItsPlace) {
  Swarm swarm({program("static void* volatile last;\n"
                       "static void loop(void) { last = malloc(1000); }")},
              3);
  swarm.start();
  swarm.steps(200);
  std::vector<std::string> told;
  for (const auto& warning : swarm.hosts[0]->warnings()) told.push_back(warning.text);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("the heap is full"), std::string::npos) << told[0];
  EXPECT_NE(told[0].find("in loop() at program0.c:"), std::string::npos) << told[0];
  EXPECT_EQ(swarm.hosts[0]->robots_failed(), 0u);
}

TEST(Faults, ARequestOfTheWholeHeapIsRefused) {
  Swarm swarm({program("static void loop(void) { set_color(malloc(65536) == 0 ? 3 : 1); }")}, 1);
  swarm.start();
  swarm.steps(2);
  EXPECT_EQ(swarm.led(0), 3);
}

TEST(Faults, InACallback) {
  Swarm swarm({program("static void rx(message_t* m, distance_measurement_t* d) { *(volatile char*)8 = 1; }")}, 4);
  swarm.start();
  Air air;
  air.receptions = {{1, message(0)}};
  swarm.step(air);
  EXPECT_EQ(swarm.life_cycle(1), LifeCycle::kFailed);
  EXPECT_EQ(swarm.life_cycle(2), LifeCycle::kRunning);
  swarm.step(air);  // a failed robot hears nothing
  EXPECT_EQ(swarm.hosts[0]->robots_failed(), 1u);
}

TEST(Faults, AnEndedProgramIsSilentNotFailed) {
  Swarm swarm({"#include <kilolib.h>\nint main(void) { kilo_init(); set_color(3); return 0; }\n"}, 1);
  swarm.start();
  EXPECT_EQ(swarm.led(0), 3);
  EXPECT_EQ(swarm.life_cycle(0), LifeCycle::kIdle);
  EXPECT_EQ(swarm.hosts[0]->robots_failed(), 0u);
}

TEST(FaultsDeathTest, OtherFaultsOfTheProcessStayFatal) {
  Swarm swarm({program("")}, 1);
  swarm.start();
  EXPECT_DEATH(std::raise(SIGSEGV); volatile int* nowhere = nullptr; *nowhere = 1;, "");
}

}  // namespace
}  // namespace kilotwin::behaviours::test
