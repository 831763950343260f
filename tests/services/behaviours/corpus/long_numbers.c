#include <kilolib.h>
#include <inttypes.h>
#include <limits.h>
#include <stdbool.h>
#include <float.h>
unsigned long long big = 1ULL << 40; bool yes = true;
void setup() {}
void loop() { int64_t q = -(int64_t)big / 3; set_color(q == -366503875925 && big >> 39 == 2 && __builtin_popcountll(big) == 1 && CHAR_MIN == 0 && yes && FLT_MAX > 1e38 ? RGB(3, 0, 0) : RGB(0, 0, 3)); }
int main() { kilo_init(); kilo_start(setup, loop); return 0; }
