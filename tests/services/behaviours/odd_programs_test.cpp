// Odd but valid C that laboratories write: it compiles and runs for five seconds on five robots, and none fails.
#include <gtest/gtest.h>

#include "tests/services/behaviours/swarm.hpp"

namespace kilotwin::behaviours::test {
namespace {

/// A program that reports by its LED: red when all is right, blue when it found something wrong.
struct Odd {
  const char* name;
  const char* text;
};
void PrintTo(const Odd& odd, std::ostream* out) { *out << odd.name; }

class OddPrograms : public testing::TestWithParam<Odd> {};

TEST_P(OddPrograms, RunFiveSecondsOnFiveRobots) {
  Swarm swarm({std::string("#include <kilolib.h>\n#line 1\n") + GetParam().text}, 5);
  swarm.start();
  for (int tick = 0; tick < 153; ++tick) swarm.step(echo(swarm.frame()));
  for (std::uint32_t robot = 0; robot < 5; ++robot) {
    EXPECT_EQ(swarm.life_cycle(robot), LifeCycle::kRunning) << "robot " << robot;
    EXPECT_EQ(swarm.led(robot), kRed) << "robot " << robot;
  }
  for (const auto& host : swarm.hosts) EXPECT_EQ(host->robots_failed(), 0u);
}

const Odd kPrograms[] = {
    {"tentative_definitions",
     "int a; int a; extern int a; static int b; static int b; int table[]; int table[3] = {1, 2, 3};\n"
     "void setup() { a = b + 1; }\n"
     "void loop() { set_color(a == 1 && table[2] == 3 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "int main() { kilo_init(); kilo_start(setup, loop); }\n"},
    {"old_style_functions_and_implicit_int",
     "static counter;\n"
     "sum(x, y) int x; int y; { return x + y; }\n"
     "void setup() {}\n"
     "void loop() { counter = sum(20, 22); set_color(later(counter) == 43 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "later(n) { return n + 1; }\n"
     "main() { kilo_init(); kilo_start(setup, loop); }\n"},
    {"names_of_the_c_library",
     "#include <math.h>\n"
     "#define min(a, b) ((a) < (b) ? (a) : (b))\n"
     "int index, time, y0 = 1, j1 = 2, read, write, remove, signal, link, pipe, random_state, gamma;\n"
     "int abs(int v) { return v < 0 ? -v : v; }\n"
     "int max(int a, int b) { return a > b ? a : b; }\n"
     "void send(void) { ++write; }\n"
     "float round_to(float x) { return floorf(x + 0.5f); }\n"
     "void setup(void) {}\n"
     "void loop(void) { index = max(abs(-7), min(3, y0 + j1)); send(); read = (int)round_to(2.6f);\n"
     "  set_color(index == 7 && read == 3 && write > 0 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"},
    {"own_rand_and_memcpy",
     "#include <stddef.h>\n"
     "static unsigned state = 1; int rand(void) { return (state = state * 5 + 3) & 0xff; }\n"
     "void *memcpy(void *to, const void *from, size_t n) { char *t = to; const char *f = from; while (n--) *t++ = "
     "*f++; return to; }\n"
     "struct big { char octets[200]; } x, y;\n"
     "void setup(void) { x.octets[199] = 9; }\n"
     "void loop(void) { y = x; rand(); set_color(y.octets[199] == 9 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"},
    {"own_booleans",
     "typedef enum { false, true } bool;\n"
     "enum state { WAIT, GO = 5, DONE } state = WAIT;\n"
     "bool ready = false;\n"
     "void setup(void) { ready = true; }\n"
     "void loop(void) { if (ready == true && state != DONE) state = state == WAIT ? GO : DONE; set_color(RGB(ready "
     "* 3, 0, 0)); }\n"
     "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"},
    {"recursion_and_big_arrays",
     "uint8_t map[64][64]; int32_t history[2000];\n"
     "static uint32_t fibonacci(uint8_t n) { return n < 2 ? n : fibonacci(n - 1) + fibonacci(n - 2); }\n"
     "static void fill(int x, int y) {\n"
     "  if (x < 0 || y < 0 || x > 31 || y > 31 || map[x][y]) return;\n"
     "  map[x][y] = 1; fill(x + 1, y); fill(x - 1, y); fill(x, y + 1); fill(x, y - 1); }\n"
     "void setup(void) { fill(3, 3); }\n"
     "void loop(void) { history[kilo_ticks % 2000] = fibonacci(10); set_color(map[31][31] && history[kilo_ticks % "
     "2000] == 55 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"},
    {"main_with_locals_that_callbacks_use",
     "static uint16_t *shared;\n"
     "void setup(void) { *shared += 1; }\n"
     "void loop(void) { *shared += 1; set_color(*shared > 1000 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "int main(int argc, char **argv) { uint16_t local = 1000; char text[300]; for (int i = 0; i < 300; i++) "
     "text[i] = i;\n"
     "  shared = &local; kilo_init(); kilo_start(setup, loop); return text[5]; }\n"},
    {"callbacks_installed_late",
     "message_t out; volatile uint8_t heard, left; uint8_t installed;\n"
     "void rx(message_t *m, distance_measurement_t *d) { heard += m->data[0] == 7 && estimate_distance(d) > 0; }\n"
     "message_t *tx() { return &out; }\n"
     "void success() { left = 1; }\n"
     "void setup() { out.type = NORMAL; out.data[0] = 7; out.crc = message_crc(&out); }\n"
     "void loop() { if (kilo_ticks > 40 && !installed) { kilo_message_rx = rx; kilo_message_tx = tx; "
     "kilo_message_tx_success = success; installed = 1; }\n"
     "  set_color(heard && left ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "int main() { kilo_init(); kilo_start(setup, loop); }\n"},
    {"messages_sent_from_setup",
     "#include <message_buffered.h>\n"
     "uint8_t heard;\n"
     "void setup(void) { message_t m = {.type = NORMAL}; m.data[0] = 42; m.crc = message_crc(&m); for (int i = 0; "
     "i < 3; i++) txbuffer_push(&m); }\n"
     "void loop(void) { distance_measurement_t d; message_t *m; while ((m = rxbuffer_peek(&d)) != NULL) { heard += "
     "m->data[0] == 42; rxbuffer_pop(); }\n"
     "  set_color(heard ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "int main(void) { kilo_init(); kilo_message_buffered(); kilo_start(setup, loop); return 0; }\n"},
    {"tables_of_functions_and_unions",
     "typedef union { float f; uint32_t u; uint8_t octet[4]; } word_t;\n"
     "static void wait(void); static void go(void);\n"
     "static const struct { void (*run)(void); const char *name; uint8_t next : 4, repeats : 4; } states[] = "
     "{{wait, \"wait\", 1, 3}, {go, \"go\", 0, 2}};\n"
     "static uint8_t state, count; static word_t w = {.f = 1.0f};\n"
     "static void wait(void) {} static void go(void) {}\n"
     "void setup(void) {}\n"
     "void loop(void) { states[state].run(); if (++count >= states[state].repeats) { state = states[state].next; "
     "count = 0; }\n"
     "  set_color(w.u == 0x3f800000 && states[1].name[0] == 'g' ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"},
    {"jumps_and_switches",
     "void setup(void) {}\n"
     "void loop(void) { static int step; register int n = 0; goto middle;\n"
     "  again: ++n;\n"
     "  middle: switch (step++ & 3) { default: case 3: n += 8; break; case 0: for (n = 4; n > 0; n--) if (n == 2) "
     "goto again; case 1 ... 2: n |= 1; }\n"
     "  set_color(n > 0 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"},
    {"text_without_a_terminal",
     "#include <stdio.h>\n#include <string.h>\n#define DEBUG\n#include <debug.h>\n"
     "char line[40];\n"
     "void setup(void) { debug_init(); }\n"
     "void loop(void) { sprintf(line, \"%d:%05.2f:%s\", kilo_uid, 3.14159, \"x\"); printf(\"%s\\n\", line);\n"
     "  set_color(strstr(line, \":03.14:x\") ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"},
    {"wide_arithmetic",
     "uint64_t product; int64_t quotient; float f = 0.1f; double d;\n"
     "void setup(void) {}\n"
     "void loop(void) { product = (uint64_t)0xffffffffu * 0xffffffffu; quotient = (int64_t)product / 7; d += f; f "
     "*= 1.01f; uint8_t wrapped = 250; wrapped += 10;\n"
     "  set_color(product == 0xfffffffe00000001u && quotient < 0 && d > 0 && wrapped == 4 ? RGB(3, 0, 0) : RGB(0, "
     "0, 3)); }\n"
     "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"},
    {"heap",
     "#include <stdlib.h>\n#include <string.h>\n"
     "typedef struct node { struct node *next; uint8_t value; } node;\n"
     "node *list; uint16_t wrong;\n"
     "void setup(void) {}\n"
     "void loop(void) { node *n = malloc(sizeof *n); if (!n) wrong++; n->value = kilo_ticks; n->next = list; list "
     "= n;\n"
     "  char *text = calloc(20, 5); if (!text || text[99]) wrong++; memset(text, 1, 100); text = realloc(text, "
     "500); if (!text || text[99] != 1) wrong++; free(text);\n"
     "  uint8_t length = 0; for (node **at = &list; *at;) { if (++length > 5) { node *old = *at; *at = old->next; "
     "free(old); } else at = &(*at)->next; }\n"
     "  if (malloc(100000) || malloc((size_t)-1)) wrong++;\n"
     "  set_color(!wrong && length <= 6 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"},
    {"registers_of_the_robot",
     "#define BAUD 38400\n"
     "#include <avr/eeprom.h>\n#include <avr/interrupt.h>\n#include <avr/io.h>\n#include "
     "<avr/pgmspace.h>\n#include <avr/wdt.h>\n#include <util/delay.h>\n"
     "#include <util/setbaud.h>\n"
     "const uint8_t primes[] PROGMEM = {2, 3, 5}; uint16_t EEMEM stored; uint8_t block[4], erased;\n"
     "void setup(void) { wdt_disable(); UBRR0H = UBRRH_VALUE; UBRR0L = UBRRL_VALUE; while (!(UCSR0A & "
     "_BV(UDRE0))); UDR0 = 'x';\n"
     "  erased = eeprom_read_byte((uint8_t *)0xC0); eeprom_update_word(&stored, kilo_uid + 1); "
     "eeprom_write_dword((uint32_t *)1020, 0x04030201); DDRB |= _BV(5); }\n"
     "void loop(void) { cli(); PORTB ^= 1 << 5; sei(); wdt_reset(); eeprom_read_block(block, (void *)1020, 4);\n"
     "  set_color(erased == 0xff && eeprom_read_word(&stored) == kilo_uid + 1 && block[3] == 4 && "
     "pgm_read_byte(&primes[2]) == 5 && UBRR_VALUE == 12 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }\n"
     "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"},
};

INSTANTIATE_TEST_SUITE_P(Corpus, OddPrograms, testing::ValuesIn(kPrograms),
                         [](const testing::TestParamInfo<Odd>& tested) { return tested.param.name; });

}  // namespace
}  // namespace kilotwin::behaviours::test
